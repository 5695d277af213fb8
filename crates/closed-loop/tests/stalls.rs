//! A machine that stalls: processes pass over cycles, all at once or one alone, and the valve keeps its steps.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use closed_loop::{InProcess, Parts, Presence, Wire, wire};
use config::{Damping, parse_model, parse_scenario};
use proptest::prelude::*;
use signals::{FaultCode, Source};

/// What differs from a scenario as it is shipped.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Variant {
    Shipped,
    Shaped,
    TwoCyclesOfDelay,
    WithoutEncoder,
}

fn parts(scenario: &str, variant: Variant) -> Parts {
    let read = |path: String| std::fs::read_to_string(path).unwrap();
    let root = format!("{}/../../rt-config", env!("CARGO_MANIFEST_DIR"));
    let mut scenario = parse_scenario(&read(format!("{root}/scenarios/{scenario}")), scenario).unwrap();
    match variant {
        Variant::Shipped => {}
        Variant::Shaped => scenario.control.damping = Damping::Shaping,
        Variant::TwoCyclesOfDelay => scenario.loop_delay_cycles = 2,
        Variant::WithoutEncoder => {
            scenario.encoder.fitted = false;
            scenario.control.observer = false;
            scenario.control.damping = Damping::None;
        }
    }
    let model = parse_model(&read(format!("{root}/models/rig.toml")), "rig.toml").unwrap();
    wire(&scenario, &model, &model).unwrap()
}

/// From cycle `first` on: cycles that run, then cycles that are passed over, again and again.
#[derive(Debug, Clone)]
struct Stalls {
    first: u64,
    runs_and_stalls: Vec<(u64, u64)>,
    /// Who stalls, and how many cycles later than the others: processes wake one after another.
    sources: &'static [(Source, u64)],
}

impl Wire for Stalls {
    fn presence(&self, source: Source, cycle: u64) -> Presence {
        let Some((_, late)) = self.sources.iter().find(|(stalling, _)| *stalling == source) else {
            return Presence::Runs;
        };
        let mut begin = self.first + late;
        let stalled = self.runs_and_stalls.iter().any(|(runs, stall)| {
            let from = begin + runs;
            begin = from + stall;
            (from..begin).contains(&cycle)
        });
        if stalled { Presence::PassedOver } else { Presence::Runs }
    }
}

/// The first fault and the most teeth lost. Where one stall follows another while the valve brakes, the drive goes on at the
/// last rate until it is beyond the limits of angle, and stops there by itself: that is no fault of the controller's.
fn run(parts: &Parts, stalls: Stalls) -> (FaultCode, u64) {
    let mut run = InProcess::over(parts, stalls);
    let (mut fault, mut lost) = (FaultCode::None, 0);
    while let Some(outputs) = run.cycle() {
        let stopped_itself =
            outputs.plant.is_some_and(|plant| plant.feedback.drive_fault == FaultCode::AngleLimit.code());
        if stopped_itself && fault == FaultCode::None {
            return (fault, lost);
        }
        if let Some(output) = outputs.controller.filter(|_| fault == FaultCode::None) {
            fault = FaultCode::from_code(output.status.fault).unwrap();
        }
        lost = outputs.plant.map_or(lost, |plant| lost.max(plant.truth.lost_teeth.unsigned_abs()));
    }
    (fault, lost)
}

const PLANT: (Source, u64) = (Source::Plant, 0);
const TRAJECTORY: (Source, u64) = (Source::Trajectory, 0);
const CONTROLLER: (Source, u64) = (Source::Controller, 0);
const MACHINE: &[(Source, u64)] = &[PLANT, TRAJECTORY, CONTROLLER];
const WHO: [&[(Source, u64)]; 7] = [
    MACHINE,
    &[PLANT, (Source::Trajectory, 1), CONTROLLER],
    &[PLANT, TRAJECTORY, (Source::Controller, 1)],
    &[TRAJECTORY],
    &[CONTROLLER],
    &[TRAJECTORY, CONTROLLER],
    &[PLANT],
];
const VARIANTS: [Variant; 4] =
    [Variant::Shipped, Variant::Shaped, Variant::TwoCyclesOfDelay, Variant::WithoutEncoder];

/// Scenarios, and the cycles in which their valve begins to move, turns back or stops.
const SCENARIOS: [(&str, &[u64]); 3] = [
    ("rotation-200khz.toml", &[310, 4310]),
    ("step-sequence.toml", &[210, 1010, 1810, 2610, 2690]),
    ("flow-steps.toml", &[210, 1010]),
];

/// Stalls of up to 20 ms, some far from each other and some with a single cycle between them; the scenarios allow 50.
fn stalls() -> impl Strategy<Value = (&'static str, Stalls)> {
    let dense = prop::collection::vec((1_u64..20, 1_u64..20), 1..8);
    let sparse = prop::collection::vec((1_u64..600, 1_u64..20), 1..8);
    let runs_and_stalls = prop_oneof![3 => dense, 1 => sparse];
    let place = prop::sample::select(SCENARIOS.to_vec())
        .prop_flat_map(|(name, moves)| (Just(name), prop::sample::select(moves.to_vec())));
    (place, 0_u64..50, runs_and_stalls, prop::sample::select(WHO.to_vec())).prop_map(
        |((name, moves), before, runs_and_stalls, sources)| {
            (name, Stalls { first: moves - before, runs_and_stalls, sources })
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]

    #[test]
    fn no_step_is_lost_for_stalls((scenario, stalls) in stalls(), variant in prop::sample::select(&VARIANTS[..])) {
        let (fault, lost) = run(&parts(scenario, variant), stalls);
        prop_assert_eq!((fault, lost), (FaultCode::None, 0));
    }
}

/// The command catches up what it missed, and must not be caught by the next stall while it does.
#[test]
fn a_stall_after_a_single_cycle_finds_the_command_at_a_rate_that_can_be_held() {
    let stalls = Stalls { first: 322, runs_and_stalls: vec![(0, 11), (1, 4)], sources: MACHINE };
    assert_eq!(run(&parts("rotation-200khz.toml", Variant::Shipped), stalls), (FaultCode::None, 0));
}

/// A stall while the valve brakes: the drive goes on at the last rate, 4.6° too far, and comes back.
#[test]
fn a_stall_while_braking_is_no_fault() {
    for variant in VARIANTS {
        for stall in 1..20 {
            let stalls = Stalls { first: 2642, runs_and_stalls: vec![(0, stall)], sources: MACHINE };
            let found = run(&parts("step-sequence.toml", variant), stalls);
            assert_eq!(found, (FaultCode::None, 0), "{variant:?}, {stall} cycles");
        }
    }
}
