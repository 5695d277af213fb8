//! Matrices of three by three, and the Riccati equation on them: all that the design of observer and feedback needs.

use serde::{Deserialize, Serialize};

/// A vector of three.
pub(crate) type Vector = [f64; 3];

/// A matrix, row by row.
pub(crate) type Matrix = [Vector; 3];

/// Iterations in which the Riccati equation of a plant of three states has settled to the last digits that matter.
const ITERATIONS: usize = 4000;

pub(crate) fn dot(a: &Vector, b: &Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn apply(matrix: &Matrix, vector: &Vector) -> Vector {
    matrix.map(|row| dot(&row, vector))
}

pub(crate) fn transposed(m: &Matrix) -> Matrix {
    [[m[0][0], m[1][0], m[2][0]], [m[0][1], m[1][1], m[2][1]], [m[0][2], m[1][2], m[2][2]]]
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let columns = transposed(b);
    a.map(|row| columns.map(|column| dot(&row, &column)))
}

fn sum(a: &Matrix, b: &Matrix) -> Matrix {
    [add(&a[0], &b[0]), add(&a[1], &b[1]), add(&a[2], &b[2])]
}

pub(crate) fn add(a: &Vector, b: &Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(crate) fn scaled(a: &Vector, factor: f64) -> Vector {
    a.map(|value| value * factor)
}

pub(crate) fn diagonal(values: Vector) -> Matrix {
    [[values[0], 0.0, 0.0], [0.0, values[1], 0.0], [0.0, 0.0, values[2]]]
}

/// The gain l of the feedback u = −l·x that costs least in Σ x'·Q·x + r·u² for x⁺ = A·x + b·u.
pub(crate) fn least_cost_gain(a: &Matrix, b: &Vector, state_cost: &Matrix, input_cost: f64) -> Vector {
    let across = transposed(a);
    let (mut cost, mut gain) = (*state_cost, [0.0; 3]);
    for _ in 0..ITERATIONS {
        let weighted = apply(&cost, b);
        gain = scaled(&apply(&across, &weighted), 1.0 / (input_cost + dot(b, &weighted)));
        // P = Q + A'·P·(A − b·l)
        let closed =
            [subtracted(&a[0], &gain, b[0]), subtracted(&a[1], &gain, b[1]), subtracted(&a[2], &gain, b[2])];
        cost = symmetric(&sum(state_cost, &product(&across, &product(&cost, &closed))));
    }
    gain
}

/// A filter for x⁺ = A·x + noise of covariance Q that takes readings of the first state with noise of variance r:
/// x̂ ← x̂ + gain·(reading − x̂₀).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Filter {
    /// Q.
    pub noise: Matrix,
    /// Covariance of the estimate before a reading is taken.
    covariance: Matrix,
    /// The gain.
    pub gain: Vector,
}

impl Filter {
    /// Its gain once it has settled.
    pub(crate) fn settled(a: &Matrix, noise: Matrix, reading_variance: f64) -> Self {
        let mut filter = Self { noise, covariance: noise, gain: [0.0; 3] };
        (0..ITERATIONS).for_each(|_| filter.settle(a, reading_variance));
        filter
    }

    /// The gain a cycle later: it follows a change of Q as the estimate's covariance does.
    pub(crate) fn settle(&mut self, a: &Matrix, reading_variance: f64) {
        let covariance = &self.covariance;
        let first = [covariance[0][0], covariance[1][0], covariance[2][0]];
        let gain = scaled(&first, 1.0 / (first[0] + reading_variance));
        let known = [
            subtracted(&covariance[0], &first, gain[0]),
            subtracted(&covariance[1], &first, gain[1]),
            subtracted(&covariance[2], &first, gain[2]),
        ];
        self.covariance = symmetric(&sum(&self.noise, &product(a, &product(&known, &transposed(a)))));
        self.gain = gain;
    }
}

fn subtracted(row: &Vector, other: &Vector, factor: f64) -> Vector {
    add(row, &scaled(other, -factor))
}

fn symmetric(m: &Matrix) -> Matrix {
    sum(m, &transposed(m)).map(|row| scaled(&row, 0.5))
}
