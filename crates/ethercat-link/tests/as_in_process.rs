//! The whole loop over the bus moves the drive as the loop in one thread moves the simulated plant: pulse for pulse.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use closed_loop::{ControllerRole, InProcess, Parts, TrajectoryRole, wire};
use common::{Rig, drive_file, off, valve};
use config::{Scenario, parse_model, parse_scenario};
use oracle::{Judge, Limits, Order, Wish};
use signals::{Feedback, PlantTruth, StepCommand, validity};
use subdevice::{Device, Settings, SyncRow};

/// What the drive and the simulated plant are asked for: the shipped scenario of a drive, for a minute.
fn scenario() -> Scenario {
    const SECONDS: u64 = 60;
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../rt-config/scenarios/drive.toml");
    let text = std::fs::read_to_string(path).unwrap().replace("\"5s\"", &format!("\"{SECONDS}s\""));
    let points = (0..SECONDS / 2).map(|place| {
        let angle = ["17deg", "40deg", "-3deg", "22.32deg", "22deg"][place as usize % 5];
        format!("[[set_point]]\ntime = \"{}s\"\nangle = \"{angle}\"\n", 2 * place + 1)
    });
    let scenario = parse_scenario(&(text + &points.collect::<String>()), path).unwrap();
    assert_eq!((scenario.duration_s, scenario.loop_delay_cycles), (SECONDS as f64, 2));
    scenario
}

fn parts(scenario: &Scenario) -> Parts {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../rt-config/models/rig.toml");
    let model = parse_model(&std::fs::read_to_string(path).unwrap(), path).unwrap();
    wire(scenario, &model, &model).unwrap()
}

/// A run by cycles: what each Feedback says of the encoder, and each cycle's motion.
#[derive(Default)]
struct Run {
    counts: Vec<i64>,
    ways: Vec<i64>,
    commands: Vec<(u64, StepCommand)>,
}

impl Run {
    /// From the first cycle with a motion on, so long.
    fn motion(&self, cycles: usize) -> (&[i64], &[i64]) {
        let first = self.ways.iter().position(|way| *way != 0).unwrap();
        (&self.ways[first..first + cycles], &self.counts[first..first + cycles])
    }
}

fn in_one_thread(parts: &Parts) -> Run {
    let mut run = Run::default();
    let mut before = 0;
    for cycle in InProcess::new(parts) {
        let feedback = cycle.plant.feedback;
        if cycle.cycle > 0 {
            run.ways.push(feedback.accepted_microsteps - before);
        }
        before = feedback.accepted_microsteps;
        run.counts.push(feedback.encoder_counts);
    }
    run
}

/// The roles of trajectory and controller beside a bridge, whose drive is at the other end of a cable in memory.
fn over_the_bus(parts: &Parts) -> (Run, Vec<(i64, SyncRow)>) {
    let params = common::params(drive_file(), parts.plant.drive);
    let mut rig = Rig::over(vec![Device::new(Settings::default(), valve(), 1_000)], params);
    rig.operate(Some(&off()));
    rig.begin_anew();
    rig.rows();
    let mut trajectory = TrajectoryRole::new(parts.trajectory.clone());
    let mut controller = ControllerRole::new(&parts.controller);
    let (mut status, mut command) = (None, None::<StepCommand>);
    let mut run = Run::default();
    for cycle in 0..=parts.timeline.last_cycle {
        let feedback: Feedback = rig.step(command.as_ref(), false).unwrap();
        assert_eq!(feedback.drive_fault, 0, "cycle {cycle}");
        assert_eq!(feedback.validity & validity::STOPPED_ITSELF, 0, "cycle {cycle}");
        run.counts.push(feedback.encoder_counts);
        run.commands.extend(command.map(|command| (cycle, command)));
        let reference = trajectory.step(cycle, Some(&feedback), status.as_ref(), None);
        let output = controller.step(cycle, Some(&feedback), Some(&reference), None);
        (status, command) = (Some(output.status), Some(output.command));
    }
    let rows = rig.rows();
    assert!(rows.iter().all(|row| row.fresh), "every SYNC0 finds fresh outputs");
    let rows: Vec<_> = rows.into_iter().map(|row| (rig.cycle_of(&row), row)).collect();
    run.ways = rows.iter().map(|(_, row)| row.end - row.start).collect();
    (run, rows)
}

/// The drive's own pulses, as a judge who shares no arithmetic with guard and controller sees them.
fn judged(scenario: &Scenario, parts: &Parts, commands: &[(u64, StepCommand)], rows: &[(i64, SyncRow)]) {
    let mut judge = Judge::new(Limits {
        period_s: 1e-3,
        max_pulse_rate_hz: scenario.driver.max_pulse_rate_hz,
        max_pulse_acceleration_hz_per_s: scenario.driver.max_pulse_acceleration_hz_per_s,
        quick_stop_deceleration_hz_per_s: scenario.driver.quick_stop_deceleration_hz_per_s,
        silence_cycles: scenario.safety.silence_cycles,
        command_delay_cycles: 1,
        arming_cycles: 2000,
        neutral_pulse_rate_hz: 0.0,
    });
    for (wish, cycle) in [(Wish::Move, parts.timeline.arm_cycle), (Wish::Stop, parts.timeline.disarm_cycle)] {
        judge.order(Order { wish, from_cycle: cycle, until_cycle: cycle });
    }
    for (cycle, command) in commands {
        judge.command(*cycle, command);
    }
    for (cycle, row) in rows {
        let pulses = row.end - row.start;
        // At a constant rate each comes half-way between two micro-steps.
        let half_ns = 500_000 / pulses.unsigned_abs().max(1);
        let (first_pulse_ns, last_pulse_ns) =
            if pulses == 0 { (0, 0) } else { (half_ns, 1_000_000 - half_ns) };
        let truth = PlantTruth { pulses, first_pulse_ns, last_pulse_ns, ..PlantTruth::default() };
        // Told at the end of its cycle.
        judge.truth(u64::try_from(cycle + 1).unwrap(), &truth);
    }
    let verdict = judge.verdict();
    assert_eq!(verdict.findings, []);
    assert!(verdict.moving_cycles > 1000, "{verdict:?}");
}

#[test]
fn a_minute_over_the_bus_is_the_minute_in_one_thread() {
    let scenario = scenario();
    let parts = parts(&scenario);
    let alone = in_one_thread(&parts);
    let (bus, rows) = over_the_bus(&parts);
    // The set-points come a second after arming; the drive needs a few cycles more until it carries current.
    let cycles = 58_500;
    assert_eq!(alone.motion(cycles), bus.motion(cycles));
    let pulses: i64 = alone.ways.iter().map(|way| way.abs()).sum();
    println!("{cycles} cycles with {pulses} pulses are the same");
    judged(&scenario, &parts, &bus.commands, &rows);
}
