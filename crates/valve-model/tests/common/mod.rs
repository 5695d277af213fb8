//! Parameter sets and motions that the tests share.
#![allow(dead_code)]

use valve_model::*;

/// The rig's LuGre parameters.
pub fn soft() -> LuGreParams {
    LuGreParams::BENCH_RIG
}

/// Table 1's bristles, with torques at which the motor can turn.
pub fn table1() -> LuGreParams {
    LuGreParams {
        stribeck_velocity_rad_per_s: 0.001,
        bristle_stiffness_nm_per_rad: 1e5,
        bristle_damping_nm_s_per_rad: 316.277,
        ..soft()
    }
}

pub fn stribeck() -> StribeckParams {
    StribeckParams {
        coulomb_torque_nm: 1.5,
        static_torque_nm: 3.0,
        stribeck_velocity_rad_per_s: 0.05,
        stribeck_exponent: 2.0,
        viscous_nm_s_per_rad: 2e-4,
        regularisation_velocity_rad_per_s: 1e-3,
    }
}

pub fn dahl(exponent: f64) -> DahlParams {
    DahlParams {
        coulomb_torque_nm: 1.5,
        bristle_stiffness_nm_per_rad: 1000.0,
        viscous_nm_s_per_rad: 2e-4,
        dahl_exponent: exponent,
    }
}

pub fn leuven(exponent: f64) -> LeuvenParams {
    LeuvenParams {
        coulomb_torque_nm: 1.5,
        static_torque_nm: 3.0,
        stribeck_velocity_rad_per_s: 0.05,
        stribeck_exponent: 2.0,
        bristle_stiffness_nm_per_rad: 1000.0,
        bristle_damping_nm_s_per_rad: 1.0,
        viscous_nm_s_per_rad: 2e-4,
        transition_exponent: exponent,
        maxwell_elements: 10,
        maxwell_saturation_ratio: 1.3,
        maxwell_spacing_exponent: 1.0,
        maxwell_tail_exponent: 0.0,
        maxwell_curve_share: 0.0,
        maxwell_damping_share: 0.0,
    }
}

/// Every law, with its name for messages.
pub fn laws() -> Vec<(&'static str, FrictionParams)> {
    vec![
        ("stribeck", FrictionParams::Stribeck(stribeck())),
        ("dahl, 1/2", FrictionParams::Dahl(dahl(0.5))),
        ("dahl, 1", FrictionParams::Dahl(dahl(1.0))),
        ("dahl, 2", FrictionParams::Dahl(dahl(2.0))),
        ("lugre, soft", FrictionParams::LuGre(soft())),
        ("lugre, Table 1", FrictionParams::LuGre(table1())),
        ("leuven, 10", FrictionParams::Leuven(leuven(10.0))),
        ("leuven, 2", FrictionParams::Leuven(leuven(2.0))),
        (
            "leuven along the curve",
            FrictionParams::Leuven(LeuvenParams {
                maxwell_curve_share: 1.0,
                maxwell_damping_share: 1.0,
                ..leuven(4.0)
            }),
        ),
    ]
}

pub fn coulomb(law: &FrictionParams) -> f64 {
    match law {
        FrictionParams::Stribeck(p) => p.coulomb_torque_nm,
        FrictionParams::Dahl(p) => p.coulomb_torque_nm,
        FrictionParams::LuGre(p) => p.coulomb_torque_nm,
        FrictionParams::Leuven(p) => p.coulomb_torque_nm,
    }
}

/// σ0 where the law has bristles.
pub fn stiffness(law: &FrictionParams) -> Option<f64> {
    match law {
        FrictionParams::Stribeck(_) => None,
        FrictionParams::Dahl(p) => Some(p.bristle_stiffness_nm_per_rad),
        FrictionParams::LuGre(p) => Some(p.bristle_stiffness_nm_per_rad),
        FrictionParams::Leuven(p) => Some(p.bristle_stiffness_nm_per_rad),
    }
}

/// The rig's motor.
pub fn motor() -> MotorParams {
    MotorParams::BENCH_RIG
}

/// The rig with some friction.
pub fn model(friction: FrictionParams) -> Model {
    Model {
        name: "test".into(),
        motor: Some(motor()),
        load: Some(LoadParams { inertia_kg_m2: 1e-4 }),
        friction,
        orifice: None,
        oil: None,
        clearance: None,
        seals: None,
        effects: Vec::new(),
    }
}

/// A cycle's input without pressure, at 40 °C.
pub fn input(command_start_rad: f64, command_end_rad: f64) -> ValveInput {
    ValveInput {
        command_start_rad,
        command_end_rad,
        pressure_drop_pa: 0.0,
        oil_temperature_c: 40.0,
        current_ratio: 1.0,
    }
}

/// A contact moved along `angles` (rad), `dt_s` between them at a constant speed each: the torque after each.
pub fn moved(law: &FrictionLaw, state: &mut FrictionState, angles: &[f64], dt_s: f64) -> Vec<f64> {
    angles
        .windows(2)
        .map(|pair| {
            let speed = (pair[1] - pair[0]) / dt_s;
            state.step(law, speed, speed, dt_s)
        })
        .collect()
}

/// From `start` to `end` in `count` even pieces, both ends included.
pub fn line(start: f64, end: f64, count: usize) -> Vec<f64> {
    (0..=count).map(|i| start + (end - start) * i as f64 / count as f64).collect()
}

pub fn effect(id: &str, parameters: &[(&str, f64)]) -> Effect {
    let parts: Vec<_> = parameters.iter().map(|(key, value)| (*key, EffectValue::Number(*value))).collect();
    Effect::from_parts(id, &parts).unwrap()
}

pub fn with(effects: Vec<Effect>) -> Model {
    Model { effects, ..model(FrictionParams::LuGre(soft())) }
}

/// The torques at the end of each of `count` milliseconds of a motion without pressure, begun as `begin` has it.
pub fn along(
    params: &MotionParams,
    begin: &MotionSample,
    motion: impl Fn(i32) -> MotionSample,
    count: i32,
) -> Vec<MotionOutput> {
    let mut state = params.at_start(begin);
    (0..count)
        .map(|k| {
            let (start, end) = (motion(k), motion(k + 1));
            let input = MotionInput { start, end, pressure_drop_pa: 0.0, oil_temperature_c: 40.0 };
            motion_step(params, &mut state, &input, 1e-3)
        })
        .collect()
}
