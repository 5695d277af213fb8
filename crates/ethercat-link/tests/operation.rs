//! The bridge with the simulated drive: brought up, enabled, followed, over the wraps of 32 bits, on a clock that runs off.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::{Rig, drive_file, go, off, valve};
use fieldbus::{DriveFile, Homing, Profile};
use signals::validity;
use subdevice::{AlState, Device, Identity, Kind, Settings};

/// A ramp up to `rate_hz`, on for `cycles`, and down again: positions and rates.
fn trapezoid(start: i64, rate_hz: f64, cycles: usize) -> Vec<(f64, f64)> {
    let (mut position, mut rate) = (start as f64, 0.0_f64);
    let mut wanted = vec![rate_hz; cycles];
    wanted.extend(vec![0.0; 60]);
    wanted
        .into_iter()
        .map(|wanted| {
            rate += (wanted - rate).clamp(-19_000.0, 19_000.0);
            position += rate * 1e-3;
            (position, rate)
        })
        .collect()
}

/// Follows a trapezoid; the drive's motion has to be the commands', each cycle's, one cycle after its frame.
fn follows(mut rig: Rig, rate_hz: f64, cycles: usize) {
    let start = rig.enabled().accepted_microsteps;
    rig.rows();
    let course = trapezoid(start, rate_hz, cycles);
    let zero = {
        let rows = rig.rows();
        assert!(rows.is_empty());
        rig.step(Some(&go(start as f64, 0.0)), false);
        rig.step(Some(&go(start as f64, 0.0)), false);
        rig.rows().last().unwrap().end - start
    };
    let mut accepted = Vec::new();
    for (position, rate) in &course {
        let feedback = rig.step(Some(&go(*position, *rate)), false).unwrap();
        assert_eq!(feedback.drive_fault, 0);
        assert_ne!(feedback.validity & validity::ENERGISED, 0);
        accepted.push(feedback.accepted_microsteps);
    }
    let ends: Vec<i64> = rig.rows().iter().map(|row| row.end - zero).collect();
    let commanded: Vec<i64> = course.iter().map(|(position, _)| position.round() as i64).collect();
    // Frame k is active from t_k+1: the SYNC0 after it.
    assert_eq!(ends[1..], commanded[..ends.len() - 1], "the drive's ends of cycle");
    // Feedback k tells of StepCommand k-2.
    assert_eq!(accepted[2..], commanded[..commanded.len() - 2]);
}

#[test]
fn the_drive_moves_as_commanded() {
    follows(Rig::new(Settings::default(), drive_file()), 200e3, 400);
}

/// Feed-forward of the speed, error code, inputs and following error: a drive without them, of which its file says so, moves all the same.
#[test]
fn a_drive_without_what_frames_can_do_without() {
    let lacking = [(0x60B1, 0), (0x603F, 0), (0x60FD, 0), (0x60F4, 0)];
    let mut device = Device::new(Settings::default(), valve(), 1_000);
    lacking.into_iter().for_each(|(index, sub)| device.without(index, sub));
    let file = DriveFile { absent: lacking.to_vec(), ..drive_file() };
    follows(Rig::with(vec![device], file), 200e3, 200);
}

#[test]
fn counts_wrap_both_ways_at_600_khz() {
    for (rate_hz, edge) in [(600e3, i64::from(i32::MAX) - 60_000), (-600e3, i64::from(i32::MIN) + 60_000)] {
        let settings = Settings { zero_offset: edge, ..Settings::default() };
        follows(Rig::new(settings, drive_file()), rate_hz, 400);
    }
}

#[test]
fn a_drive_that_turns_the_other_way() {
    let file = DriveFile { reversed: true, ..drive_file() };
    let mut rig = Rig::new(Settings::default(), file);
    let start = rig.enabled().accepted_microsteps;
    for (position, rate) in trapezoid(start, 100e3, 100) {
        rig.step(Some(&go(position, rate)), false).unwrap();
    }
    let feedback = rig.step(Some(&off()), false).unwrap();
    assert!(feedback.encoder_counts > 5000, "{feedback:?}");
    assert!(rig.device().angle_rad() < -0.2, "{}", rig.device().angle_rad());
}

#[test]
fn a_pulse_train_terminal_moves_as_commanded() {
    let identity = Identity { vendor: 2, product: 0x09DA_3052, ..Settings::default().identity };
    let settings = Settings { kind: Kind::PulseTrain, identity, ..Settings::default() };
    let file = DriveFile {
        profile: Profile::El2522,
        vendor: 2,
        product: 0x09DA_3052,
        position_is_measured: false,
        homing: Homing::Absolute { offset: 0 },
        ..drive_file()
    };
    follows(Rig::new(settings, file), 200e3, 400);
}

#[test]
fn the_clock_is_locked_within_three_seconds_and_stays() {
    for drift_ppb in [-150_000, -100_000, 0, 100_000, 150_000] {
        let settings = Settings { drift_ppb, ..Settings::default() };
        let mut rig = Rig::new(settings, drive_file());
        let cycles = rig.operate(Some(&off()));
        assert!(cycles < 3000, "{drift_ppb} ppb: {cycles} cycles");
        rig.rows();
        for _ in 0..5000 {
            rig.step(Some(&off()), false);
            assert_eq!(rig.device().al_state(), AlState::Op);
        }
        let rows = rig.rows();
        assert!(rows.iter().all(|row| row.fresh), "every SYNC0 finds fresh outputs");
        // The frame passes 10 µs after it was sent, which the clock aims at.
        for row in &rows[1000..] {
            assert!(row.age_ns.abs_diff(900_000) < 60_000, "{drift_ppb} ppb: {row:?}");
        }
    }
}

#[test]
fn disarmed_it_carries_no_current() {
    let mut rig = Rig::new(Settings::default(), drive_file());
    rig.enabled();
    for _ in 0..20 {
        rig.step(Some(&off()), false);
    }
    assert!(!rig.bridge.enabled());
    assert_eq!(rig.rows().last().unwrap().status & 0x6F, 0x21, "ready to switch on");
}
