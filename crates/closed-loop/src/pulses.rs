//! The driver's pulses in a cycle, computed from the guard's output: for the oracle that judges a run afterwards.

use drive::Microsteps;

/// The pulses of one cycle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Pulses {
    /// How many, signed.
    pub(crate) count: i64,
    /// Time of the first after the cycle's beginning, ns; 0 where there is none.
    pub(crate) first_ns: u64,
    /// The same of the last.
    pub(crate) last_ns: u64,
}

impl Pulses {
    /// The pulses of a command that goes from one whole micro-step to another within a period, at a constant rate: each
    /// comes where the command is half-way to the next micro-step.
    pub(crate) fn between(start: Microsteps, end: Microsteps, period_ns: u64) -> Self {
        let count = (end - start).0 as i64;
        let half_spacings = 2 * u128::from(count.unsigned_abs());
        if half_spacings == 0 {
            return Self::default();
        }
        let at = |half_spacing: u128| (u128::from(period_ns) * half_spacing / half_spacings) as u64;
        Self { count, first_ns: at(1), last_ns: at(half_spacings - 1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulses_are_spread_evenly_over_the_cycle() {
        assert_eq!(Pulses::between(Microsteps(5.0), Microsteps(5.0), 1000), Pulses::default());
        assert_eq!(
            Pulses::between(Microsteps(5.0), Microsteps(4.0), 1000),
            Pulses { count: -1, first_ns: 500, last_ns: 500 }
        );
        assert_eq!(
            Pulses::between(Microsteps(-2.0), Microsteps(2.0), 1000),
            Pulses { count: 4, first_ns: 125, last_ns: 875 }
        );
    }
}
