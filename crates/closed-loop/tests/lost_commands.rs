//! Commands that are lost between controller and drive: the valve stays where it is wanted, or the controller knows.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use closed_loop::{InProcess, Parts, Wire, wire};
use config::{Damping, parse_model, parse_scenario};
use signals::{FaultCode, StepCommand};
use std::collections::VecDeque;

fn parts(scenario: &str, encoder: bool, loop_delay_cycles: u64) -> Parts {
    let read = |path: String| std::fs::read_to_string(path).unwrap();
    let root = format!("{}/../../rt-config", env!("CARGO_MANIFEST_DIR"));
    let mut scenario = parse_scenario(&read(format!("{root}/scenarios/{scenario}")), scenario).unwrap();
    scenario.loop_delay_cycles = loop_delay_cycles;
    if !encoder {
        scenario.encoder.fitted = false;
        scenario.control.observer = false;
        scenario.control.damping = Damping::None;
    }
    let model = parse_model(&read(format!("{root}/models/rig.toml")), "rig.toml").unwrap();
    wire(&scenario, &model, &model).unwrap()
}

/// From cycle `first` on, of each `lost + kept` commands the first `lost` don't arrive.
#[derive(Debug, Clone, Copy)]
struct Losing {
    first: u64,
    lost: u64,
    kept: u64,
}

impl Wire for Losing {
    fn command(&mut self, cycle: u64, body: StepCommand) -> Option<StepCommand> {
        let since = cycle.checked_sub(self.first);
        let lost = since.is_some_and(|since| since % (self.lost + self.kept) < self.lost);
        (!lost).then_some(body)
    }
}

#[derive(Debug)]
struct Found {
    fault: FaultCode,
    lost_teeth: u64,
    /// Largest distance of the spool from the reference, and at the end of the scenario, rad.
    peak_rad: f64,
    last_rad: f64,
}

fn run(parts: &Parts, losing: Losing) -> Found {
    let mut run = InProcess::over(parts, losing);
    let mut found = Found { fault: FaultCode::None, lost_teeth: 0, peak_rad: 0.0, last_rad: 0.0 };
    // Reference k was sent in cycle k − 2.
    let mut references = VecDeque::from([None, None]);
    while let Some(outputs) = run.cycle() {
        let (plant, reference) = (outputs.plant.unwrap(), outputs.reference.unwrap());
        references.push_back(Some(reference.angle_rad));
        let wanted = references.pop_front().flatten();
        let status = outputs.controller.unwrap().status;
        if found.fault == FaultCode::None {
            found.fault = FaultCode::from_code(status.fault).unwrap();
        }
        found.lost_teeth = found.lost_teeth.max(plant.truth.lost_teeth.unsigned_abs());
        if let Some(wanted_rad) = wanted.filter(|_| outputs.cycle < parts.timeline.disarm_cycle) {
            found.last_rad = (wanted_rad - plant.truth.angle_rad).abs();
            found.peak_rad = found.peak_rad.max(found.last_rad);
        }
    }
    found
}

const SCENARIOS: [&str; 4] =
    ["step-sequence.toml", "rotation-200khz.toml", "sine-1hz.toml", "flow-steps.toml"];

/// The first commands lost: on a cycle of each pattern at rest and in motion.
const FIRST: [u64; 3] = [100, 101, 102];

fn all(patterns: &[(u64, u64)]) -> Vec<(String, bool, Found)> {
    let mut found = Vec::new();
    for scenario in SCENARIOS {
        for (encoder, delay) in [(true, 1), (false, 1), (true, 2), (false, 2)] {
            let parts = parts(scenario, encoder, delay);
            for &(lost, kept) in patterns {
                for first in FIRST {
                    let losing = Losing { first, lost, kept };
                    let name = format!("{scenario}, encoder {encoder}, delay {delay}, {losing:?}");
                    found.push((name, encoder, run(&parts, losing)));
                }
            }
        }
    }
    found
}

/// A machine takes two cycles without a command; the third one in a row stops the valve.
#[test]
fn two_of_three_commands_lost_cost_milliradians_and_no_step() {
    for (name, encoder, found) in all(&[(1, 3), (1, 1), (2, 1)]) {
        assert_eq!((found.fault, found.lost_teeth), (FaultCode::None, 0), "{name}: {found:?}");
        // The drive goes on at the last rate: what the reference accelerates in three cycles is missing, and the resonance rings
        // with it where nothing damps it.
        let most_rad = if encoder { 0.02 } else { 0.006 };
        assert!(found.peak_rad < most_rad, "{name}: {found:?}");
        assert!(found.last_rad < 4e-3, "{name}: {found:?}");
    }
}

#[test]
fn more_lost_commands_never_lose_a_step_without_a_fault() {
    for (name, _, found) in all(&[(3, 1), (5, 1), (10, 1)]) {
        assert!(found.lost_teeth == 0 || found.fault != FaultCode::None, "{name}: {found:?}");
    }
}

/// The load angle that the status tells is the one of the drive's command: what was sent and lost is no part of it.
#[test]
fn the_load_angle_is_counted_from_what_the_drive_accepted() {
    let parts = parts("rotation-200khz.toml", true, 1);
    let mut run = InProcess::over(&parts, Losing { first: 330, lost: 8, kept: 1 << 40 });
    let (mut seen, mut missed) = (0, 0);
    while let Some(outputs) = run.cycle() {
        let (plant, status) = (outputs.plant.unwrap(), outputs.controller.unwrap().status);
        if (320..360).contains(&outputs.cycle) {
            let truth_rad = 50.0 * (plant.truth.command_angle_rad - plant.truth.angle_rad);
            // Noise and counts of the encoder.
            assert!((status.load_angle_rad - truth_rad).abs() < 0.01, "{}: {status:?}", outputs.cycle);
            seen += 1;
        }
        missed = missed.max(status.missed_commands);
    }
    assert_eq!((seen, missed), (40, 8));
}
