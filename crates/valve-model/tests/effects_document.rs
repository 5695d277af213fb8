//! docs/effects.md is the table of effects in the code; `STEPVALVE_WRITE_DOCS=1 cargo test -p valve-model --test
//! effects_document` writes it anew.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::fmt::Write;
use std::path::Path;

use valve_model::*;

const HEAD: &str = "# Effects

What a valve does beyond the nominal model, by the names that `stepvalve diagnose` gives to causes and corrections. Each is an
`[[effect]]` of a model file, at most once a file, in any combination. A parameter that is left out has its default,
which changes nothing unless the table says otherwise; an array left out is empty.

Symbols: ω speed, θ angle, p pressure drop, ϑ oil temperature, ϑ_ref the model's `reference_temperature_c`, T_c and T_s
Coulomb and static torque, σ0 bristle stiffness, σ1 bristle damping, σ2 viscous coefficient, ω_s Stribeck velocity.
A time at rest grows with time and falls with slip over T_c/σ0: presliding leaves it, sliding ends it.

What has no row here, users add as a formula or a table: [model.md](model.md#effect).

This file is written by `STEPVALVE_WRITE_DOCS=1 cargo test -p valve-model --test effects_document` from
`crates/valve-model/src/effect/table/`; a test compares the two.
";

fn document() -> String {
    let mut text = String::from(HEAD);
    for spec in EffectId::ALL.iter().map(|id| id.spec()) {
        writeln!(text, "\n## {}\n\n{}.\n", spec.id, spec.formula).unwrap();
        writeln!(text, "| key | unit | accepted | default | meaning |\n|---|---|---|---|---|").unwrap();
        for row in spec.parameters {
            let default = match row.kind {
                ValueKind::Number => row.default.to_string(),
                ValueKind::List(_) => "empty".into(),
            };
            let meaning = row.meaning.replace('|', "\\|");
            writeln!(text, "| `{}` | {} | {} | {default} | {meaning} |", row.key, row.unit, row.range)
                .unwrap();
        }
    }
    text
}

#[test]
fn the_document_is_the_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/effects.md");
    if std::env::var_os("STEPVALVE_WRITE_DOCS").is_some() {
        std::fs::write(&path, document()).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap();
    assert_eq!(found, document(), "docs/effects.md differs from the code; see the head of this test");
}

#[test]
fn every_cause_of_the_design_has_a_row() {
    let named = [
        "coulomb-level",
        "static-level",
        "viscous-level",
        "stribeck-velocity",
        "bristle-stiffness",
        "bristle-damping",
        "load-inertia",
        "holding-torque-level",
        "rotor-inertia",
        "motor-damping",
        "pressure-dependent-friction",
        "temperature-dependent-viscosity",
        "temperature-dependent-friction",
        "angle-dependent-friction",
        "direction-asymmetry",
        "dwell-stiction",
        "hydraulic-lock",
        "friction-lag",
        "presliding-hysteresis",
        "wear-drift",
        "flow-torque",
        "pressure-torque",
        "position-torque",
        "coupling-compliance",
        "detent-torque",
        "microstep-error",
        "backlash",
        "missed-steps",
        "torque-offset",
        "torque-gain",
        "sensor-delay",
        "encoder-eccentricity",
    ];
    let rows: Vec<&str> = EffectId::ALL.iter().map(|id| id.name()).collect();
    assert_eq!(rows, named);
    for spec in EffectId::ALL.iter().map(|id| id.spec()) {
        for row in spec.parameters {
            assert!(spec.keys.contains(&format!("`{}`", row.key)), "{}: {} in words", spec.id, row.key);
        }
    }
}
