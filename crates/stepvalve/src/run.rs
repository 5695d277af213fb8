//! `stepvalve run`: the valve without an end, in real time, spoken to over its control socket.

use crate::control;
use crate::failure::{Failure, Outcome};
use crate::files;
use crate::instance::Instance;
use crate::output::Output;
use crate::say::say;
use crate::signals::Interruption;
use crate::simulate::{Mode, info};
use crate::supervisor::{self, Channel, Setup, Stay};
use anyhow::anyhow;
use processes::complain;
use processes::{Keep, Mode as Pace};
use std::path::PathBuf;

/// What to run.
#[derive(clap::Args)]
pub struct Arguments {
    /// The scenario: its models, limits, driver and timing; its set-points and its end are left out
    #[arg(value_name = "SCENARIO.toml")]
    scenario: PathBuf,
    /// Name of the instance: what `stepvalve status --instance NAME` and the others ask for
    #[arg(long, value_name = "NAME")]
    instance: String,
    /// Folder for the record and the timing of slow cycles
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// What to record: `none`, `all`, or `ring=SIZE`, the newest segments of that size together (500MB, 2GB) and those
    /// around a fault
    #[arg(long, value_name = "none|all|ring=SIZE", default_value = "ring=2GB", value_parser = parse_keep)]
    record: Keep,
    /// Fail instead of running without the scheduling, core or locked memory that the scenario asks for
    #[arg(long)]
    require_realtime: bool,
    /// Let `stepvalve inject` make things go wrong on purpose; never beside a real valve
    #[arg(long)]
    allow_injection: bool,
    /// Print how it ended as JSON
    #[arg(long)]
    json: bool,
}

/// Runs until SIGTERM (exit code 0), SIGINT (130), or until the processes died too often (1).
///
/// # Errors
/// [`Failure::Input`] before anything is started; [`Failure::Failed`] as above.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let mut loaded = files::load(&arguments.scenario)?;
    for warning in loaded.scenario.warnings() {
        complain(format_args!("note: {warning}"));
    }
    loaded.parts = loaded.parts.without_end();
    let output = Output::of_instance(&arguments.out)?;
    let interruption = Interruption::watch()?;
    let instance = Instance::acquire(&arguments.instance)?;
    let channel = Channel::new();
    control::serve(instance.folder(), channel.sender())?;
    let setup = Setup {
        instance: &instance,
        name: arguments.instance.clone(),
        pace: Pace::Realtime,
        loaded: &loaded,
        output: &output,
        keep: arguments.record,
        info: info(&loaded, Mode::Realtime, &arguments.instance),
        injections: arguments.allow_injection.then(Vec::new),
        require_realtime: arguments.require_realtime,
        interruption: interruption.clone(),
    };
    let stay = supervisor::stay(setup, &channel)?;
    report(&stay, &output, arguments.json)?;
    match stay.failure {
        Some(failure) => Err(Failure::Failed(anyhow!("{failure}"))),
        None if interruption.terminated() => Ok(Outcome::Done),
        None => Ok(Outcome::Interrupted),
    }
}

fn report(stay: &Stay, output: &Output, json: bool) -> Result<(), anyhow::Error> {
    if json {
        say(serde_json::to_string_pretty(stay)?);
        return Ok(());
    }
    say(format_args!("stopped after {} starts of the processes", stay.generations));
    let segments = output.segments();
    if !segments.is_empty() {
        let folder = output.folder().display();
        say(format_args!(
            "record: {} segments; stepvalve convert {folder}/run-*.mcap --out run.h5",
            segments.len()
        ));
    }
    Ok(())
}

/// `none`, `all` or `ring=SIZE`.
pub fn parse_keep(text: &str) -> Result<Keep, String> {
    const UNITS: [(&str, u64); 4] = [("GB", 1_000_000_000), ("MB", 1_000_000), ("kB", 1000), ("B", 1)];
    let expected =
        || format!("found {text:?}, expected none, all, or ring=SIZE with a size like 500MB or 2GB");
    match text {
        "none" => return Ok(Keep::None),
        "all" => return Ok(Keep::All),
        _ => {}
    }
    let size = text.strip_prefix("ring=").ok_or_else(expected)?;
    let (number, factor) = UNITS
        .iter()
        .find_map(|(unit, factor)| Some((size.strip_suffix(unit)?, *factor)))
        .ok_or_else(expected)?;
    let number: u64 = number.trim().parse().map_err(|_| expected())?;
    let bytes = number
        .checked_mul(factor)
        .filter(|bytes| *bytes >= 10_000_000)
        .ok_or_else(|| format!("found {text:?}, expected at least 10MB: some seconds of a 1 kHz loop"))?;
    Ok(Keep::Ring { bytes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(parse_keep("none"), Ok(Keep::None));
        assert_eq!(parse_keep("ring=500MB"), Ok(Keep::Ring { bytes: 500_000_000 }));
        for bad in ["", "ring", "ring=", "ring=5", "ring=-1GB", "ring=1kB", "ring=99999999999999GB", "ALL"] {
            assert!(parse_keep(bad).is_err(), "{bad}");
        }
    }
}
