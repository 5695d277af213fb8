//! A machine that stalls: all processes pass over whole cycles at once, and the valve keeps its steps.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use closed_loop::{ControllerRole, GeneratorRole, Parts, PlantRole, wire};
use config::{parse_model, parse_scenario};
use proptest::prelude::*;
use signals::{ControlStatus, FaultCode, StepCommand};
use std::collections::BTreeMap;

fn parts(scenario: &str) -> Parts {
    let read = |path: String| std::fs::read_to_string(path).unwrap();
    let root = format!("{}/../../rt-config", env!("CARGO_MANIFEST_DIR"));
    let scenario = parse_scenario(&read(format!("{root}/scenarios/{scenario}")), scenario).unwrap();
    let model = parse_model(&read(format!("{root}/models/rig.toml")), "rig.toml").unwrap();
    wire(&scenario, &model, &model).unwrap()
}

/// Runs the loop; in the cycles of a stall nobody runs. The statuses of the cycles that were run, and the steps lost.
fn run(parts: &Parts, stalls: &BTreeMap<u64, u64>) -> (Vec<ControlStatus>, u64) {
    let mut plant = PlantRole::new(parts.plant.clone());
    let mut generator = GeneratorRole::new(parts.generator.clone());
    let mut controller = ControllerRole::new(&parts.controller);
    let mut commands = BTreeMap::<u64, StepCommand>::new();
    let (mut statuses, mut lost) = (Vec::new(), 0);
    let (mut status, mut cycle) = (None, 0);
    while cycle <= parts.timeline.last_cycle {
        let stalled = stalls.get(&cycle).copied().unwrap_or(0);
        for passed in cycle..cycle + stalled {
            plant.advance(passed, commands.get(&passed));
        }
        cycle += stalled;
        let sample = plant.sample(cycle);
        let reference = generator.step(cycle, Some(&sample.feedback), status.as_ref(), None);
        let output = controller.step(cycle, Some(&sample.feedback), Some(&reference), None);
        plant.advance(cycle, commands.get(&cycle));
        commands.insert(cycle + 1, output.command);
        status = Some(output.status);
        statuses.push(output.status);
        lost = lost.max(sample.truth.lost_teeth.unsigned_abs());
        cycle += 1;
    }
    (statuses, lost)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Stalls of up to 20 ms while turning at 200 kHz and while holding; the scenario allows 50.
    #[test]
    fn no_step_is_lost_for_a_stall(stalls in prop::collection::btree_map(20_u64..4000, 1_u64..20, 1..8)) {
        let parts = parts("rotation-200khz.toml");
        let (statuses, lost) = run(&parts, &stalls);
        let fault = statuses.iter().map(|status| status.fault).find(|fault| *fault != FaultCode::None.code());
        prop_assert_eq!(fault, None, "fault {:?}", fault.and_then(FaultCode::from_code));
        prop_assert_eq!(lost, 0);
    }
}
