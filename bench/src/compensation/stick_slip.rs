//! The speed below which sliding is unstable on the motor's own spring: stick-slip.
//!
//! Around steady sliding at v, with g the Stribeck curve, g' its slope, K = T_hold·N_r·cos(lead) the motor's stiffness
//! and τ = g/(σ0·v) the time in which bristles follow, small motions s obey
//! J·τ·s³ + (J + D'·τ + g'·σ1/σ0)·s² + (D' + K·τ + g')·s + K = 0, D' = D + σ2: LuGre linearised. Routh's criterion says
//! when all of them die out.

use valve_model::{FrictionParams, LuGreParams, Model};

/// Speeds looked at, rad/s, and how finely.
const SLOWEST_RAD_PER_S: f64 = 1e-4;
const FASTEST_RAD_PER_S: f64 = 100.0;
const PER_STEP: f64 = 1.002;

/// The lowest speed above which sliding is stable throughout, rad/s; `None` where it is stable at any speed, or the law
/// is not LuGre, or the model lacks motor or load.
pub fn stick_slip_speed_rad_per_s(model: &Model) -> Option<f64> {
    let FrictionParams::LuGre(law) = &model.friction else { return None };
    let mut speed = FASTEST_RAD_PER_S;
    while speed > SLOWEST_RAD_PER_S {
        if !stable(model, law, speed)? {
            return Some(speed * PER_STEP);
        }
        speed /= PER_STEP;
    }
    None
}

fn stable(model: &Model, law: &LuGreParams, speed: f64) -> Option<bool> {
    let (motor, load) = (model.motor?, model.load?);
    let inertia = motor.rotor_inertia_kg_m2 + load.inertia_kg_m2;
    let power = (speed / law.stribeck_velocity_rad_per_s).powf(law.stribeck_exponent);
    let excess_nm = (law.static_torque_nm - law.coulomb_torque_nm) * (-power).exp();
    let torque_nm = law.coulomb_torque_nm + excess_nm;
    let slope = -excess_nm * law.stribeck_exponent * power / speed;
    let ratio = (torque_nm + law.viscous_nm_s_per_rad * speed) / motor.holding_torque_nm;
    if ratio.abs() >= 1.0 {
        return Some(false);
    }
    let stiffness = motor.holding_torque_nm * f64::from(motor.rotor_teeth) * (1.0 - ratio * ratio).sqrt();
    let damping = motor.damping_nm_s_per_rad + law.viscous_nm_s_per_rad;
    let bristle_s = torque_nm / (law.bristle_stiffness_nm_per_rad * speed);
    let relaxation_s = law.bristle_damping_nm_s_per_rad / law.bristle_stiffness_nm_per_rad;
    let cubic = inertia * bristle_s;
    let square = inertia + damping * bristle_s + slope * relaxation_s;
    let linear = damping + stiffness * bristle_s + slope;
    Some(square > 0.0 && linear > 0.0 && square * linear > cubic * stiffness)
}
