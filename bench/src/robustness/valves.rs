//! Valves drawn at random: other motors, inertias and friction laws than the bench rig's, and the scenarios fitted to them.

use config::{MotionLimits, Scenario, SetPoint};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::f64::consts::TAU;
use valve_model::{
    DahlParams, FrictionParams, LeuvenParams, LoadParams, LuGreParams, Model, MotorParams, StribeckParams,
};

/// The bench rig's inertia, kg·m², for which the shipped scenarios' accelerations are.
const RIG_INERTIA_KG_M2: f64 = 5e-4;

/// Holding torques, N·m; resonances of motor and load in sliding, Hz; damping ratios of the motor alone. Log-uniform.
const HOLDING_NM: (f64, f64) = (1.0, 20.0);
const RESONANCE_HZ: (f64, f64) = (60.0, 250.0);
const DAMPING_RATIO: (f64, f64) = (0.01, 0.08);
/// The rotor's part of the inertia.
const ROTOR_PART: (f64, f64) = (0.4, 0.9);
const PHASES: [u32; 3] = [2, 3, 5];
const TEETH: [u32; 2] = [50, 100];
const MICROSTEPS: [u32; 3] = [64, 128, 256];

/// Coulomb torque in parts of the holding torque; break-away over Coulomb torque. Friction of 1.9 times as much still leaves
/// the motor able to turn.
const COULOMB_PART: (f64, f64) = (0.05, 0.3);
const BREAK_AWAY: (f64, f64) = (1.0, 2.0);
const LARGEST_BREAK_AWAY_PART: f64 = 0.5;
/// Stribeck velocity, rad/s; its exponent; the way to break away, rad; the bristles' damping over the critical one of all the
/// inertia; viscous friction at 10 rad/s over Coulomb friction.
const STRIBECK_RAD_PER_S: (f64, f64) = (0.01, 0.2);
const STRIBECK_EXPONENT: (f64, f64) = (0.5, 2.0);
const BREAK_AWAY_RAD: (f64, f64) = (5e-4, 5e-3);
const BRISTLE_DAMPING: (f64, f64) = (0.2, 1.0);
const VISCOUS_PART: (f64, f64) = (1e-3, 0.2);

/// The `index`th valve of a seed, with the orifice and oil of `rig`.
pub fn valve(rig: &Model, seed: u64, index: u64) -> Model {
    let random = &mut Pcg64::seed_from_u64(seed.wrapping_add(index));
    let holding_torque_nm = log_uniform(random, HOLDING_NM);
    let (phases, rotor_teeth) = (pick(random, PHASES), pick(random, TEETH));
    let frequency = TAU * log_uniform(random, RESONANCE_HZ);
    let inertia = holding_torque_nm * f64::from(rotor_teeth) / (frequency * frequency);
    let rotor_part = random.random_range(ROTOR_PART.0..ROTOR_PART.1);
    let damping = 2.0 * log_uniform(random, DAMPING_RATIO) * inertia * frequency;
    let mut motor = MotorParams {
        phases,
        rotor_teeth,
        full_steps_per_rev: 2 * phases * rotor_teeth,
        microsteps_per_full_step: pick(random, MICROSTEPS),
        holding_torque_nm,
        rotor_inertia_kg_m2: rotor_part * inertia,
        damping_nm_s_per_rad: damping,
        ..MotorParams::BENCH_RIG
    };
    motor.max_pulse_rate_hz *= rates(&motor);
    let load = LoadParams { inertia_kg_m2: (1.0 - rotor_part) * inertia };
    let friction = friction(random, holding_torque_nm, inertia);
    Model {
        name: format!("valve of seed {}", seed.wrapping_add(index)),
        motor: Some(motor),
        load: Some(load),
        friction,
        ..rig.clone()
    }
}

fn friction(random: &mut impl Rng, holding_nm: f64, inertia: f64) -> FrictionParams {
    let coulomb_torque_nm = holding_nm * log_uniform(random, COULOMB_PART);
    let excess = random.random_range(BREAK_AWAY.0..BREAK_AWAY.1);
    let static_torque_nm =
        (excess * coulomb_torque_nm).min(LARGEST_BREAK_AWAY_PART * holding_nm).max(coulomb_torque_nm);
    let stiffness = static_torque_nm / log_uniform(random, BREAK_AWAY_RAD);
    let stribeck_velocity_rad_per_s = log_uniform(random, STRIBECK_RAD_PER_S);
    let lugre = LuGreParams {
        coulomb_torque_nm,
        static_torque_nm,
        stribeck_velocity_rad_per_s,
        stribeck_exponent: random.random_range(STRIBECK_EXPONENT.0..STRIBECK_EXPONENT.1),
        bristle_stiffness_nm_per_rad: stiffness,
        bristle_damping_nm_s_per_rad: log_uniform(random, BRISTLE_DAMPING)
            * 2.0
            * (stiffness * inertia).sqrt(),
        viscous_nm_s_per_rad: log_uniform(random, VISCOUS_PART) * coulomb_torque_nm / 10.0,
    };
    match random.random_range(0..4) {
        0 => FrictionParams::Stribeck(StribeckParams {
            coulomb_torque_nm,
            static_torque_nm,
            stribeck_velocity_rad_per_s,
            stribeck_exponent: lugre.stribeck_exponent,
            viscous_nm_s_per_rad: lugre.viscous_nm_s_per_rad,
            regularisation_velocity_rad_per_s: stribeck_velocity_rad_per_s / 10.0,
        }),
        1 => FrictionParams::Dahl(DahlParams {
            coulomb_torque_nm,
            bristle_stiffness_nm_per_rad: stiffness,
            viscous_nm_s_per_rad: lugre.viscous_nm_s_per_rad,
            dahl_exponent: random.random_range(1.0..2.0),
        }),
        2 => FrictionParams::Leuven(leuven(random, &lugre)),
        _ => FrictionParams::LuGre(lugre),
    }
}

fn leuven(random: &mut impl Rng, like: &LuGreParams) -> LeuvenParams {
    LeuvenParams {
        coulomb_torque_nm: like.coulomb_torque_nm,
        static_torque_nm: like.static_torque_nm,
        stribeck_velocity_rad_per_s: like.stribeck_velocity_rad_per_s,
        stribeck_exponent: like.stribeck_exponent,
        bristle_stiffness_nm_per_rad: like.bristle_stiffness_nm_per_rad,
        bristle_damping_nm_s_per_rad: like.bristle_damping_nm_s_per_rad,
        viscous_nm_s_per_rad: like.viscous_nm_s_per_rad,
        transition_exponent: 3.0,
        maxwell_elements: 10,
        maxwell_saturation_ratio: 1.15,
        maxwell_spacing_exponent: random.random_range(0.8..1.5),
        maxwell_tail_exponent: 0.0,
        maxwell_curve_share: random.random_range(0.0..1.0),
        maxwell_damping_share: random.random_range(0.0..1.0),
    }
}

/// A scenario of the bench rig for this valve: the same angles, speeds and flows; the acceleration takes the same part of the
/// holding torque, its ramps take one period of the resonance, and pulse rates belong to the same speeds.
/// A valve without motor or load leaves it as it is.
pub fn fitted(shipped: &Scenario, valve: &Model) -> Scenario {
    let (Some(motor), Some(load)) = (&valve.motor, &valve.load) else { return shipped.clone() };
    let rig = MotorParams::BENCH_RIG;
    let inertia = motor.rotor_inertia_kg_m2 + load.inertia_kg_m2;
    let frequency = (motor.holding_torque_nm * f64::from(motor.rotor_teeth) / inertia).sqrt();
    let acceleration = shipped.limits.max_acceleration_rad_per_s2 * (motor.holding_torque_nm / inertia)
        / (rig.holding_torque_nm / RIG_INERTIA_KG_M2);
    let limits = MotionLimits {
        max_acceleration_rad_per_s2: acceleration,
        max_jerk_rad_per_s3: acceleration * frequency / TAU,
        ..shipped.limits
    };
    let mut scenario = Scenario { limits, ..shipped.clone() };
    let rates = rates(motor);
    scenario.driver.max_pulse_rate_hz *= rates;
    scenario.driver.max_pulse_acceleration_hz_per_s *= rates;
    scenario.driver.quick_stop_deceleration_hz_per_s *= rates;
    for scheduled in &mut scenario.set_points {
        if let SetPoint::PulseRate { pulse_rate_hz } = &mut scheduled.set_point {
            *pulse_rate_hz *= rates;
        }
    }
    scenario.safety.max_following_error_rad *= f64::from(rig.rotor_teeth) / f64::from(motor.rotor_teeth);
    scenario
}

/// Break-away over Coulomb torque.
pub fn break_away(friction: &FrictionParams) -> f64 {
    match friction {
        FrictionParams::Stribeck(law) => law.static_torque_nm / law.coulomb_torque_nm,
        FrictionParams::Dahl(_) => 1.0,
        FrictionParams::LuGre(law) => law.static_torque_nm / law.coulomb_torque_nm,
        FrictionParams::Leuven(law) => law.static_torque_nm / law.coulomb_torque_nm,
    }
}

/// Its pulse rate over the bench rig's at the same speed.
fn rates(motor: &MotorParams) -> f64 {
    MotorParams::BENCH_RIG.microstep_angle_rad() / motor.microstep_angle_rad()
}

fn log_uniform(random: &mut impl Rng, (low, high): (f64, f64)) -> f64 {
    random.random_range(low.ln()..high.ln()).exp()
}

fn pick<const N: usize>(random: &mut impl Rng, among: [u32; N]) -> u32 {
    let index = random.random_range(0..N);
    among.get(index).copied().unwrap_or_default()
}
