//! `bench diagnosis-unnamed`: laws that no cause of the list has, hidden in campaigns of the rig, and what `stepvalve diagnose` makes of them.

use super::Log as LogChoice;
use super::ask::diagnose;
use super::tables::rate;
use crate::output::{Results, Sheet, digits};
use crate::progress::Progress;
use anyhow::Result;
use hidden_effect_rig::{Campaign, Family, Finding, Hidden, LAWS, LogKind, STRONG, Truth, choose};
use log_data::quantile;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

/// A model leaves noise if it leaves at most so many times of it.
const NOISE: f64 = 1.2;

/// How much of it.
#[derive(clap::Args, Clone)]
pub struct Arguments {
    /// Campaigns with a law
    #[arg(long, default_value_t = 60)]
    laws: u64,
    /// Campaigns with nothing hidden
    #[arg(long, default_value_t = 200)]
    clean: u64,
    /// The first seed
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// About how many samples a campaign has
    #[arg(long, default_value_t = 20_000)]
    samples: usize,
    /// Logs of one kind alone
    #[arg(long, value_enum)]
    log: Option<LogChoice>,
    /// Ends a diagnosis after so many seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 300, value_parser = clap::value_parser!(u64).range(1..))]
    limit: u64,
}

/// What was found in a campaign.
struct Row {
    key: String,
    log: LogKind,
    hides: bool,
    /// Held-out RMS over the noise, without and with what was found; and with it, each sample counted by how well it is known.
    before: f64,
    after: f64,
    after_as_known: f64,
    /// Whether there is a law, and whether its first quantity is one that drives the hidden one.
    has_law: bool,
    is_right: bool,
    named: BTreeSet<String>,
    wall_s: f64,
}

/// Hides laws of the real family, five times the noise, and asks; and asks of campaigns that hide nothing.
///
/// # Errors
/// Where the program is missing or fails.
pub fn run(arguments: &Arguments, quick: bool) -> Result<Results> {
    let (laws, clean) = if quick { (3, 3) } else { (arguments.laws, arguments.clean) };
    eprintln!("seeds from {} on", arguments.first_seed);
    let progress = Progress::new(usize::try_from(laws + clean)?);
    let mut rows = Vec::new();
    for hides in [true, false] {
        let wanted = if hides { laws } else { clean };
        let mut seed = arguments.first_seed;
        let mut drawn = 0;
        while drawn < wanted {
            seed += 1;
            let Some((campaign, key)) = draw(arguments, seed, hides) else { continue };
            progress.next(key.clone());
            drawn += 1;
            let row = ask(&campaign, key, hides, arguments)?;
            row.report();
            rows.push(row);
        }
    }
    Ok(Results {
        command: "diagnosis-unnamed",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "the normal scheduler".to_owned(),
        sheets: vec![sheet(&rows)],
        data: rows.iter().map(Row::json).collect(),
    })
}

fn draw(arguments: &Arguments, seed: u64, hides: bool) -> Option<(Campaign, String)> {
    let log = match arguments.log {
        Some(LogChoice::Torque) => LogKind::Torque,
        Some(LogChoice::Angle) => LogKind::Angle,
        None if seed.is_multiple_of(3) => LogKind::Angle,
        None => LogKind::Torque,
    };
    let law = choose(seed, LAWS);
    let hidden = if hides { Hidden::with(log, &[law], STRONG) } else { Hidden::none(log) };
    let hidden = Hidden { family: Family::Real, samples: arguments.samples, ..hidden };
    let what = if hides { law } else { "nothing" };
    Some((Campaign::try_draw(seed, &hidden)?, format!("{log:?} seed {seed}: {what}")))
}

fn ask(campaign: &Campaign, key: String, hides: bool, arguments: &Arguments) -> Result<Row> {
    let folder = tempfile::Builder::new().prefix("stepvalve-bench-").tempdir()?;
    campaign.write(folder.path())?;
    std::fs::remove_file(folder.path().join("truth.json"))?;
    let path = |name: &str| folder.path().join(name);
    let begun = Instant::now();
    let limit = Duration::from_secs(arguments.limit);
    let found = diagnose(&path("log.h5"), &path("model.toml"), &path("out"), &[], limit)?;
    let wall_s = begun.elapsed().as_secs_f64();
    let noise = noise(&campaign.truth, &found);
    let over_noise =
        |pointer: &str| found.pointer(pointer).and_then(Value::as_f64).unwrap_or(f64::NAN) / noise;
    let list = |of: Option<&Value>| of.and_then(Value::as_array).cloned().unwrap_or_default();
    let first = found.pointer("/unnamed/0/depends_on/0").cloned().unwrap_or_default();
    let hidden =
        campaign.truth.effects.first().and_then(|effect| effect.parameters.get("depends_on").cloned());
    Ok(Row {
        key: format!("{key} {}", form(&campaign.truth)),
        log: campaign.truth.log,
        hides,
        before: over_noise("/gain/rms_before"),
        after: over_noise("/gain/rms_after"),
        after_as_known: found.pointer("/gain/over_noise_after").and_then(Value::as_f64).unwrap_or(f64::NAN),
        has_law: !list(found.get("unnamed")).is_empty(),
        is_right: list(hidden.as_ref()).contains(&first),
        named: Finding::of(&found).named_wrongly(&campaign.truth),
        wall_s,
    })
}

/// The noise that a prediction can't go below, RMS: the channel's with the measured motion's, as the diagnosis estimates them. Where it
/// takes what it can't explain for coloured noise, the rig's own of the channel.
fn noise(truth: &Truth, found: &Value) -> f64 {
    let estimated = found.pointer("/residual/0/noise").and_then(Value::as_f64).unwrap_or(f64::NAN);
    let is_coloured =
        found.get("nuisances").is_some_and(|of| of.to_string().contains("the noise is coloured"));
    if is_coloured { truth.noise } else { estimated.max(truth.noise) }
}

fn form(truth: &Truth) -> String {
    let of = |key: &str| {
        truth.effects.first().and_then(|effect| effect.parameters.get(key)?.as_str().map(str::to_owned))
    };
    format!("{} {}", of("acts_on").unwrap_or_default(), of("form").unwrap_or_default())
}

impl Row {
    /// What is not as it should be is said at once.
    fn report(&self) {
        let fine = if self.hides { self.after <= NOISE && self.is_right } else { !self.has_law };
        if !fine {
            eprintln!(
                "{}: {:.2} to {:.2} times the noise in {:.1} s, law {}, its quantity {}, named {:?}",
                self.key, self.before, self.after, self.wall_s, self.has_law, self.is_right, self.named
            );
        }
    }

    fn json(&self) -> Value {
        json!({
            "key": self.key, "hides": self.hides, "before": self.before, "after": self.after,
            "after_as_known": self.after_as_known, "has_law": self.has_law, "is_right": self.is_right,
            "named": self.named, "wall_s": self.wall_s,
        })
    }
}

fn sheet(rows: &[Row]) -> Sheet {
    let title = "laws that no cause has, real family, five times the noise; rates with their 95 % intervals";
    let mut sheet = Sheet::new("diagnosis-unnamed", title, &["", "wanted", "all logs", "torque", "angle"]);
    let mut add = |what: &str, wanted: &str, of: &dyn Fn(&Row) -> Option<bool>| {
        let rated = |log: Option<LogKind>| {
            let part = rows.iter().filter(|row| log.is_none_or(|log| row.log == log));
            let answers: Vec<bool> = part.filter_map(of).collect();
            rate(answers.iter().filter(|answer| **answer).count(), answers.len())
        };
        let found = [rated(None), rated(Some(LogKind::Torque)), rated(Some(LogKind::Angle))];
        sheet.row([what.to_owned(), wanted.to_owned()].into_iter().chain(found));
    };
    add("at most 1.2 times the noise left on runs held out", "≥ 80 %", &|row| {
        row.hides.then_some(row.after <= NOISE)
    });
    add("the same, each sample counted by how well it is known", "≥ 80 %", &|row| {
        row.hides.then_some(row.after_as_known <= NOISE)
    });
    add("at most half of the error left", "-", &|row| row.hides.then_some(row.after <= 0.5 * row.before));
    add("a law is told", "-", &|row| row.hides.then_some(row.has_law));
    add("its first quantity drives the hidden one", "≥ 90 %", &|row| {
        (row.hides && row.has_law).then_some(row.is_right)
    });
    add("a cause of the list is named that is not there", "0", &|row| {
        row.hides.then_some(!row.named.is_empty())
    });
    add("nothing hidden: a law is told", "≤ 3 %", &|row| (!row.hides).then_some(row.has_law));
    let mut times: Vec<f64> = rows.iter().map(|row| row.wall_s).collect();
    times.sort_by(f64::total_cmp);
    let at = |part: f64| quantile(&times, part).map_or_else(|| "-".to_owned(), digits);
    let (middle, most) = (at(0.5), at(0.95));
    sheet.row([
        "s, median and 95th percentile".to_owned(),
        "< 60".to_owned(),
        format!("{middle}, {most}"),
        String::new(),
        String::new(),
    ]);
    sheet
}
