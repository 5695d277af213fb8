//! Devices that are not the drive of the file: refused before anything moves, with what was found and what was expected.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::{Rig, drive_file, valve};
use ethercat_link::BringUpError;
use fieldbus::{DriveFile, OwnLimits, Plan};
use subdevice::{Device, Identity, Settings};

fn device(settings: Settings) -> Device {
    Device::new(settings, valve(), 1_000)
}

fn refusal(devices: Vec<Device>, file: DriveFile) -> BringUpError {
    Rig::with(devices, file).bridge.check().unwrap_err()
}

/// What a device refuses is said in one sentence that names both sides.
fn refused_with(device: Device, expected: &str) {
    assert_eq!(refusal(vec![device], drive_file()).to_string(), expected);
}

#[test]
fn the_right_one_is_taken() {
    assert_eq!(Rig::new(Settings::default(), drive_file()).bridge.check(), Ok(()));
}

#[test]
fn other_identities() {
    let identity = || Settings::default().identity;
    let other = |identity: Identity| device(Settings { identity, ..Settings::default() });
    refused_with(
        other(Identity { vendor: 2, ..identity() }),
        "the device's vendor is 0x00000002, expected 0x00005356",
    );
    refused_with(
        other(Identity { product: 7, ..identity() }),
        "the device's product is 0x00000007, expected 0x00000402",
    );
    refused_with(
        other(Identity { revision: 0xFFFF, ..identity() }),
        "the device's revision is 0x0000ffff, expected 0x00010000 or later",
    );
    // A later revision fits.
    let mut rig = Rig::with(vec![other(Identity { revision: 0x20000, ..identity() })], drive_file());
    assert_eq!(rig.bridge.check(), Ok(()));
}

#[test]
fn none_two_or_one_without_sii() {
    assert_eq!(refusal(Vec::new(), drive_file()), BringUpError::Count { found: 0, expected: 1 });
    let two = vec![device(Settings::default()), device(Settings::default())];
    assert_eq!(refusal(two, drive_file()), BringUpError::Count { found: 2, expected: 1 });
    refused_with(
        device(Settings { empty_sii: true, ..Settings::default() }),
        "the device's vendor is 0xffffffff, expected 0x00005356",
    );
}

#[test]
fn a_cycle_too_short_for_it() {
    refused_with(
        device(Settings { minimum_cycle_ns: 2_000_000, ..Settings::default() }),
        "0x1C32:05 is 2000000, expected at most 1000000",
    );
}

#[test]
fn no_cyclic_synchronous_position() {
    let mut other = device(Settings::default());
    other.preset(0x6502, 0, 0x0325);
    refused_with(other, "0x6502:00 is 805, expected a value with the bits 0x80");
}

#[test]
fn other_units() {
    for (index, sub, value, expected) in [
        (0x608F, 1, 10_000, "0x608F:01 is 10000, expected 112500"),
        (0x6091, 1, 5, "0x6091:01 is 5, expected 1"),
        (0x6092, 2, 2, "0x6092:02 is 2, expected 1"),
    ] {
        let mut other = device(Settings::default());
        other.preset(index, sub, value);
        refused_with(other, expected);
    }
}

/// An abort at every object of the bring-up is told with the object.
#[test]
fn every_object_that_is_refused_is_named() {
    let limits = OwnLimits::of(&common::guard(), drive_file().units_per_rev);
    let plan = Plan::new(&drive_file(), common::PERIOD_NS, limits);
    let mut objects: Vec<_> = plan.requests().iter().map(|request| request.object).collect();
    objects.sort();
    objects.dedup();
    assert!(objects.len() > 40);
    for object in objects {
        let mut other = device(Settings::default());
        other.refuse(object.index, object.sub, 0x0800_0000);
        match refusal(vec![other], drive_file()) {
            BringUpError::Sdo { object: named, .. } => assert_eq!(named, object),
            error => panic!("{object}: {error:?}"),
        }
    }
}

#[test]
fn an_object_that_keeps_its_own_value_is_told() {
    // Read back as it was: the mode is one that the drive does not take.
    let mut other = device(Settings::default());
    other.without(0x10F1, 2);
    match refusal(vec![other], drive_file()) {
        BringUpError::Sdo { object, write: true, .. } => assert_eq!(object.to_string(), "0x10F1:02"),
        error => panic!("{error:?}"),
    }
    // Said to be absent in the drive file, it is passed over.
    let mut other = device(Settings::default());
    other.without(0x10F1, 2);
    let file = DriveFile { absent: vec![(0x10F1, 2)], ..drive_file() };
    assert_eq!(Rig::with(vec![other], file).bridge.check(), Ok(()));
}

#[test]
fn nothing_moves_and_no_current_flows_before_it_is_asked_for() {
    let mut rig = Rig::new(Settings::default(), drive_file());
    rig.operate(None);
    for _ in 0..200 {
        rig.step(None, false);
    }
    assert!(rig.rows().iter().all(|row| row.start == row.end && row.status & 0x6F != 0x27));
}
