//! `stepvalve convert`: a record becomes a run file.

use crate::files::{name, segments};
use crate::pulse::Pulse;
use crate::say::say;
use anyhow::{Context, anyhow};
use processes::complain;
use run_log::RunLogError;
use std::path::PathBuf;
use supervisor::{Failure, Outcome};

/// What to convert.
#[derive(clap::Args)]
pub struct Arguments {
    /// The folder of a run, or the record's segments in order
    #[arg(value_name = "REC.mcap", required = true)]
    segments: Vec<PathBuf>,
    /// The run file to write
    #[arg(long, value_name = "run.h5")]
    out: PathBuf,
}

/// Converts, and says what was found damaged or missing.
///
/// # Errors
/// [`Failure::Input`] where a segment is no record, none holds a cycle, or the output exists; [`Failure::Failed`] where writing fails.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let out = &arguments.out;
    if out.exists() {
        return Err(Failure::Input(anyhow!("{} exists: give --out another name", name(out))));
    }
    let segments = segments(&arguments.segments)?;
    for segment in &segments {
        recording::read_info(segment).map_err(Failure::input)?;
    }
    let pulse = Pulse::new(|| "converting".to_owned());
    let converted = match run_log::convert(&segments, out) {
        Err(error @ (RunLogError::NoCycles { .. } | RunLogError::Record(_))) => {
            return Err(Failure::input(error));
        }
        converted => converted.with_context(|| name(out))?,
    };
    drop(pulse);
    for segment in &converted.report.segments {
        for damage in &segment.damage {
            complain(format_args!("{}: {damage}", name(&segment.path)));
        }
    }
    let report = &converted.report;
    say(format_args!(
        "{}: {} messages, {} missing in {} gaps",
        name(out),
        report.recorded(),
        report.missed(),
        report.gaps.len()
    ));
    Ok(Outcome::Done)
}
