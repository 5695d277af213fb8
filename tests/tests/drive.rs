//! A valve on a drive: all processes, with the simulated drive at the far end of an EtherCAT cable.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::path::{Path, PathBuf};
use stepvalve_tests::{DriveProcess, Finished, NEAR, TestPlace, on_a_cable, repository};

fn model() -> PathBuf {
    repository().join("rt-config/models/rig.toml")
}

/// The shipped scenario and drive file, with room for the stalls of a busy test machine.
fn scenario(place: &TestPlace) -> PathBuf {
    let drive = std::fs::read_to_string(repository().join("rt-config/drives/simulated.toml")).unwrap();
    let drive = place.write("drive.toml", &drive.replace("bus_lost_cycles = 3 ", "bus_lost_cycles = 500 "));
    place.scenario(
        "drive.toml",
        &[
            ("file =", &format!("file = \"{}\"", drive.display())),
            ("silence_cycles", "silence_cycles = 500"),
            ("max_following_error", "max_following_error = \"30deg\""),
        ],
    )
}

/// A row of the drive's log: start and end of the command, status word, control word, AL status.
struct Row {
    start: i64,
    end: i64,
    fresh: bool,
    status: u16,
    al: u16,
}

fn rows(log: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(log).unwrap();
    let row = |line: &str| {
        let fields: Vec<i64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        Row {
            start: fields[1],
            end: fields[2],
            fresh: fields[3] == 1,
            status: fields[5] as u16,
            al: fields[7] as u16,
        }
    };
    text.lines().skip(1).map(row).collect()
}

#[test]
fn an_instance_turns_a_drive() {
    on_a_cable("an_instance_turns_a_drive", || {
        let place = TestPlace::new();
        let scenario = scenario(&place);
        let log = place.path("drive.csv");
        let drive = DriveProcess::start(&model(), &["--log", log.to_str().unwrap(), "--drift", "20000"]);
        let run = place.start_instance("bus", &["--json"], &scenario, &place.path("out"));
        // Refused until the drive is in operation; absolute set-points until it is heard where it stands.
        place.wait_for("the drive", || (place.stepvalve(&["arm"]).code == Some(0)).then_some(()));
        place.wait_for("current", || {
            (place.stepvalve(&["set", "angle", "17deg"]).code == Some(0)).then_some(())
        });
        place.wait_for("17 degrees", || {
            let angle = place.status()?["angle_rad"].as_f64()?;
            ((angle - 17_f64.to_radians()).abs() < 2e-3).then_some(())
        });
        place.stepvalve(&["disarm"]).expect_code(0);
        kill(Pid::from_raw(run.id().cast_signed()), Signal::SIGTERM).unwrap();
        let ended = Finished::from(run.wait_with_output().unwrap());
        drive.end();
        println!("{}", ended.stderr);
        let rows = rows(&log);
        let operating = rows.iter().filter(|row| row.al == 8).count();
        let fresh = rows.iter().filter(|row| row.al == 8 && row.fresh).count();
        println!("{operating} SYNC0 in operation, {fresh} with fresh outputs");
        assert!(operating > 50 && fresh * 10 > operating * 9);
        for row in &rows {
            assert!((row.end - row.start).abs() <= 600, "no way of a cycle is longer than 600 kHz allow");
        }
        let last = rows.iter().rev().find(|row| row.al == 8).unwrap();
        assert_ne!(last.status & 0x6F, 0x27, "it is let go at the end");
    });
}

#[test]
fn a_wrong_drive_is_refused_before_anything_runs() {
    on_a_cable("a_wrong_drive_is_refused_before_anything_runs", || {
        let place = TestPlace::new();
        let scenario = scenario(&place);
        let wrong = [
            (&["--vendor", "2"][..], "vendor is 0x00000002, expected 0x00005356"),
            (&["--set", "6092:1=10000"], "0x6092:01 is 10000, expected 112500"),
            (&["--minimum-cycle", "2000000"], "0x1C32:05 is 2000000, expected at most 1000000"),
            (&["--refuse", "6085:0=08000000"], "0x6085:00"),
            (&["--devices", "2"], "2 devices on the bus, expected 1"),
        ];
        for (arguments, expected) in wrong {
            let drive = DriveProcess::start(&model(), arguments);
            let mut command = place.command("stepvalve");
            command.args(["run", "--instance", "wrong", "--out"]).arg(place.path("wrong")).arg(&scenario);
            let ended = Finished::from(command.output().unwrap()).expect_code(2);
            assert!(ended.stderr.contains(expected), "{arguments:?}: {}", ended.stderr);
            assert!(ended.stderr.contains(NEAR), "{}", ended.stderr);
            drive.end();
        }
    });
}

#[test]
fn a_scan_names_the_drive() {
    on_a_cable("a_scan_names_the_drive", || {
        let place = TestPlace::new();
        let drive = DriveProcess::start(&model(), &[]);
        let scan = place.stepvalve(&["bus", "scan", NEAR]).expect_code(0);
        drive.end();
        println!("{}", scan.stdout);
        assert!(scan.stdout.contains("SIM-STEPPER: vendor 0x00005356, product 0x00000402"));
        assert!(scan.stdout.contains("cyclic synchronous position: yes"));
        let proposal = scan.stdout.split_once("\n\n").unwrap().1;
        let file = place.write("proposed.toml", proposal);
        place.stepvalve(&["check", file.to_str().unwrap()]).expect_code(0);
    });
}
