//! The valve's step against SUNDIALS CVODE at rtol 1e-11: a sine of 0.2 rad and 1 Hz from rest, the command linear
//! within each millisecond. The numbers are the output of `bench/peers/cvode_valve.c`; `bench integrator` compares
//! every cycle.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]
#![allow(clippy::excessive_precision, clippy::unreadable_literal)]

mod common;

use common::*;
use valve_model::*;

/// Cycle, angle in rad, friction torque in N·m, for the rig's bristles.
const SOFT: [(usize, f64, f64); 12] = [
    (1, 7.301669742239823e-05, 0.24149643723304245),
    (3, 0.0007411103390340793, 0.8543755864049016),
    (10, 0.007389403586012051, 1.5002559043356742),
    (100, 0.11240852839809193, 1.5002096461938617),
    (251, 0.19461675691809915, 1.5950518595730478),
    (500, 0.005140979553876813, -1.5002513443781627),
    (741, -0.19448622755714876, -1.5371132222687782),
    (760, -0.19457609983567017, -1.4936301992915333),
    (1262, 0.19455030274292728, 1.4507155855424567),
    (2000, -0.005140979723840607, 1.5002513441130287),
    (3247, 0.1946097034693367, 1.5875998396473998),
    (4000, -0.005140979704716488, 1.5002513441125407),
];

/// The same for Table 1's bristles.
const TABLE_1: [(usize, f64, f64); 12] = [
    (1, 5.426242778578396e-07, 0.37607746984146134),
    (3, 4.615957888568089e-06, 1.1221736257092274),
    (10, 0.008510748884554538, 1.5007638875353881),
    (100, 0.1120199182261441, 1.5002034498313295),
    (251, 0.1949624641867694, 1.5000013641976675),
    (500, 0.005122061321828241, -1.5002503284387936),
    (741, -0.1946346185299808, -1.500014292053302),
    (760, -0.1949584302606499, -1.381573936536782),
    (1262, 0.19495818331207085, 1.3309252507071532),
    (2000, -0.005121990828762499, 1.500250357120151),
    (3247, 0.19492223992452432, 1.5000048478415622),
    (4000, -0.0051219908181458955, 1.5002503571202148),
];

fn compare(params: LuGreParams, reference: &[(usize, f64, f64)], angle_rad: f64, torque_nm: f64) {
    let valve = ValveParams::new(&model(FrictionParams::LuGre(params))).unwrap();
    let mut state = ValveState::at_rest(0.0);
    let command = |k: usize| 0.2 * (std::f64::consts::TAU * k as f64 * 1e-3).sin();
    for k in 0..4000 {
        let out = step(&valve, &mut state, &input(command(k), command(k + 1)), 1e-3);
        if let Some((_, angle, torque)) = reference.iter().find(|row| row.0 == k + 1) {
            let apart = (state.angle_rad - angle).abs();
            assert!(apart < angle_rad, "cycle {}: {apart} rad apart", k + 1);
            let apart = (out.friction_torque_nm - torque).abs();
            assert!(apart < torque_nm, "cycle {}: {apart} N·m apart", k + 1);
        }
    }
}

#[test]
fn soft_bristles() {
    compare(soft(), &SOFT, 5e-7, 1.6e-4);
}

#[test]
fn bristles_of_table_1() {
    compare(table1(), &TABLE_1, 1e-6, 2e-3);
}
