//! model-extended.toml: the given model with what was found, and comments that say how well it is known.

use config::{ModelComments, write_model};
use diagnosis::{Cause, Found};
use valve_model::Model;

use super::words::short;

/// The text of the file.
pub fn text(found: &Found, given: &Model, log: &str, model: &str) -> String {
    let mut extended = found.extended.clone();
    let causes = &found.diagnosis.causes;
    if !causes.is_empty() {
        extended.name = format!("{}, extended", given.name);
    }
    let mut comments = ModelComments::new().with_header(header(found, given, log, model));
    for (index, effect) in extended.effects.iter().enumerate() {
        let section = format!("effect[{index}]");
        let Some(cause) = causes.iter().find(|cause| cause.id == effect.id()) else { continue };
        comments = comments.with_section(&section, about(cause));
    }
    write_model(&extended, &comments)
}

fn header(found: &Found, given: &Model, log: &str, model: &str) -> String {
    let gain = &found.diagnosis.gain;
    let unit = if found.channel == log_data::Channel::Torque { "N·m" } else { "rad" };
    let mut lines = vec![
        format!("{} ({model}), held against {log} by stepvalve diagnose.", given.name),
        format!("Verdict: {}.", found.diagnosis.verdict.name()),
    ];
    if !found.diagnosis.causes.is_empty() {
        lines.push(format!(
            "Error on runs not used for fitting: {:.4e} {unit} before, {:.4e} {unit} after.",
            gain.rms_before, gain.rms_after
        ));
    }
    lines.join("\n")
}

fn about(cause: &Cause) -> String {
    let mut lines = vec![format!(
        "Found by stepvalve diagnose; without it the error on held-out runs is {:.1} % larger.",
        100.0 * cause.rms_gain / (1.0 - cause.rms_gain).max(1e-9)
    )];
    for (key, of) in &cause.parameters {
        lines.push(format!(
            "{key}: {} ± {} {}, 95 % between {} and {}",
            short(of.value),
            short(of.std_error),
            of.unit,
            short(of.ci95[0]),
            short(of.ci95[1])
        ));
    }
    lines.join("\n")
}
