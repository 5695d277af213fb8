//! Absolute sleeps on a common epoch plus a phase of one's own; overruns skip whole periods.

use crate::clock::now_ns;
use nix::errno::Errno;
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_nanosleep};

/// Wakes its process once a period: cycle k at epoch + k·period + phase.
#[derive(Debug, Clone)]
pub struct CyclicTimer {
    first_ns: u64,
    period_ns: u64,
    next_cycle: u64,
    shift_ns: i64,
    early_ns: u64,
}

/// A wake-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wake {
    /// The cycle that has begun.
    pub cycle: u64,
    /// When it should have begun for this process, CLOCK_MONOTONIC, in ns.
    pub deadline_ns: u64,
    /// The deadline that the process slept for, in ns: earlier by what was skipped.
    pub awaited_ns: u64,
    /// When the process woke, CLOCK_MONOTONIC, in ns.
    pub woke_ns: u64,
    /// Whole cycles that were passed over since the last wake-up, because they were already over.
    pub skipped: u64,
}

impl Wake {
    /// How late the process woke, in ns, after the deadline that it slept for. From that of the cycle that it
    /// still caught, no wake-up would ever be later than a period.
    pub fn latency_ns(&self) -> u64 {
        self.woke_ns.saturating_sub(self.awaited_ns)
    }
}

impl CyclicTimer {
    /// A timer whose cycle 0 begins at `epoch_ns + phase_ns` on CLOCK_MONOTONIC. A period of 0 counts as 1 ns.
    pub fn new(epoch_ns: u64, period_ns: u64, phase_ns: u64) -> Self {
        Self {
            first_ns: epoch_ns + phase_ns,
            period_ns: period_ns.max(1),
            next_cycle: 0,
            shift_ns: 0,
            early_ns: 0,
        }
    }

    /// The same, awake so long before each deadline.
    #[must_use]
    pub fn early(self, early_ns: u64) -> Self {
        Self { early_ns, ..self }
    }

    /// The deadline of the next cycle, in ns.
    pub fn next_deadline_ns(&self) -> u64 {
        self.deadline_ns(self.next_cycle)
    }

    /// Shifts all deadlines from the next on by `shift_ns` from where they were at the start: onto the clock of a drive's bus.
    pub fn steer(&mut self, shift_ns: i64) {
        self.shift_ns = shift_ns;
    }

    fn deadline_ns(&self, cycle: u64) -> u64 {
        (self.first_ns + cycle * self.period_ns).saturating_add_signed(self.shift_ns)
    }

    /// Sleeps until the next cycle begins. Where that is past, the present cycle is run at once, and those wholly
    /// over are skipped: never two cycles to make up for lost ones, and the phase stays.
    pub fn wait(&mut self) -> Wake {
        self.wait_ready(|_| ())
    }

    /// The same; where it wakes early, `ready` is called with the cycle to come, unless half of that time is over already; then it spins. So what
    /// the kernel takes to wake a process, and what caches have forgotten since, is paid for before the deadline.
    pub fn wait_ready(&mut self, ready: impl FnOnce(u64)) -> Wake {
        let deadline_ns = self.next_deadline_ns();
        sleep_until(deadline_ns.saturating_sub(self.early_ns));
        if self.early_ns > 0 {
            if now_ns() + self.early_ns / 2 < deadline_ns {
                ready(self.next_cycle);
            }
            while now_ns() < deadline_ns {
                std::hint::spin_loop();
            }
        }
        self.woken(now_ns())
    }

    fn woken(&mut self, woke_ns: u64) -> Wake {
        let awaited_ns = self.next_deadline_ns();
        let skipped = woke_ns.saturating_sub(awaited_ns) / self.period_ns;
        let cycle = self.next_cycle + skipped;
        self.next_cycle = cycle + 1;
        Wake { cycle, deadline_ns: self.deadline_ns(cycle), awaited_ns, woke_ns, skipped }
    }
}

fn sleep_until(deadline_ns: u64) {
    let deadline = TimeSpec::new(
        (deadline_ns / 1_000_000_000).cast_signed(),
        (deadline_ns % 1_000_000_000).cast_signed(),
    );
    // A signal may end the sleep early; the deadline is absolute, so sleeping again is right.
    while clock_nanosleep(ClockId::CLOCK_MONOTONIC, ClockNanosleepFlags::TIMER_ABSTIME, &deadline)
        == Err(Errno::EINTR)
    {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// However late a process wakes, cycles only go forward, the phase stays, and no cycle is run that is over.
        #[test]
        fn cycles_go_forward_and_keep_their_phase(latenesses in prop::collection::vec(0_u64..5_000_000, 1..100)) {
            let mut timer = CyclicTimer::new(1_000, 1_000_000, 250_000);
            let mut previous = None;
            for late_ns in latenesses {
                let wake = timer.woken(timer.next_deadline_ns() + late_ns);
                prop_assert_eq!((wake.deadline_ns - 251_000) % 1_000_000, 0);
                prop_assert!(wake.woke_ns.saturating_sub(wake.deadline_ns) < 1_000_000, "a cycle that is over was run");
                let expected = previous.map_or(0, |cycle: u64| cycle + 1) + wake.skipped;
                prop_assert_eq!(wake.cycle, expected);
                previous = Some(wake.cycle);
            }
        }
    }

    #[test]
    fn it_follows_another_clock() {
        let mut timer = CyclicTimer::new(1_000, 1_000_000, 250_000);
        assert_eq!(timer.next_deadline_ns(), 251_000);
        timer.steer(-700);
        assert_eq!(timer.woken(timer.next_deadline_ns()).deadline_ns, 250_300);
        timer.steer(500);
        assert_eq!(timer.next_deadline_ns(), 1_251_500);
    }

    #[test]
    fn it_sleeps_to_the_deadline() {
        let mut timer = CyclicTimer::new(now_ns() + 2_000_000, 1_000_000, 0);
        let wakes: Vec<_> = (0..5).map(|_| timer.wait_ready(|_| panic!("nothing to ready"))).collect();
        for wake in wakes {
            assert!(wake.woke_ns >= wake.deadline_ns, "woke before the deadline: {wake:?}");
        }
    }

    #[test]
    fn awake_early_it_is_ready_for_its_cycle_and_never_before_the_deadline() {
        // Without a real-time priority a wake-up may be late by milliseconds: 10 ms of being early leave 5 to be ready in.
        let mut timer = CyclicTimer::new(now_ns() + 20_000_000, 20_000_000, 0).early(10_000_000);
        let (mut readied, mut last) = (0, None);
        for _ in 0..200 {
            let mut asked = None;
            let wake = timer.wait_ready(|cycle| asked = Some((cycle, now_ns())));
            assert!(wake.woke_ns >= wake.deadline_ns, "{wake:?}");
            assert!(last.is_none_or(|last| wake.cycle > last));
            last = Some(wake.cycle);
            if let Some((cycle, at_ns)) = asked {
                readied += 1;
                assert_eq!(cycle, wake.cycle - wake.skipped, "{wake:?}");
                assert!(at_ns < wake.woke_ns, "{wake:?}: {asked:?}");
            }
            if readied == 5 {
                return;
            }
        }
        panic!("ready in {readied} of 200 cycles");
    }
}
