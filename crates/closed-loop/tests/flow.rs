//! Flow set-points hold while pressure drop and temperature change, to what the orifice's model allows.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use closed_loop::{CycleMessages, InProcess, wire};
use config::{Scenario, parse_model, parse_scenario};
use signals::ControllerState;

const M3_PER_S_PER_L_PER_MIN: f64 = 1e-3 / 60.0;

fn shipped(path: &str) -> String {
    std::fs::read_to_string(format!("{}/../../rt-config/{path}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

fn run(change: impl Fn(&mut Scenario)) -> Vec<(f64, CycleMessages)> {
    let mut scenario = parse_scenario(&shipped("scenarios/flow-steps.toml"), "flow-steps.toml").unwrap();
    change(&mut scenario);
    let model = parse_model(&shipped("models/rig.toml"), "rig.toml").unwrap();
    let parts = wire(&scenario, &model, &model).unwrap();
    let timeline = parts.timeline;
    InProcess::new(&parts).map(|messages| (timeline.scenario_time_s(messages.cycle), messages)).collect()
}

/// The largest relative error of the flow between two scenario times, while running.
fn flow_error(run: &[(f64, CycleMessages)], from_s: f64, to_s: f64, wanted_l_per_min: f64) -> f64 {
    let wanted = wanted_l_per_min * M3_PER_S_PER_L_PER_MIN;
    let samples = run.iter().filter(|(time_s, m)| {
        *time_s >= from_s && *time_s < to_s && m.status.state == ControllerState::Running.code()
    });
    samples.map(|(_, m)| (m.plant.truth.flow_m3_per_s / wanted - 1.0).abs()).fold(0.0, f64::max)
}

/// Between the steps, 0.2 s after each: while the pressure drop rises threefold at 10 MPa/s, stands, and falls to a
/// sixth at 6 MPa/s. What is left comes from the dead time and from the angle's following error.
#[test]
fn the_flow_holds_while_the_pressure_changes() {
    let run = run(|_| {});
    for (from_s, to_s, wanted) in [(0.4, 1.0, 40.0), (1.3, 2.3, 120.0), (2.6, 4.0, 60.0)] {
        let error = flow_error(&run, from_s, to_s, wanted);
        println!("{wanted} L/min from {from_s} to {to_s} s: within {:.2} %", error * 100.0);
        assert!(error < 0.03, "{wanted} L/min: {error}");
    }
}

/// A set-point at a given pressure drop keeps its angle: at 1 MPa it gives what 2 MPa were meant to, less √2.
#[test]
fn a_flow_at_a_given_pressure_drop_keeps_its_angle() {
    let run = run(|_| {});
    let error = flow_error(&run, 4.5, 5.0, 60.0 / 2.0_f64.sqrt());
    assert!(error < 0.01, "{error}");
}

/// A flow that the pressure no longer gives: the orifice opens as far as it may, and the flow comes back with the pressure.
#[test]
fn a_flow_out_of_reach_comes_back() {
    let run = run(|scenario| {
        scenario.pressure_drop.points = vec![(0.0, 6e6), (1.5, 6e6), (1.7, 0.2e6), (1.9, 0.2e6), (2.1, 6e6)];
    });
    let at = |time_s: f64| run.iter().find(|(t, _)| *t >= time_s).unwrap().1.plant.truth;
    let open_rad =
        parse_model(&shipped("models/rig.toml"), "rig.toml").unwrap().orifice.unwrap().open_angle_rad;
    assert!((at(1.85).angle_rad - open_rad).abs() < 0.01, "opens fully: {}", at(1.85).angle_rad);
    let error = flow_error(&run, 2.2, 2.3, 120.0);
    assert!(error < 0.03, "{error}");
}
