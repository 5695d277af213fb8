//! `stepvalve new`: a commented scenario, model or drive file to begin from.

use crate::files::name;
use crate::say::say;
use anyhow::anyhow;
use config::{Editable, Setting};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use supervisor::{Failure, Outcome};

const SCENARIO: &str = include_str!("../../../rt-config/scenarios/step-sequence.toml");
const MODEL: &str = include_str!("../../../rt-config/models/rig.toml");
const TORQUE_MODEL: &str = include_str!("../../../rt-config/models/torque-rig.toml");
const DRIVE: &str = include_str!("../../../rt-config/drives/simulated.toml");

/// The name that a new scenario has for its model.
const MODEL_FILE: &str = "model.toml";
/// What the shipped scenario calls it.
const SHIPPED_MODEL: &str = "../models/rig.toml";
/// Shipped scenarios run on virtual machines too, a new one is for a valve.
const SHIPPED_SILENCE: &str =
    "silence_cycles = 50             # virtual machines stall for milliseconds; a machine takes 3";
const SILENCE: &str =
    "silence_cycles = 3              # a virtual machine stalls for longer: 50 to try it there";

/// What to write.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// What kind of file
    #[arg(value_enum)]
    what: What,
    /// Its name [default: scenario.toml, model.toml or drive.toml]
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum What {
    /// Limits, driver, encoder, safety, set-points by time; refers to model.toml beside it
    Scenario,
    /// Motor, load, friction, orifice, oil
    Model,
    /// A model of friction and load alone, for records of a torque transducer
    TorqueModel,
    /// A drive on EtherCAT
    Drive,
}

impl What {
    fn default_name(self) -> &'static str {
        match self {
            Self::Scenario => "scenario.toml",
            Self::Model | Self::TorqueModel => MODEL_FILE,
            Self::Drive => "drive.toml",
        }
    }

    /// The file's text, and what it is about.
    fn text(self) -> (String, &'static str) {
        match self {
            Self::Scenario => (
                SCENARIO.replace(SHIPPED_MODEL, MODEL_FILE).replace(SHIPPED_SILENCE, SILENCE),
                "A scenario to begin from: steps of the spool's angle. docs/scenario.md lists every key.",
            ),
            Self::Model => (
                MODEL.to_owned(),
                "A model to begin from: replace each number by what you know of your valve.",
            ),
            Self::TorqueModel => (
                TORQUE_MODEL.to_owned(),
                "A model to begin from: replace each number by your rig's. docs/model.md says how to read them off a record.",
            ),
            Self::Drive => (
                DRIVE.to_owned(),
                "A drive file to begin from: docs/drive.md says where each number is to be found.",
            ),
        }
    }

    /// The file as it is written.
    fn whole(self, file: &str) -> String {
        let (shipped, about) = self.text();
        // The shipped file's heading is about the shipped file.
        let body = shipped.find("format = ").and_then(|at| shipped.get(at..)).unwrap_or(&shipped);
        format!("# {about}\n# Verify: stepvalve check {file}\n{body}")
    }
}

/// Writes the file.
///
/// # Errors
/// [`Failure::Input`] where the file exists or can't be made.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let path = arguments.file.clone().unwrap_or_else(|| PathBuf::from(arguments.what.default_name()));
    write_new(&path, &arguments.what.whole(&name(&path)))?;
    say(format_args!("{} written; stepvalve check {0} says whether it is right", name(&path)));
    if matches!(arguments.what, What::Scenario) {
        say(format_args!("it needs {MODEL_FILE} beside it: stepvalve new model"));
    }
    Ok(Outcome::Done)
}

fn write_new(path: &Path, text: &str) -> Result<(), Failure> {
    let input = |error: std::io::Error| match error.kind() {
        ErrorKind::AlreadyExists => Failure::Input(anyhow!("{} exists: give another name", name(path))),
        _ => Failure::Input(anyhow!("{}: {error}", name(path))),
    };
    let mut file = std::fs::File::create_new(path).map_err(input)?;
    file.write_all(text.as_bytes()).map_err(input)
}

/// Which numbers of a model are still those that [`run`] wrote, by sections; `None` where it is no such file, or none is.
pub fn untouched(text: &str) -> Option<String> {
    let kinds = [What::Model, What::TorqueModel].map(What::text);
    let (template, _) =
        kinds.into_iter().find(|(_, about)| text.lines().take(3).any(|line| line.ends_with(about)))?;
    let (own, template) = (Editable::new(text)?, Editable::new(&template)?);
    let number = |of: &Editable, path: &str| of.get(path).filter(|it| matches!(it, Setting::Number { .. }));
    let mut sections: Vec<(String, usize, usize)> = Vec::new();
    for path in template.paths() {
        let Some((section, there)) = path.split('.').next().zip(number(&template, &path)) else { continue };
        // Numbers of the head are the format's.
        if section == path {
            continue;
        }
        if sections.last().is_none_or(|last| last.0 != section) {
            sections.push((section.to_owned(), 0, 0));
        }
        if let Some((_, same, all)) = sections.last_mut() {
            *same += usize::from(number(&own, &path) == Some(there));
            *all += 1;
        }
    }
    let told = sections.iter().filter(|(_, same, _)| *same > 0).map(|(section, same, all)| match same {
        same if same == all => format!("[{section}] all"),
        same => format!("[{section}] {same} of {all}"),
    });
    let told: Vec<String> = told.collect();
    (!told.is_empty()).then(|| {
        format!("these numbers are still the template's, a rig's and not your valve's: {}", told.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_of_the_template_is_told() {
        let whole = What::Model.whole("model.toml");
        let told = untouched(&whole).unwrap();
        assert!(
            told.ends_with("[motor] all, [load] all, [friction] all, [orifice] all, [oil] all"),
            "{told}"
        );
        let changed =
            whole.replace("rotor_teeth = 50 ", "rotor_teeth = 100 # was 50 ").replace("= 1.0e-4 ", "= 2e-4");
        let told = untouched(&changed).unwrap();
        assert!(told.ends_with(": [motor] 7 of 8, [friction] all, [orifice] all, [oil] all"), "{told}");
        assert_eq!(untouched(MODEL), None, "the shipped file is no template");
    }
}
