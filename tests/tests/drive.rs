//! A valve on a drive: all processes, with the simulated drive at the far end of an EtherCAT cable.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::fcntl::{FcntlArg, fcntl};
use nix::sys::signal::Signal;
use recording::{AnyMessage, read_record};
use serde_json::Value;
use signals::{BusPhase, BusStatus};
use std::path::{Path, PathBuf};
use std::process::Command;
use stepvalve_tests::{
    Finished, TestPlace, despite_stalls, drive_scenario, end_drive, end_instance, on_a_cable,
    patient_drive_scenario, repository, start_drive,
};
use subdevice::{NEAR, read_log};
use test_needs::skip_without;

fn model() -> PathBuf {
    repository().join("rt-config/models/rig.toml")
}

/// Arms as soon as the drive lets it, and turns to 17 degrees.
fn turn_to_17_degrees(place: &TestPlace) {
    turn_to_17_degrees_within(place, 2e-3);
}

/// Without an encoder the angle is the command's, which leads the spool by what friction takes: at most 0.39 degrees.
const LEAD_RAD: f64 = 7e-3;

fn turn_to_17_degrees_within(place: &TestPlace, within_rad: f64) {
    // Absolute set-points are refused until it is heard where the drive stands.
    place.arm_when_ready();
    place.wait_for("current", || (place.stepvalve(&["set", "angle", "17deg"]).code == Some(0)).then_some(()));
    place.wait_for("17 degrees", || {
        let angle = place.status()?["angle_rad"].as_f64()?;
        ((angle - 17_f64.to_radians()).abs() < within_rad).then_some(())
    });
}

#[test]
fn an_instance_turns_a_drive() {
    on_a_cable("an_instance_turns_a_drive", || {
        despite_stalls(|place| {
            let scenario = patient_drive_scenario(place);
            let log = place.path("drive.csv");
            let drive = start_drive(&model(), &["--log", log.to_str().unwrap(), "--drift", "20000"]);
            let run =
                place.start_instance("bus", &["--json", "--record", "all"], &scenario, &place.path("out"));
            turn_to_17_degrees(place);
            in_operation(&place.status().unwrap()["bus"]);
            let people = place.stepvalve(&["status"]).expect_code(0).stdout;
            assert!(people.contains("drive's bus      in operation, OP, working counter 3"), "{people}");
            assert!(people.contains("operation enabled (0x1237), mode 8"), "{people}");
            place.stepvalve(&["disarm"]).expect_code(0);
            let ended = end_instance(run, Signal::SIGTERM);
            end_drive(drive);
            println!("{}", ended.stderr);
            let rows = read_log(&log).unwrap();
            let operating = rows.iter().filter(|row| row.al == 8).count();
            let fresh = rows.iter().filter(|row| row.al == 8 && row.fresh).count();
            println!("{operating} SYNC0 in operation, {fresh} with fresh outputs");
            assert!(operating > 50 && fresh * 10 > operating * 9);
            for row in &rows {
                assert!((row.end - row.start).abs() <= 600, "no way of a cycle is longer than 600 kHz allow");
            }
            let last = rows.iter().rev().find(|row| row.al == 8).unwrap();
            assert_ne!(last.status & 0x6F, 0x27, "it is let go at the end");
            recorded_with_its_bus(place);
        });
    });
}

/// What `status` says of a bus that carries a drive in motion.
fn in_operation(bus: &Value) {
    assert_eq!((&bus["phase"], &bus["al_state"]), (&"in operation".into(), &"OP".into()), "{bus}");
    assert_eq!((&bus["drive_state"], &bus["mode"]), (&"operation enabled".into(), &8.into()), "{bus}");
    assert_eq!((&bus["working_counter"], &bus["bring_ups"]), (&3.into(), &2.into()), "{bus}");
    let round_trip_ns = bus["round_trip_ns"].as_u64().unwrap();
    assert!((1_000..400_000).contains(&round_trip_ns), "{bus}");
}

/// A terminal that was paused, or a journal that hangs, takes nothing more once its pipe is full.
#[test]
fn a_reader_of_stderr_that_stops_reading_stops_no_drive() {
    on_a_cable("a_reader_of_stderr_that_stops_reading_stops_no_drive", || {
        despite_stalls(|place| {
            let drive = start_drive(&model(), &[]);
            let run = place.start_instance("bus", &[], &patient_drive_scenario(place), &place.path("out"));
            fcntl(run.stderr.as_ref().unwrap(), FcntlArg::F_SETPIPE_SZ(4096)).unwrap();
            place.arm_when_ready();
            place.stepvalve(&["disarm"]).expect_code(0);
            for _ in 0..100 {
                let refused = place.stepvalve(&["set", "angle", "1deg"]);
                assert_ne!(refused.code, Some(0), "not armed");
            }
            end_drive(drive);
            let cycle = || place.status()?["processes"]["plant-simulator"]["cycle"].as_u64();
            place.wait_for("the bus's loss", || {
                (place.status()?["bus"]["phase"] != "in operation").then_some(())
            });
            let then = cycle().unwrap();
            place.wait_for("the bridge's next second", || (cycle()? > then + 1000).then_some(()));
            let ended = end_instance(run, Signal::SIGTERM);
            assert!(ended.stderr.contains("the drive is not in operation any more"), "{}", ended.stderr);
        });
    });
}

/// Each cycle's BusStatus is in the record, in run.h5, and on the page.
fn recorded_with_its_bus(place: &TestPlace) {
    let (record, run, page) = (place.path("out/run-0001.mcap"), place.path("run.h5"), place.path("run.html"));
    let mut all: Vec<BusStatus> = Vec::new();
    read_record(&[&record], |message| {
        if let AnyMessage::BusStatus(message) = message {
            all.push(message.body);
        }
    })
    .unwrap();
    let phases: Vec<u64> = all.iter().map(|bus| bus.phase).collect();
    for phase in [BusPhase::BringUp, BusPhase::Lock, BusPhase::Start, BusPhase::Operate] {
        assert!(phases.contains(&phase.code()), "{phase} is recorded");
    }
    let operating: Vec<_> = all.iter().filter(|bus| bus.phase == BusPhase::Operate.code()).collect();
    assert!(operating.iter().any(|bus| bus.drive_status & 0x6F == 0x27 && bus.mode == 8));
    let good = operating.iter().filter(|bus| (bus.working_counter, bus.al_status) == (3, 8)).count();
    assert!(good * 10 > operating.len() * 9, "{good} of {}", operating.len());
    place.stepvalve(&["convert", record.to_str().unwrap(), "--out", run.to_str().unwrap()]).expect_code(0);
    place.stepvalve(&["report", run.to_str().unwrap(), "--out", page.to_str().unwrap()]).expect_code(0);
    let file = hdf5::File::open(run).unwrap();
    let column =
        |name: &str| file.dataset(&format!("runs/closed-loop/{name}")).unwrap().read_raw::<f64>().unwrap();
    let trips: Vec<f64> = column("bus_round_trip").into_iter().filter(|trip| *trip > 0.0).collect();
    assert!(trips.len() > 100, "{}", trips.len());
    let page = std::fs::read_to_string(page).unwrap();
    for words in ["Drive's bus", "AL state", "drive state", "operation enabled"] {
        let escaped = words.replace('\'', "&#39;");
        assert!(page.contains(words) || page.contains(&escaped), "{words}");
    }
}

/// Arguments of a drive that is another one than the drive file's, and what is said of it.
const WRONG: [(&[&str], &str); 15] = [
    (&["--vendor", "2"], "vendor is 0x00000002, expected 0x00005356"),
    (&["--product", "7"], "product is 0x00000007, expected 0x00000402"),
    (&["--revision", "1"], "revision is 0x00000001, expected 0x00010000 or later"),
    (&["--empty-sii"], "vendor is 0xffffffff, expected 0x00005356"),
    (&["--devices", "2"], "2 devices on the bus, expected 1"),
    (&["--devices", "0"], "0 devices on the bus, expected 1"),
    (&["--refuse", "6085:0=08000000"], "0x6085:00"),
    (&["--without", "60C2:1"], "0x60C2:01"),
    (&["--set", "1600:2=1617166368", "--stubborn", "1600:2"], "0x1600:02 is 1617166368, expected 1618608160"),
    (&["--stubborn", "1600:0"], "0x1600:00 is 4, expected 0"),
    (&["--stubborn", "1C13:0"], "0x1C13:00 is 1, expected 0"),
    (&["--set", "6502:0=805"], "0x6502:00 is 805, expected a value with the bits 0x80"),
    (&["--minimum-cycle", "2000000"], "0x1C32:05 is 2000000, expected at most 1000000"),
    (&["--set", "6092:1=10000"], "0x6092:01 is 10000, expected 112500"),
    (&["--set", "6091:2=5"], "0x6091:02 is 5, expected 1"),
];

/// The terminal has no encoder and one bit that says go; its driver always carries current.
#[test]
fn an_instance_turns_a_valve_through_a_pulse_train_terminal() {
    on_a_cable("an_instance_turns_a_valve_through_a_pulse_train_terminal", || {
        despite_stalls(|place| {
            let changes = [("fitted = true", "fitted = false")];
            let scenario = drive_scenario(place, "el2522", 500, &changes);
            let log = place.path("drive.csv");
            let drive = start_drive(&model(), &["--log", log.to_str().unwrap(), "--pulse-train"]);
            let run = place.start_instance("bus", &["--json"], &scenario, &place.path("out"));
            turn_to_17_degrees_within(place, LEAD_RAD);
            let bus = place.status().unwrap()["bus"].clone();
            assert_eq!((&bus["al_state"], &bus["working_counter"]), (&"OP".into(), &3.into()), "{bus}");
            place.stepvalve(&["disarm"]).expect_code(0);
            println!("{}", end_instance(run, Signal::SIGTERM).stderr);
            end_drive(drive);
            let rows = read_log(&log).unwrap();
            let end = rows.iter().rev().find(|row| row.al == 8).unwrap().end;
            // Pulses of 0.0032 degrees.
            let wanted = (17.0_f64 / 360.0 * 112_500.0).round() as i64;
            assert!((end - wanted).abs() < 200, "{end} pulses, expected some {wanted}");
            assert!(rows.iter().all(|row| (row.end - row.start).abs() <= 600));
        });
    });
}

/// The drive's own homing makes the place where it stands the zero; the controller then aligns encoder and teeth.
#[test]
fn a_drive_finds_its_zero_when_ordered_to() {
    on_a_cable("a_drive_finds_its_zero_when_ordered_to", || {
        despite_stalls(|place| {
            let homing = "counts_per_turn = 112500\nabsolute = true\n\n[homing]\nbegins_homed = false\nmethod = \"absolute\"\n\
                          largest_spread = \"1deg\"\n";
            let scenario = drive_scenario(place, "simulated", 500, &[("counts_per_turn", homing)]);
            let file = std::fs::read_to_string(place.path("drive.toml")).unwrap();
            let (before, _) = file.split_once("[homing]").unwrap();
            place.write("drive.toml", &format!("{before}[homing]\nkind = \"drive\"\nmethod = 37\n"));
            let drive = start_drive(&model(), &["--zero-offset", "54321"]);
            let run = place.start_instance("bus", &["--json"], &scenario, &place.path("out"));
            place.wait_for("the drive", || (place.status()?["bus"]["phase"] == "in operation").then_some(()));
            let before = place.status().unwrap();
            assert_eq!(before["homed"], false, "{before}");
            assert!(
                (before["angle_rad"].as_f64().unwrap() - 54321.0 / 112_500.0 * std::f64::consts::TAU).abs()
                    < 0.2
            );
            let homed = place.stepvalve(&["home"]).expect_code(0);
            println!("{}", homed.stdout);
            let after = place.status().unwrap();
            assert_eq!((&after["homed"], &after["homing"]), (&true.into(), &"done".into()), "{after}");
            assert!(after["angle_rad"].as_f64().unwrap().abs() < 0.2, "{after}");
            turn_to_17_degrees(place);
            println!("{}", end_instance(run, Signal::SIGTERM).stderr);
            end_drive(drive);
        });
    });
}

#[test]
fn a_wrong_drive_is_refused_before_anything_runs() {
    on_a_cable("a_wrong_drive_is_refused_before_anything_runs", || {
        for (arguments, expected) in WRONG {
            despite_stalls(|place| refused(place, arguments, expected));
        }
    });
}

fn refused(place: &TestPlace, arguments: &[&str], expected: &str) {
    let scenario = patient_drive_scenario(place);
    let drive = start_drive(&model(), arguments);
    let mut command = place.command("stepvalve");
    command.args(["run", "--instance", "wrong", "--out"]).arg(place.path("wrong")).arg(&scenario);
    let ended = Finished::from(command.output().unwrap());
    end_drive(drive);
    println!("{arguments:?}: {}", ended.stderr.trim_end());
    let ended = ended.expect_code(2);
    assert!(ended.stderr.contains(expected), "{arguments:?}: {}", ended.stderr);
    assert!(ended.stderr.contains("expected"), "{arguments:?}: {}", ended.stderr);
    assert!(ended.stderr.contains(NEAR), "{}", ended.stderr);
}

#[test]
fn a_scan_names_the_drive() {
    on_a_cable("a_scan_names_the_drive", || {
        let place = TestPlace::new();
        let drive = start_drive(&model(), &[]);
        let scan = place.stepvalve(&["bus", "scan", NEAR]).expect_code(0);
        end_drive(drive);
        println!("{}", scan.stdout);
        assert!(scan.stdout.contains("SIM-STEPPER: vendor 0x00005356, product 0x00000402"));
        assert!(scan.stdout.contains("cyclic synchronous position: yes"));
        let file = check_proposal(&place, &scan.stdout);
        assert!(!file.contains("absent"), "{file}");
    });
}

/// The drive file that a scan proposes, which `check` takes.
fn check_proposal(place: &TestPlace, scanned: &str) -> String {
    let proposal = scanned.split_once("\n\n").unwrap().1;
    let file = place.write("proposed.toml", proposal);
    place.stepvalve(&["check", file.to_str().unwrap()]).expect_code(0);
    proposal.to_owned()
}

#[test]
fn a_scan_lists_what_the_drive_lacks() {
    on_a_cable("a_scan_lists_what_the_drive_lacks", || {
        let place = TestPlace::new();
        // No such object, no such subindex; what can't be read now is there.
        let refused =
            ["6007:0=06020000", "10F1:2=06090011", "60FD:0=06020000", "6502:0=06020000", "6085:0=08000000"];
        let arguments: Vec<_> = refused.iter().flat_map(|refused| ["--refuse", refused]).collect();
        let drive = start_drive(&model(), &arguments);
        let scan = place.stepvalve(&["bus", "scan", NEAR]).expect_code(0);
        end_drive(drive);
        let file = check_proposal(&place, &scan.stdout);
        assert!(file.contains("\nabsent = [\"0x60FD:00\"]\n"), "frames can do without it: {file}");
        assert!(
            file.contains("\n# absent = [\"0x10F1:02\", \"0x6007:00\", \"0x60FD:00\", \"0x6502:00\"]\n"),
            "{file}"
        );
        assert!(scan.stdout.contains("does not say which modes it has"), "{}", scan.stdout);
    });
}

/// What tshark prints of some fields of a capture's frames, a line each.
fn tshark(capture: &Path, filter: &str, fields: &[&str]) -> String {
    let mut command = Command::new("tshark");
    command.args(["-r"]).arg(capture).args(["-Y", filter, "-T", "fields"]);
    fields.iter().for_each(|field| _ = command.args(["-e", field]));
    Finished::from(command.output().unwrap()).expect_code(0).stdout
}

/// Bring-up, motion and end of an instance, captured beside it, and read by Wireshark's dissectors.
#[test]
fn wireshark_finds_no_malformed_frame_in_a_capture() {
    if Command::new("tshark").arg("--version").output().is_err() {
        return skip_without("tshark");
    }
    on_a_cable("wireshark_finds_no_malformed_frame_in_a_capture", || {
        despite_stalls(|place| {
            let scenario = patient_drive_scenario(place);
            let file = place.path("bus.pcapng");
            let mut command = place.command("stepvalve");
            command.args(["bus", "capture", NEAR, "--out"]).arg(&file);
            let capture = command.stdout(std::process::Stdio::piped()).spawn().unwrap();
            place.wait_for("the capture", || file.exists().then_some(()));
            let drive = start_drive(&model(), &[]);
            let run = place.start_instance("bus", &["--json"], &scenario, &place.path("out"));
            turn_to_17_degrees(place);
            // That alone takes about a second, which is about the thousand cycles that are counted below.
            std::thread::sleep(std::time::Duration::from_secs(1));
            end_instance(run, Signal::SIGTERM);
            end_drive(drive);
            let said = end_instance(capture, Signal::SIGINT).expect_code(0).stdout;
            println!("{}", said.trim_end());
            let all = tshark(&file, "ecat", &["frame.number", "eth.src"]);
            let (outgoing, incoming): (Vec<&str>, Vec<&str>) =
                all.lines().partition(|line| line.ends_with("10:10:10:10:10:10"));
            println!("{} frames of ours, {} replies", outgoing.len(), incoming.len());
            assert!(outgoing.len() > 1000 && incoming.len() > 1000);
            assert_eq!(
                tshark(
                    &file,
                    "_ws.malformed || _ws.short || _ws.lua.error",
                    &["frame.number", "_ws.expert.message"]
                ),
                ""
            );
            // The dissectors see what we mean: the commands of a cycle's frame, and CoE in the mailboxes.
            let cycle = tshark(&file, "ecat.cmd == 14 && ecat.cmd == 12 && ecat.cmd == 4", &["frame.number"]);
            assert!(cycle.lines().count() > 1000, "{}", cycle.lines().count());
            assert!(tshark(&file, "ecat_mailbox.coe", &["frame.number"]).lines().count() > 50);
        });
    });
}
