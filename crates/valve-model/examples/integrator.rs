//! Error and cost of the valve's step beside SUNDIALS CVODE, as one table. Run by `bench/integrator.sh`, which builds
//! the peer and gives its path as the first argument.
//!
//! The reference is CVODE at rtol 1e-11 for LuGre, and this integrator called 40 times a cycle for the other laws.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing)]

use std::io::Write;
use std::process::{Command, Stdio};
use std::time::Instant;

use valve_model::*;

const PERIOD_S: f64 = 1e-3;
const REPEATS: usize = 9;

/// Angle (rad) and friction torque (N·m) at the cycles.
struct Trace {
    angles: Vec<f64>,
    torques: Vec<f64>,
    us_per_cycle: f64,
}

fn main() {
    let peer = std::env::args().nth(1).expect("the path of cvode_lugre");
    println!("| law | parameters | motion | solver | angle rms rad | torque max % of peak | µs per ms |");
    println!("|---|---|---|---|---|---|---|");
    for (motion, commands) in motions() {
        for (name, params) in [("soft", soft()), ("Table 1", table1())] {
            lugre_rows(&peer, name, &params, motion, &commands);
        }
        for (law, params) in others() {
            let valve = ValveParams::new(&model(params)).unwrap();
            let reference = run(&valve, &commands, 40);
            row(law, "soft", motion, "valve-model", &timed(&valve, &commands), &reference);
        }
    }
}

fn lugre_rows(peer: &str, name: &str, params: &LuGreParams, motion: &str, commands: &[f64]) {
    let valve = ValveParams::new(&model(FrictionParams::LuGre(*params))).unwrap();
    let reference = cvode(peer, "1e-11", params, commands);
    row("lugre", name, motion, "valve-model", &timed(&valve, commands), &reference);
    for rtol in ["1e-8", "1e-7", "1e-6", "1e-5", "1e-4"] {
        let trace = cvode(peer, rtol, params, commands);
        row("lugre", name, motion, &format!("CVODE {rtol}"), &trace, &reference);
    }
}

fn row(law: &str, params: &str, motion: &str, solver: &str, trace: &Trace, reference: &Trace) {
    let square = |(a, b): (&f64, &f64)| (a - b) * (a - b);
    let sum: f64 = trace.angles.iter().zip(&reference.angles).map(square).sum();
    let rms = (sum / reference.angles.len() as f64).sqrt();
    let peak = reference.torques.iter().fold(0.0, |most: f64, torque| most.max(torque.abs()));
    let gaps = trace.torques.iter().zip(&reference.torques).map(|(a, b)| (a - b).abs());
    let worst = 100.0 * gaps.fold(0.0, f64::max) / peak;
    println!(
        "| {law} | {params} | {motion} | {solver} | {rms:.1e} | {worst:.4} | {:.2} |",
        trace.us_per_cycle
    );
}

/// The best of several runs: what the code costs, not what the machine was doing.
fn timed(valve: &ValveParams, commands: &[f64]) -> Trace {
    let runs = (0..REPEATS).map(|_| run(valve, commands, 1));
    runs.min_by(|a, b| a.us_per_cycle.total_cmp(&b.us_per_cycle)).unwrap()
}

fn run(valve: &ValveParams, commands: &[f64], calls: usize) -> Trace {
    let mut state = ValveState::at_rest(0.0);
    let (mut angles, mut torques) = (Vec::with_capacity(commands.len()), Vec::with_capacity(commands.len()));
    let begin = Instant::now();
    for pair in commands.windows(2) {
        let at = |call: usize| pair[0] + (pair[1] - pair[0]) * call as f64 / calls as f64;
        let mut torque = 0.0;
        for call in 0..calls {
            let input = ValveInput {
                command_start_rad: at(call),
                command_end_rad: at(call + 1),
                pressure_drop_pa: 0.0,
                oil_temperature_c: 40.0,
                energised: true,
            };
            torque = step(valve, &mut state, &input, PERIOD_S / calls as f64).friction_torque_nm;
        }
        angles.push(state.angle_rad);
        torques.push(torque);
    }
    let us_per_cycle = begin.elapsed().as_secs_f64() * 1e6 / (commands.len() - 1) as f64;
    Trace { angles, torques, us_per_cycle }
}

fn cvode(peer: &str, rtol: &str, params: &LuGreParams, commands: &[f64]) -> Trace {
    let numbers = [
        5e-4,
        6.0,
        50.0,
        0.02,
        params.coulomb_torque_nm,
        params.static_torque_nm,
        params.stribeck_velocity_rad_per_s,
        params.bristle_stiffness_nm_per_rad,
        params.bristle_damping_nm_s_per_rad,
        params.viscous_nm_s_per_rad,
    ];
    let mut child = Command::new(peer)
        .args([rtol, &(commands.len() - 1).to_string(), &PERIOD_S.to_string()])
        .args(numbers.iter().map(f64::to_string))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("cvode_lugre starts");
    let text: String = commands.iter().map(|command| format!("{command:e}\n")).collect();
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (mut angles, mut torques) = (Vec::new(), Vec::new());
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        let fields: Vec<f64> = line.split_whitespace().map(|field| field.parse().unwrap()).collect();
        angles.push(fields[0]);
        torques.push(fields[3]);
    }
    let cost = String::from_utf8(output.stderr).unwrap();
    let us_per_cycle = cost.split_whitespace().last().unwrap().parse().unwrap();
    Trace { angles, torques, us_per_cycle }
}

/// Commands at the cycles: a sine, a slow start up to the first slip, a move with rests before and after.
fn motions() -> Vec<(&'static str, Vec<f64>)> {
    let sine = (0..=4000).map(|k| 0.2 * (std::f64::consts::TAU * f64::from(k) * PERIOD_S).sin());
    let ramp = (0..=120).map(|k| 0.2 * f64::from(k) * PERIOD_S);
    let smooth = |part: f64| part * part * part * (10.0 + part * (6.0 * part - 15.0));
    let moved = (0..=1000).map(|k| 0.5 * smooth(((f64::from(k) - 200.0) / 400.0).clamp(0.0, 1.0)));
    vec![("sine", sine.collect()), ("break-away ramp", ramp.collect()), ("move", moved.collect())]
}

fn soft() -> LuGreParams {
    LuGreParams {
        coulomb_torque_nm: 1.5,
        static_torque_nm: 3.0,
        stribeck_velocity_rad_per_s: 0.05,
        stribeck_exponent: 2.0,
        bristle_stiffness_nm_per_rad: 1000.0,
        bristle_damping_nm_s_per_rad: 1.0,
        viscous_nm_s_per_rad: 2e-4,
    }
}

/// Table 1's bristles, with torques and viscosity at which the motor can turn.
fn table1() -> LuGreParams {
    LuGreParams {
        stribeck_velocity_rad_per_s: 0.001,
        bristle_stiffness_nm_per_rad: 1e5,
        bristle_damping_nm_s_per_rad: 316.277,
        ..soft()
    }
}

fn others() -> Vec<(&'static str, FrictionParams)> {
    let stribeck = StribeckParams {
        coulomb_torque_nm: 1.5,
        static_torque_nm: 3.0,
        stribeck_velocity_rad_per_s: 0.05,
        stribeck_exponent: 2.0,
        viscous_nm_s_per_rad: 2e-4,
        regularisation_velocity_rad_per_s: 1e-3,
    };
    let dahl = DahlParams {
        coulomb_torque_nm: 1.5,
        bristle_stiffness_nm_per_rad: 1000.0,
        viscous_nm_s_per_rad: 2e-4,
        dahl_exponent: 1.0,
    };
    let leuven = LeuvenParams {
        coulomb_torque_nm: 1.5,
        static_torque_nm: 3.0,
        stribeck_velocity_rad_per_s: 0.05,
        stribeck_exponent: 2.0,
        bristle_stiffness_nm_per_rad: 1000.0,
        bristle_damping_nm_s_per_rad: 1.0,
        viscous_nm_s_per_rad: 2e-4,
        transition_exponent: 10.0,
        maxwell_elements: 10,
        maxwell_saturation_ratio: 1.3,
        maxwell_spacing_exponent: 1.0,
    };
    vec![
        ("stribeck", FrictionParams::Stribeck(stribeck)),
        ("dahl", FrictionParams::Dahl(dahl)),
        ("leuven", FrictionParams::Leuven(leuven)),
    ]
}

fn model(friction: FrictionParams) -> Model {
    let motor = MotorParams {
        phases: 5,
        rotor_teeth: 50,
        full_steps_per_rev: 500,
        microsteps_per_full_step: 225,
        holding_torque_nm: 6.0,
        rotor_inertia_kg_m2: 4e-4,
        damping_nm_s_per_rad: 0.02,
        max_pulse_rate_hz: 600e3,
        supply_voltage_v: None,
        phase_resistance_ohm: None,
        phase_inductance_h: None,
        rated_current_a: None,
        torque_constant_nm_per_a: None,
    };
    Model {
        name: "bench".into(),
        motor: Some(motor),
        load: Some(LoadParams { inertia_kg_m2: 1e-4 }),
        friction,
        orifice: None,
        oil: None,
        clearance: None,
        seals: None,
        effects: Vec::new(),
    }
}
