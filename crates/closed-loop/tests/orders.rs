//! Parameters that an operator changes while the valve runs.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use closed_loop::{ControllerRole, PlantRole, TrajectoryRole, wire};
use common::{Valve, scenario};
use config::{Scenario, ScheduledSetPoint, SetPoint};
use signals::{ControlParameter, ControlStatus, OperatorCommand, OperatorKind, OperatorResult};

/// Runs a scenario with orders due in these cycles; status and true error of every cycle.
fn run(
    scenario: &Scenario,
    belief: &Valve,
    orders: &[(u64, ControlParameter, f64)],
) -> Vec<(ControlStatus, f64)> {
    let parts = wire(scenario, &Valve::default().model(), &belief.model()).unwrap();
    let mut plant = PlantRole::new(parts.plant.clone());
    let mut trajectory = TrajectoryRole::new(parts.trajectory.clone());
    let mut controller = ControllerRole::new(&parts.controller);
    let (mut command, mut status, mut id) = (None, None, 0);
    let mut references = vec![0.0; 2];
    let mut all = Vec::new();
    for cycle in 0..parts.timeline.last_cycle {
        let sample = plant.sample(cycle);
        let reference = trajectory.step(cycle, Some(&sample.feedback), status.as_ref(), None);
        references.push(reference.angle_rad);
        let order = orders.iter().find(|order| order.0 == cycle).map(|&(_, parameter, value)| {
            id += 1;
            let kind = OperatorKind::SetParameter.code();
            OperatorCommand { id, valid_until_cycle: cycle, kind, parameter: parameter.code(), value }
        });
        let output = controller.step(cycle, Some(&sample.feedback), Some(&reference), order.as_ref());
        plant.advance(cycle, command.as_ref());
        (command, status) = (Some(output.command), Some(output.status));
        all.push((output.status, references[cycle as usize] - sample.truth.angle_rad));
    }
    all
}

fn rms(errors: &[(ControlStatus, f64)]) -> f64 {
    (errors.iter().map(|(_, error)| error * error).sum::<f64>() / errors.len() as f64).sqrt()
}

fn moving() -> Scenario {
    let mut scenario = scenario(3.0, "");
    scenario.set_points = vec![ScheduledSetPoint {
        time_s: 0.05,
        set_point: SetPoint::Sine { amplitude_rad: 0.2, frequency_hz: 1.0 },
        line: 0,
    }];
    scenario
}

#[test]
fn the_level_of_compensation_changes_in_motion() {
    let mut scenario = moving();
    scenario.encoder.fitted = false;
    scenario.control.observer = false;
    scenario.control.damping = config::Damping::None;
    scenario.compensation = config::Compensation::None;
    let all = run(&scenario, &Valve::default(), &[(1500, ControlParameter::CompensationLevel, 2.0)]);
    assert_eq!(all[1500].0.operator_result, OperatorResult::Done.code());
    let (before, after) = (rms(&all[200..1500]), rms(&all[1600..2900]));
    assert!(before > 10.0 * after, "{before} rad before, {after} rad after");
}

#[test]
fn the_bandwidth_of_the_observer_changes_in_motion() {
    // All of the friction is left to it.
    let moving = || Scenario { compensation: config::Compensation::None, ..moving() };
    let belief = Valve::default();
    let slow = run(&moving(), &belief, &[(20, ControlParameter::ObserverBandwidth, 2.0)]);
    let fast = run(
        &moving(),
        &belief,
        &[(20, ControlParameter::ObserverBandwidth, 2.0), (1000, ControlParameter::ObserverBandwidth, 320.0)],
    );
    let usual = run(&moving(), &belief, &[]);
    assert!(rms(&slow[1500..2900]) > 1.3 * rms(&fast[1500..2900]));
    let ratio = rms(&fast[1500..2900]) / rms(&usual[1500..2900]);
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
}

#[test]
fn what_makes_no_sense_is_refused_and_changes_nothing() {
    let wrong = [
        (ControlParameter::CompensationLevel, 1.5),
        (ControlParameter::CompensationLevel, 4.0),
        (ControlParameter::ObserverBandwidth, -1.0),
        (ControlParameter::ObserverBandwidth, f64::NAN),
        (ControlParameter::ObserverLimit, 7.0),
        (ControlParameter::MaxFollowingError, 0.0),
        // The scenario says 3°.
        (ControlParameter::MaxFollowingError, 3.01_f64.to_radians()),
        (ControlParameter::FollowingErrorPerSpeed, 1e-6),
        (ControlParameter::FollowingErrorPerSpeed, f64::INFINITY),
        (ControlParameter::None, 1.0),
    ];
    let orders: Vec<_> =
        wrong.iter().zip(100..).map(|(&(parameter, value), cycle)| (cycle, parameter, value)).collect();
    let (plain, all) = (run(&moving(), &Valve::default(), &[]), run(&moving(), &Valve::default(), &orders));
    for ((before, after), (parameter, value)) in plain[100..].iter().zip(&all[100..]).zip(wrong) {
        assert_eq!(after.0.operator_result, OperatorResult::Refused.code(), "{parameter} = {value}");
        assert_eq!(before.1.to_bits(), after.1.to_bits());
    }
    let mut blind = moving();
    blind.encoder.fitted = false;
    blind.control.observer = false;
    blind.control.damping = config::Damping::None;
    let all = run(&blind, &Valve::default(), &[(100, ControlParameter::ObserverBandwidth, 50.0)]);
    assert_eq!(all[100].0.operator_result, OperatorResult::Refused.code());
}

#[test]
fn a_tighter_limit_stops_the_valve() {
    let all = run(&moving(), &Valve::default(), &[(1000, ControlParameter::MaxFollowingError, 1e-5)]);
    assert_eq!(all[999].0.fault, 0);
    assert_eq!(all.last().unwrap().0.fault, signals::FaultCode::FollowingError.code());
}
