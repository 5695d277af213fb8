//! Whether compensation makes the error smaller than it would be without: seen from the load angle.
//!
//! Without compensation the command is the reference, and the rotor lags it by its load angle. With it the command leads the
//! reference, and the load angle is the command's lead over the reading. So each reading gives both errors:
//!
//! with compensation: θ_ref − θ, without: θ_cmd − θ
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | θ_ref, θ_cmd, θ | what was aimed at, the command, the encoder's angle at the time of a reading | rad |
//!
//! That holds while the load is the same in either case: not for the ringing that compensation itself excites. Where the
//! second is smaller for long, the lead is what makes the error: friction that is no longer there, a contact with play.

use crate::params::Params;
use serde::{Deserialize, Serialize};

/// Time constant of forgetting, s, and the time for which the error has to be the larger one: longer than the load share takes
/// to find out how much friction there is.
const FORGETTING_S: f64 = 1.0;
const HARMS_FOR_S: f64 = 0.25;

/// RMS ratio of the error with compensation to the one without above which compensation does harm.
const WORSE: f64 = 1.02;

/// Sums over the readings, each with less weight the longer ago.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Benefit {
    readings: f64,
    /// Σ of the squared errors with and without compensation, rad².
    with_2: f64,
    without_2: f64,
    /// Successive readings for which the former is the larger one.
    harmful: u64,
}

impl Benefit {
    /// Takes in a reading's two errors, rad; whether compensation makes it worse.
    pub(crate) fn harms(&mut self, params: &Params, with_rad: f64, without_rad: f64) -> bool {
        let keeps = (-params.period_s / FORGETTING_S).exp();
        let sums = [
            (&mut self.readings, 1.0),
            (&mut self.with_2, with_rad * with_rad),
            (&mut self.without_2, without_rad * without_rad),
        ];
        for (sum, term) in sums {
            *sum = keeps * *sum + term;
        }
        // Smaller differences can't be resolved by the encoder and a micro-step.
        let count_rad = params.observer.map_or(0.0, |observer| observer.settings.count_rad);
        let finest_rad = count_rad + params.drive.microstep_angle_rad;
        let least_2 = self.readings * finest_rad * finest_rad;
        let harms = self.with_2 > WORSE * WORSE * self.without_2 + least_2;
        self.harmful = if harms { self.harmful.saturating_add(1) } else { 0 };
        self.harmful as f64 * params.period_s > HARMS_FOR_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::tests::params;

    fn harms(errors_rad: impl Fn(u32) -> (f64, f64), cycles: u32) -> Option<u32> {
        let (params, mut benefit) = (params(), Benefit::default());
        (0..cycles).find(|cycle| {
            let (with_rad, without_rad) = errors_rad(*cycle);
            benefit.harms(&params, with_rad, without_rad)
        })
    }

    #[test]
    fn a_lead_that_nothing_takes_harms_and_one_that_friction_takes_does_not() {
        assert_eq!(harms(|_| (5e-3, 0.1e-3), 1000), Some(250), "after 0.25 s");
        assert_eq!(harms(|_| (-5e-3, 0.1e-3), 1000), Some(250));
        assert_eq!(harms(|_| (0.1e-3, 5e-3), 10_000), None);
        assert_eq!(harms(|_| (5e-3, 5e-3), 10_000), None, "no better, no worse");
        assert!(harms(|_| (5.2e-3, 5e-3), 10_000).is_some());
    }

    #[test]
    fn what_an_encoder_does_not_tell_apart_harms_nobody() {
        assert_eq!(harms(|_| (0.05e-3, 0.0), 10_000), None);
        assert!(harms(|_| (0.12e-3, 0.0), 10_000).is_some());
    }

    #[test]
    fn what_was_good_long_ago_does_not_outweigh_what_harms_now() {
        let errors_rad = |cycle| if cycle < 20_000 { (0.1e-3, 5e-3) } else { (5e-3, 0.1e-3) };
        let found = harms(errors_rad, 23_000).unwrap();
        assert!((20_500..21_000).contains(&found), "{found}");
    }
}
