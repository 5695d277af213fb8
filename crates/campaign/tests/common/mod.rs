//! Plans over the shipped sine, shortened.
#![allow(clippy::unwrap_used, clippy::expect_used, dead_code)]

use campaign::{BaseTexts, Campaign, CampaignError, Source};

const RIG: &str = include_str!("../../../../rt-config/models/rig.toml");
const SINE: &str = include_str!("../../../../rt-config/scenarios/sine-1hz.toml");

fn source(file: &str, text: impl Into<String>) -> Source {
    Source { file: file.to_owned(), text: text.into() }
}

/// The sine for a third of a second.
pub fn base() -> BaseTexts {
    let short = SINE.replace("duration = \"5s\"", "duration = \"0.3s\"");
    let end = short.rfind("[[set_point]]").unwrap();
    BaseTexts {
        scenario: source("sine.toml", &short[..end]),
        truth: source("truth.toml", RIG),
        belief: source("belief.toml", RIG),
    }
}

/// A plan's text with this in place of its design and what it varies.
pub fn plan_text(rest: &str) -> String {
    let head =
        "format = \"stepvalve-campaign\"\nformat_version = 1\nname = \"test\"\nscenarios = [\"sine.toml\"]\n";
    format!("{head}{rest}")
}

/// A campaign, or what is wrong with it.
pub fn campaign(rest: &str) -> Result<Campaign, CampaignError> {
    Campaign::new(source("plan.toml", plan_text(rest)), vec![base()])
}

/// Three quantities, one of which no run can have below zero.
pub const THREE: &str = "[design]\nkind = \"sobol\"\nruns = 16\nseed = 4\n\
    [[vary]]\npath = \"truth.friction.coulomb_torque_nm\"\nnormal = { mean = 1.0, sd = 1.0 }\n\
    [[vary]]\npath = \"scenario.pressure_drop\"\nrange = [\"1MPa\", \"5MPa\"]\n\
    [[vary]]\npath = \"belief.load.inertia_kg_m2\"\nas = \"factor\"\nlog = [0.5, 2.0]\n";
