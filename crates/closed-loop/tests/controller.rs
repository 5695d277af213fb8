//! What a user sees of the controller: quiet at rest, slower instead of lost, back in step, limits that grow with speed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use closed_loop::{CycleMessages, InProcess, Wire, wire};
use common::{Valve, scenario};
use config::{Damping, LostSteps, Scenario, ScheduledSetPoint, SetPoint};
use signals::{ControllerState, FaultCode, Reference, limiting, validity};

fn at(time_s: f64, set_point: SetPoint) -> ScheduledSetPoint {
    ScheduledSetPoint { time_s, set_point, line: 0 }
}

fn run(scenario: &Scenario, truth: &Valve, belief: &Valve) -> Vec<CycleMessages> {
    InProcess::new(&wire(scenario, &truth.model(), &belief.model()).unwrap()).collect()
}

fn running(messages: &CycleMessages) -> bool {
    messages.status.state == ControllerState::Running.code()
}

#[test]
fn at_rest_the_noise_of_the_encoder_moves_no_pulse() {
    for seed in 0..5 {
        let mut scenario = scenario(3.0, "");
        scenario.seed = seed;
        scenario.set_points = vec![at(0.1, SetPoint::Angle { angle_rad: 0.3 })];
        // A belief that is wrong leaves something to correct before it can be quiet.
        let belief = Valve { coulomb_torque_nm: 1.0, static_torque_nm: 2.2, ..Valve::default() };
        let messages = run(&scenario, &Valve::default(), &belief);
        let quiet = &messages[1000..3000];
        let moved = quiet.iter().filter(|m| m.command.pulse_rate_hz != 0.0).count();
        let error_rad = 0.3 - quiet[0].plant.truth.angle_rad;
        assert_eq!(moved, 0, "seed {seed}: pulses in {moved} of {} cycles at rest", quiet.len());
        assert!(error_rad.abs() < 2e-4, "seed {seed}: rests {error_rad} rad beside");
        let positions: Vec<i64> = quiet.iter().map(|m| m.command.position_microsteps).collect();
        assert!(positions.windows(2).all(|pair| pair[0] == pair[1]));
    }
}

#[test]
fn through_zero_speed_the_command_reverses_without_chatter() {
    let mut scenario = scenario(2.2, "");
    scenario.set_points = vec![at(0.1, SetPoint::Sine { amplitude_rad: 0.2, frequency_hz: 1.0 })];
    let belief = Valve { coulomb_torque_nm: 1.9, static_torque_nm: 2.2, ..Valve::default() };
    let messages = run(&scenario, &Valve::default(), &belief);
    let rates: Vec<f64> = messages
        .iter()
        .filter(|m| running(m))
        .map(|m| m.command.pulse_rate_hz)
        .filter(|rate| rate.abs() > 500.0)
        .collect();
    let reversals = rates.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count();
    // Four of the motion's own, and what it takes to lead friction's reversal.
    assert!((4..=40).contains(&reversals), "{reversals} reversals of the command");
}

#[test]
fn short_of_torque_the_reference_slows_down_and_recovers() {
    let mut scenario = scenario(2.0, "");
    // At 12 rad/s the load takes 6.1 N·m, the motor holds 6.
    let valve = Valve { viscous_nm_s_per_rad: 0.36, ..Valve::default() };
    scenario.safety.max_following_error_rad = 0.2;
    for fitted in [true, false] {
        scenario.encoder.fitted = fitted;
        scenario.control.observer = fitted;
        scenario.control.damping = if fitted { Damping::Active } else { Damping::None };
        scenario.set_points = vec![
            at(0.1, SetPoint::Speed { speed_rad_per_s: 12.5 }),
            at(1.0, SetPoint::Speed { speed_rad_per_s: 2.0 }),
        ];
        let messages = run(&scenario, &valve, &valve);
        let slowest = messages.iter().map(|m| m.reference.time_scale).fold(1.0, f64::min);
        let limited = messages.iter().filter(|m| m.status.limiting & limiting::TORQUE != 0).count();
        assert!(slowest < 0.97, "encoder {fitted}: the reference went on at {slowest}");
        assert!(messages.iter().all(|m| m.plant.truth.lost_teeth == 0), "encoder {fitted}: lost steps");
        assert!(messages.iter().all(|m| m.status.fault == 0), "encoder {fitted}: a fault");
        assert_eq!(messages[1900].reference.time_scale, 1.0, "encoder {fitted}: did not recover");
        assert!(limited < 400, "encoder {fitted}: {limited} cycles at the limit");
    }
}

#[test]
fn lost_steps_are_a_fault_or_caught_up_without_a_jerk() {
    let truth = Valve { missed_step_at_s: Some(0.5), ..Valve::default() };
    let mut scenario = scenario(2.0, "");
    scenario.set_points = vec![at(0.1, SetPoint::Speed { speed_rad_per_s: 1.0 })];
    let faulted = run(&scenario, &truth, &Valve::default());
    assert_eq!(faulted.last().unwrap().status.fault, FaultCode::LostSteps.code());
    let found = faulted.iter().find(|m| m.status.fault != 0).unwrap();
    assert!(found.cycle <= 502, "found in cycle {}", found.cycle);
    let homed = |m: &CycleMessages| m.plant.feedback.validity & validity::HOMED != 0;
    let doubted = faulted.iter().find(|m| !homed(m)).map(|m| m.cycle);
    assert!(doubted.is_some_and(|cycle| cycle <= found.cycle + 2), "not homed from cycle {doubted:?} on");
    assert!(!homed(faulted.last().unwrap()));

    scenario.safety.lost_steps = LostSteps::Resynchronise;
    let messages = run(&scenario, &truth, &Valve::default());
    assert!(messages.iter().all(|m| m.status.fault == 0 && homed(m)));
    assert_eq!(messages.last().unwrap().status.lost_teeth, 1);
    let angles: Vec<f64> = messages.iter().map(|m| m.plant.truth.angle_rad).collect();
    let speeds: Vec<f64> = angles[503..].windows(2).map(|pair| (pair[1] - pair[0]) / 1e-3).collect();
    let fastest = speeds.iter().fold(0.0_f64, |most, speed| most.max(speed.abs()));
    // A command that jumped a tooth would throw it there at some 100 rad/s.
    assert!(fastest < 5.0, "the rotor went back at {fastest} rad/s");
    let late = &messages[1500];
    assert!(late.status.following_error_rad.abs() < 1e-3, "{} rad", late.status.following_error_rad);
    assert_eq!(late.status.time_scale, 1.0);
}

#[test]
fn the_limit_of_the_following_error_grows_with_speed() {
    let mut scenario = scenario(1.0, "");
    scenario.set_points = vec![at(0.1, SetPoint::Speed { speed_rad_per_s: 11.0 })];
    scenario.compensation = config::Compensation::None;
    scenario.control.observer = false;
    scenario.control.damping = Damping::None;
    // Friction costs 5 mrad and more.
    scenario.safety.max_following_error_rad = 2e-3;
    let fault =
        |scenario: &Scenario| run(scenario, &Valve::default(), &Valve::default()).last().unwrap().status;
    assert_eq!(fault(&scenario).fault, FaultCode::FollowingError.code());
    let peak_rad = fault(&scenario).following_error_peak_rad;
    assert!(peak_rad > 2e-3, "the peak is kept after the fault: {peak_rad}");
    scenario.safety.max_following_error_rad = 1.2e-2;
    assert_eq!(fault(&scenario).fault, 0);
    scenario.safety.max_following_error_rad = 4e-3;
    scenario.safety.following_error_per_speed_s = 1.0;
    let status = fault(&scenario);
    // Slow at first, when the limit has hardly grown: it takes its break-away there.
    assert!(status.fault == 0 || status.following_error_peak_rad < 5e-3, "{status:?}");
}

/// From cycle 200 on the references are this much faster than the trajectory made them.
struct Hasty(f64);

impl Wire for Hasty {
    fn reference(&mut self, cycle: u64, body: Reference) -> Option<Reference> {
        let factor = if cycle >= 200 { self.0 } else { 1.0 };
        Some(Reference { speed_rad_per_s: body.speed_rad_per_s * factor, ..body })
    }
}

#[test]
fn a_reference_beyond_the_limits_is_a_fault_in_the_same_cycle() {
    let mut scenario = scenario(0.5, "");
    let most = scenario.limits.max_speed_rad_per_s;
    scenario.set_points = vec![at(0.01, SetPoint::Speed { speed_rad_per_s: 0.99 * most })];
    let parts = wire(&scenario, &Valve::default().model(), &Valve::default().model()).unwrap();
    for (factor, fault) in [(1.0, FaultCode::None), (1.05, FaultCode::ReferenceLimit)] {
        let mut run = InProcess::over(&parts, Hasty(factor));
        let mut found = (FaultCode::None.code(), 0);
        while let Some(outputs) = run.cycle() {
            let status = outputs.controller.unwrap().status;
            if status.fault != 0 && found.1 == 0 {
                found = (status.fault, status.fault_cycle);
            }
        }
        assert_eq!(found.0, fault.code(), "{factor}: {found:?}");
        assert_eq!(found.1, if fault == FaultCode::None { 0 } else { 200 }, "{factor}");
    }
}

/// Loses the references of cycles 200 to 209; those after are this far from where they were, rad.
struct Leaping(f64);

impl Wire for Leaping {
    fn reference(&mut self, cycle: u64, body: Reference) -> Option<Reference> {
        let leap_rad = if cycle >= 210 { self.0 } else { 0.0 };
        let heard = !(200..210).contains(&cycle);
        heard.then_some(Reference { angle_rad: body.angle_rad + leap_rad, ..body })
    }
}

#[test]
fn a_reference_that_leapt_while_it_was_not_heard_is_a_fault() {
    let mut scenario = scenario(0.5, "");
    scenario.safety.silence_cycles = 20;
    let parts = wire(&scenario, &Valve::default().model(), &Valve::default().model()).unwrap();
    // In eleven cycles of 1 ms the limit of 12.6 rad/s, one way instead of the other, makes 0.28 rad of it.
    for (leap_rad, fault) in
        [(0.0, FaultCode::None), (0.25, FaultCode::None), (-0.3, FaultCode::ReferenceLimit)]
    {
        let mut run = InProcess::over(&parts, Leaping(leap_rad));
        let mut found = FaultCode::None.code();
        while let Some(outputs) = run.cycle() {
            found = outputs.controller.unwrap().status.fault.max(found);
        }
        assert_eq!(FaultCode::from_code(found), Some(fault), "{leap_rad} rad");
    }
}
