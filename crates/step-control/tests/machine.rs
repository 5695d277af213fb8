//! States, orders, preconditions and faults, message by message.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::{Bench, HOLDS, order, params};
use signals::{Body, ControllerState, FaultCode, OperatorKind, OperatorResult, Reference, validity};
use step_control::{LostSteps, Params};

const ENCODER: u64 = HOLDS | validity::ENCODER;

/// Steps until a fault; in how many cycles, at most 5000.
fn fault_after(bench: &mut Bench) -> Option<(u64, FaultCode)> {
    let begun = bench.cycle;
    for _ in 0..5000 {
        let status = bench.step(None).status;
        if status.fault != 0 {
            assert_eq!(status.fault_cycle, bench.cycle - 1);
            return Some((bench.cycle - begun, FaultCode::from_code(status.fault).unwrap()));
        }
    }
    None
}

#[test]
fn arming_needs_feedback_reference_standstill_and_a_drive_without_fault() {
    type Spoil = fn(&mut Bench);
    let spoils: [Spoil; 4] = [
        |bench| bench.silent = true,
        |bench| bench.reference = None,
        |bench| bench.validity &= !validity::STANDSTILL,
        |bench| bench.drive_fault = FaultCode::Drive,
    ];
    for (index, spoil) in spoils.iter().enumerate() {
        let mut bench = Bench::new(params());
        spoil(&mut bench);
        assert_eq!(bench.ask(1, OperatorKind::Arm), OperatorResult::NotReady, "precondition {index}");
        assert_eq!(bench.machine(), ControllerState::Disarmed, "precondition {index}");
    }
    assert_eq!(Bench::new(params()).ask(1, OperatorKind::Home), OperatorResult::NoHoming);
    assert_eq!(Bench::new(params()).ask(1, OperatorKind::Arm), OperatorResult::Done);
}

#[test]
fn an_id_is_obeyed_once_and_a_late_order_only_disarms() {
    let mut bench = Bench::running(params());
    assert_eq!(bench.ask(2, OperatorKind::Disarm), OperatorResult::Done);
    assert_eq!(bench.machine(), ControllerState::Disarmed);
    for id in [1, 2] {
        bench.step(Some(order(id, OperatorKind::Arm)));
        assert_eq!(bench.machine(), ControllerState::Disarmed, "id {id} was obeyed again");
    }
    let mut late = order(3, OperatorKind::Arm);
    late.valid_until_cycle = bench.cycle - 1;
    assert_eq!(bench.step(Some(late)).status.operator_result, OperatorResult::Expired.code());
    let mut just = order(4, OperatorKind::Arm);
    just.valid_until_cycle = bench.cycle;
    bench.step(Some(just));
    assert_eq!(bench.machine(), ControllerState::Running);
    let mut late = order(5, OperatorKind::Disarm);
    late.valid_until_cycle = 0;
    bench.step(Some(late));
    assert_eq!(bench.machine(), ControllerState::Disarmed);
}

#[test]
fn arming_waits_for_the_drive_and_gives_up_after_two_seconds() {
    let mut bench = Bench::new(params());
    bench.validity &= !validity::ENERGISED;
    assert_eq!(bench.ask(1, OperatorKind::Arm), OperatorResult::Begun);
    let (cycles, fault) = fault_after(&mut bench).unwrap();
    assert_eq!((cycles, fault), (2001, FaultCode::NotEnergised));

    let mut bench = Bench::new(params());
    bench.validity &= !validity::ENERGISED;
    bench.ask(1, OperatorKind::Arm);
    bench.validity = HOLDS;
    bench.reference = None;
    bench.step(None);
    assert_eq!(bench.machine(), ControllerState::Arming, "without a reference there is nothing to follow");
    bench.reference = Some(Reference::default());
    assert_eq!(bench.step(None).status.operator_result, OperatorResult::Done.code());
    assert_eq!(bench.machine(), ControllerState::Running);

    let mut bench = Bench::new(params());
    bench.validity &= !validity::ENERGISED;
    bench.ask(1, OperatorKind::Arm);
    bench.drive_fault = FaultCode::Drive;
    let status = bench.step(None).status;
    assert_eq!(status.fault, FaultCode::Drive.code());
    assert_eq!(status.operator_result, OperatorResult::Failed.code());
}

#[test]
fn a_silent_partner_is_a_fault_in_the_cycle_that_is_one_too_many() {
    type Silence = fn(&mut Bench);
    let silences: [(Silence, FaultCode); 2] = [
        (|bench| bench.silent = true, FaultCode::FeedbackSilent),
        (|bench| bench.reference = None, FaultCode::ReferenceSilent),
    ];
    for (silence, expected) in silences {
        let mut bench = Bench::running(params());
        silence(&mut bench);
        assert_eq!(fault_after(&mut bench), Some((3, expected)));
    }
}

#[test]
fn a_fault_of_the_drive_is_one_of_the_controller() {
    let mut bench = Bench::running(params());
    bench.drive_fault = FaultCode::CommandSilent;
    assert_eq!(fault_after(&mut bench), Some((1, FaultCode::Drive)));
}

#[test]
fn only_reset_leaves_a_fault_and_only_once_the_valve_stands() {
    let mut bench = Bench::running(params());
    bench.drive_fault = FaultCode::Drive;
    bench.validity &= !validity::STANDSTILL;
    bench.step(None);
    assert_eq!(bench.machine(), ControllerState::QuickStop);
    assert_eq!(bench.ask(2, OperatorKind::Reset), OperatorResult::WrongState);
    assert_eq!(bench.state.fault(), FaultCode::Drive);
    bench.validity = HOLDS;
    bench.step(None);
    assert_eq!(bench.machine(), ControllerState::Fault);
    for (id, kind) in [(3, OperatorKind::Arm), (4, OperatorKind::Disarm), (5, OperatorKind::Home)] {
        assert_eq!(bench.ask(id, kind), OperatorResult::WrongState);
        assert_eq!(bench.machine(), ControllerState::Fault);
    }
    bench.drive_fault = FaultCode::None;
    assert_eq!(bench.ask(6, OperatorKind::Reset), OperatorResult::Done);
    assert_eq!((bench.machine(), bench.state.fault()), (ControllerState::Disarmed, FaultCode::None));
}

#[test]
fn each_arming_has_a_number_and_what_follows_bears_it() {
    let mut bench = Bench::new(params());
    for arming in 1..4 {
        let idle = bench.step(None).command;
        assert_eq!((idle.follow, idle.follow_id), (0, 0));
        let armed = bench.step(Some(order(2 * arming, OperatorKind::Arm))).command;
        assert_eq!((armed.follow, armed.follow_id), (1, arming));
        let goes_on = bench.step(None).command;
        assert_eq!((goes_on.follow, goes_on.follow_id), (1, arming));
        let stops = bench.step(Some(order(2 * arming + 1, OperatorKind::Disarm))).command;
        assert_eq!((stops.follow, stops.follow_id), (0, 0));
    }
}

#[test]
fn a_quick_stop_ramps_down_and_ends_when_the_drive_stands() {
    let mut bench = Bench::running(params());
    for cycle in 0..100 {
        bench.refer(0.002 * f64::from(cycle), 2.0, 0.0);
        bench.validity = HOLDS & !validity::STANDSTILL;
        bench.step(None);
    }
    bench.refer(0.2, 2.0, 0.0);
    let before = bench.step(None).command;
    let mut rate_hz = before.pulse_rate_hz;
    assert!(rate_hz > 30e3, "{rate_hz} Hz");
    bench.step(Some(order(2, OperatorKind::Disarm)));
    for _ in 0..20 {
        let command = bench.step(None).command;
        assert!(command.pulse_rate_hz <= rate_hz && command.pulse_rate_hz >= 0.0);
        assert_eq!(command.energise, 1, "the current brakes the rotor");
        assert_eq!(command.follow, 0);
        rate_hz = command.pulse_rate_hz;
    }
    assert_eq!(rate_hz, 0.0);
    assert_eq!(bench.machine(), ControllerState::QuickStop, "the drive still moves");
    bench.validity = HOLDS;
    bench.step(None);
    assert_eq!(bench.machine(), ControllerState::Disarmed);
    assert_eq!(bench.step(None).command.energise, 0);
}

#[test]
fn a_drive_that_never_rests_after_a_stop_is_a_fault_in_time() {
    let mut bench = Bench::running(params());
    bench.validity &= !validity::STANDSTILL;
    bench.step(Some(order(2, OperatorKind::Disarm)));
    let mut cycles = 0;
    while bench.machine() == ControllerState::QuickStop {
        assert_eq!(bench.step(None).command.pulse_rate_hz, 0.0);
        cycles += 1;
    }
    let most = drive::stop_cycles_bound(&bench.params.drive) + 2000;
    assert_eq!(cycles, most + 1);
    assert_eq!((bench.machine(), bench.state.fault()), (ControllerState::Fault, FaultCode::NeverRests));
}

#[test]
fn a_quick_stop_does_not_end_before_its_own_ramp() {
    let mut bench = Bench::running(params());
    for cycle in 0..100 {
        bench.refer(0.002 * f64::from(cycle), 2.0, 0.0);
        bench.step(None);
    }
    // This drive says that it stands all the while.
    bench.step(Some(order(2, OperatorKind::Disarm)));
    let mut cycles = 0;
    while bench.machine() == ControllerState::QuickStop {
        bench.step(None);
        cycles += 1;
    }
    assert!((3..20).contains(&cycles), "{cycles} cycles");
    assert_eq!(bench.machine(), ControllerState::Disarmed);
}

#[test]
fn a_drive_that_is_silent_counts_as_still_once_it_stops_by_itself() {
    let mut bench = Bench::running(params());
    bench.validity &= !validity::STANDSTILL;
    bench.step(Some(order(2, OperatorKind::Disarm)));
    bench.silent = true;
    bench.step(None);
    bench.step(None);
    assert_eq!(bench.machine(), ControllerState::QuickStop);
    bench.step(None);
    assert_eq!(bench.machine(), ControllerState::Disarmed);
}

#[test]
fn references_keep_to_their_limits_or_stop_the_valve() {
    // Angle, speed, homed, and whether that is a fault.
    let cases = [
        (0.5, 1.0, true, false),
        (0.502, 1.0, true, true),
        (0.502, 0.0, true, false),
        (0.502, -1.0, true, false),
        (-0.502, -1.0, true, true),
        (-0.502, 1.0, true, false),
        (0.0, 10.05, true, false),
        (0.0, 10.2, true, true),
        (0.0, -10.2, true, true),
        (0.502, 0.1, false, false),
        (0.0, 0.201, false, false),
        (0.0, 0.21, false, true),
    ];
    for (angle_rad, speed_rad_per_s, homed, is_fault) in cases {
        let mut bench = Bench::new(Params { max_following_error_rad: 10.0, ..params() });
        bench.refer(angle_rad, 0.0, 0.0);
        if !homed {
            bench.validity &= !validity::HOMED;
        }
        bench.step(Some(order(1, OperatorKind::Arm)));
        assert_eq!(bench.machine(), ControllerState::Running);
        bench.refer(angle_rad, speed_rad_per_s, 0.0);
        let status = bench.step(None).status;
        let expected = if is_fault { FaultCode::ReferenceLimit } else { FaultCode::None };
        assert_eq!(status.fault, expected.code(), "{angle_rad} rad, {speed_rad_per_s} rad/s, homed: {homed}");
    }
}

#[test]
fn a_following_error_beyond_its_limit_is_a_fault() {
    for (off_rad, speed_rad_per_s, expected) in [
        (0.0099, 0.0, FaultCode::None),
        (0.0101, 0.0, FaultCode::FollowingError),
        (-0.0101, 0.0, FaultCode::FollowingError),
        (0.0299, 2.0, FaultCode::None),
        (0.0301, 2.0, FaultCode::FollowingError),
    ] {
        let params = Params { max_following_error_rad: 0.01, following_error_per_speed_s: 0.01, ..params() };
        let mut bench = Bench::new(params);
        bench.validity = ENCODER;
        bench.step(Some(order(1, OperatorKind::Arm)));
        let mut fault = FaultCode::None;
        for cycle in 0..30 {
            let angle_rad = 1e-3 * speed_rad_per_s * f64::from(cycle);
            bench.refer(angle_rad, speed_rad_per_s, 0.0);
            // The newest reference is for two cycles later; the error is wanted once the speed holds.
            let late_rad = (angle_rad - 2e-3 * speed_rad_per_s).max(0.0);
            bench.rotor_rad = late_rad - if cycle > 10 { off_rad } else { 0.0 };
            let status = bench.step(None).status;
            if fault == FaultCode::None {
                fault = FaultCode::from_code(status.fault).unwrap();
            }
        }
        assert_eq!(fault, expected, "{off_rad} rad at {speed_rad_per_s} rad/s");
    }
}

#[test]
fn a_rotor_in_another_tooth_is_a_fault_or_the_new_beginning() {
    let tooth_rad = std::f64::consts::TAU / 50.0;
    for (reaction, expected) in
        [(LostSteps::Fault, FaultCode::LostSteps), (LostSteps::Resynchronise, FaultCode::None)]
    {
        let mut bench = Bench::new(Params { lost_steps: reaction, max_following_error_rad: 1.0, ..params() });
        bench.validity = ENCODER;
        bench.step(Some(order(1, OperatorKind::Arm)));
        bench.step(None);
        bench.rotor_rad = -tooth_rad;
        let status = bench.step(None).status;
        assert_eq!(status.fault, expected.code(), "{reaction:?}");
        assert_eq!(status.lost_teeth, u64::from(reaction == LostSteps::Resynchronise), "{reaction:?}");
    }
}

#[test]
fn after_lost_steps_the_drive_is_told_until_it_says_that_it_is_not_homed() {
    for (reaction, doubts) in [(LostSteps::Fault, 1), (LostSteps::Resynchronise, 0)] {
        let mut bench = Bench::new(Params { lost_steps: reaction, max_following_error_rad: 1.0, ..params() });
        bench.validity = ENCODER;
        bench.step(Some(order(1, OperatorKind::Arm)));
        assert_eq!(bench.step(None).command.zero_in_doubt, 0, "{reaction:?}");
        bench.rotor_rad = -std::f64::consts::TAU / 50.0;
        assert_eq!(bench.step(None).command.zero_in_doubt, doubts, "{reaction:?}");
        // Neither silence nor a reset ends it.
        bench.silent = true;
        assert_eq!(bench.step(None).command.zero_in_doubt, doubts, "{reaction:?}: silent");
        bench.silent = false;
        (0..50).for_each(|_| _ = bench.step(None));
        let reset = bench.step(Some(order(2, OperatorKind::Reset)));
        assert_eq!(reset.command.zero_in_doubt, doubts, "{reaction:?}: reset");
        bench.validity &= !validity::HOMED;
        assert_eq!(bench.step(None).command.zero_in_doubt, 0, "{reaction:?}: the drive has heard it");
    }
    // Of a controller that was started anew.
    let mut bench = Bench::new(params());
    bench.state = bench.state.with_zero_in_doubt(true);
    assert_eq!(bench.step(None).command.zero_in_doubt, 1);
}

#[test]
fn current_flows_when_it_must_and_not_before() {
    for (holds, after_stop, disarmed, fault) in [
        (false, drive::AfterStop::Hold, 0, 1),
        (true, drive::AfterStop::Hold, 1, 1),
        (true, drive::AfterStop::DeEnergise, 1, 0),
    ] {
        let mut params = Params { holds_when_disarmed: holds, ..params() };
        params.drive.after_stop = after_stop;
        let mut bench = Bench::new(params);
        assert_eq!(bench.step(None).command.energise, disarmed, "{holds}, {after_stop:?}: disarmed");
        bench.validity &= !validity::ENERGISED;
        assert_eq!(bench.step(Some(order(1, OperatorKind::Arm))).command.energise, 1, "arming");
        bench.validity = HOLDS;
        assert_eq!(bench.step(None).command.energise, 1, "running");
        bench.drive_fault = FaultCode::Drive;
        bench.step(None);
        assert_eq!(bench.step(None).command.energise, fault, "{holds}, {after_stop:?}: fault");
    }
}

#[test]
fn a_position_that_no_drive_can_have_changes_nothing_that_is_sent() {
    let run = |wrong: Option<i64>| {
        let mut bench = Bench::new(params());
        bench.validity = ENCODER;
        bench.step(Some(order(1, OperatorKind::Arm)));
        (0..20)
            .map(|cycle| {
                bench.wrong_position = wrong.filter(|_| cycle == 10);
                let output = bench.step(None);
                (output.command, output.status)
            })
            .collect::<Vec<_>>()
    };
    let right = run(None);
    for wrong in [1 << 53, -(1 << 53), 1_000_000] {
        assert_eq!(run(Some(wrong)), right, "{wrong} micro-steps");
    }
}

#[test]
fn whatever_the_encoder_says_the_status_is_one_that_readers_accept() {
    for reading_rad in [6.3e9, -6.3e9, 1.3e8, -1.3e8, 1e3] {
        let mut bench = Bench::new(Params { max_following_error_rad: 1.0, ..params() });
        bench.validity = ENCODER;
        bench.refer(0.5, 1.0, 0.0);
        bench.step(Some(order(1, OperatorKind::Arm)));
        (0..20).for_each(|_| _ = bench.step(None));
        bench.rotor_rad = reading_rad;
        for _ in 0..200 {
            let output = bench.step(None);
            assert!(output.status.is_within_rules(), "{reading_rad}: {:?}", output.status);
            assert!(output.command.is_within_rules(), "{reading_rad}: {:?}", output.command);
        }
    }
}
