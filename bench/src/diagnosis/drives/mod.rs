//! `bench diagnosis-real`: `stepvalve diagnose` on records of real drives, beside what is known of them by hand.
//!
//! The records stay outside the repository: `STEPVALVE_DATA` names the folder, else it is `../shared/data` beside the repository.

mod carriage;
mod cogging;
mod found;
mod record;
mod screw;
mod seal;

use super::ask::diagnose;
use crate::output::{Results, Sheet};
use crate::scenario::repository;
use anyhow::{Context, Result};
use found::Found;
use log_data::{Log, Run};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// How much of it.
#[derive(clap::Args, Clone)]
pub struct Arguments {
    /// Ends a diagnosis after so many seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 300, value_parser = clap::value_parser!(u64).range(1..))]
    limit: u64,
    /// One drive alone: carriage, seal, screw, cogging; may be given more than once
    #[arg(long, value_name = "DRIVE")]
    only: Vec<String>,
}

/// What is expected of one diagnosis, what was found, and whether that is it.
struct Check {
    record: String,
    expected: String,
    found: String,
    passed: bool,
}

/// Where records become logs and are diagnosed.
struct Place {
    data: PathBuf,
    folder: TempDir,
    limit: Duration,
    checks: Vec<Check>,
}

impl Place {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn model(&self, name: &str, friction: &Friction) -> Result<PathBuf> {
        let path = self.path(name);
        std::fs::write(&path, friction.toml()).with_context(|| path.display().to_string())?;
        Ok(path)
    }

    /// Writes runs as a log and diagnoses it; what it took is part of what was found.
    fn diagnosed(&self, name: &str, runs: Vec<Run>, model: &Path) -> Result<Found> {
        self.diagnosed_log(name, Log { title: name.to_owned(), runs, ..Log::default() }, model)
    }

    /// The same of a log.
    fn diagnosed_log(&self, name: &str, contents: Log, model: &Path) -> Result<Found> {
        let log = self.path(&format!("{name}.h5"));
        run_log::write_log(&log, &contents)?;
        let out = self.path(name);
        let begun = Instant::now();
        let json = diagnose(&log, model, &out, &[], self.limit)?;
        Ok(Found { json, folder: out, wall_s: begun.elapsed().as_secs_f64() })
    }

    fn check(&mut self, record: &str, expected: &str, found: impl Into<String>, passed: bool) {
        let (record, expected) = (record.to_owned(), expected.to_owned());
        self.checks.push(Check { record, expected, found: found.into(), passed });
    }
}

/// A static Stribeck model with one level both ways, T_s = T_c.
struct Friction {
    inertia_kg_m2: f64,
    coulomb_nm: f64,
    viscous_nm_s_per_rad: f64,
}

impl Friction {
    fn toml(&self) -> String {
        let Self { inertia_kg_m2, coulomb_nm, viscous_nm_s_per_rad } = self;
        format!(
            "format = \"stepvalve-model\"\nformat_version = 1\nname = \"symmetric\"\n[load]\n\
             inertia_kg_m2 = {inertia_kg_m2:?}\n[friction]\nlaw = \"stribeck\"\ncoulomb_torque_nm = {coulomb_nm:?}\n\
             static_torque_nm = {coulomb_nm:?}\nstribeck_velocity_rad_per_s = 0.1\nstribeck_exponent = 2.0\n\
             regularisation_velocity_rad_per_s = 0.05\nviscous_nm_s_per_rad = {viscous_nm_s_per_rad:?}\n"
        )
    }
}

/// The folder of records, if it is there.
fn data() -> Option<PathBuf> {
    let beside = || repository().join("../shared/data");
    let folder = std::env::var_os("STEPVALVE_DATA").map_or_else(beside, PathBuf::from);
    folder.join("README.md").exists().then_some(folder)
}

type Drive = (&'static str, fn(&mut Place) -> Result<()>);
const DRIVES: [Drive; 4] =
    [("carriage", carriage::run), ("seal", seal::run), ("screw", screw::run), ("cogging", cogging::run)];

/// Diagnoses all records and holds each finding against what is known by hand.
///
/// # Errors
/// A record that can't be read, or a program that is missing.
pub fn run(arguments: &Arguments, quick: bool) -> Result<Results> {
    let title = "Records of real drives: what is known by hand, and what stepvalve diagnose finds";
    let mut sheet = Sheet::new("diagnosis-real", title, &["record", "expected", "found", "as expected"]);
    let mut passed = 0;
    if let Some(data) = data() {
        let limit = Duration::from_secs(arguments.limit);
        let mut place = Place { data, folder: tempfile::tempdir()?, limit, checks: Vec::new() };
        let wanted = |name: &str| arguments.only.is_empty() || arguments.only.iter().any(|only| only == name);
        for (name, drive) in DRIVES.iter().filter(|(name, _)| wanted(name)) {
            drive(&mut place).with_context(|| format!("the {name}'s record"))?;
        }
        for check in place.checks {
            passed += usize::from(check.passed);
            let verdict = if check.passed { "yes" } else { "no" };
            sheet.row([check.record, check.expected, check.found, verdict.to_owned()]);
        }
    } else {
        eprintln!("SKIPPED: no records of real drives; STEPVALVE_DATA names their folder");
    }
    let failed = sheet.rows.len() - passed;
    eprintln!("{passed} as expected, {failed} not");
    Ok(Results {
        command: "diagnosis-real",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "the normal scheduler".to_owned(),
        sheets: vec![sheet],
        data: json!({ "as_expected": passed, "not": failed }),
    })
}
