//! What the encoder adds: a disturbance observer that predicts over the delay, and a feedback that damps.
//!
//! In deviations from the reference the shaft obeys J·ẍ = w − K·x − D·ẋ − d: x is the angle's deviation, w the torque
//! that the command gives beyond the one fed forward were the spool on its reference, K = T_hold·N_r, and d the torque
//! that the feed-forward left out. A stationary Kalman filter estimates x, ẋ and d from the encoder; the estimate is
//! carried over the dead time with the commands that are under way; the next w cancels d and, where damping is active,
//! takes x and ẋ to zero at least cost. The state of d is the integral action: without it in the way of limits, since
//! what is under way is what the limits left.

use crate::riccati::{Filter, least_cost_gain};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What the observer is told.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ObserverSettings {
    /// How fast it follows a torque that was left out, Hz; far slower where it does not damp the resonance.
    pub bandwidth_hz: f64,
    /// The largest torque that it makes up for, N·m.
    pub torque_limit_nm: f64,
    /// Angle of an encoder's count, rad.
    pub count_rad: f64,
    /// Noise of the encoder beyond its counts, RMS, rad.
    pub noise_rad: f64,
    /// Age of the encoder's reading, cycles.
    pub delay_cycles: u64,
    /// Whether it damps the resonance of motor and load.
    pub damps: bool,
}

/// The shaft as believed, for the observer's design.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shaft {
    pub inertia_kg_m2: f64,
    pub stiffness_nm_per_rad: f64,
    pub damping_nm_s_per_rad: f64,
    pub period_s: f64,
}

impl Shaft {
    /// The bandwidth up to which an observer leaves the resonance alone that it does not damp, Hz: there the resonance
    /// amplifies by half its quality, 1/ζ, and that has to stay below one.
    fn quiet_hz(&self) -> f64 {
        let frequency = (self.stiffness_nm_per_rad / self.inertia_kg_m2).sqrt();
        let damping_ratio = self.damping_nm_s_per_rad / (2.0 * self.inertia_kg_m2 * frequency);
        (damping_ratio * frequency / (2.0 * TAU)).max(SLOWEST_HZ)
    }
}

/// No observer is faster, Hz.
const LARGEST_HZ: f64 = 1000.0;

/// Slower than this an observer is none, Hz.
const SLOWEST_HZ: f64 = 0.1;

/// The observer, designed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Observer {
    /// What it was told.
    pub settings: ObserverSettings,
    /// From one cycle to the next: x, ẋ and d.
    transition: Matrix3<f64>,
    /// What w at the cycle's beginning and end add.
    by_start: Vector3<f64>,
    by_end: Vector3<f64>,
    /// How an innovation corrects the estimate.
    pub(crate) filter: Filter,
    /// Variance of a reading, rad².
    reading_variance: f64,
    /// Variance of d's change in a cycle for each Hz² of bandwidth, N²·m²/Hz².
    change_variance_per_hz2: f64,
    /// The largest bandwidth that it may have, Hz.
    largest_hz: f64,
    /// Feedback of x, ẋ and the present w − d.
    feedback: Vector3<f64>,
}

/// Torque noise that stands for everything the model has not, in parts of K times a count, per cycle.
const TORQUE_NOISE_COUNTS: f64 = 1.0;

impl Observer {
    pub(crate) fn design(shaft: &Shaft, settings: ObserverSettings) -> Self {
        let stiffness = shaft.stiffness_nm_per_rad;
        let (transition, by_start, by_end) = discrete(shaft, settings.damps);
        let reading_variance =
            settings.count_rad * settings.count_rad / 12.0 + settings.noise_rad * settings.noise_rad;
        let reading_nm = stiffness * reading_variance.sqrt();
        let kick = TORQUE_NOISE_COUNTS * reading_nm * shaft.period_s / shaft.inertia_kg_m2;
        let per_hz = TAU * shaft.period_s * reading_nm;
        let largest_hz = if settings.damps { LARGEST_HZ } else { shaft.quiet_hz() };
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
            reading_variance,
            change_variance_per_hz2,
            largest_hz,
            feedback,
        }
    }

    /// `filter` with another bandwidth: its gain gets there as it settles.
    pub(crate) fn retuned(&self, mut filter: Filter, bandwidth_hz: f64) -> Filter {
        let bandwidth_hz = bandwidth_hz.min(self.largest_hz);
        filter.noise.m33 = self.change_variance_per_hz2 * bandwidth_hz * bandwidth_hz;
        filter
    }

    /// The filter's gain a cycle later.
    pub(crate) fn settle(&self, filter: &mut Filter) {
        filter.settle(&self.transition, self.reading_variance);
    }

    /// The estimate a cycle later, with w going from `start_nm` to `end_nm`.
    pub(crate) fn predicted(&self, estimate: &Vector3<f64>, start_nm: f64, end_nm: f64) -> Vector3<f64> {
        self.transition * estimate + (self.by_start * start_nm + self.by_end * end_nm)
    }

    /// The estimate with a reading of x taken in; d within ±`limit_nm`.
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

    /// The next w, from the state predicted for its cycle's beginning and w there.
    pub(crate) fn torque_nm(&self, estimate: &Vector3<f64>, present_nm: f64) -> f64 {
        let (disturbance_nm, feedback) = (estimate.z, &self.feedback);
        disturbance_nm
            - feedback.x * estimate.x
            - feedback.y * estimate.y
            - feedback.z * (present_nm - disturbance_nm)
    }
}

/// The shaft from cycle to cycle; one that is not damped is taken to follow at once.
fn discrete(shaft: &Shaft, resonant: bool) -> (Matrix3<f64>, Vector3<f64>, Vector3<f64>) {
    let Shaft { stiffness_nm_per_rad: stiffness, damping_nm_s_per_rad: damping, period_s, .. } = *shaft;
    let free = if resonant { free_motion(shaft) } else { Matrix2::zeros() };
    // Where w − d goes linearly from 0 to 1 or stays at 1, x goes along behind by `behind` of its slope.
    let behind_s = if resonant { damping / stiffness } else { 0.0 };
    let response = |start: f64, end: f64| {
        let slope = (end - start) / (stiffness * period_s);
        let moved = free * Vector2::new(-(start / stiffness - slope * behind_s), -slope);
        let speed = if resonant { slope + moved.y } else { 0.0 };
        Vector3::new(end / stiffness - slope * behind_s + moved.x, speed, 0.0)
    };
    let (by_start, by_end) = (response(1.0, 0.0), response(0.0, 1.0));
    let held = response(1.0, 1.0);
    let transition = Matrix3::new(free.m11, free.m12, -held.x, free.m21, free.m22, -held.y, 0.0, 0.0, 1.0);
    (transition, by_start, by_end)
}

/// exp(A·T) of x and ẋ without torque, by the series to the third order on a small part of the cycle, squared.
fn free_motion(shaft: &Shaft) -> Matrix2<f64> {
    const SQUARINGS: u32 = 12;
    let dt = shaft.period_s / f64::from(1_u32 << SQUARINGS);
    let (a, b) = (
        -shaft.stiffness_nm_per_rad / shaft.inertia_kg_m2,
        -shaft.damping_nm_s_per_rad / shaft.inertia_kg_m2,
    );
    let first = Matrix2::new(0.0, 1.0, a, b);
    let square = Matrix2::new(a, b, a * b, a + b * b);
    let cube = Matrix2::new(a * b, a + b * b, a * (a + b * b), a * b + b * (a + b * b));
    let mut free = Matrix2::identity() + (first + (square / 2.0 + cube * dt / 6.0) * dt) * dt;
    for _ in 0..SQUARINGS {
        free = free * free;
    }
    free
}

/// What a deviation of K·x, of √(K·J)·ẋ and of w − d by one N·m costs beside a change of w by one. With these the loop
/// stays stable for inertias and holding torques 30 % off; stiffer ones gain little against friction.
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
    // x, ẋ and w − d at the cycle's beginning; the input is the change of w.
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
    fn a_changed_bandwidth_ends_where_a_design_has_it() {
        let (slow, fast) =
            (Observer::design(&SHAFT, settings(2.0, true)), Observer::design(&SHAFT, settings(200.0, true)));
        let mut filter = slow.retuned(slow.filter, 200.0);
        (0..3000).for_each(|_| slow.settle(&mut filter));
        for (gain, designed) in filter.gain.iter().zip(&fast.filter.gain) {
            assert_relative_eq!(*gain, *designed, max_relative = 1e-9);
        }
    }

    #[test]
    fn the_shaft_rings_at_its_resonance_from_cycle_to_cycle() {
        // x⁺ has eigenvalues exp(−ζω ± jω_d)T: their product and sum.
        let (transition, ..) = discrete(&SHAFT, true);
        let (a, b, c, d) = (transition.m11, transition.m12, transition.m21, transition.m22);
        let (omega, decay) = ((300.0_f64 / 5e-4).sqrt(), 0.02 / (2.0 * 5e-4));
        let ringing = (omega * omega - decay * decay).sqrt();
        assert_relative_eq!(a * d - b * c, (-2.0 * decay * 1e-3).exp(), max_relative = 1e-9);
        assert_relative_eq!(a + d, 2.0 * (-decay * 1e-3).exp() * (ringing * 1e-3).cos(), max_relative = 1e-7);
    }

    #[test]
    fn what_does_not_damp_leaves_the_resonance_alone() {
        let observer = Observer::design(&SHAFT, settings(200.0, false));
        assert!(observer.largest_hz < 2.0, "{} Hz", observer.largest_hz);
        assert_eq!(observer.torque_nm(&Vector3::new(1e-3, 1.0, 0.7), 0.1), 0.7);
    }
}
