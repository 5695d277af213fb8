//! How a truth may differ from the belief.

use rand::RngExt;
use rand_pcg::Pcg64;
use std::fmt::Write;
use valve_model::{Effect, EffectId, EffectValue, FrictionParams, Model};

/// The effects that a truth may have, the belief's own form each.
pub const CHANGES: &[EffectId] = &[
    EffectId::CoulombLevel,
    EffectId::StaticLevel,
    EffectId::StribeckVelocity,
    EffectId::ViscousLevel,
    EffectId::LoadInertia,
    EffectId::PressureDependentFriction,
    EffectId::DirectionAsymmetry,
    EffectId::AngleDependentFriction,
    EffectId::FlowTorque,
    EffectId::DetentTorque,
    EffectId::MicrostepError,
    EffectId::Backlash,
    EffectId::CouplingCompliance,
];

/// One of them with its numbers: levels by a fifth, viscous friction three times, inertia by two fifths, and the others as
/// large as they are met.
pub(crate) fn draw(id: EffectId, belief: &Model, rng: &mut Pcg64) -> Effect {
    let coulomb_nm = coulomb_nm(belief);
    let up = rng.random_bool(0.5);
    let mut between = |low: f64, high: f64| rng.random_range(low..high);
    let number = |key: &'static str, value: f64| vec![(key, EffectValue::Number(value))];
    let wave = |size: f64, phase: f64| {
        let (sin, cos) = phase.sin_cos();
        vec![("cos", EffectValue::List(vec![size * cos])), ("sin", EffectValue::List(vec![size * sin]))]
    };
    let phase = between(0.0, std::f64::consts::TAU);
    let parts = match id {
        EffectId::CoulombLevel => number("factor", if up { 1.2 } else { 0.8 }),
        EffectId::StaticLevel => number("factor", if up { 1.3 } else { 0.75 }),
        EffectId::StribeckVelocity => number("factor", if up { 2.0 } else { 0.5 }),
        EffectId::ViscousLevel => number("factor", 3.0),
        EffectId::LoadInertia => number("factor", 1.4),
        EffectId::PressureDependentFriction => number("gain", between(0.03, 0.08)),
        EffectId::DirectionAsymmetry => number("level", between(0.08, 0.2) * if up { 1.0 } else { -1.0 }),
        EffectId::AngleDependentFriction => wave(between(0.1, 0.2), phase),
        EffectId::FlowTorque => wave(between(0.02, 0.06) * coulomb_nm, phase),
        EffectId::DetentTorque => wave(between(0.1, 0.3), phase),
        EffectId::MicrostepError => wave(between(1e-4, 4e-4), phase),
        EffectId::Backlash => number("half_width_rad", between(5e-4, 2e-3)),
        EffectId::CouplingCompliance => vec![
            ("stiffness_nm_per_rad", EffectValue::Number(between(1500.0, 3000.0))),
            ("damping_nm_s_per_rad", EffectValue::Number(between(0.5, 1.5))),
        ],
        other => panic!("no amounts for {other}"),
    };
    Effect::new(id, &parts).unwrap()
}

/// The level of sliding friction.
pub(crate) fn coulomb_nm(model: &Model) -> f64 {
    match &model.friction {
        FrictionParams::LuGre(lugre) => lugre.coulomb_torque_nm,
        other => panic!("expected LuGre friction, found {other:?}"),
    }
}

/// The effect as a model file has it.
pub(crate) fn toml(effect: &Effect) -> String {
    let mut text = format!("\n[[effect]]\nid = \"{}\"\n", effect.id());
    for (key, value) in effect.parts() {
        let _ = match value {
            EffectValue::Number(number) => writeln!(text, "{key} = {number:?}"),
            EffectValue::List(numbers) => writeln!(text, "{key} = {numbers:?}"),
        };
    }
    text
}
