//! `stepvalve doctor`: whether this machine holds the loop, what stands in the way, and what to do about each thing.

mod cores;
mod finding;
mod interrupts;
mod kernel;
mod leftovers;
mod measure;
mod memory;
mod network;
mod power;
mod rights;
mod root;
mod target;
mod verdict;

use crate::say::say;
use anyhow::anyhow;
use config::{Dimension, parse_quantity};
use finding::{Finding, State};
use measure::Measurement;
use root::Root;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Duration;
use supervisor::{Failure, Outcome};
use target::Target;
use verdict::Verdict;

/// The longest measurement, s.
const LONGEST_MEASUREMENT_S: f64 = 86_400.0;

/// What to look at.
#[derive(clap::Args)]
pub struct Arguments {
    /// Length of a cycle to judge for, as 1ms or 250us [default: the scenario's, else 1ms]
    #[arg(long, value_name = "TIME")]
    period: Option<String>,
    /// Take period, cores, priorities and phases from this scenario [default: those of the shipped ones]
    #[arg(long, value_name = "SCENARIO.toml")]
    scenario: Option<PathBuf>,
    /// The core that the loop runs on [default: the scenario's, else 1]
    #[arg(long, value_name = "CORE")]
    core: Option<usize>,
    /// How long to measure wake-up latency; 0s: not at all, and the verdict stays open
    #[arg(long, value_name = "TIME", default_value = "10s")]
    measure: String,
    /// A network interface that carries a drive's bus; several are allowed
    #[arg(long, alias = "bus-interface", value_name = "INTERFACE")]
    interface: Vec<String>,
    /// Print all of it as JSON
    #[arg(long)]
    json: bool,
    /// Where /proc, /sys and /dev are looked for
    #[arg(long, hide = true, value_name = "DIR", default_value = "/")]
    root: PathBuf,
}

/// Everything, for machines.
#[derive(Serialize)]
struct Report {
    format: &'static str,
    format_version: u32,
    target: Target,
    verdict: Verdict,
    reasons: Vec<String>,
    findings: Vec<Finding>,
    measurement: Option<Measurement>,
}

/// Looks, measures, judges. The exit code is 1 where the period is out of reach.
///
/// # Errors
/// [`Failure::Input`] for a bad period, scenario or time; [`Failure::Failed`] where the period is out of reach.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let target = Target::new(arguments.scenario.as_deref(), arguments.period.as_deref(), arguments.core)?;
    let duration = measuring_time(&arguments.measure)?;
    let root = Root::new(&arguments.root);
    let findings = look(&root, &target, &arguments.interface);
    let measurement = duration.map(|duration| measure::measure(&target, duration)).transpose()?;
    let (verdict, reasons) = verdict::judge(&target, &findings, measurement.as_ref());
    let report = Report {
        format: "stepvalve-doctor",
        format_version: 1,
        target,
        verdict,
        reasons,
        findings,
        measurement,
    };
    if arguments.json {
        say(serde_json::to_string_pretty(&report).map_err(anyhow::Error::from)?);
    } else {
        print(&report);
    }
    if verdict == Verdict::OutOfReach {
        let period_us = report.target.period_ns as f64 / 1e3;
        return Err(Failure::Failed(anyhow!("a period of {period_us} µs is out of reach of this machine")));
    }
    Ok(Outcome::Done)
}

fn measuring_time(text: &str) -> Result<Option<Duration>, Failure> {
    let seconds = parse_quantity(text, Dimension::Time)
        .map_err(|error| Failure::Input(anyhow!("--measure {text}: {error}")))?;
    if !(0.0..=LONGEST_MEASUREMENT_S).contains(&seconds) {
        return Err(Failure::Input(anyhow!("--measure: found {text}, expected a time from 0s to a day")));
    }
    Ok((seconds > 0.0).then(|| Duration::from_secs_f64(seconds)))
}

fn look(root: &Root, target: &Target, interfaces: &[String]) -> Vec<Finding> {
    let mut findings = kernel::look(root);
    findings.extend(cores::look(root, target));
    findings.extend(interrupts::look(root, target));
    findings.extend(power::look(root, target));
    findings.extend(rights::look(root, target));
    findings.extend(memory::look(root));
    findings.push(leftovers::look(root));
    findings.extend(network::look(root, interfaces));
    findings
}

fn print(report: &Report) {
    for finding in &report.findings {
        let state = match finding.state {
            State::Ok => "ok",
            State::Advice => "advice",
            State::Problem => "PROBLEM",
            State::Unknown => "unknown",
        };
        let found = finding.found.strip_prefix("unknown: ").unwrap_or(&finding.found);
        say(format_args!("{state:8} {}: {found}", finding.what));
        if finding.state != State::Ok {
            say(format_args!("         {}", finding.why));
        }
        if !finding.fix.is_empty() {
            say(format_args!("         to do: {}", finding.fix));
        }
    }
    say("");
    let us = |ns: u64| ns as f64 / 1e3;
    match &report.measurement {
        Some(measured) => say(format_args!(
            "wake-up latency ({}, {}, {} wake-ups): p50 {} µs, p99 {} µs, p99.9 {} µs, largest {} µs",
            measured.with,
            measured.scheduling,
            measured.wake_ups,
            us(measured.p50_ns),
            us(measured.p99_ns),
            us(measured.p999_ns),
            us(measured.max_ns)
        )),
        None => say("wake-up latency: not measured"),
    }
    say(format_args!(
        "a period of {} µs: {}: {}",
        us(report.target.period_ns),
        report.verdict.words(),
        report.reasons.join("; ")
    ));
}
