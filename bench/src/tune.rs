//! `bench tune`: beliefs that are off by up to half, put right by `stepvalve tune`, and what that is worth on another motion.

use crate::output::{Results, Sheet, digits};
use crate::programs::beside;
use crate::progress::Progress;
use anyhow::{Context, Result, bail};
use closed_loop::{Level, measure};
use config::{Compensation, Scenario, parse_model, parse_scenario};
use log_data::quantile;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::{Value, json};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;
use toml::{Table, Value as Toml};
use valve_model::Model;

const BELIEF: &str = include_str!("../../rt-config/models/rig.toml");
/// What is tuned on, and what is judged on.
const TUNED_ON: &str = include_str!("../../rt-config/scenarios/sine-1hz.toml");
const JUDGED_ON: &str = include_str!("../../rt-config/scenarios/step-sequence.toml");
/// How far a truth's numbers may be off the belief's, in parts.
const OFF: f64 = 0.5;
/// T_s stays this far above T_c at least.
const ABOVE: f64 = 1.05;
/// So much better it is to be.
const WANTED: f64 = 5.0;

/// How much of it.
#[derive(clap::Args, Clone)]
pub struct Arguments {
    /// Truths
    #[arg(long, default_value_t = 50)]
    truths: u64,
    /// The first seed
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
}

/// Following errors, rad RMS: with the belief, with what was tuned, with the truth.
#[derive(Clone, Copy)]
struct Errors {
    before: f64,
    after: f64,
    best: f64,
}

struct Row {
    seed: u64,
    /// By feed-forward alone, and with the observer.
    forward: Errors,
    observed: Errors,
    wall_s: f64,
}

/// Draws truths, tunes, and judges.
///
/// # Errors
/// Where the program is missing or fails.
pub fn run(arguments: &Arguments, quick: bool) -> Result<Results> {
    let truths = if quick { 2 } else { arguments.truths };
    eprintln!("seeds from {} on", arguments.first_seed);
    let progress = Progress::new(usize::try_from(truths)?);
    let mut rows = Vec::new();
    for seed in arguments.first_seed..arguments.first_seed + truths {
        progress.next(format!("seed {seed}"));
        rows.push(tuned(seed)?);
    }
    Ok(Results {
        command: "tune",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "the normal scheduler".to_owned(),
        sheets: vec![sheet(&rows)],
        data: rows.iter().map(Row::json).collect(),
    })
}

fn tuned(seed: u64) -> Result<Row> {
    let folder = tempfile::Builder::new().prefix("stepvalve-bench-").tempdir()?;
    let path = |name: &str| folder.path().join(name);
    let truth = truth(seed)?;
    let (here, judged) = (named(TUNED_ON)?, parse_scenario(JUDGED_ON, "step-sequence.toml")?);
    for (name, text) in [("truth.toml", truth.as_str()), ("belief.toml", BELIEF), ("scenario.toml", &here)] {
        std::fs::write(path(name), text)?;
    }
    let begun = Instant::now();
    let output = Command::new(beside("stepvalve")?)
        .arg("tune")
        .arg(path("scenario.toml"))
        .arg("--out")
        .arg(path("tuned.toml"))
        .stdin(Stdio::null())
        .output()?;
    if !output.status.success() {
        bail!("seed {seed}: stepvalve tune: {}", String::from_utf8_lossy(&output.stderr));
    }
    let wall_s = begun.elapsed().as_secs_f64();
    let models = [model(BELIEF)?, read(&path("tuned.toml"))?, model(&truth)?];
    let errors = |encoder: bool| errors(&judged, &models, encoder);
    let row = Row { seed, forward: errors(false)?, observed: errors(true)?, wall_s };
    let Errors { before, after, best } = row.forward;
    if before / after < WANTED || after > before {
        eprintln!("seed {seed}: {before:.2e} rad before, {after:.2e} after, {best:.2e} at best");
    }
    Ok(row)
}

/// The scenario with the models beside it.
fn named(scenario: &str) -> Result<String> {
    let mut table: Table = toml::from_str(scenario)?;
    for (key, file) in [("truth", "truth.toml"), ("belief", "belief.toml")] {
        table.insert(key.to_owned(), Toml::String(file.to_owned()));
    }
    Ok(toml::to_string(&table)?)
}

fn model(text: &str) -> Result<Model> {
    Ok(parse_model(text, "model.toml")?)
}

fn read(path: &Path) -> Result<Model> {
    model(&std::fs::read_to_string(path).with_context(|| path.display().to_string())?)
}

/// The belief with friction and inertia off by up to half.
fn truth(seed: u64) -> Result<String> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut table: Table = toml::from_str(BELIEF)?;
    for (section, key) in [
        ("friction", "coulomb_torque_nm"),
        ("friction", "static_torque_nm"),
        ("friction", "stribeck_velocity_rad_per_s"),
        ("friction", "bristle_stiffness_nm_per_rad"),
        ("friction", "bristle_damping_nm_s_per_rad"),
        ("friction", "viscous_nm_s_per_rad"),
        ("load", "inertia_kg_m2"),
    ] {
        let slot = table.get_mut(section).and_then(|of| of.get_mut(key)).context(key)?;
        let own = slot.as_float().context(key)?;
        *slot = Toml::Float(own * random.random_range(1.0 - OFF..1.0 + OFF));
    }
    let friction = table.get_mut("friction").context("friction")?;
    let coulomb = friction.get("coulomb_torque_nm").and_then(Toml::as_float).context("coulomb_torque_nm")?;
    let slot = friction.get_mut("static_torque_nm").context("static_torque_nm")?;
    *slot = Toml::Float(slot.as_float().unwrap_or(0.0).max(ABOVE * coulomb));
    Ok(toml::to_string(&table)?)
}

/// The last model is the valve; each in turn is believed.
fn errors(scenario: &Scenario, [belief, tuned, truth]: &[Model; 3], encoder: bool) -> Result<Errors> {
    let level = Level { feed_forward: Compensation::Full, encoder };
    let of = |belief: &Model| Ok::<_, anyhow::Error>(measure(scenario, truth, belief, level)?.rms_rad);
    Ok(Errors { before: of(belief)?, after: of(tuned)?, best: of(truth)? })
}

impl Row {
    fn json(&self) -> Value {
        let of = |errors: Errors| json!([errors.before, errors.after, errors.best]);
        json!({ "seed": self.seed, "feed_forward": of(self.forward), "observer": of(self.observed), "wall_s": self.wall_s })
    }
}

fn sheet(rows: &[Row]) -> Sheet {
    let title = "friction and inertia off by up to half: tuned on a sine, judged on the step sequence";
    let columns = ["", "wanted", "feed-forward", "with the observer"];
    let mut sheet = Sheet::new("tune", title, &columns);
    let mut add = |what: &str, wanted: &str, of: &dyn Fn(Errors) -> bool| {
        let part = |pick: fn(&Row) -> Errors| {
            format!("{} of {}", rows.iter().filter(|row| of(pick(row))).count(), rows.len())
        };
        sheet.row([what.to_owned(), wanted.to_owned(), part(|row| row.forward), part(|row| row.observed)]);
    };
    add("following error at least 5 times lower", "≥ 90 %", &|of| of.before / of.after >= WANTED);
    add("the truth as belief is 5 times lower", "-", &|of| of.before / of.best >= WANTED);
    add("at most 1.2 times that with the truth as belief", "-", &|of| of.after <= 1.2 * of.best);
    add("higher than before", "0", &|of| of.after > of.before);
    let middle = |of: &dyn Fn(&Row) -> f64| {
        let mut all: Vec<f64> = rows.iter().map(of).collect();
        all.sort_by(f64::total_cmp);
        quantile(&all, 0.5).map_or_else(|| "-".to_owned(), digits)
    };
    sheet.row([
        "before over after, median".to_owned(),
        "-".to_owned(),
        middle(&|row| row.forward.before / row.forward.after),
        middle(&|row| row.observed.before / row.observed.after),
    ]);
    sheet.row(["s, median".to_owned(), "-".to_owned(), middle(&|row| row.wall_s), String::new()]);
    sheet
}
