//! Any parameters that a model file may hold: the step stays bounded, repeatable and finite.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::*;
use proptest::prelude::*;
use valve_model::*;

/// Evenly over the decades.
fn decades(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.log10()..high.log10()).prop_map(|x| 10f64.powf(x))
}

prop_compose! {
    fn any_friction()(
        law in 0..4_usize,
        coulomb in decades(1e-3, 1e2),
        ratio in 1.0_f64..5.0,
        velocity in decades(1e-5, 10.0),
        exponent in 0.3_f64..4.0,
        stiffness in decades(1.0, 1e7),
        damping in prop_oneof![Just(0.0), decades(1e-4, 1e4)],
        viscous in prop_oneof![Just(0.0), decades(1e-6, 10.0)],
        transition in 1.0_f64..30.0,
        dahl in 0.3_f64..3.0,
        share in prop_oneof![Just(0.0), Just(1.0), 0.0_f64..1.0],
    ) -> FrictionParams {
        match law {
            0 => FrictionParams::Stribeck(StribeckParams {
                coulomb_torque_nm: coulomb, static_torque_nm: coulomb * ratio,
                stribeck_velocity_rad_per_s: velocity, stribeck_exponent: exponent,
                viscous_nm_s_per_rad: viscous, regularisation_velocity_rad_per_s: 0.1 * velocity,
            }),
            1 => FrictionParams::Dahl(DahlParams {
                coulomb_torque_nm: coulomb, bristle_stiffness_nm_per_rad: stiffness,
                viscous_nm_s_per_rad: viscous, dahl_exponent: dahl,
            }),
            2 => FrictionParams::LuGre(LuGreParams {
                coulomb_torque_nm: coulomb, static_torque_nm: coulomb * ratio,
                stribeck_velocity_rad_per_s: velocity, stribeck_exponent: exponent,
                bristle_stiffness_nm_per_rad: stiffness, bristle_damping_nm_s_per_rad: damping,
                viscous_nm_s_per_rad: viscous,
            }),
            _ => FrictionParams::Leuven(LeuvenParams {
                coulomb_torque_nm: coulomb, static_torque_nm: coulomb * ratio,
                stribeck_velocity_rad_per_s: velocity, stribeck_exponent: exponent,
                bristle_stiffness_nm_per_rad: stiffness, bristle_damping_nm_s_per_rad: damping,
                viscous_nm_s_per_rad: viscous, transition_exponent: transition,
                maxwell_elements: 8, maxwell_saturation_ratio: 1.2, maxwell_spacing_exponent: 1.0, maxwell_tail_exponent: share,
                maxwell_curve_share: share, maxwell_damping_share: share,
            }),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn the_valve_stays_bounded(
        friction in any_friction(),
        rotor in decades(1e-7, 1e-1),
        damping in prop_oneof![Just(0.0), decades(1e-4, 1.0)],
        dt_s in prop_oneof![Just(1e-4), Just(1e-3), Just(1e-2)],
        rates in prop::collection::vec(-33.5_f64..33.5, 20),
    ) {
        let mut model = model(friction);
        model.motor = Some(MotorParams { rotor_inertia_kg_m2: rotor, damping_nm_s_per_rad: damping, ..motor() });
        let valve = ValveParams::new(&model).unwrap();
        let run = || {
            let mut state = ValveState::at_rest(0.0);
            let (mut command, mut fastest) = (0.0, 0.0_f64);
            for cycle in 0..400 {
                // Half of the time in motion, half at rest.
                let rate = if cycle < 200 { rates[cycle / 10] } else { 0.0 };
                let next = command + rate * dt_s;
                let out = step(&valve, &mut state, &input(command, next), dt_s);
                command = next;
                fastest = fastest.max(state.speed_rad_per_s.abs());
                assert!(out.friction_torque_nm.is_finite() && out.load_torque_nm.is_finite());
            }
            (state, fastest)
        };
        let (state, fastest) = run();
        prop_assert!(state.angle_rad.is_finite() && state.speed_rad_per_s.is_finite());
        // A free rotor swings with the energy of one tooth on top of the command's speed; twice that is generous.
        // Below the passive bound a start adds what the dashpots give out while the bristles fall back to the curve.
        let kick = match friction {
            FrictionParams::LuGre(p) => p.passive_viscous_nm_s_per_rad() * p.static_torque_nm
                / p.bristle_stiffness_nm_per_rad,
            FrictionParams::Leuven(p) => p.bristle_damping_nm_s_per_rad * p.static_torque_nm
                * (1.2 * p.static_torque_nm / p.coulomb_torque_nm).powf(p.transition_exponent)
                / p.bristle_stiffness_nm_per_rad,
            _ => 0.0,
        } / rotor;
        let swing = kick + 2.0 * (4.0 * 6.0 / 50.0 / rotor).sqrt() + 2.0 * 33.5;
        prop_assert!(fastest < 2.0 * swing, "{fastest} rad/s, {swing} expected at most");
        let z = state.friction.bristle_deflection_rad();
        prop_assert!(z.is_finite());
        prop_assert_eq!(run().0, state, "not repeatable");
    }

    #[test]
    fn a_given_motion_stays_bounded(
        friction in any_friction(),
        dt_s in decades(1e-5, 1.0),
        speeds in prop::collection::vec(-50.0_f64..50.0, 40),
    ) {
        let law = FrictionLaw::new(&friction);
        let mut state = FrictionState::default();
        let most = match friction {
            FrictionParams::Dahl(p) => p.coulomb_torque_nm + 50.0 * p.viscous_nm_s_per_rad,
            FrictionParams::Stribeck(p) => p.static_torque_nm + 50.0 * p.viscous_nm_s_per_rad,
            FrictionParams::LuGre(p) =>
                p.static_torque_nm + 50.0 * (p.viscous_nm_s_per_rad + p.bristle_damping_nm_s_per_rad * 6.0),
            FrictionParams::Leuven(p) =>
                1.2 * p.static_torque_nm + 50.0 * p.viscous_nm_s_per_rad
                + 50.0 * p.bristle_damping_nm_s_per_rad * (1.0 + 6f64.powf(p.transition_exponent)),
        };
        for pair in speeds.windows(2) {
            let torque = state.step(&law, pair[0], pair[1], dt_s);
            prop_assert!(torque.abs() <= 1.03 * most, "{torque} N·m, {most} at most");
        }
    }
}

#[test]
fn numbers_that_are_none_end_a_cycle_all_the_same() {
    for (_, params) in laws() {
        let valve = ValveParams::new(&model(params)).unwrap();
        for bad in [f64::NAN, f64::INFINITY, 1e300] {
            let mut state = ValveState::at_rest(0.0);
            step(&valve, &mut state, &input(0.0, bad), 1e-3);
            let mut state = ValveState { speed_rad_per_s: bad, ..ValveState::at_rest(0.0) };
            step(&valve, &mut state, &input(0.0, 0.0), 1e-3);
        }
    }
}

/// Speeds down to the smallest number there is, subnormal ones among them: their products and quotients leave the range
/// of numbers, and 0/0 is none. A reference damaged on its way brought one into a controller.
#[test]
fn vanishing_speeds_give_numbers() {
    let sizes = [0.0, 5e-324, 2e-320, 1e-311, 2.2e-308, 1e-300, 1e-200, 1e-160, 1e-100, 1e-20, 10.0];
    let speeds: Vec<f64> = sizes.iter().flat_map(|size| [*size, -size]).collect();
    for (name, params) in laws() {
        let law = FrictionLaw::new(&params);
        for (start, end) in speeds.iter().flat_map(|start| speeds.iter().map(move |end| (*start, *end))) {
            for held in [0.0, 0.02, -10.0] {
                let mut state = FrictionState::default();
                state.step(&law, held, held, 1e-3);
                for pair in [[start, end], [end, start], [0.0, 1.0]] {
                    let torque = state.step(&law, pair[0], pair[1], 1e-3);
                    assert!(torque.is_finite(), "{name}: {torque} N·m after {pair:?} from {held} rad/s");
                }
            }
        }
        let lagging =
            Model { effects: vec![effect("friction-lag", &[("time_constant_s", 0.02)])], ..model(params) };
        for rig in [model(params), lagging] {
            let (valve, motion) = (ValveParams::new(&rig).unwrap(), MotionParams::new(&rig).unwrap());
            for (start, end) in speeds.iter().flat_map(|start| speeds.iter().map(move |end| (*start, *end))) {
                let at = |speed| MotionSample {
                    angle_rad: 0.0,
                    speed_rad_per_s: speed,
                    acceleration_rad_per_s2: 0.0,
                };
                let given = along(&motion, &at(start), |k| at(if k == 0 { start } else { end }), 3);
                assert!(given.iter().all(|out| out.friction_torque_nm.is_finite()), "{name}: {start}, {end}");
                let mut state = ValveState { speed_rad_per_s: start, ..ValveState::at_rest(0.0) };
                let out = step(&valve, &mut state, &input(0.0, end * 1e-3), 1e-3);
                assert!(out.friction_torque_nm.is_finite(), "{name}: from {start} rad/s, pulled {end}");
            }
        }
    }
}

#[test]
fn without_current_the_valve_stays_where_it_is() {
    for (name, params) in laws() {
        let valve = ValveParams::new(&model(params)).unwrap();
        let mut state = ValveState::at_rest(0.3);
        for _ in 0..1000 {
            let out = step(&valve, &mut state, &ValveInput { current_ratio: 0.0, ..input(0.35, 0.35) }, 1e-3);
            assert_eq!(out.motor_torque_nm.abs() + out.friction_torque_nm.abs(), 0.0, "{name}");
        }
        assert_eq!(state.angle_rad, 0.3, "{name}");
    }
}
