//! Damaged text is refused, or accepted, but never a panic; and every error points into the text.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use config::{ConfigErrors, parse_drive, parse_model, parse_scenario};
use proptest::prelude::*;
use proptest::sample::Index;

const SCENARIO: &str = include_str!("../../../rt-config/scenarios/flow-steps.toml");
const SINE: &str = include_str!("../../../rt-config/scenarios/sine-1hz.toml");
const MODEL: &str = include_str!("../../../rt-config/models/rig.toml");
const DRIVE: &str = include_str!("../../../rt-config/drives/simulated.toml");
const SDO: &str = "\n[[sdo]]\nindex = 0x6098\nsub = 0\ntype = \"i8\"\nvalue = 35\n";
const EFFECT: &str = "\n[[effect]]\nid = \"position-torque\"\nsin = [0.1, 0]\n\n[[effect]]\nid = \"formula\"\nname = \"f\"\nacts_on = \"level\"\nexpression = \"a*speed\"\nparameters = { a = 0.1 }\n";

/// Pieces that a file may be damaged with: parts of the format and characters that are special somewhere.
const PIECES: &[&str] = &[
    "",
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    "\"",
    "'",
    "\"\"\"",
    "#",
    ",",
    ".",
    "-",
    "\n",
    "\r",
    "\t",
    "\0",
    "\u{feff}",
    "ä",
    "𝄞",
    "nan",
    "inf",
    "1e999",
    "-1",
    "0",
    "true",
    "1979-05-27",
    "0x7f",
    "\\u0000",
    "[limits]",
    "[[set_point]]",
    "set_point = []",
    "timing.step-controller.phase = 1",
    "a.b.c = 1",
    "[a.b]",
    "[[effect]]",
    "effect = [{}]",
    "time = []",
    "deg",
    "ms",
    "9223372036854775808",
    "99999999999999999999",
    "1_000",
    "0b",
    "\"\\",
    "'''",
    "period",
    "angle = ",
];

#[derive(Debug, Clone)]
struct Damage {
    at: Index,
    removed: usize,
    piece: usize,
}

fn damage() -> impl Strategy<Value = Damage> {
    (any::<Index>(), prop_oneof![0usize..4, 0usize..200], 0..PIECES.len())
        .prop_map(|(at, removed, piece)| Damage { at, removed, piece })
}

fn damaged(text: &str, damages: &[Damage], kept: Option<Index>) -> String {
    let mut chars: Vec<char> = text.chars().collect();
    for damage in damages {
        if chars.is_empty() {
            break;
        }
        let at = damage.at.index(chars.len());
        let end = (at + damage.removed).min(chars.len());
        chars.splice(at..end, PIECES[damage.piece].chars());
    }
    if let Some(kept) = kept.filter(|_| !chars.is_empty()) {
        chars.truncate(kept.index(chars.len()));
    }
    chars.into_iter().collect()
}

fn points_into(text: &str, errors: &ConfigErrors) -> Result<(), TestCaseError> {
    prop_assert!(!errors.errors().is_empty());
    let lines: Vec<&str> = text.split('\n').collect();
    for error in errors.errors() {
        prop_assert!(error.line >= 1 && error.line <= lines.len(), "{error}");
        let width = lines[error.line - 1].chars().count();
        prop_assert!(error.column >= 1 && error.column <= width + 1, "{error}, {width} wide");
        prop_assert!(!error.found.is_empty() && !error.expected.is_empty(), "{error}");
        prop_assert!(!error.to_string().contains(['\n', '\0', '\u{1b}']), "{error:?}");
    }
    Ok(())
}

fn holds_only_finite_numbers(debug: &str) -> Result<(), TestCaseError> {
    prop_assert!(!debug.contains("NaN") && !debug.contains("inf"), "{debug}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn of_scenarios(flow in any::<bool>(), damages in prop::collection::vec(damage(), 0..6), kept in prop::option::of(any::<Index>())) {
        let text = damaged(if flow { SCENARIO } else { SINE }, &damages, kept);
        match parse_scenario(&text, "x.toml") {
            Ok(scenario) => holds_only_finite_numbers(&format!("{:?}", (scenario.limits, scenario.set_points, scenario.driver)))?,
            Err(errors) => points_into(&text, &errors)?,
        }
    }

    #[test]
    fn of_models(damages in prop::collection::vec(damage(), 0..6), kept in prop::option::of(any::<Index>())) {
        let text = damaged(&format!("{MODEL}{EFFECT}"), &damages, kept);
        match parse_model(&text, "m.toml") {
            Ok(model) => prop_assert!(model.validate().is_ok()),
            Err(errors) => points_into(&text, &errors)?,
        }
    }

    #[test]
    fn of_drive_files(damages in prop::collection::vec(damage(), 0..6), kept in prop::option::of(any::<Index>())) {
        let text = damaged(&format!("{DRIVE}{SDO}"), &damages, kept);
        match parse_drive(&text, "d.toml") {
            Ok(drive) => prop_assert!(drive.validate().is_ok(), "{drive:?}"),
            Err(errors) => points_into(&text, &errors)?,
        }
    }

    #[test]
    fn of_any_text(text in "(\\PC|[\\n\\r\\t\u{0}\\[\\]{}=\"'#.,])*") {
        for result in [
            parse_scenario(&text, "x").map(drop),
            parse_model(&text, "x").map(drop),
            parse_drive(&text, "x").map(drop),
        ] {
            points_into(&text, &result.expect_err("accepted"))?;
        }
    }
}
