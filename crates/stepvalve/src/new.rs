//! `stepvalve new`: a commented scenario, model or drive file to begin from.

use crate::files::name;
use crate::say::say;
use anyhow::anyhow;
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
}

/// Writes the file.
///
/// # Errors
/// [`Failure::Input`] where the file exists or can't be made.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let path = arguments.file.clone().unwrap_or_else(|| PathBuf::from(arguments.what.default_name()));
    let (shipped, about) = arguments.what.text();
    // The shipped file's heading is about the shipped file.
    let body = shipped.find("format = ").and_then(|at| shipped.get(at..)).unwrap_or(&shipped);
    write_new(&path, &format!("# {about}\n# Verify: stepvalve check {}\n{body}", name(&path)))?;
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
