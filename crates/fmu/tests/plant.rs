//! A unit beside the plant of the loop, and what it must hold by itself.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use closed_loop::{InProcess, wire};
use config::{parse_model, parse_scenario};
use fmu::{Causality, Snapshot, Unit, UnitError, Version, description, documentation, token};
use proptest::prelude::*;
use signals::validity;
use std::path::{Path, PathBuf};

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rt-config").join(name)
}

fn rig() -> String {
    std::fs::read_to_string(shipped("models/rig.toml")).unwrap()
}

fn reference(unit: &Unit, name: &str) -> u32 {
    unit.variables().iter().find(|of| of.name == name).unwrap_or_else(|| panic!("no {name}")).reference
}

fn set(unit: &mut Unit, name: &str, value: f64) {
    unit.set_real(reference(unit, name), value).unwrap();
}

fn get(unit: &Unit, name: &str) -> f64 {
    unit.real(reference(unit, name)).unwrap()
}

/// At 1 ms a unit that gets the commands of a loop is that loop's plant.
#[test]
fn it_moves_as_the_plant_of_the_loop() {
    for name in ["step-sequence", "sine-1hz", "flow-steps", "rotation-200khz", "paper-revised"] {
        let path = shipped(&format!("scenarios/{name}.toml"));
        let scenario = parse_scenario(&std::fs::read_to_string(&path).unwrap(), name).unwrap();
        let text = |file: &str| std::fs::read_to_string(path.parent().unwrap().join(file)).unwrap();
        let (truth, belief) = (text(&scenario.truth), text(&scenario.belief));
        let parts =
            wire(&scenario, &parse_model(&truth, "truth").unwrap(), &parse_model(&belief, "belief").unwrap());
        let mut unit = Unit::new(&truth).unwrap();
        let (mut before, mut most_rad, mut steps) = (None, 0.0_f64, 0);
        for messages in InProcess::new(&parts.unwrap()) {
            let (feedback, plant) = (messages.plant.feedback, messages.plant.truth);
            match before.replace(feedback) {
                None => {
                    set(&mut unit, "start_angle", plant.angle_rad);
                    set(&mut unit, "command", plant.command_angle_rad);
                    unit.begin().unwrap();
                }
                Some(before) => {
                    let energised = feedback.validity & validity::ENERGISED != 0;
                    set(&mut unit, "current_ratio", f64::from(u8::from(energised)));
                    set(&mut unit, "command", plant.command_angle_rad);
                    set(&mut unit, "pressure_drop", before.pressure_drop_pa);
                    set(&mut unit, "oil_temperature", before.oil_temperature_c);
                    unit.step(1e-3).unwrap();
                    most_rad = most_rad.max((get(&unit, "angle") - plant.angle_rad).abs());
                    steps += 1;
                }
            }
        }
        println!("{name}: {steps} steps, largest difference {most_rad:e} rad");
        assert!(steps > 1000 && most_rad <= 1e-12, "{name}: {most_rad:e} rad in {steps} steps");
    }
}

#[test]
fn every_shipped_model_of_a_valve_is_described() {
    for name in ["rig", "paper-initial", "paper-revised"] {
        let text = std::fs::read_to_string(shipped(&format!("models/{name}.toml"))).unwrap();
        for version in [Version::Two, Version::Three] {
            let xml = description(&text, version).unwrap();
            assert!(
                xml.contains("friction.coulomb_torque_nm") && xml.contains(&token(&text).unwrap()),
                "{xml}"
            );
        }
        assert!(documentation(&text).unwrap().contains("start_angle"));
    }
    let alone = std::fs::read_to_string(shipped("models/torque-rig.toml")).unwrap();
    assert!(description(&alone, Version::Two).unwrap_err().to_string().contains("motor"));
}

#[test]
fn a_token_is_the_models_and_not_the_comments() {
    let text = rig();
    assert_eq!(token(&text).unwrap(), token(&format!("# another comment\n{text}")).unwrap());
    assert_ne!(
        token(&text).unwrap(),
        token(&text.replace("holding_torque_nm = 6.0", "holding_torque_nm = 6.5")).unwrap()
    );
}

#[test]
fn numbers_of_the_model_are_tuned_and_checked_together() {
    let mut unit = Unit::new(&rig()).unwrap();
    unit.begin().unwrap();
    let (coulomb, level) = ("friction.coulomb_torque_nm", "friction.static_torque_nm");
    // Below the Coulomb friction for as long as that is not set, too.
    set(&mut unit, level, 0.5);
    let refused = unit.clone().step(1e-3).unwrap_err().to_string();
    assert!(refused.contains("static_torque_nm") && refused.contains("0.5"), "{refused}");
    set(&mut unit, coulomb, 0.4);
    unit.step(1e-3).unwrap();
    assert_eq!((get(&unit, coulomb), get(&unit, level)), (0.4, 0.5));
    // The same as a model that was written so.
    let text = rig().replace("coulomb_torque_nm = 1.5", "coulomb_torque_nm = 0.4");
    let mut written = Unit::new(&text.replace("static_torque_nm = 3.0", "static_torque_nm = 0.5")).unwrap();
    written.begin().unwrap();
    written.step(1e-3).unwrap();
    for unit in [&mut unit, &mut written] {
        set(unit, "command", 0.05);
        unit.step(1e-3).unwrap();
    }
    assert_eq!(get(&unit, "angle").to_bits(), get(&written, "angle").to_bits());
}

#[test]
fn what_is_refused_says_why() {
    let mut unit = Unit::new(&rig()).unwrap();
    assert!(matches!(unit.set_real(7777, 1.0), Err(UnitError::Unknown(7777))));
    assert!(matches!(unit.set_real(10, 1.0), Err(UnitError::Computed(name)) if name == "angle"));
    assert!(matches!(unit.set_real(0, f64::NAN), Err(UnitError::NoNumber { name, .. }) if name == "command"));
    assert!(matches!(unit.integer(10), Err(UnitError::Unknown(10))));
    unit.begin().unwrap();
    assert!(matches!(unit.set_real(50, 1.0), Err(UnitError::Fixed(name)) if name == "start_angle"));
    for step_s in [0.0, -1e-3, f64::NAN, f64::INFINITY, 11.0] {
        assert!(matches!(unit.step(step_s), Err(UnitError::Step(_))), "{step_s}");
    }
    assert!(matches!(Snapshot::of_bytes(b"no state"), Err(UnitError::State)));
    let errors = Unit::new("format = 1").unwrap_err().to_string();
    assert!(errors.contains("model.toml:1:"), "{errors}");
}

/// A unit at its start, moved by random commands.
fn moved(commands: &[f64]) -> Unit {
    let mut unit = Unit::new(&rig()).unwrap();
    unit.begin().unwrap();
    commands.iter().for_each(|command| step_to(&mut unit, *command));
    unit
}

fn step_to(unit: &mut Unit, command_rad: f64) {
    set(unit, "command", command_rad);
    unit.step(1e-3).unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// A state, kept as bytes and given to another unit, goes on bit for bit.
    #[test]
    fn a_state_goes_on_elsewhere(
        before in prop::collection::vec(-0.01f64..0.01, 1..30),
        after in prop::collection::vec(-0.01f64..0.01, 1..30),
        friction in 0.5f64..3.0,
    ) {
        let mut unit = moved(&before);
        set(&mut unit, "friction.static_torque_nm", friction.max(1.5));
        let bytes = unit.snapshot().to_bytes().unwrap();
        let mut other = moved(&[0.02]);
        other.restore(&Snapshot::of_bytes(&bytes).unwrap()).unwrap();
        for command in after {
            step_to(&mut unit, command);
            step_to(&mut other, command);
            for of in unit.variables().clone().iter().filter(|of| of.causality == Causality::Output) {
                if of.name == "lost_steps" {
                    prop_assert_eq!(unit.integer(of.reference).unwrap(), other.integer(of.reference).unwrap());
                } else {
                    let [one, two] = [&unit, &other].map(|unit| unit.real(of.reference).unwrap().to_bits());
                    prop_assert_eq!(one, two, "{}", of.name);
                }
            }
        }
    }

    /// Damaged bytes are no state.
    #[test]
    fn a_flipped_bit_is_noticed(at in 0usize..4000) {
        let mut bytes = moved(&[0.01]).snapshot().to_bytes().unwrap();
        let bits = 8 * bytes.len();
        bytes[at % bits / 8] ^= 1 << (at % 8);
        prop_assert!(Snapshot::of_bytes(&bytes).is_err());
    }
}
