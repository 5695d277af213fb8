//! Which replies count, and when the bus is lost: working counter, AL state and status word must all be right, in every cycle.
//!
//! ```text
//!  Good ──bad reply──▶ Missing(n) ──n = bus_lost_cycles──▶ Lost (latched)
//!    ▲                    │
//!    └────good reply──────┘
//! ```
//! A device whose power went comes back with a right working counter, and one whose watchdog ran out keeps it; a main device
//! that reads no reply may see its own bytes as inputs. So no single one of the three is proof.

use serde::{Deserialize, Serialize};

/// AL states (ETG.1000.6).
const OP: u16 = 0x08;
const AL_STATE: u16 = 0x0F;
const AL_ERROR: u16 = 0x10;

/// The name of the state in an AL status.
pub const fn al_state_name(al_status: u16) -> &'static str {
    match al_status & AL_STATE {
        0x01 => "INIT",
        0x02 => "PRE-OP",
        0x03 => "BOOT",
        0x04 => "SAFE-OP",
        OP => "OP",
        _ => "unknown",
    }
}

/// What became of a cycle's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The reply came in time, with the process data exchanged.
    Answered {
        /// AL status.
        al_status: u16,
        /// AL status code.
        al_code: u16,
        /// Deviation of the frame's place in the bus's cycle, ns.
        clock_error_ns: i64,
    },
    /// The reply came, but the device had not taken part.
    WorkingCounter {
        /// The working counter.
        found: u16,
    },
    /// No reply by its time, or one that can't be read.
    Missing,
    /// The frame could not be sent: the link is down.
    NotSent,
}

/// Why the bus, or the drive on it, is not to be trusted any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusFault {
    /// No good reply for `bus_lost_cycles`.
    Lost,
    /// The device left OP by itself.
    LeftOperation {
        /// AL status.
        al_status: u16,
        /// AL status code.
        al_code: u16,
    },
    /// Our cycle is not on the bus's.
    NotSynchronised {
        /// Deviation, ns.
        error_ns: i64,
    },
}

/// Bounds of the judge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct JudgeParams {
    /// So many cycles without a good reply are a lost bus.
    pub bus_lost_cycles: u64,
    /// Largest deviation of the frame's place, ns.
    pub clock_window_ns: i64,
    /// So many cycles beyond it are too many.
    pub clock_cycles: u64,
}

/// What a cycle's outcome means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verdict {
    /// Whether the device took this cycle's outputs, as far as is known, and its inputs count.
    pub good: bool,
    /// A fault that is found in this cycle, or was before: it is latched.
    pub fault: Option<BusFault>,
}

/// Counts, and remembers the first fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Judge {
    params: JudgeParams,
    missing: u64,
    unsynchronised: u64,
    fault: Option<BusFault>,
    lost_frames: u64,
}

impl Judge {
    /// A judge who has seen nothing.
    pub fn new(params: JudgeParams) -> Self {
        Self { params, missing: 0, unsynchronised: 0, fault: None, lost_frames: 0 }
    }

    /// Frames without a good reply so far.
    pub fn lost_frames(&self) -> u64 {
        self.lost_frames
    }

    /// Cycles in a row without a good reply.
    pub fn missing_cycles(&self) -> u64 {
        self.missing
    }

    /// Begins anew, after a bring-up.
    pub fn clear(&mut self) {
        *self = Self { lost_frames: self.lost_frames, ..Self::new(self.params) };
    }

    /// Judges a cycle in operation.
    pub fn judge(&mut self, outcome: Outcome) -> Verdict {
        let good = match outcome {
            Outcome::Answered { al_status, al_code, clock_error_ns } => {
                self.missing = 0;
                let in_op = al_status & AL_STATE == OP && al_status & AL_ERROR == 0;
                if !in_op {
                    self.find(BusFault::LeftOperation { al_status, al_code });
                }
                let outside = clock_error_ns.abs() > self.params.clock_window_ns;
                self.unsynchronised = if outside { self.unsynchronised + 1 } else { 0 };
                if self.unsynchronised >= self.params.clock_cycles {
                    self.find(BusFault::NotSynchronised { error_ns: clock_error_ns });
                }
                in_op
            }
            Outcome::WorkingCounter { .. } | Outcome::Missing | Outcome::NotSent => {
                self.missing += 1;
                self.lost_frames += 1;
                if self.missing >= self.params.bus_lost_cycles {
                    self.find(BusFault::Lost);
                }
                false
            }
        };
        Verdict { good, fault: self.fault }
    }

    /// The first fault stays.
    fn find(&mut self, fault: BusFault) {
        self.fault.get_or_insert(fault);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARAMS: JudgeParams = JudgeParams { bus_lost_cycles: 3, clock_window_ns: 200, clock_cycles: 10 };
    const GOOD: Outcome = Outcome::Answered { al_status: 8, al_code: 0, clock_error_ns: 0 };

    #[test]
    fn every_bad_outcome_counts_towards_a_lost_bus() {
        for bad in [Outcome::Missing, Outcome::NotSent, Outcome::WorkingCounter { found: 0 }] {
            let mut judge = Judge::new(PARAMS);
            for _ in 0..2 {
                assert_eq!(judge.judge(bad), Verdict { good: false, fault: None });
            }
            // A good one in between begins the count anew.
            assert!(judge.judge(GOOD).good);
            for _ in 0..2 {
                assert_eq!(judge.judge(bad).fault, None);
            }
            assert_eq!(judge.judge(bad).fault, Some(BusFault::Lost));
            assert_eq!(judge.judge(GOOD).fault, Some(BusFault::Lost), "latched");
        }
    }

    #[test]
    fn every_al_status_but_op_is_a_fault_at_once() {
        for al_status in 0..0x20 {
            let mut judge = Judge::new(PARAMS);
            let verdict = judge.judge(Outcome::Answered { al_status, al_code: 0x1B, clock_error_ns: 0 });
            let fault = (al_status != 8).then_some(BusFault::LeftOperation { al_status, al_code: 0x1B });
            assert_eq!(verdict, Verdict { good: al_status == 8, fault });
        }
    }

    #[test]
    fn a_clock_that_is_off_for_long_is_a_fault() {
        let off = |error| Outcome::Answered { al_status: 8, al_code: 0, clock_error_ns: error };
        let mut judge = Judge::new(PARAMS);
        for _ in 0..9 {
            assert_eq!(judge.judge(off(-201)).fault, None);
        }
        assert_eq!(judge.judge(off(200)).fault, None);
        for _ in 0..9 {
            assert_eq!(judge.judge(off(201)).fault, None);
        }
        assert_eq!(judge.judge(off(201)).fault, Some(BusFault::NotSynchronised { error_ns: 201 }));
    }
}
