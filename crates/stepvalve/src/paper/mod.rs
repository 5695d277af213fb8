//! `stepvalve paper`: the paper's tables and figures as the model gives them, beside what the paper claims.

mod claims;
mod figures;
mod page;
mod ramp;
mod verdict;

use crate::files::name;
use crate::pulse::Pulse;
use crate::say::say;
use anyhow::{Context, Result, anyhow};
use config::parse_model;
use std::path::PathBuf;
use supervisor::{Failure, Outcome};
use valve_model::{FrictionParams, LuGreParams, Model};
use verdict::Verdict;

/// Where to write.
#[derive(clap::Args)]
pub struct Arguments {
    /// The folder for paper.html and paper.json
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// A parameter set under examination.
pub struct Candidate {
    /// What it is called.
    pub name: &'static str,
    /// Its model.
    pub model: Model,
}

/// A number of the paper's, or about it, found by calculation.
pub struct Fact {
    /// The heading that it stands under.
    pub group: &'static str,
    /// A name for it, as on stdout and in paper.json.
    pub id: String,
    /// What it is.
    pub text: String,
    /// Its value.
    pub value: f64,
    /// Its unit; "1" for a pure number.
    pub unit: &'static str,
    /// What the paper states for it.
    pub stated: Option<f64>,
}

/// Everything on the page.
struct Findings {
    verdicts: Vec<Verdict>,
    facts: Vec<Fact>,
    sines: Vec<figures::Sine>,
    rotations: Vec<figures::Rotation>,
    ramps: Vec<ramp::Ramps>,
}

impl Fact {
    /// Its unit behind a number; nothing for a pure number.
    fn unit_shown(&self) -> String {
        if self.unit == "1" { String::new() } else { format!(" {}", self.unit) }
    }
}

/// Calculates everything, prints every number, writes the page and the same as JSON.
///
/// # Errors
/// [`Failure::Input`] where a file to be written exists; [`Failure::Failed`] where writing fails.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let (html, json) = (arguments.out.join("paper.html"), arguments.out.join("paper.json"));
    if let Some(taken) = [&html, &json].into_iter().find(|path| path.exists()) {
        return Err(Failure::Input(anyhow!("{} exists: give --out another folder", name(taken))));
    }
    std::fs::create_dir_all(&arguments.out).with_context(|| name(&arguments.out)).map_err(Failure::Input)?;
    let pulse = Pulse::new(|| "calculating".to_owned());
    let findings = find()?;
    drop(pulse);
    findings.tell();
    let document = serde_json::to_string_pretty(&findings.to_json()).context("paper.json")?;
    page::page(&findings).write_html(&html).with_context(|| name(&html))?;
    whole_file::write(&json, document + "\n").with_context(|| name(&json))?;
    say(format_args!("{} and {}", name(&html), name(&json)));
    Ok(Outcome::Done)
}

fn find() -> Result<Findings> {
    let candidates = candidates()?;
    let mut facts = claims::facts();
    let sines: Vec<_> = candidates.iter().map(figures::sine).collect::<Result<_>>()?;
    let mut rotations = Vec::new();
    for candidate in &candidates {
        for pulse_rate_hz in [200e3, 600e3] {
            rotations.push(figures::rotation(candidate, pulse_rate_hz)?);
        }
    }
    let ramps: Vec<_> = candidates.iter().map(ramp::ramps).collect::<Result<_>>()?;
    facts.extend(sines.iter().flat_map(figures::Sine::facts));
    facts.extend(rotations.iter().flat_map(figures::Rotation::facts));
    facts.extend(ramps.iter().flat_map(ramp::Ramps::facts));
    Ok(Findings { verdicts: verdict::verdicts(&facts)?, facts, sines, rotations, ramps })
}

/// The paper's two sets as printed, the rig's, and Table 1's bristles with torques at which the motor can turn.
fn candidates() -> Result<Vec<Candidate>> {
    let shipped = [
        ("initial", include_str!("../../../../rt-config/models/paper-initial.toml")),
        ("revised", include_str!("../../../../rt-config/models/paper-revised.toml")),
        ("rig", include_str!("../../../../rt-config/models/rig.toml")),
    ];
    let mut candidates = Vec::new();
    for (name, text) in shipped {
        let model = parse_model(text, name).map_err(anyhow::Error::new)?;
        candidates.push(Candidate { name, model });
    }
    let revised =
        candidates.iter().find(|candidate| candidate.name == "revised").map(|found| found.model.clone());
    let mut stiff = revised.context("the revised set")?;
    if let FrictionParams::LuGre(friction) = stiff.friction {
        let numbers = LuGreParams {
            coulomb_torque_nm: 1.5,
            static_torque_nm: 3.0,
            viscous_nm_s_per_rad: 2e-4,
            ..friction
        };
        stiff.friction = FrictionParams::LuGre(numbers);
    }
    candidates.push(Candidate { name: "stiff", model: stiff });
    Ok(candidates)
}

impl Findings {
    /// Verdicts first, then each number under its heading.
    fn tell(&self) {
        say(format_args!("{}\n", verdict::headline(&self.verdicts)));
        for Verdict { claim, outcome, why } in &self.verdicts {
            say(format_args!("{:<10} {claim}: {why}", outcome.word()));
        }
        for facts in self.groups() {
            say(format_args!("\n{}", facts.first().map_or("", |fact| fact.group)));
            for fact in facts {
                let stated = fact.stated.map_or_else(String::new, |stated| format!("  (paper: {stated})"));
                let unit = fact.unit_shown();
                say(format_args!("{} = {}{unit}{stated}  # {}", fact.id, Short(fact.value), fact.text));
            }
        }
    }

    /// The facts by their headings.
    fn groups(&self) -> impl Iterator<Item = &[Fact]> {
        self.facts.chunk_by(|a, b| a.group == b.group)
    }

    fn to_json(&self) -> serde_json::Value {
        let fact = |fact: &Fact| serde_json::json!({ "group": fact.group, "id": fact.id, "text": fact.text, "value": fact.value, "unit": fact.unit, "stated": fact.stated });
        serde_json::json!({
            "format": "stepvalve-paper",
            "format_version": 1,
            "verdicts": self.verdicts.iter().map(Verdict::to_json).collect::<Vec<_>>(),
            "facts": self.facts.iter().map(fact).collect::<Vec<_>>(),
            "figure_7_and_12": self.sines.iter().map(figures::Sine::to_json).collect::<Vec<_>>(),
            "figure_10_and_11": self.rotations.iter().map(figures::Rotation::to_json).collect::<Vec<_>>(),
            "peak_against_ramp": self.ramps.iter().map(ramp::Ramps::to_json).collect::<Vec<_>>(),
        })
    }
}

/// A number with as many digits as matter.
pub struct Short(pub f64);

impl std::fmt::Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let size = self.0.abs();
        if size != 0.0 && !(1e-3..1e5).contains(&size) {
            return write!(f, "{:.3e}", self.0);
        }
        let text = format!("{:.4}", self.0);
        write!(f, "{}", text.trim_end_matches('0').trim_end_matches('.'))
    }
}
