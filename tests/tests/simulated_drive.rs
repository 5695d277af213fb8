//! The simulated EtherCAT drive beside a main device that is not ours: SOEM, through pysoem.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::process::Command;
use stepvalve_tests::{Finished, end_drive, on_a_cable, repository, start_drive};
use subdevice::NEAR;
use test_needs::python;

const CYCLES: u64 = 3000;

#[test]
fn soem_drives_it() {
    let Some(python) = python(&["pysoem"]) else { return };
    on_a_cable("soem_drives_it", || {
        let drive = start_drive(&repository().join("rt-config/models/rig.toml"), &[]);
        let script = repository().join("tools/soem_check.py");
        let output = Command::new(&python).arg(script).args([NEAR, &CYCLES.to_string()]).output();
        let seen = Finished::from(output.unwrap()).expect_code(0).summary();
        end_drive(drive);
        println!("{seen}");
        assert_eq!((seen["vendor"].as_u64(), seen["product"].as_u64()), (Some(0x5356), Some(0x402)));
        assert_eq!(seen["name"], "SIM-STEPPER");
        assert_eq!(seen["firmware"].as_str().unwrap().len(), 19 * 20, "a segmented upload");
        assert_eq!(seen["abort"].as_u64(), Some(0x0602_0000), "object does not exist");
        assert_eq!(seen["map_size"].as_u64(), Some(28), "11 bytes of outputs, 17 of inputs");
        // Operation enabled, voltage, remote, and following: 0x27 | 0x10 | 0x200 | 0x1000.
        assert_eq!(seen["status"].as_u64(), Some(0x1237));
        assert_eq!(seen["end_status"].as_u64(), Some(0x1237));
        // Frames are lost where the machine stalls; the spool rests within its static lag of the command.
        let lost = seen["lost"].as_u64().unwrap();
        assert!(lost < CYCLES / 20, "{lost} of {CYCLES} frames lost");
        let moved = seen["moved"].as_f64().unwrap();
        assert!((moved - (CYCLES - 1) as f64 * 10.0).abs() < 150.0, "moved {moved} micro-steps");
    });
}
