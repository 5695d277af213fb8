//! A ride of a real-time instance on a simulated drive: its pulses are those of the run in one thread, and what a cycle of the
//! bridge costs.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use oracle::{Judge, Limits, Order, Wish};
use recording::{AnyMessage, read_record};
use signals::{ControllerState, PlantTruth, StepCommand};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::Duration;
use stepvalve_tests::{
    Finished, TestPlace, despite_stalls, drive_scenario, end_drive, end_instance, on_a_cable_in_real_time,
    payloads, repository, start_drive,
};
use subdevice::{SyncRow, read_log};
use test_needs::{skip_on_this_machine, skip_without};

/// Silence and lost frames are borne for so long, cycles: a busy test machine stalls.
const PATIENCE_CYCLES: u64 = 500;

/// Angles that are asked for, one after the other, rad.
const ANGLES_RAD: [f64; 5] = [0.3, 0.7, 0.05, 0.39, 0.384];

fn model() -> PathBuf {
    repository().join("rt-config/models/rig.toml")
}

/// With the three processes a third of the cycle apart, so that each may wake as late as the others.
fn scenario(place: &TestPlace) -> PathBuf {
    let phases = [("phase = \"400us\"", "phase = \"430us\""), ("phase = \"600us\"", "phase = \"760us\"")];
    drive_scenario(place, "simulated", PATIENCE_CYCLES, &phases)
}

/// Arms, asks for an angle each second for `seconds`, and lets go; what the instance said.
fn ride(place: &TestPlace, scenario: &Path, seconds: usize) -> Finished {
    let run = place.start_instance("bus", &["--json", "--record", "all"], scenario, &place.path("out"));
    place.arm_when_ready();
    for second in 0..seconds {
        let angle = format!("{}rad", ANGLES_RAD[second % ANGLES_RAD.len()]);
        place.wait_for("the set-point", || {
            let set = place.stepvalve(&["set", "angle", &angle]);
            if set.code != Some(0) {
                println!("{}", set.stderr.trim_end());
            }
            (set.code == Some(0)).then_some(())
        });
        sleep(Duration::from_secs(1));
    }
    place.stepvalve(&["disarm"]);
    end_instance(run, Signal::SIGTERM)
}

/// What a record says.
#[derive(Default)]
struct Recorded {
    /// The cycle of the first Reference to each set-point, with its target.
    set_points: BTreeMap<u64, (u64, f64)>,
    /// The pulses of each cycle (a simulated plant's).
    pulses: Vec<i64>,
    /// The first cycle at whose end the drive's count is another than before.
    first_moved: u64,
    commands: BTreeMap<u64, StepCommand>,
    /// Cycles in which the controller's state became another.
    states: Vec<(u64, u64)>,
}

fn recorded(record: &Path) -> Recorded {
    let mut all = Recorded::default();
    let mut before = None;
    read_record(&[record], |message| match message {
        AnyMessage::Reference(m) if m.body.set_point_id > 0 => {
            let first = (m.header.cycle, m.body.target_angle_rad);
            all.set_points.entry(m.body.set_point_id).or_insert(first);
        }
        AnyMessage::PlantTruth(m) => all.pulses.push(m.body.pulses),
        AnyMessage::StepCommand(m) => _ = all.commands.insert(m.header.cycle, m.body),
        AnyMessage::ControlStatus(m) if all.states.last().is_none_or(|last| last.1 != m.body.state) => {
            all.states.push((m.header.cycle, m.body.state));
        }
        AnyMessage::Feedback(m) => {
            let moved = before.replace(m.body.accepted_microsteps) != Some(m.body.accepted_microsteps);
            if moved && all.first_moved == 0 && !all.set_points.is_empty() {
                all.first_moved = m.header.cycle;
            }
        }
        _ => {}
    })
    .unwrap();
    all
}

/// The scenario without the drive, with those set-points in the same cycles.
fn in_one_thread(place: &TestPlace, scenario: &Path, recorded: &Recorded) -> Vec<i64> {
    let text = std::fs::read_to_string(scenario).unwrap();
    let (before, after) = text.split_once("[drive]").unwrap();
    let after = &after[after.find("\n[").unwrap()..];
    let first = recorded.set_points.values().next().unwrap().0;
    let last = recorded.set_points.values().last().unwrap().0;
    let seconds = (last - first) / 1000 + 3;
    let mut text = format!("{before}{after}").replace("\"5s\"", &format!("\"{seconds}s\""));
    for (cycle, angle_rad) in recorded.set_points.values() {
        let time_ms = 100 + cycle - first;
        write!(text, "\n[[set_point]]\ntime = \"{time_ms}ms\"\nangle = {angle_rad:?}\n").unwrap();
    }
    let scenario = place.write("in-process.toml", &text);
    place.simulate(&scenario, "in-process", "alone").expect_code(0);
    self::recorded(&place.path("alone/run-0001.mcap")).pulses
}

/// The rows of the drive's log from the first motion on; `None` where it never moved.
fn in_motion(rows: &[SyncRow]) -> Option<&[SyncRow]> {
    let first = rows.iter().position(|row| row.al == 8 && row.start != row.end)?;
    rows.get(first..)
}

/// Cycles from the first motion on that the drive moved as the plant in one thread does, up to the first cycle that the machine
/// did not keep.
fn cycles_alike(place: &TestPlace, rows: &[SyncRow], scenario: &Path, run: &Recorded) -> usize {
    let late = payloads(&place.path("out/run-0001.mcap")).late_cycles;
    let kept = late.range(run.first_moved.saturating_sub(5)..).next().map_or(u64::MAX, |first| *first);
    let kept = kept.saturating_sub(run.first_moved) as usize;
    let alone = in_one_thread(place, scenario, run);
    let alone = &alone[alone.iter().position(|pulses| *pulses != 0).unwrap()..];
    let rows = in_motion(rows).unwrap();
    // A command that was late shows from the next SYNC0 on.
    let fresh = rows.iter().position(|row| !row.fresh).unwrap_or(rows.len());
    // The scenario in one thread ends two seconds after the last set-point came.
    let cycles = kept.min(fresh).min(alone.len());
    println!(
        "{cycles} cycles: first late {kept}, first SYNC0 without fresh outputs {fresh}, of {}",
        rows.len()
    );
    let pulses: Vec<i64> = rows[..cycles].iter().map(|row| row.end - row.start).collect();
    assert_eq!(pulses, alone[..cycles]);
    cycles
}

/// The drive's pulses of the cycles that were kept, as a judge who shares no arithmetic with guard and controller sees them.
fn judged(run: &Recorded, rows: &[SyncRow], cycles: usize) {
    let mut judge = Judge::new(Limits {
        period_s: 1e-3,
        max_pulse_rate_hz: 600e3,
        max_pulse_acceleration_hz_per_s: 400e6,
        quick_stop_deceleration_hz_per_s: 10e6,
        silence_cycles: PATIENCE_CYCLES,
        command_delay_cycles: 1,
        arming_cycles: 2000,
        neutral_pulse_rate_hz: 0.0,
    });
    let mut armed = false;
    for (cycle, state) in &run.states {
        let wish = match ControllerState::from_code(*state).unwrap() {
            ControllerState::Arming if !armed => Wish::Move,
            ControllerState::QuickStop | ControllerState::Disarmed if armed => Wish::Stop,
            _ => continue,
        };
        armed = wish == Wish::Move;
        judge.order(Order { wish, from_cycle: *cycle, until_cycle: *cycle });
    }
    let end = run.first_moved + cycles as u64;
    run.commands.range(..end).for_each(|(cycle, command)| judge.command(*cycle, command));
    // The first row in motion is that of the cycle before Feedback tells of it.
    let rows = in_motion(rows).unwrap();
    for (row, cycle) in rows[..cycles].iter().zip(run.first_moved..) {
        let pulses = row.end - row.start;
        // At a constant rate each comes half-way between two micro-steps.
        let half_ns = 500_000 / pulses.unsigned_abs().max(1);
        let (first_pulse_ns, last_pulse_ns) =
            if pulses == 0 { (0, 0) } else { (half_ns, 1_000_000 - half_ns) };
        judge.truth(cycle, &PlantTruth { pulses, first_pulse_ns, last_pulse_ns, ..PlantTruth::default() });
    }
    let verdict = judge.verdict();
    assert_eq!(verdict.findings, []);
    assert!(verdict.moving_cycles > 0 || cycles == 0, "{verdict:?}");
}

/// iceoryx2 allocates once for each message that the bridge sends; nothing else allocates or faults once the bus operates.
fn quiet_cycle(ended: &Finished) {
    if ended.stderr.contains("not in operation any more") {
        // A machine that stalled for half a second: the bus was brought up again, which allocates.
        return;
    }
    let summary = ended.summary();
    let bridge = &summary["processes"]["plant-simulator"];
    let count = |key: &str| bridge[key].as_u64().unwrap();
    assert!(count("steady_cycles") > 100, "{bridge}");
    assert_eq!(count("steady_allocations"), count("steady_published"), "{bridge}");
    if bridge["scheduling"]["memory_locked"] == true {
        assert_eq!(bridge["steady_page_faults"]["minor"], 0, "{bridge}");
        assert_eq!(bridge["steady_page_faults"]["major"], 0, "{bridge}");
    } else {
        skip_on_this_machine("no right to lock memory, so the bridge may have page faults");
    }
}

/// Up to the first cycle that the machine did not keep; `STEPVALVE_DRIVE_SECONDS` rides longer, and wants a whole ride.
#[test]
fn the_drives_pulses_are_those_of_the_run_in_one_thread() {
    on_a_cable_in_real_time("the_drives_pulses_are_those_of_the_run_in_one_thread", || {
        let asked = std::env::var("STEPVALVE_DRIVE_SECONDS").ok().map(|text| text.parse().unwrap());
        let seconds: usize = asked.unwrap_or(3);
        let enough = asked.map_or(100, |seconds| 1000 * seconds);
        let mut best = 0;
        for attempt in 0..20 {
            let place = TestPlace::new();
            let scenario = scenario(&place);
            let log = place.path("drive.csv");
            let drive = start_drive(&model(), &["--log", log.to_str().unwrap()]);
            let ended = ride(&place, &scenario, seconds);
            end_drive(drive);
            quiet_cycle(&ended);
            let rows = read_log(&log).unwrap();
            let run = recorded(&place.path("out/run-0001.mcap"));
            let cycles = cycles_alike(&place, &rows, &scenario, &run);
            judged(&run, &rows, cycles);
            println!(
                "attempt {attempt}: {cycles} cycles alike; exit code {:?}\n{}",
                ended.code, ended.stderr
            );
            best = best.max(cycles);
            if best >= enough {
                return;
            }
        }
        panic!("the best of 20 rides was the same for {best} cycles, expected {enough}");
    });
}

/// What a cycle of the bridge may call.
const CALLS: [&str; 4] = ["clock_nanosleep", "sendto", "ppoll", "recvfrom"];

/// The system calls of a trace, by name; without the first and the last, in which the tracer came and went.
fn calls(trace: &Path) -> BTreeMap<String, usize> {
    let text = std::fs::read_to_string(trace).unwrap();
    let names: Vec<&str> =
        text.lines().filter_map(|line| line.split_once('(')).map(|(name, _)| name).collect();
    let mut counts = BTreeMap::new();
    for name in names.get(1..names.len().saturating_sub(1)).unwrap_or_default() {
        *counts.entry((*name).to_owned()).or_insert(0) += 1;
    }
    counts
}

#[test]
fn a_cycle_of_the_bridge_makes_four_system_calls() {
    if Command::new("strace").arg("--version").output().is_err() {
        return skip_without("strace");
    }
    on_a_cable_in_real_time("a_cycle_of_the_bridge_makes_four_system_calls", || {
        despite_stalls(|place| {
            let scenario = scenario(place);
            let drive = start_drive(&model(), &[]);
            let run = place.start_instance("bus", &["--json"], &scenario, &place.path("out"));
            place.wait_for("operation", || (place.status()?["bus"]["phase"] == "in operation").then_some(()));
            // Its first 50 cycles in operation are not its steady ones.
            sleep(Duration::from_millis(200));
            // The one thread of the cycle, and nothing else: on some machines a call takes 0.1 ms under the tracer.
            let bridge = place.child_of(run.id(), "valve-bridge").expect("the bridge");
            let trace = place.path("trace");
            let mut strace = Command::new("strace");
            strace.arg("-o").arg(&trace).args(["-p", &bridge.to_string()]);
            let mut strace = strace.stderr(std::process::Stdio::null()).spawn().unwrap();
            sleep(Duration::from_secs(2));
            kill(Pid::from_raw(strace.id().cast_signed()), Signal::SIGINT).unwrap();
            strace.wait().unwrap();
            let ended = end_instance(run, Signal::SIGTERM);
            end_drive(drive);
            println!("{}", ended.stderr);
            let counts = calls(&trace);
            println!("{counts:?}");
            let count = |name: &str| counts.get(name).copied().unwrap_or(0);
            let cycles = count("clock_nanosleep");
            assert!(cycles > 300, "{counts:?}");
            assert!(counts.keys().all(|name| CALLS.contains(&name.as_str())), "{counts:?}");
            assert!(count("sendto").abs_diff(cycles) <= 1, "one frame a cycle: {counts:?}");
            // A reply that the tracer made late is read in a later cycle, with a wait more.
            assert!(count("ppoll") >= cycles - 1 && count("recvfrom") <= count("ppoll"), "{counts:?}");
            let late = count("ppoll").saturating_sub(cycles);
            assert!(late * 20 < cycles, "{counts:?}");
        });
    });
}
