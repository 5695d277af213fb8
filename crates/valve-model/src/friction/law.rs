//! What the laws have in common: one inner state z, its rate, the torque, and how both depend on speed and z.

use super::curve::{Curve, Levels};
use super::maxwell::Memory;

/// A law at one instant.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Flow {
    /// Friction torque, N·m, positive against positive speed.
    pub torque_nm: f64,
    /// dz/dt, rad/s.
    pub rate: f64,
}

/// A law at one instant and its partial derivatives: by the speed ω, the speed ω_c at which the curve is read, z, and
/// the factor of the levels.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Linearised {
    pub flow: Flow,
    pub torque_by_speed: f64,
    pub torque_by_curve_speed: f64,
    pub torque_by_z: f64,
    pub torque_by_level: f64,
    pub rate_by_speed: f64,
    pub rate_by_curve_speed: f64,
    pub rate_by_z: f64,
    pub rate_by_level: f64,
}

/// Where a law is asked for its torque.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point {
    /// Speed ω, rad/s.
    pub speed: f64,
    /// The speed at which the steady curve is read, rad/s; ω but where friction lags.
    pub curve_speed: f64,
    /// Inner state z, rad.
    pub z: f64,
    /// ±1: the sign with which |ω| and sgn ω are taken. That of ω, but where a sub-step of an integrator keeps the one it
    /// began with, so that its equations are smooth.
    pub direction: f64,
}

/// A friction law with its coefficients prepared.
pub(crate) trait Law {
    /// Torque and dz/dt.
    fn flow(&self, at: Point, levels: &Levels, memory: &Memory) -> Flow;

    /// Torque, dz/dt and their derivatives.
    fn linearise(&self, at: Point, levels: &Levels, memory: &Memory) -> Linearised;

    /// z after `dt_s` at a frozen speed: exact, or bounded where no closed form exists; never past the steady value.
    fn frozen(&self, at: Point, dt_s: f64, levels: &Levels, memory: &Memory) -> f64;

    /// The torque that goes with a known rate of z.
    fn torque(&self, at: Point, rate: f64, levels: &Levels, memory: &Memory) -> f64;

    /// The Stribeck curve, flat for a law without one.
    fn curve(&self) -> &Curve;

    /// σ0, N·m/rad; 0 for a law without z.
    fn stiffness(&self) -> f64;

    /// σ1, N·m·s/rad; 0 for a law without bristle damping.
    fn damping(&self) -> f64 {
        0.0
    }

    /// The torque at a speed held for ever, N·m; zero at rest.
    fn steady_nm(&self, speed: f64, levels: &Levels) -> f64 {
        self.curve().steady_nm(speed, levels)
    }

    /// The deflection at which a contact that is loaded carries a torque (N·m), rad; 0 for a law without z.
    fn deflection_rad(&self, torque_nm: f64, _levels: &Levels, _memory: &Memory) -> f64 {
        if self.stiffness() > 0.0 { torque_nm / self.stiffness() } else { 0.0 }
    }

    /// Takes the Maxwell elements along as z moves to that of `at`.
    fn remember(&self, _at: Point, _levels: &Levels, _memory: &mut Memory) {}

    /// Over which change of speed the curve changes near zero: ω_s, rad/s; infinite for a flat curve.
    fn stribeck_velocity(&self) -> f64 {
        self.curve().stribeck_velocity()
    }

    /// T_c, N·m: the scale of the law's torque.
    fn coulomb_nm(&self) -> f64 {
        self.curve().coulomb_nm()
    }

    /// An error of the speed as a part of the law's own torque: the steepest ∂T/∂ω over T_c, s/rad.
    fn relative_damping_s_per_rad(&self) -> f64 {
        self.damping() / self.coulomb_nm()
    }

    /// An error of z as a part of the law's own torque: σ0/T_c, 1/rad; 0 for a law without z.
    fn relative_stiffness_per_rad(&self) -> f64 {
        self.stiffness() / self.coulomb_nm()
    }
}

/// sgn with the sign of zero: +1 for +0.
#[inline]
pub(crate) fn sign(value: f64) -> f64 {
    1.0_f64.copysign(value)
}
