//! The design of the encoder's feedback: a disturbance observer with a predictor for the dead time, and a linear-quadratic
//! state feedback that damps the resonance.
//!
//! The model, linear about the reference:
//!
//! J·ẍ = w − K·x − D·ẋ − d, with K = T_hold·N_r
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | x | measured angle minus reference angle | rad |
//! | w | torque that the command would give a rotor on its reference, minus the torque fed forward | N·m |
//! | d | disturbance: load torque that the feed-forward does not know | N·m |
//! | J, D | inertia and viscous damping of motor and load, as believed | kg·m², N·m·s/rad |
//!
//! 1. A stationary Kalman filter estimates x, ẋ and d from the encoder. d is modelled as a random walk.
//! 2. The predictor advances the estimate over the dead time, with the commands already sent.
//! 3. The next w cancels d. With active damping it also returns x and ẋ to zero by the feedback of least quadratic cost.
//!
//! The estimate of d is the integral action. It does not wind up when the command is limited, because the filter is fed
//! with the commands after the limits.

pub(crate) mod design;
pub(crate) mod margins;
pub(crate) mod riccati;
pub(crate) mod shaft;

use crate::observer::riccati::{Filter, least_cost_gain};
use crate::observer::shaft::{Shaft, discrete};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What the observer is designed from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ObserverSettings {
    /// Bandwidth of the disturbance estimate, Hz. Without damping it is limited far below the resonance.
    pub bandwidth_hz: f64,
    /// Limit of the disturbance estimate, ± N·m.
    pub torque_limit_nm: f64,
    /// Angle of one encoder count, rad.
    pub count_rad: f64,
    /// Encoder noise before quantisation, RMS, rad.
    pub noise_rad: f64,
    /// Age of the encoder's reading, cycles.
    pub delay_cycles: u64,
    /// Whether the state feedback damps the resonance of motor and load.
    pub damps: bool,
}

/// Upper bound of the bandwidth, Hz.
pub const LARGEST_HZ: f64 = 1000.0;

/// Lower bound of the bandwidth, Hz: a slower observer would have no effect.
pub const SLOWEST_HZ: f64 = 0.1;

/// The fastest bandwidth that is chosen by itself, Hz.
const FASTEST_SUITED_HZ: f64 = 320.0;

/// How wrong the believed friction may be, as a part of it: what the margins are shown for (docs/robustness.md).
const FRICTION_DOUBT: f64 = 0.3;

/// How often the motion is expected to reverse, 1/s: then the disturbance changes by twice what friction is off by.
const REVERSALS_PER_S: f64 = 1.0;

/// Variance of a reading, rad²: rounding to counts, and noise.
fn reading_variance(count_rad: f64, noise_rad: f64) -> f64 {
    count_rad * count_rad / 12.0 + noise_rad * noise_rad
}

/// The bandwidth that suits an encoder, Hz. The disturbance is followed as fast as friction that is off by [`FRICTION_DOUBT`] of
/// the Coulomb torque makes it wander. How fast that is does not depend on the encoder; with one bandwidth for all of them the
/// observer would take a coarse encoder's rounding for a disturbance, and move the valve by it.
pub(crate) fn suited_hz(shaft: &Shaft, coulomb_torque_nm: f64, count_rad: f64, noise_rad: f64) -> f64 {
    let reading_nm = shaft.stiffness_nm_per_rad * reading_variance(count_rad, noise_rad).sqrt();
    let wander_nm = 2.0 * FRICTION_DOUBT * coulomb_torque_nm * (REVERSALS_PER_S * shaft.period_s).sqrt();
    (wander_nm / (TAU * shaft.period_s * reading_nm)).clamp(SLOWEST_HZ, FASTEST_SUITED_HZ)
}

/// The largest bandwidth of an observer without damping, Hz, so that it does not excite the resonance: the loop gain
/// there, raised by the quality factor 1/(2ζ), is a quarter.
fn quiet_hz(shaft: &Shaft) -> f64 {
    let frequency = (shaft.stiffness_nm_per_rad / shaft.inertia_kg_m2).sqrt();
    let damping_ratio = shaft.damping_nm_s_per_rad / (2.0 * shaft.inertia_kg_m2 * frequency);
    (damping_ratio * frequency / (2.0 * TAU)).max(SLOWEST_HZ)
}

/// A designed observer: constant coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Observer {
    /// What it was designed from.
    pub settings: ObserverSettings,
    /// State transition of (x, ẋ, d) over one cycle.
    transition: Matrix3<f64>,
    /// Input vectors of w at the cycle's beginning and end; w is linear in between.
    by_start: Vector3<f64>,
    by_end: Vector3<f64>,
    /// The Kalman filter.
    pub(crate) filter: Filter,
    /// The filter that trusts the model of the shaft least, for a shaft that is not as believed.
    pub(crate) cautious: Filter,
    /// Variance of a reading, rad².
    reading_variance: f64,
    /// Process noise of d per cycle, for each Hz² of bandwidth, N²·m²/Hz².
    change_variance_per_hz2: f64,
    /// Upper bound of the bandwidth for this shaft, Hz.
    largest_hz: f64,
    /// State feedback of x, ẋ and the present w − d; zero without damping.
    feedback: Vector3<f64>,
}

/// An observer's coefficients, for the transfer function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ObserverParts {
    pub transition: Matrix3<f64>,
    pub by_start: Vector3<f64>,
    pub by_end: Vector3<f64>,
    pub gain: Vector3<f64>,
    pub feedback: Vector3<f64>,
}

/// Process noise of the speed, which stands for unmodelled dynamics: a torque per cycle, in multiples of K times the reading's
/// standard deviation. The more of it, the less the filter trusts its model of the shaft, and the larger are the margins;
/// disturbances are found later. The first with which the loop has the margins below is taken, or else the last.
pub(crate) const TORQUE_NOISES_COUNTS: [f64; 9] =
    [1.0, 1.4, 2.0, 2.8, 4.0, 5.7, 8.0, 16.0, MOST_NOISE_COUNTS];
pub(crate) const MOST_NOISE_COUNTS: f64 = 32.0;

impl Observer {
    /// An observer whose filter assumes this much unmodelled dynamics, see [`TORQUE_NOISES_COUNTS`].
    pub(crate) fn with_noise(shaft: &Shaft, settings: ObserverSettings, noise_counts: f64) -> Self {
        let stiffness = shaft.stiffness_nm_per_rad;
        let (transition, by_start, by_end) = discrete(shaft, settings.damps);
        let reading_variance = reading_variance(settings.count_rad, settings.noise_rad);
        let reading_nm = stiffness * reading_variance.sqrt();
        let kick = noise_counts * reading_nm * shaft.period_s / shaft.inertia_kg_m2;
        let per_hz = TAU * shaft.period_s * reading_nm;
        let largest_hz = if settings.damps { LARGEST_HZ } else { quiet_hz(shaft) };
        let change_variance_per_hz2 = per_hz * per_hz;
        let bandwidth_hz = settings.bandwidth_hz.min(largest_hz);
        let noise = Matrix3::from_diagonal(&Vector3::new(
            0.0,
            kick * kick,
            change_variance_per_hz2 * bandwidth_hz * bandwidth_hz,
        ));
        let filter = Filter::settled(&transition, noise, reading_variance);
        let feedback = if settings.damps {
            damping_gain(shaft, &transition, &by_start, &by_end)
        } else {
            Vector3::zeros()
        };
        Self {
            settings,
            transition,
            by_start,
            by_end,
            filter,
            cautious: filter,
            reading_variance,
            change_variance_per_hz2,
            largest_hz,
            feedback,
        }
    }

    /// `filter` with the process noise of another bandwidth; its gain converges over the following cycles.
    pub(crate) fn retuned(&self, mut filter: Filter, bandwidth_hz: f64) -> Filter {
        let bandwidth_hz = bandwidth_hz.min(self.largest_hz);
        filter.noise.m33 = self.change_variance_per_hz2 * bandwidth_hz * bandwidth_hz;
        filter
    }

    /// Advances the filter's covariance and gain by one cycle.
    pub(crate) fn settle(&self, filter: &mut Filter) {
        filter.settle(&self.transition, self.reading_variance);
    }

    /// The estimate one cycle later, while w goes linearly from `start_nm` to `end_nm`.
    pub(crate) fn predicted(&self, estimate: &Vector3<f64>, start_nm: f64, end_nm: f64) -> Vector3<f64> {
        self.transition * estimate + (self.by_start * start_nm + self.by_end * end_nm)
    }

    /// The estimate corrected by a reading of x, with d limited to ±`limit_nm`.
    pub(crate) fn corrected(
        &self,
        filter: &Filter,
        estimate: &Vector3<f64>,
        reading_rad: f64,
        limit_nm: f64,
    ) -> Vector3<f64> {
        let mut corrected = estimate + filter.gain * (reading_rad - estimate.x);
        corrected.z = corrected.z.clamp(-limit_nm, limit_nm);
        corrected
    }

    /// The coefficients for the transfer function.
    pub(crate) fn parts(&self) -> ObserverParts {
        ObserverParts {
            transition: self.transition,
            by_start: self.by_start,
            by_end: self.by_end,
            gain: self.filter.gain,
            feedback: self.feedback,
        }
    }

    /// The w to command at the end of the next cycle, from the state and w predicted for its beginning.
    pub(crate) fn torque_nm(&self, estimate: &Vector3<f64>, present_nm: f64) -> f64 {
        let (disturbance_nm, feedback) = (estimate.z, &self.feedback);
        disturbance_nm
            - feedback.x * estimate.x
            - feedback.y * estimate.y
            - feedback.z * (present_nm - disturbance_nm)
    }
}

/// Weights of the quadratic cost: of K·x, of √(K·J)·ẋ and of w − d, each in N·m, and of the change of w in a cycle. The
/// loop stays stable with inertia and holding torque 30 % off; larger weights of x reduce friction's error only slightly.
const ANGLE_COST: f64 = 1.0;
const SPEED_COST: f64 = 0.3;
const TORQUE_COST: f64 = 2.0;
const CHANGE_COST: f64 = 1.0;

fn damping_gain(
    shaft: &Shaft,
    transition: &Matrix3<f64>,
    by_start: &Vector3<f64>,
    by_end: &Vector3<f64>,
) -> Vector3<f64> {
    // The state is (x, ẋ, w − d) at the cycle's beginning, the input the change of w over the cycle.
    let held = by_start + by_end;
    let mut plant = *transition;
    plant.set_column(2, &Vector3::new(held.x, held.y, 1.0));
    let input = Vector3::new(by_end.x, by_end.y, 1.0);
    let stiffness = shaft.stiffness_nm_per_rad;
    let speed_weight = (stiffness * shaft.inertia_kg_m2).sqrt();
    let cost = Vector3::new(
        ANGLE_COST * stiffness * stiffness,
        SPEED_COST * speed_weight * speed_weight,
        TORQUE_COST,
    );
    let gain = least_cost_gain(&plant, &input, &Matrix3::from_diagonal(&cost), CHANGE_COST);
    // w⁺ = w + change, so w⁺ − d = (1 − l₂)·(w − d) − …
    Vector3::new(gain.x, gain.y, gain.z - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const SHAFT: Shaft = Shaft {
        inertia_kg_m2: 5e-4,
        stiffness_nm_per_rad: 300.0,
        damping_nm_s_per_rad: 0.02,
        period_s: 1e-3,
    };

    fn settings(bandwidth_hz: f64, damps: bool) -> ObserverSettings {
        ObserverSettings {
            bandwidth_hz,
            torque_limit_nm: 3.0,
            count_rad: TAU / 131_072.0,
            noise_rad: 1e-5,
            delay_cycles: 0,
            damps,
        }
    }

    #[test]
    fn a_changed_bandwidth_converges_to_the_design_for_it() {
        let (slow, fast) = (
            Observer::with_noise(&SHAFT, settings(2.0, true), 1.0),
            Observer::with_noise(&SHAFT, settings(200.0, true), 1.0),
        );
        let mut filter = slow.retuned(slow.filter, 200.0);
        (0..3000).for_each(|_| slow.settle(&mut filter));
        for (gain, designed) in filter.gain.iter().zip(&fast.filter.gain) {
            assert_relative_eq!(*gain, *designed, max_relative = 1e-9);
        }
    }

    #[test]
    fn the_discretised_shaft_has_the_eigenvalues_of_the_continuous_one() {
        // x⁺ has eigenvalues exp(−ζω ± jω_d)T: their product and sum.
        let (transition, ..) = discrete(&SHAFT, true);
        let (a, b, c, d) = (transition.m11, transition.m12, transition.m21, transition.m22);
        let (omega, decay) = ((300.0_f64 / 5e-4).sqrt(), 0.02 / (2.0 * 5e-4));
        let ringing = (omega * omega - decay * decay).sqrt();
        assert_relative_eq!(a * d - b * c, (-2.0 * decay * 1e-3).exp(), max_relative = 1e-9);
        assert_relative_eq!(a + d, 2.0 * (-decay * 1e-3).exp() * (ringing * 1e-3).cos(), max_relative = 1e-7);
    }

    #[test]
    fn a_coarse_encoder_gets_a_slow_observer() {
        let hz = |counts: f64, coulomb_nm: f64| suited_hz(&SHAFT, coulomb_nm, TAU / counts, 1e-5);
        assert_eq!([hz(131_072.0, 1.5), hz(1e6, 1.5), hz(1e9, 1.5)], [FASTEST_SUITED_HZ; 3]);
        assert!((120.0..150.0).contains(&hz(16_000.0, 1.5)), "{}", hz(16_000.0, 1.5));
        // The noise is next to nothing then: as the counts.
        assert_relative_eq!(hz(16_000.0, 1.5) / hz(4_000.0, 1.5), 4.0, max_relative = 0.01);
        assert_relative_eq!(hz(4_000.0, 3.0) / hz(4_000.0, 1.5), 2.0, max_relative = 1e-9);
        // Readings twice as often, each of them as coarse: √2.
        let quick = Shaft { period_s: 5e-4, ..SHAFT };
        let ratio = suited_hz(&quick, 1.5, TAU / 4_000.0, 0.0) / suited_hz(&SHAFT, 1.5, TAU / 4_000.0, 0.0);
        assert_relative_eq!(ratio, std::f64::consts::SQRT_2, max_relative = 1e-9);
        assert_eq!(hz(4_000.0, 0.0), SLOWEST_HZ, "no friction");
    }

    #[test]
    fn an_observer_without_damping_is_slow_and_has_no_state_feedback() {
        let observer = Observer::with_noise(&SHAFT, settings(200.0, false), 1.0);
        assert!(observer.largest_hz < 2.0, "{} Hz", observer.largest_hz);
        assert_eq!(observer.torque_nm(&Vector3::new(1e-3, 1.0, 0.7), 0.1), 0.7);
    }
}
