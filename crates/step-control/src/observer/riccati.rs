//! The Riccati equation of three states, for the design of observer and feedback.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Iterations in which the Riccati equation of a plant of three states converges to the digits that matter.
const ITERATIONS: usize = 4000;

/// The gain l of the feedback u = −l·x that minimises Σ x'·Q·x + r·u² for x⁺ = A·x + b·u.
pub(crate) fn least_cost_gain(
    a: &Matrix3<f64>,
    b: &Vector3<f64>,
    state_cost: &Matrix3<f64>,
    input_cost: f64,
) -> Vector3<f64> {
    let across = a.transpose();
    let (mut cost, mut gain) = (*state_cost, Vector3::zeros());
    for _ in 0..ITERATIONS {
        let weighted = cost * b;
        gain = across * weighted * (1.0 / (input_cost + b.dot(&weighted)));
        // P = Q + A'·P·(A − b·l)
        let closed = a - b * gain.transpose();
        cost = symmetric(&(state_cost + across * (cost * closed)));
    }
    gain
}

/// A filter for x⁺ = A·x + noise of covariance Q that takes readings of the first state with noise of variance r:
/// x̂ ← x̂ + gain·(reading − x̂₀).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Filter {
    /// Q.
    pub noise: Matrix3<f64>,
    /// Covariance of the estimate before a reading is taken.
    covariance: Matrix3<f64>,
    /// The gain.
    pub gain: Vector3<f64>,
}

impl Filter {
    /// The filter with its stationary gain.
    pub(crate) fn settled(a: &Matrix3<f64>, noise: Matrix3<f64>, reading_variance: f64) -> Self {
        let mut filter = Self { noise, covariance: noise, gain: Vector3::zeros() };
        (0..ITERATIONS).for_each(|_| filter.settle(a, reading_variance));
        filter
    }

    /// Advances the gain by a cycle: it follows a change of Q as the estimate's covariance does.
    pub(crate) fn settle(&mut self, a: &Matrix3<f64>, reading_variance: f64) {
        let first = self.covariance.column(0).into_owned();
        let gain = first * (1.0 / (first.x + reading_variance));
        let known = self.covariance - gain * first.transpose();
        self.covariance = symmetric(&(self.noise + a * (known * a.transpose())));
        self.gain = gain;
    }
}

fn symmetric(m: &Matrix3<f64>) -> Matrix3<f64> {
    (m + m.transpose()) * 0.5
}
