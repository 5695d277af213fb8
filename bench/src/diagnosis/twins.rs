//! `bench diagnosis-twins`: causes that a rig's plan can't tell apart, and how `stepvalve investigate` decides between them.

use super::ask::diagnose;
use super::tables::rate;
use crate::output::{Results, Sheet, digits};
use crate::programs::beside;
use crate::progress::Progress;
use anyhow::{Context, Result};
use hidden_effect_rig::{Campaign, Finding, Gap, Hidden, LogKind, STRONG, twins};
use log_data::quantile;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The rig's own plan has so many samples; half of them are what an investigation may use.
const FIXED_PLAN: usize = 60_000;
/// The first record's samples, about: a third of that.
const FIRST: usize = 20_000;
/// Experiments that an investigation may make.
const EXPERIMENTS: u64 = 2;
/// Seeds that are tried for each pair, at most, until so many are ambiguous.
const TRIES: u64 = 4;

/// How much of it.
#[derive(clap::Args, Clone)]
pub struct Arguments {
    /// Ambiguous campaigns for each pair of twins
    #[arg(long, default_value_t = 5)]
    each: u64,
    /// The first seed
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
}

/// What an investigation came to.
struct Row {
    key: String,
    hidden: String,
    ended: String,
    named: BTreeSet<String>,
    steps: usize,
    samples: u64,
    wall_s: f64,
}

impl Row {
    fn is_right(&self) -> bool {
        self.ended == "decided" && self.named == BTreeSet::from([self.hidden.clone()])
    }

    fn json(&self) -> Value {
        json!({
            "key": self.key, "hidden": self.hidden, "ended": self.ended, "named": self.named, "steps": self.steps,
            "samples": self.samples, "wall_s": self.wall_s,
        })
    }
}

/// Draws campaigns whose twins a diagnosis calls ambiguous, and has each investigated.
///
/// # Errors
/// Where a program is missing or fails.
pub fn run(arguments: &Arguments, quick: bool) -> Result<Results> {
    let each = if quick { 1 } else { arguments.each };
    let pairs = twins(LogKind::Torque);
    eprintln!("seeds from {} on", arguments.first_seed);
    let progress = Progress::new(pairs.len() * usize::try_from(each)?);
    let (mut rows, mut clear) = (Vec::new(), 0);
    for (place, (hidden, _, gap)) in pairs.into_iter().enumerate() {
        let first = arguments.first_seed + 1000 * place as u64;
        let mut found = 0;
        for seed in first..first + TRIES * each {
            if found == each {
                break;
            }
            match investigated(seed, hidden, gap)? {
                Some(row) => {
                    progress.next(row.key.clone());
                    found += 1;
                    if !row.is_right() {
                        eprintln!("{}: {} {:?} in {} steps", row.key, row.ended, row.named, row.steps);
                    }
                    rows.push(row);
                }
                None => clear += 1,
            }
        }
    }
    Ok(Results {
        command: "diagnosis-twins",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "the normal scheduler".to_owned(),
        sheets: vec![sheet(&rows, clear)],
        data: rows.iter().map(Row::json).collect(),
    })
}

/// A campaign without what would tell the twins apart; `None` where the diagnosis does not call it ambiguous.
fn investigated(seed: u64, hidden: &str, gap: Gap) -> Result<Option<Row>> {
    let folder = tempfile::Builder::new().prefix("stepvalve-bench-").tempdir()?;
    let path = |name: &str| folder.path().join(name);
    let wish =
        Hidden { without: Some(gap), samples: FIRST, ..Hidden::with(LogKind::Torque, &[hidden], STRONG) };
    let Some(campaign) = Campaign::try_draw(seed, &wish) else { return Ok(None) };
    campaign.write(folder.path())?;
    std::fs::remove_file(path("truth.json"))?;
    let first =
        diagnose(&path("log.h5"), &path("model.toml"), &path("first"), &[], Duration::from_secs(300))?;
    let groups = Finding::of(&first).groups;
    if !groups.iter().any(|group| group.contains(hidden)) {
        return Ok(None);
    }
    let begun = Instant::now();
    let told = investigate(folder.path(), seed, hidden, gap)?;
    let steps = told.get("steps").and_then(Value::as_array).cloned().unwrap_or_default();
    let last = steps.last().cloned().unwrap_or_default();
    let causes = last.get("causes").and_then(Value::as_array).cloned().unwrap_or_default();
    let id = |cause: &Value| Some(cause.get("id")?.as_str()?.to_owned());
    Ok(Some(Row {
        key: format!("seed {seed}: {hidden} without {}", gap.name()),
        hidden: hidden.to_owned(),
        ended: told.get("ended").and_then(Value::as_str).unwrap_or_default().to_owned(),
        named: causes.iter().filter_map(id).collect(),
        steps: steps.len(),
        samples: last.get("samples").and_then(Value::as_u64).unwrap_or(0),
        wall_s: begun.elapsed().as_secs_f64(),
    }))
}

/// `stepvalve investigate`, with the rig as the command that measures; its investigation.json.
fn investigate(folder: &Path, seed: u64, hidden: &str, gap: Gap) -> Result<Value> {
    let out = folder.join("out");
    // The machine has made all earlier experiments too: it wears.
    let measure = format!(
        "plans=; for k in $(seq 1 $STEPVALVE_EXPERIMENT); do plans=\"$plans --plan {out}/$k/next-experiment.toml\"; done; \
         {rig} --seed {seed} --hidden {hidden} --without {gap} --samples {FIRST} $plans --out {made} >{made}.said && \
         mv {made}/log.h5 \"$STEPVALVE_LOG\"",
        out = out.display(),
        rig = beside("hidden-effect-rig")?.display(),
        gap = gap.name(),
        made = folder.join("made").display(),
    );
    let said = folder.join("said");
    let status = Command::new(beside("stepvalve")?)
        .args(["investigate", "--experiments", &EXPERIMENTS.to_string(), "--measure", &measure, "--log"])
        .arg(folder.join("log.h5"))
        .arg("--against")
        .arg(folder.join("model.toml"))
        .arg("--out")
        .arg(&out)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(File::create(&said)?)
        .status()?;
    if !status.success() {
        let said = std::fs::read_to_string(&said)?;
        return Ok(json!({ "ended": format!("failed: {}", said.lines().last().unwrap_or_default()) }));
    }
    serde_json::from_slice(&std::fs::read(out.join("investigation.json"))?).context("investigation.json")
}

fn sheet(rows: &[Row], clear: usize) -> Sheet {
    let title = "twins that the first record can't tell apart, torque logs; rates with their 95 % intervals";
    let mut sheet = Sheet::new("diagnosis-twins", title, &["", "wanted", "found"]);
    let count = |is: &dyn Fn(&Row) -> bool| rate(rows.iter().filter(|row| is(row)).count(), rows.len());
    sheet.row([
        "decided rightly within two experiments".to_owned(),
        "≥ 90 %".to_owned(),
        count(&Row::is_right),
    ]);
    let wrong = |row: &Row| row.named.iter().any(|id| *id != row.hidden);
    sheet.row(["a cause that is not hidden is named".to_owned(), "0".to_owned(), count(&wrong)]);
    let few = |row: &Row| row.samples <= FIXED_PLAN as u64 / 2;
    sheet.row([
        format!("at most half the {FIXED_PLAN} samples of the rig's plan"),
        "all".to_owned(),
        count(&few),
    ]);
    let middle = |of: &dyn Fn(&Row) -> f64| {
        let mut all: Vec<f64> = rows.iter().map(of).collect();
        all.sort_by(f64::total_cmp);
        quantile(&all, 0.5).map_or_else(|| "-".to_owned(), digits)
    };
    sheet.row(["samples, median".to_owned(), "-".to_owned(), middle(&|row| row.samples as f64)]);
    sheet.row(["s, median".to_owned(), "-".to_owned(), middle(&|row| row.wall_s)]);
    sheet.row(["campaigns drawn that were not ambiguous".to_owned(), "-".to_owned(), clear.to_string()]);
    sheet
}
