//! The shaft that the observer is designed for: rotor and load on the motor's spring, sliding.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// The shaft as believed, for the observer's design.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shaft {
    pub inertia_kg_m2: f64,
    pub stiffness_nm_per_rad: f64,
    pub damping_nm_s_per_rad: f64,
    pub period_s: f64,
}

impl Shaft {
    /// The shaft scaled by these factors.
    pub(crate) fn times(self, factors: ShaftFactors) -> Self {
        Self {
            inertia_kg_m2: self.inertia_kg_m2 * factors.inertia,
            stiffness_nm_per_rad: self.stiffness_nm_per_rad * factors.stiffness,
            ..self
        }
    }
}

/// How a valve's shaft differs from the believed one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShaftFactors {
    /// Factor on the inertia of motor and load.
    pub inertia: f64,
    /// Factor on the motor's torque by load angle: a wrong holding torque, or the cosine of the load angle.
    pub stiffness: f64,
}

impl ShaftFactors {
    /// The shaft as believed.
    pub const BELIEVED: Self = Self { inertia: 1.0, stiffness: 1.0 };
}

/// The shaft discretised over one cycle. Without damping the resonance is left out: x follows the torque at once.
pub(crate) fn discrete(shaft: &Shaft, resonant: bool) -> (Matrix3<f64>, Vector3<f64>, Vector3<f64>) {
    let Shaft { stiffness_nm_per_rad: stiffness, damping_nm_s_per_rad: damping, period_s, .. } = *shaft;
    let free = if resonant { free_motion(shaft) } else { Matrix2::zeros() };
    // The forced response to w − d = start + slope·t is x = (start + slope·(t − D/K))/K; the rest decays freely.
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

/// exp(A·T) of (x, ẋ) without torque: scaling and squaring, with a Taylor series of third order.
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
