//! Takes a run's messages in any order, and says what was unsafe in it.

use crate::Limits;
use crate::orders::{Order, Orders};
use signals::{PlantTruth, StepCommand};
use std::collections::{BTreeMap, BTreeSet};

/// Something that must not be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unsafe {
    /// More pulses than the driver's rate allows, or closer together.
    Rate {
        /// The cycle.
        cycle: u64,
        /// Its pulses.
        pulses: i64,
    },
    /// The pulse rate changed faster than the driver's limits allow.
    Acceleration {
        /// The cycle.
        cycle: u64,
        /// The pulses of the one before.
        before: i64,
        /// Its own.
        pulses: i64,
    },
    /// A pulse outside its cycle, or a time for none.
    Time {
        /// The cycle.
        cycle: u64,
    },
    /// A pulse before there was any command to follow.
    BeforeArming {
        /// The cycle.
        cycle: u64,
    },
    /// The drive was told to begin to follow, and no operator's order allowed it.
    WithoutOrder {
        /// The cycle.
        cycle: u64,
    },
    /// A pulse after an operator wanted the valve to stop, and had not yet wanted it to move again.
    AfterDisarm {
        /// The cycle.
        cycle: u64,
        /// The cycle in which the order to stop was given.
        given: u64,
    },
    /// A pulse after the valve had to stand.
    AfterDeadline {
        /// The cycle.
        cycle: u64,
        /// The last cycle in which there might have been one.
        deadline: u64,
    },
}

/// What a run came to.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Verdict {
    /// What was unsafe, in the order of cycles.
    pub findings: Vec<Unsafe>,
    /// Cycles judged.
    pub cycles: u64,
    /// Cycles with pulses.
    pub moving_cycles: u64,
    /// All pulses, in either direction.
    pub pulses: u64,
    /// The last cycle with a pulse; `None` where there was none.
    pub last_moving_cycle: Option<u64>,
}

/// What was recorded of a cycle.
#[derive(Debug, Clone, Copy, Default)]
struct Cycle {
    pulses: Option<(i64, u64, u64)>,
    /// Whether there was a command, and the arming under which it was to be followed; 0 for none.
    follow: Option<u64>,
    /// Whether there may have been one that nobody recorded.
    unknown: bool,
}

/// Collects one start's messages.
#[derive(Debug, Clone)]
pub struct Judge {
    limits: Limits,
    cycles: BTreeMap<u64, Cycle>,
    orders: Orders,
}

impl Judge {
    /// For a run with these limits.
    pub fn new(limits: Limits) -> Self {
        Self { limits, cycles: BTreeMap::new(), orders: Orders::default() }
    }

    /// PlantTruth k tells of the pulses in the cycle before.
    pub fn truth(&mut self, cycle: u64, truth: &PlantTruth) {
        if let Some(of) = cycle.checked_sub(1) {
            self.cycles.entry(of).or_default().pulses =
                Some((truth.pulses, truth.first_pulse_ns, truth.last_pulse_ns));
        }
    }

    /// A StepCommand that was valid and there in time for its cycle.
    pub fn command(&mut self, cycle: u64, command: &StepCommand) {
        // One that contradicts itself was altered on the way: it counts for none.
        if (command.follow == 1) == (command.follow_id != 0) {
            let id = if command.energise == 1 { command.follow_id } else { 0 };
            self.cycles.entry(cycle).or_default().follow = Some(id);
        }
    }

    /// What an operator wanted.
    pub fn order(&mut self, order: Order) {
        self.orders.add(order);
    }

    /// There may have been orders that nobody recorded: nothing is judged by orders then.
    pub fn orders_unknown(&mut self) {
        self.orders.unknown = true;
    }

    /// Commands of these cycles may have been there that nobody recorded.
    pub fn commands_unknown(&mut self, cycles: std::ops::Range<u64>) {
        for cycle in cycles {
            self.cycles.entry(cycle).or_default().unknown = true;
        }
    }

    /// The verdict over everything collected.
    pub fn verdict(&self) -> Verdict {
        let mut verdict = Verdict::default();
        let mut walk = Walk {
            limits: self.limits,
            orders: self.orders.clone(),
            before: None,
            deadline: None,
            followed: None,
            follows: Some(0),
            ended: BTreeSet::new(),
        };
        for (cycle, seen) in &self.cycles {
            walk.cycle(*cycle, seen, &mut verdict);
        }
        verdict
    }
}

/// Goes through the cycles.
struct Walk {
    limits: Limits,
    /// The cycle before and its pulses, where known.
    before: Option<(u64, i64)>,
    /// No pulse in a cycle after this one; `None` before the first command to follow.
    deadline: Option<u64>,
    /// The last command to follow (or one that may have been), and the pulses then.
    followed: Option<u64>,
    orders: Orders,
    /// The arming under which the newest command was to be followed, 0 for none; `None` where nobody knows.
    follows: Option<u64>,
    /// The armings that have ended: nothing is followed under them any more.
    ended: BTreeSet<u64>,
}

impl Walk {
    fn cycle(&mut self, cycle: u64, seen: &Cycle, verdict: &mut Verdict) {
        let follow = self.check_order(cycle, seen, verdict);
        let before = self.before.filter(|(last, _)| last + 1 == cycle).map(|(_, pulses)| pulses);
        let size = before.or(seen.pulses.map(|p| p.0)).unwrap_or(0).unsigned_abs();
        let delay = self.limits.command_delay_cycles;
        if seen.unknown || follow == Some(true) {
            self.followed = Some(cycle);
            // Pulses may be as many as the limits allow in the last cycles before the ramp.
            self.deadline = Some(cycle + self.limits.cycles_after_silence(self.grown(size)));
        } else if follow == Some(false)
            && let (Some(deadline), Some(followed)) = (self.deadline, self.followed)
            && followed + 1 == cycle
        {
            self.deadline = Some(deadline.min(cycle + delay + self.limits.ramp_cycles(self.grown(size))));
        }
        let Some((pulses, first_ns, last_ns)) = seen.pulses else { return };
        verdict.cycles += 1;
        verdict.pulses += pulses.unsigned_abs();
        self.check_times(cycle, pulses, first_ns, last_ns, verdict);
        if let Some(before) = before {
            self.check_change(cycle, before, pulses, verdict);
        }
        if pulses != 0 {
            verdict.moving_cycles += 1;
            verdict.last_moving_cycle = Some(cycle);
            self.check_deadline(cycle, pulses, verdict);
        }
        self.before = Some((cycle, pulses));
    }

    /// The drive begins to follow under an order alone, and once under each arming. Whether this cycle's command is to be followed.
    fn check_order(&mut self, cycle: u64, seen: &Cycle, verdict: &mut Verdict) -> Option<bool> {
        // A command was made in the cycle before its own.
        let late = self.limits.arming_cycles + 1;
        let id = seen.follow.map(|id| if self.ended.contains(&id) { 0 } else { id });
        let begins = id.is_some_and(|id| id != 0) && self.follows == Some(0);
        if begins && !self.orders.use_up(cycle, late) {
            verdict.findings.push(Unsafe::WithoutOrder { cycle });
        }
        if seen.unknown {
            self.follows = None;
        } else if id == Some(0) {
            self.ended.extend(self.follows.take().filter(|id| *id != 0));
            self.follows = id;
        } else if id.is_some() && self.follows.is_none_or(|id| id == 0) {
            self.follows = id;
        }
        id.map(|id| id != 0)
    }

    /// What the rate may have become in the cycles that the drive still follows commands under way.
    fn grown(&self, pulses: u64) -> u64 {
        let more = self.limits.most_change() * (1 + self.limits.command_delay_cycles) as f64;
        pulses.saturating_add(more as u64).min(self.limits.most_pulses() as u64)
    }

    fn check_times(&self, cycle: u64, pulses: i64, first_ns: u64, last_ns: u64, verdict: &mut Verdict) {
        let count = pulses.unsigned_abs();
        let period_ns = self.limits.period_s * 1e9;
        let ordered = first_ns <= last_ns && last_ns as f64 <= period_ns;
        if !ordered || count == 0 && (first_ns, last_ns) != (0, 0) || count > 1 && first_ns == last_ns {
            verdict.findings.push(Unsafe::Time { cycle });
        }
        let spacing_ns = last_ns.saturating_sub(first_ns) as f64 / count.saturating_sub(1).max(1) as f64;
        // Times are whole nanoseconds.
        let dense = count > 1 && spacing_ns + 2.0 < period_ns / self.limits.most_pulses();
        if dense || count as f64 > self.limits.most_pulses() {
            verdict.findings.push(Unsafe::Rate { cycle, pulses });
        }
    }

    fn check_change(&self, cycle: u64, before: i64, pulses: i64, verdict: &mut Verdict) {
        let falls = pulses.signum() * before.signum() >= 0 && pulses.unsigned_abs() < before.unsigned_abs();
        let most = if falls { self.limits.most_fall() } else { self.limits.most_change() };
        if pulses.abs_diff(before) as f64 > most {
            verdict.findings.push(Unsafe::Acceleration { cycle, before, pulses });
        }
    }

    fn check_deadline(&self, cycle: u64, pulses: i64, verdict: &mut Verdict) {
        let Some(deadline) = self.deadline else {
            return verdict.findings.push(Unsafe::BeforeArming { cycle });
        };
        let neutral = self.limits.neutral_pulse_rate_hz * self.limits.period_s;
        let to_neutral = neutral > 0.0 && pulses.unsigned_abs() as f64 <= neutral + 1.0;
        if cycle > deadline && !to_neutral {
            verdict.findings.push(Unsafe::AfterDeadline { cycle, deadline });
        }
        // Whoever is silent when the order comes is found silent first; and an order waits a cycle for its reader.
        if let Some(given) = self.orders.stop_before(cycle) {
            let most = self.limits.cycles_after_silence(self.limits.most_pulses() as u64) + 2;
            if cycle > given + most && !to_neutral {
                verdict.findings.push(Unsafe::AfterDisarm { cycle, given });
            }
        }
    }
}
