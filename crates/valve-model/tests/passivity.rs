//! Energy: no law gives out more than it took in where theory promises it, and LuGre does where it doesn't.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::*;
use proptest::prelude::*;
use valve_model::*;

/// The work (N·m·rad) that a contact, relaxed at first, has taken in after each piece of a motion, at its lowest.
fn lowest_energy(law: &FrictionLaw, speeds: &[f64], dt_s: f64) -> f64 {
    let mut state = FrictionState::default();
    let (mut energy, mut lowest) = (0.0_f64, 0.0_f64);
    let parts = 20;
    for pair in speeds.windows(2) {
        let at = |j: usize| pair[0] + (pair[1] - pair[0]) * j as f64 / f64::from(parts);
        let part_s = dt_s / f64::from(parts);
        let mut before = state.step(law, at(0), at(0), 1e-12);
        for j in 0..parts as usize {
            let after = state.step(law, at(j), at(j + 1), part_s);
            energy += 0.5 * (before * at(j) + after * at(j + 1)) * part_s;
            before = after;
            lowest = lowest.min(energy);
        }
    }
    lowest
}

fn passive_laws() -> Vec<(&'static str, FrictionParams)> {
    let soft = soft();
    // σ2 at the bound of theory, σ1(T_s − T_c)/T_c.
    let bound = soft.passive_viscous_nm_s_per_rad();
    vec![
        ("stribeck", FrictionParams::Stribeck(stribeck())),
        ("dahl", FrictionParams::Dahl(dahl(1.0))),
        ("dahl, 2", FrictionParams::Dahl(dahl(2.0))),
        ("lugre at the bound", FrictionParams::LuGre(LuGreParams { viscous_nm_s_per_rad: bound, ..soft })),
        ("lugre, no Stribeck effect", FrictionParams::LuGre(LuGreParams { static_torque_nm: 1.5, ..soft })),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn passive_laws_give_out_no_energy(
        speeds in prop::collection::vec(-0.3_f64..0.3, 2..30),
        dt_s in 1e-4_f64..2e-2,
    ) {
        for (name, params) in passive_laws() {
            let lowest = lowest_energy(&FrictionLaw::new(&params), &speeds, dt_s);
            // 1e-6 of what break-away takes (3 N·m over 3 mrad) is the quadrature's.
            prop_assert!(lowest > -1e-5, "{}: {} J given out", name, -lowest);
        }
    }
}

#[test]
fn neither_the_default_nor_table_1_is_passive() {
    for params in [soft(), table1()] {
        assert!(params.viscous_nm_s_per_rad < params.passive_viscous_nm_s_per_rad());
    }
    let bound = table1().passive_viscous_nm_s_per_rad();
    assert!((bound - 316.277).abs() < 1e-9, "σ1·(3 − 1.5)/1.5: {bound}");
}

/// Loaded at creep to T_s, then moved fast: the bristle lies beyond the curve, dz/dt runs against ω, and the dashpot
/// σ1 drives the motion with more than the spring gives back.
#[test]
fn lugre_gives_out_energy_below_the_bound() {
    let speed = 30.0;
    let start = |params: LuGreParams| {
        let law = FrictionLaw::new(&FrictionParams::LuGre(params));
        let mut state = FrictionState::default();
        state.step(&law, 1e-5, 1e-5, 1e4);
        let z = state.bristle_deflection_rad();
        assert!((z - 3e-3).abs() < 1e-5, "{z}");
        let rate = speed * (1.0 - params.bristle_stiffness_nm_per_rad * z / params.coulomb_torque_nm);
        let released_w = -params.bristle_stiffness_nm_per_rad * z * rate;
        let given_w = -speed * state.step(&law, speed, speed, 1e-9);
        (given_w, released_w)
    };
    let (given_w, released_w) = start(soft());
    assert!(given_w > released_w + 100.0, "{given_w} W given out, {released_w} W released by the spring");
    let bound = soft().passive_viscous_nm_s_per_rad();
    let (given_w, released_w) = start(LuGreParams { viscous_nm_s_per_rad: bound, ..soft() });
    assert!(given_w <= released_w, "{given_w} W given out, {released_w} W released by the spring");
}
