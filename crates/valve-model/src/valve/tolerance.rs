//! The errors that the integrator accepts in one sub-step.

/// Of the angle, rad.
pub(super) const ANGLE_TOLERANCE: f64 = 7e-11;
/// Of the speed, rad/s.
pub(super) const SPEED_TOLERANCE: f64 = 1e-6;
/// Of the bristles' torque, in parts of the Coulomb torque.
pub(super) const TORQUE_TOLERANCE: f64 = 2e-5;
/// As the last, for what an error of the speed makes of the torque through the law's damping.
pub(super) const DAMPING_TOLERANCE: f64 = 2e-4;
