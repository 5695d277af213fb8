//! Detects that the loop itself oscillates: the observer's feedback with a belief that is too far from the valve.
//!
//! An unstable loop swings at about the resonance of motor and load, and does not decay. Friction's own events (break-away,
//! reversals, slips) ring at the same frequency but die out within some periods. So the sign of an oscillation is a number of
//! half-waves of the deviation's speed one after another, each no longer than a slow resonance allows, whose second half is
//! as large as the first.

use crate::params::Params;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Half-waves one after another: five periods, in which a resonance of damping ratio 0.026 decays to less than a half.
const HALF_WAVES: usize = 10;

/// Successive half-waves that must grow, and the least growth of each: an excitation that a stable loop gets twice at the most
/// (the beginning and the end of a jerk) makes fewer.
const GROWING_WAVES: usize = 4;
const GROWS: f64 = 1.05;

/// One less is enough if the newest is as large as this, electrical rad: 45°, which only an unstable loop reaches repeatedly.
const LARGE_RAD: f64 = PI / 4.0;

/// The longest half-wave, in half periods of the believed resonance: six times the believed inertia.
const LONGEST: f64 = 2.5;

/// The smallest amplitude of a half-wave, electrical rad: 5°, a sixteenth of the largest lead.
const SMALLEST_RAD: f64 = 5.0 * PI / 180.0;

/// Ratio of the mean amplitude of the later half-waves to the earlier ones' from which on they do not decay.
const KEEPS: f64 = 0.8;

/// The half-waves so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Oscillation {
    /// Deviation of the last reading from its aim, rad.
    before_rad: Option<f64>,
    /// Sum of the changes of the present half-wave, electrical rad, and its cycles.
    swing_rad: f64,
    cycles: u64,
    /// Amplitudes of the half-waves before, newest first, and how many of them follow one another.
    past_rad: [f64; HALF_WAVES],
    count: usize,
}

impl Oscillation {
    /// Takes in the deviation of a reading from its aim; whether the loop oscillates.
    pub(crate) fn step(&mut self, params: &Params, deviation_rad: f64) -> bool {
        let Some(before_rad) = self.before_rad.replace(deviation_rad) else { return false };
        let change_rad = f64::from(params.motor.rotor_teeth) * (deviation_rad - before_rad);
        self.cycles += 1;
        if change_rad * self.swing_rad >= 0.0 {
            self.swing_rad += change_rad;
            return false;
        }
        self.close(params);
        self.swing_rad = change_rad;
        self.cycles = 0;
        self.count >= HALF_WAVES && self.keeps() || self.grows()
    }

    /// Ends a half-wave: it continues the ones before, or begins anew.
    fn close(&mut self, params: &Params) {
        let long = self.cycles as f64 * params.period_s > LONGEST * params.half_period_s();
        // From peak to peak.
        let amplitude_rad = self.swing_rad.abs() / 2.0;
        if long || amplitude_rad < SMALLEST_RAD {
            self.count = 0;
            return;
        }
        self.past_rad.rotate_right(1);
        if let Some(newest) = self.past_rad.first_mut() {
            *newest = amplitude_rad;
        }
        self.count += 1;
    }

    /// Whether each of the last half-waves is larger than the one before: a loop that does not oscillate by itself has a decay.
    fn grows(&self) -> bool {
        let large = self.past_rad.first().is_some_and(|newest_rad| *newest_rad > LARGE_RAD);
        let waves = GROWING_WAVES - usize::from(large);
        let newest = self.past_rad.iter().take(waves);
        self.count >= waves
            && newest.clone().zip(newest.skip(1)).all(|(later, earlier)| *later > GROWS * earlier)
    }

    fn keeps(&self) -> bool {
        let (later, earlier) = self.past_rad.split_at(HALF_WAVES / 2);
        later.iter().sum::<f64>() >= KEEPS * earlier.iter().sum::<f64>()
    }
}
