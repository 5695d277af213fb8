//! `stepvalve schema`: JSON Schema of a kind of file, for editors that complete and check while one types.

use crate::say::say;
use config::{FileKind, schema};
use supervisor::{Failure, Outcome};

/// Of what.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// What kind of file
    #[arg(value_enum)]
    what: What,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum What {
    /// Limits, driver, encoder, safety, set-points by time
    Scenario,
    /// Motor, load, friction, orifice, oil, effects
    Model,
    /// A drive on EtherCAT
    Drive,
    /// A campaign: scenarios, what is varied, design
    Plan,
}

/// Prints it.
///
/// # Errors
/// None that a user could mend.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let kind = match arguments.what {
        What::Scenario => FileKind::Scenario,
        What::Model => FileKind::Model,
        What::Drive => FileKind::Drive,
        What::Plan => FileKind::Plan,
    };
    say(serde_json::to_string_pretty(&schema(kind)).map_err(anyhow::Error::from)?);
    Ok(Outcome::Done)
}
