//! Zeros over the bus: found by the drive itself (CiA 402, mode 6), or by the controller and taken from its command.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::{Rig, arming, drive_file, go, off};
use fieldbus::{DriveFile, Homing};
use signals::{FaultCode, Feedback, StepCommand, validity};
use subdevice::{Hurt, Line, Settings};

/// A drive whose position on the bus says nothing of the valve.
fn settings() -> Settings {
    Settings { zero_offset: 12_345, ..Settings::default() }
}

fn homes(method: i8) -> DriveFile {
    DriveFile { homing: Homing::Drive { method }, ..drive_file() }
}

fn has(feedback: &Feedback, flag: u64) -> bool {
    feedback.validity & flag != 0
}

/// Steps with one command until `enough`, at most so many cycles; the last Feedback.
fn until(rig: &mut Rig, command: &StepCommand, enough: impl Fn(&Rig, &Feedback) -> bool) -> Feedback {
    for _ in 0..3000 {
        if let Some(feedback) = rig.step(Some(command), false).filter(|feedback| enough(rig, feedback)) {
            return feedback;
        }
    }
    panic!("not within 3 s: {:?}", rig.bridge.status());
}

#[test]
fn armed_without_an_order_the_drive_looks_for_no_zero() {
    let mut rig = Rig::new(settings(), homes(37));
    let feedback = rig.enabled();
    assert!(!has(&feedback, validity::HOMED));
    assert_eq!(feedback.encoder_counts, 12_345);
    assert!(!rig.rows().iter().any(|row| row.control & 0x10 != 0), "homing was never started");
}

#[test]
fn an_order_makes_this_place_the_zero_before_the_drive_follows() {
    for method in [35, 37] {
        let mut rig = Rig::new(settings(), homes(method));
        let before = {
            rig.operate(Some(&off()));
            until(&mut rig, &off(), |_, feedback| has(feedback, validity::ENCODER))
        };
        assert_eq!((before.encoder_counts, has(&before, validity::HOMED)), (12_345, false));
        rig.bridge.home();
        let after = until(&mut rig, &arming(), |_, feedback| has(feedback, validity::ENERGISED));
        assert!(has(&after, validity::HOMED));
        // The rotor may have been drawn to a tooth meanwhile.
        assert!(after.encoder_counts.abs() < 1200, "{after:?}");
        assert!((after.accepted_microsteps - after.encoder_counts).abs() < 1200, "{after:?}");
        let rows = rig.rows();
        assert!(rows.iter().all(|row| row.start == row.end), "nothing moves for it");
        assert!(rows.iter().any(|row| row.control & 0x10 != 0));
        // It follows from there, by counts from the new zero.
        let start = after.accepted_microsteps;
        for step in 1..=50 {
            rig.step(Some(&go((start + 10 * step) as f64, 10_000.0)), false);
        }
        for _ in 0..10 {
            rig.step(Some(&go((start + 500) as f64, 0.0)), false);
        }
        let feedback = rig.step(Some(&go((start + 500) as f64, 0.0)), false).unwrap();
        assert_eq!((feedback.drive_fault, feedback.accepted_microsteps), (0, start + 500));
        // Disarmed and armed again it stays homed, and looks for nothing.
        until(&mut rig, &off(), |rig, _| !rig.bridge.enabled());
        rig.rows();
        assert!(has(&until(&mut rig, &arming(), |_, f| has(f, validity::ENERGISED)), validity::HOMED));
        assert!(!rig.rows().iter().any(|row| row.control & 0x10 != 0));
    }
}

#[test]
fn a_method_that_fails_or_an_order_that_is_refused() {
    // The simulated drive knows no other methods: status bit 13.
    let mut rig = Rig::new(settings(), homes(17));
    rig.operate(Some(&off()));
    rig.bridge.home();
    let feedback = until(&mut rig, &arming(), |_, feedback| feedback.drive_fault != 0);
    assert_eq!(feedback.drive_fault, FaultCode::Homing.code());
    assert!(!has(&feedback, validity::HOMED) && !rig.bridge.enabled());
    // The controller asked for no current: the order is forgotten.
    let mut rig = Rig::new(settings(), homes(37));
    rig.operate(Some(&off()));
    rig.bridge.home();
    (0..30).for_each(|_| _ = rig.step(Some(&off()), false));
    assert!(!has(&rig.enabled(), validity::HOMED));
}

#[test]
fn a_lost_bus_clears_a_zero_that_is_not_absolute() {
    for (homing, stays) in
        [(Homing::Drive { method: 37 }, false), (Homing::Absolute { offset: 12_345 }, true)]
    {
        let mut rig = Rig::new(settings(), DriveFile { homing, ..drive_file() });
        rig.operate(Some(&off()));
        rig.bridge.home();
        until(&mut rig, &arming(), |_, feedback| has(feedback, validity::ENERGISED));
        rig.hurt(Hurt::Power(50_000_000));
        until(&mut rig, &off(), |_, feedback| feedback.drive_fault != 0);
        rig.operate(Some(&off()));
        let feedback = until(&mut rig, &off(), |_, feedback| has(feedback, validity::ENCODER));
        assert_eq!(has(&feedback, validity::HOMED), stays, "{homing:?}");
    }
}

/// The controller's new zero shifts its counts and the encoder's angle, once, and not the drive.
#[test]
fn a_zero_of_the_controllers_moves_nothing() {
    for line in [None, Some(Hurt::Line(Line::DropReply, 1))] {
        let mut rig = Rig::new(settings(), DriveFile { homing: Homing::None, ..drive_file() });
        let start = rig.enabled();
        assert!(!has(&start, validity::HOMED));
        let here = start.accepted_microsteps;
        (0..5).for_each(|_| _ = rig.step(Some(&go(here as f64, 0.0)), false));
        rig.rows();
        let zero = StepCommand {
            energise: 1,
            zero_id: 1,
            zero_shift_microsteps: -5000,
            zero_shift_rad: -0.25,
            ..StepCommand::default()
        };
        if let Some(hurt) = line {
            rig.hurt(hurt);
        }
        let taken = until(&mut rig, &zero, |_, feedback| feedback.zero_id == 1);
        assert!(has(&taken, validity::HOMED));
        assert_eq!((taken.accepted_microsteps, taken.drive_fault), (here - 5000, 0));
        assert!((taken.angle_rad - (start.angle_rad - 0.25)).abs() < 0.05, "{taken:?}");
        (0..10).for_each(|_| _ = rig.step(Some(&zero), false));
        let again = rig.step(Some(&zero), false).unwrap();
        assert_eq!(again.accepted_microsteps, here - 5000, "once");
        // It follows from there.
        let follow = |end: i64| StepCommand {
            zero_id: 1,
            zero_shift_microsteps: -5000,
            zero_shift_rad: -0.25,
            // Armed again: homing ends disarmed.
            follow_id: 2,
            ..go(end as f64, 0.0)
        };
        for end in [here - 5000, here - 5000 + 100] {
            (0..10).for_each(|_| _ = rig.step(Some(&follow(end)), false));
            assert_eq!(rig.step(Some(&follow(end)), false).unwrap().accepted_microsteps, end);
        }
        let ways: i64 = rig.rows().iter().map(|row| row.end - row.start).sum();
        assert_eq!(ways, 100, "the drive itself moved by what was asked for");
    }
}

/// What the controller doubts is no zero before the next one, over a lost bus as well.
#[test]
fn a_zero_in_doubt_is_none_until_the_next() {
    let doubt = StepCommand { zero_in_doubt: 1, ..off() };
    for homing in [Homing::Drive { method: 37 }, Homing::Absolute { offset: 12_345 }] {
        let mut rig = Rig::new(settings(), DriveFile { homing, ..drive_file() });
        rig.operate(Some(&off()));
        rig.bridge.home();
        until(&mut rig, &arming(), |_, feedback| has(feedback, validity::ENERGISED | validity::HOMED));
        let doubted = until(&mut rig, &doubt, |_, feedback| !has(feedback, validity::HOMED));
        assert!(has(&doubted, validity::ENCODER), "{homing:?}");
        (0..10).for_each(|_| _ = rig.step(Some(&off()), false));
        assert!(
            !has(&rig.step(Some(&off()), false).unwrap(), validity::HOMED),
            "{homing:?}: the doubt ended"
        );
        rig.hurt(Hurt::Power(50_000_000));
        until(&mut rig, &off(), |_, feedback| feedback.drive_fault != 0);
        rig.operate(Some(&off()));
        let back =
            |_: &Rig, feedback: &Feedback| has(feedback, validity::ENCODER) && feedback.drive_fault == 0;
        let feedback = until(&mut rig, &off(), back);
        assert!(!has(&feedback, validity::HOMED), "{homing:?}: homed by a lost bus");
        let energised = until(&mut rig, &arming(), |_, feedback| has(feedback, validity::ENERGISED));
        let zero = StepCommand { zero_id: energised.zero_id + 1, ..arming() };
        until(&mut rig, &zero, |_, feedback| has(feedback, validity::HOMED));
    }
}
