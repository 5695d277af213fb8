//! The cycles at which a scenario arms, ends and has come to rest.

use serde::{Deserialize, Serialize};

/// `simulate` arms in this cycle; the scenario's time starts there.
pub const ARM_CYCLE: u64 = 10;

/// Time after the drive's stop in which the rotor swings out and the controller notices, s, and cycles beside it.
const SETTLING_S: f64 = 0.05;
const SETTLING_CYCLES: u64 = 20;

/// A run's cycles, known to all of its processes from the beginning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Timeline {
    /// Length of a cycle, ns.
    pub period_ns: u64,
    /// The controller arms in this cycle.
    pub arm_cycle: u64,
    /// The scenario is over in this cycle: the controller disarms.
    pub disarm_cycle: u64,
    /// The last cycle of the run: the valve stands.
    pub last_cycle: u64,
}

impl Timeline {
    /// The timeline of a scenario that lasts `duration_s` and stops within `stop_cycles`.
    pub fn new(period_ns: u64, duration_s: f64, stop_cycles: u64) -> Self {
        let in_cycles = |time_s: f64| (time_s * 1e9 / period_ns as f64).ceil() as u64;
        let cycles = in_cycles(duration_s);
        let disarm_cycle = ARM_CYCLE + cycles.max(1);
        Self {
            period_ns,
            arm_cycle: ARM_CYCLE,
            disarm_cycle,
            last_cycle: disarm_cycle + stop_cycles + in_cycles(SETTLING_S) + SETTLING_CYCLES,
        }
    }

    /// The same without an end.
    #[must_use]
    pub fn without_end(self) -> Self {
        Self { disarm_cycle: u64::MAX, last_cycle: u64::MAX, ..self }
    }

    /// Length of a cycle, s.
    pub fn period_s(&self) -> f64 {
        self.period_ns as f64 / 1e9
    }

    /// The scenario's time at the beginning of a cycle, s; negative before arming.
    pub fn scenario_time_s(&self, cycle: u64) -> f64 {
        (cycle as f64 - self.arm_cycle as f64) * self.period_s()
    }

    /// The cycle in which a set-point of scenario time `time_s` comes. The first that can be followed is the one
    /// after arming, when the trajectory has heard of it.
    pub fn cycle_of(&self, time_s: f64) -> u64 {
        let cycles = (time_s / self.period_s() - 1e-6).ceil().max(1.0);
        self.arm_cycle + cycles as u64
    }
}
