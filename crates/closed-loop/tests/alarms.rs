//! Alarms: an observer that makes the loop oscillate is slowed down; one at its limit is told; friction below the belief is
//! told, and less of it is fed. None is raised where the belief is right.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use closed_loop::{InProcess, Level, measure, wire, wire_level};
use config::{Scenario, parse_model, parse_scenario};
use signals::{alarm, limiting};
use valve_model::Model;

fn shipped(name: &str) -> (Scenario, Model) {
    let root = format!("{}/../../rt-config", env!("CARGO_MANIFEST_DIR"));
    let read = |path: &str| std::fs::read_to_string(format!("{root}/{path}")).unwrap();
    let scenario = parse_scenario(&read(&format!("scenarios/{name}")), name).unwrap();
    (scenario, parse_model(&read("models/rig.toml"), "rig.toml").unwrap())
}

const SCENARIOS: [&str; 5] = [
    "flow-steps.toml",
    "rotation-200khz.toml",
    "rotation-600khz.toml",
    "sine-1hz.toml",
    "step-sequence.toml",
];

fn with_inertia(belief: &Model, factor: f64) -> Model {
    let mut truth = belief.clone();
    truth.motor.as_mut().unwrap().rotor_inertia_kg_m2 *= factor;
    truth.load.as_mut().unwrap().inertia_kg_m2 *= factor;
    truth
}

#[test]
fn a_right_belief_raises_no_alarm() {
    for name in SCENARIOS {
        for period_ns in [250_000, 1_000_000, 2_000_000, 4_000_000] {
            let (scenario, belief) = shipped(name);
            let scenario = Scenario { period_ns, ..scenario };
            let outcome = measure(&scenario, &belief, &belief, Level::OBSERVED).unwrap();
            assert_eq!(outcome.alarms, 0, "{name}, {period_ns} ns: {outcome:?}");
        }
    }
}

/// What a coarse encoder says of a vibration is the flicker between two counts: with damping fed by it, 4,000 counts left 2 to 8 times the error at 1 ms
/// that they leave at 2 ms, where there is none.
#[test]
fn a_coarse_encoder_is_no_worse_in_shorter_cycles() {
    for name in SCENARIOS {
        let (mut scenario, belief) = shipped(name);
        scenario.encoder.counts_per_turn = 4000;
        let of = |period_ns| {
            let scenario = Scenario { period_ns, ..scenario.clone() };
            measure(&scenario, &belief, &belief, Level::OBSERVED).unwrap().rms_rad
        };
        let (short, long) = (of(1_000_000), of(2_000_000));
        assert!(short <= 1.02 * long, "{name}: {short} rad RMS at 1 ms, {long} at 2 ms");
    }
}

/// As fast as with a fine encoder, the observer takes a coarse one's rounding for a disturbance: of 16,000 counts it made up to 2.5 times the error.
#[test]
fn a_coarse_encoder_is_followed_more_slowly() {
    for (name, factor) in ["step-sequence.toml", "flow-steps.toml"]
        .map(|name| [0.7, 1.0, 1.3].map(|factor| (name, factor)))
        .concat()
    {
        let (mut scenario, belief) = shipped(name);
        scenario.encoder.counts_per_turn = 16_000;
        let of = |observer_bandwidth_hz| {
            let mut scenario = scenario.clone();
            scenario.control.observer_bandwidth_hz = observer_bandwidth_hz;
            measure(&scenario, &with_friction(&belief, factor), &belief, Level::OBSERVED).unwrap().rms_rad
        };
        let (suited, fast) = (of(None), of(Some(320.0)));
        let found = format!("{name}, friction × {factor}: {suited} rad RMS as suits, {fast} at 320 Hz");
        println!("{found}");
        assert!(suited < 0.9 * fast, "{found}");
    }
}

#[test]
fn an_observer_that_the_shaft_does_not_suit_is_slowed_down_and_says_so() {
    // A valve that turns at the driver's greatest rate has nothing left to catch up with what a swing cost.
    for (name, part) in [("rotation-200khz.toml", 0.2), ("rotation-600khz.toml", 0.3)] {
        for factor in [0.4, 2.0, 2.5] {
            let (scenario, belief) = shipped(name);
            let truth = with_inertia(&belief, factor);
            let of = |level| measure(&scenario, &truth, &belief, level).unwrap();
            let (none, observed) = (of(Level::NONE), of(Level::OBSERVED));
            let says = alarm::OSCILLATION | alarm::INERTIA;
            assert_ne!(observed.alarms & says, 0, "{name}, inertia × {factor}: {observed:?}");
            assert_eq!(observed.alarms & !says, 0, "{name}, inertia × {factor}: {observed:?}");
            assert_eq!((observed.fault, observed.lost_teeth), (None, 0), "{name}, inertia × {factor}");
            // Left to itself, the loop swings with up to three times the error of none until the end.
            assert!(observed.rms_rad < part * none.rms_rad, "{name}, inertia × {factor}: {observed:?}");
        }
    }
}

#[test]
fn an_observer_at_its_limit_is_limiting_and_an_alarm_after_a_second() {
    let (mut scenario, belief) = shipped("rotation-200khz.toml");
    scenario.control.observer_limit = 0.05;
    let mut truth = belief.clone();
    if let valve_model::FrictionParams::LuGre(law) = &mut truth.friction {
        // More than the feed-forward adapts to.
        law.coulomb_torque_nm *= 1.9;
        law.static_torque_nm *= 1.9;
    }
    let parts = wire(&scenario, &truth, &belief).unwrap();
    let (mut first, mut alarmed) = (None, None);
    for cycle in InProcess::new(&parts) {
        if cycle.status.limiting & limiting::OBSERVER != 0 {
            first.get_or_insert(cycle.cycle);
        }
        if cycle.status.alarms & alarm::OBSERVER_SATURATED != 0 {
            alarmed.get_or_insert(cycle.cycle);
        }
    }
    let (first, alarmed) = (first.unwrap(), alarmed.unwrap());
    assert!((1000..1500).contains(&(alarmed - first)), "limiting from cycle {first}, alarm in {alarmed}");
}

fn with_friction(belief: &Model, factor: f64) -> Model {
    let mut truth = belief.clone();
    if let valve_model::FrictionParams::LuGre(law) = &mut truth.friction {
        law.coulomb_torque_nm *= factor;
        law.static_torque_nm *= factor;
    }
    truth
}

#[test]
fn friction_far_below_the_belief_is_told_and_no_longer_fed() {
    for period_ns in [250_000, 1_000_000, 4_000_000] {
        for factor in [0.01, 0.3, 0.6] {
            let (scenario, belief) = shipped("sine-1hz.toml");
            let scenario = Scenario { period_ns, ..scenario };
            let truth = with_friction(&belief, factor);
            let parts = wire_level(&scenario, &truth, &belief, Level::OBSERVED).unwrap();
            let last = InProcess::new(&parts)
                .take_while(|cycle| cycle.cycle < parts.timeline.disarm_cycle)
                .filter(|cycle| cycle.reference.speed_rad_per_s.abs() > 0.5)
                .last()
                .unwrap();
            let what = format!("{period_ns} ns, friction × {factor}");
            // Where hardly any is left, compensation is seen to do harm before the share is known, and is given up.
            let may_add = if factor < 0.1 { alarm::NO_BENEFIT } else { 0 };
            assert_eq!(last.status.alarms & !may_add, alarm::LOAD_BELOW_BELIEF, "{what}");
            let fed_nm = last.status.friction_estimate_nm - last.status.disturbance_estimate_nm;
            let share = fed_nm.abs() / 1.5;
            assert!((share - factor).abs() < 0.1, "{what}: feeds {share} of it");
        }
    }
}

#[test]
fn friction_above_the_belief_is_fed_too() {
    let (scenario, belief) = shipped("sine-1hz.toml");
    let truth = with_friction(&belief, 1.3);
    let of = |level| measure(&scenario, &truth, &belief, level).unwrap();
    let (none, observed) = (of(Level::NONE), of(Level::OBSERVED));
    assert_eq!(observed.alarms, 0);
    assert!(observed.rms_rad < none.rms_rad / 30.0, "{observed:?}");
}
