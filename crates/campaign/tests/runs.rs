//! Plans and their runs: what is varied, what is refused, and that a row follows from the run's number alone.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use campaign::{Stage, Values, columns};
use common::{THREE, campaign};
use config::Setting;

fn never() -> bool {
    false
}

#[test]
fn rows_follow_from_their_number() {
    let first = campaign(THREE).unwrap();
    let again = campaign(THREE).unwrap();
    assert_eq!(first.runs(), 16);
    let forwards: Vec<_> = (0..16).map(|run| first.run(run, &never).unwrap()).collect();
    let mut backwards: Vec<_> = (0..16).rev().map(|run| again.run(run, &never).unwrap()).collect();
    backwards.reverse();
    let bytes = |rows: &[campaign::Row]| {
        rows.iter().flat_map(|row| campaign::log::row(row).unwrap()).collect::<Vec<u8>>()
    };
    assert_eq!(bytes(&forwards), bytes(&backwards));
    // About one in six draws of the torque is not above zero.
    let failed: Vec<_> = forwards.iter().filter_map(|row| row.failure.as_ref()).collect();
    assert!((1..6).contains(&failed.len()), "{failed:?}");
    assert!(failed.iter().all(|failure| failure.stage == Stage::Simulation));
    assert!(failed[0].reason.starts_with("truth.toml:"), "{}", failed[0].reason);
    assert!(failed[0].reason.contains("friction.coulomb_torque_nm: found -"), "{}", failed[0].reason);
    let errors = forwards.iter().filter_map(|row| row.motion.as_ref()).map(|motion| motion.error_rms_rad);
    assert!(errors.clone().all(|error| error > 0.0 && error < 0.1));
    let table = columns(&first, &forwards);
    let names: Vec<&str> = table.iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names[..4], ["run", "scenario", "truth.friction.coulomb_torque_nm", "scenario.pressure_drop"]);
    assert_eq!((table[3].unit.as_str(), table[4].unit.as_str()), ("MPa", "1"));
    let lengths = table.iter().map(|column| match &column.values {
        Values::Numbers(values) => values.len(),
        Values::Counts(values) => values.len(),
        Values::Texts(values) => values.len(),
    });
    assert!(lengths.into_iter().all(|length| length == 16));
}

#[test]
fn a_run_is_given_up_in_its_middle() {
    assert!(campaign(THREE).unwrap().run(1, &|| true).is_none());
}

#[test]
fn texts_hold_what_was_drawn() {
    let plan = "[design]\nkind = \"grid\"\n[[vary]]\npath = \"truth.friction.coulomb_torque_nm\"\nas = \"factor\"\nvalues = [1, 2]\n\
                [[vary]]\npath = \"scenario.encoder.noise\"\nrange = [0, 0.001]\nlevels = 3\n\
                [[vary]]\npath = \"scenario.compensation.level\"\nvalues = [\"none\", \"full\"]\n";
    let campaign = campaign(plan).unwrap();
    assert_eq!(campaign.runs(), 12);
    let shown = |run| campaign.settings(run).iter().map(Setting::shown).collect::<Vec<_>>().join(" ");
    assert_eq!(
        (shown(0), shown(7), shown(11)),
        ("1.0 0.0 none".into(), "2.0 0.0 full".into(), "2.0 0.001 full".into())
    );
    let texts = campaign.texts(11).unwrap();
    assert!(texts.truth.text.contains("coulomb_torque_nm = 3.0"), "{}", texts.truth.text);
    assert!(texts.scenario.text.contains("noise = 0.001\n"), "{}", texts.scenario.text);
    assert_eq!(texts.belief, common::base().belief);
    assert!(campaign.texts(12).is_none());
}

/// What is wrong with a plan whose quantity is this.
fn refused(vary: &str) -> String {
    let design = "[design]\nkind = \"random\"\nruns = 2\n";
    campaign(&format!("{design}[[vary]]\n{vary}\n"))
        .map_or_else(|error| error.to_string(), |_| panic!("{vary}: taken"))
}

#[test]
fn plans_that_do_not_fit() {
    for (vary, expected) in [
        (
            "path = \"truth.friction.coulomb_nm\"\nas = \"factor\"\nrange = [1, 2]",
            "plan.toml:9:8: vary.path: found truth.friction.coulomb_nm, which truth.toml does not have, expected a path such as \
             truth.friction.coulomb_torque_nm,",
        ),
        (
            "path = \"scenario.encoder.nois\"\nvalues = [1]",
            "which sine.toml does not have, expected a path such as scenario.encoder.noise,",
        ),
        ("path = \"scenario.nowhere.noise\"\nvalues = [1]", "which sine.toml does not have"),
        (
            "path = \"truth.friction.law\"\nas = \"factor\"\nvalues = [1]",
            "found a factor of the word lugre, expected a path to a number",
        ),
        (
            "path = \"scenario.encoder.fitted\"\nas = \"factor\"\nvalues = [1]",
            "found a factor of the word true",
        ),
        (
            "path = \"scenario.pressure_drop\"\nrange = [\"1kg\", \"2kg\"]",
            "found the value 1.5kg for scenario.pressure_drop, expected",
        ),
        ("path = \"truth.friction\"\nvalues = [1]", "which truth.toml does not have"),
    ] {
        let found = refused(vary);
        assert!(found.contains(expected), "{vary}:\n{found}");
    }
    // One value of several may be tried on purpose; a key that the file leaves out may be added.
    let design = "[design]\nkind = \"grid\"\n[[vary]]\n";
    assert!(campaign(&format!("{design}path = \"truth.load.inertia_kg_m2\"\nvalues = [-1, 1e-4]")).is_ok());
    assert!(campaign(&format!("{design}path = \"scenario.encoder.delay_cycles\"\nvalues = [0, 2]")).is_ok());
}

/// The controller is wired once where neither belief nor scenario are varied; a factor of 1 has it wired for each run.
#[test]
fn a_controller_wired_once_does_the_same() {
    let varied = |path: &str, values: &str| {
        format!("[[vary]]\npath = \"{path}\"\nas = \"factor\"\nvalues = {values}\n")
    };
    let truth = ["friction.coulomb_torque_nm", "motor.rotor_inertia_kg_m2"]
        .map(|key| varied(&format!("truth.{key}"), "[1, 0.8]"));
    let grid = format!("[design]\nkind = \"grid\"\n{}", truth.concat());
    let once = campaign(&grid).unwrap();
    let each = campaign(&(grid + &varied("belief.load.inertia_kg_m2", "[1]"))).unwrap();
    for run in 0..4 {
        let (one, other) = (once.run(run, &never).unwrap(), each.run(run, &never).unwrap());
        assert!(one.motion.is_some(), "{one:?}");
        assert_eq!(one, other);
    }
}
