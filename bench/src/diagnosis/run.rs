//! Draws each campaign, has it diagnosed by the program, and judges the finding.

use super::Family;
use super::ask::{Limits, diagnose};
use super::baseline;
use super::cases::{Case, Class};
use super::own;
use super::row::{Other, Row};
use crate::progress::Progress;
use anyhow::{Context, Result};
use hidden_effect_rig::{Campaign, Finding, Hidden, Interval, LogKind, Outcome, Truth, intervals};
use log_data::{Log, Run};
use serde_json::Value;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// All cases, several at a time; each is told to `record` once it is judged.
///
/// # Errors
/// The first failure.
pub fn all(
    cases: &[Case],
    progress: &Mutex<Progress>,
    limits: Limits,
    record: &(dyn Fn(&Row) -> Result<()> + Sync),
) -> Result<Vec<Row>> {
    let begun = Instant::now();
    let in_time = || limits.all.is_none_or(|limit| begun.elapsed() < limit);
    let queue = Mutex::new(cases.iter().enumerate());
    let done: Mutex<Vec<(usize, Result<Option<Row>>)>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..limits.threads {
            scope.spawn(|| {
                let next =
                    || queue.lock().unwrap_or_else(PoisonError::into_inner).next().filter(|_| in_time());
                while let Some((index, case)) = next() {
                    let what = case.key();
                    progress.lock().unwrap_or_else(PoisonError::into_inner).next(what.clone());
                    let row = one(case, limits).with_context(|| what).and_then(|row| {
                        if let Some(row) = &row {
                            row.report();
                            record(row)?;
                        }
                        Ok(row)
                    });
                    done.lock().unwrap_or_else(PoisonError::into_inner).push((index, row));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().filter_map(|(_, row)| row.transpose()).collect()
}

/// `None` where the rig can't be drawn from the seed.
fn one(case: &Case, limits: Limits) -> Result<Option<Row>> {
    if case.family == Family::Own {
        return own::one(case, limits).map(Some);
    }
    let Some(campaign) = Campaign::try_draw(case.seed, &case.hidden) else {
        eprintln!("left out: {}: no attempt keeps step and shows what is hidden", case.key());
        return Ok(None);
    };
    let truth = &campaign.truth;
    let folder = tempfile::Builder::new().prefix("stepvalve-bench-").tempdir()?;
    let begun = Instant::now();
    let diagnosis =
        diagnose_campaign(&campaign, case.family == Family::Exact, None, folder.path(), limits.each)?;
    let wall_s = begun.elapsed().as_secs_f64();
    let finding = Finding::of(&diagnosis);
    let outcome = finding.judge(truth);
    let mut row = Row::new(case.key(), (case.family, case.class), limits.program, truth, &finding, outcome);
    row.wall_s = wall_s;
    row.samples = campaign.log.runs.iter().map(Run::len).sum();
    if truth.log == LogKind::Torque {
        let log = filled(&campaign.log);
        let [regression, frols] = baseline::found(&log, &campaign.model_toml)?
            .map(|finding| Some(Other { outcome: finding.judge(truth), named: finding.named }));
        (row.regression, row.frols) = (regression, frols);
    }
    if matches!(case.class, Class::Strong | Class::Weak) && outcome == Outcome::Right {
        row.intervals = intervals(truth, &diagnosis, true);
        row.rms_over_noise = rms_after(&diagnosis).map(|rms| rms / truth.noise);
        if case.best_fit {
            row.best_fits = best_fits(case, truth, &diagnosis, limits.each)?;
        }
    }
    Ok(Some(row))
}

/// Held-out RMS with the extended model; with what fitted best of a group, where that is all that is said.
fn rms_after(diagnosis: &Value) -> Option<f64> {
    let extended = diagnosis.pointer("/gain/rms_after");
    let best =
        diagnosis.pointer("/ambiguous/0/best/rms_after").filter(|_| diagnosis["verdict"] == "ambiguous");
    best.or(extended).and_then(Value::as_f64)
}

/// The same campaign without noise, fitted by the product: what its own form makes of the rig's. It is told the noise of the
/// other: how much a run counts that is off by more than noise goes by that.
fn best_fits(case: &Case, truth: &Truth, diagnosis: &Value, limit: Duration) -> Result<Vec<Interval>> {
    let mut found = intervals(truth, diagnosis, false);
    if found.is_empty() || case.family != Family::Exact {
        return Ok(Vec::new());
    }
    let quiet = Campaign::draw(case.seed, &Hidden { noise_free: true, ..case.hidden.clone() });
    let folder = tempfile::Builder::new().prefix("stepvalve-bench-").tempdir()?;
    let best = diagnose_campaign(&quiet, true, Some(truth.noise), folder.path(), limit)?;
    let best = intervals(&quiet.truth, &best, false);
    found.retain_mut(|interval| match best.iter().find(|other| other.of == interval.of) {
        Some(other) => {
            interval.truth = other.value;
            true
        }
        None => false,
    });
    Ok(found)
}

/// What `stepvalve diagnose` says of a campaign. It sees the log and the model, no more, but for a noise that it is told, and
/// that the numbers of the exact family's models are exact.
fn diagnose_campaign(
    campaign: &Campaign,
    exact: bool,
    noise: Option<f64>,
    folder: &Path,
    limit: Duration,
) -> Result<Value> {
    campaign.write(folder)?;
    std::fs::remove_file(folder.join("truth.json"))?;
    let mut more: Vec<String> = noise.map(|noise| format!("--noise={noise:e}")).into_iter().collect();
    if exact {
        more.push("--tolerance=0".to_owned());
    }
    diagnose(&folder.join("log.h5"), &folder.join("model.toml"), &folder.join("out"), &more, limit)
}

/// The log with its missing samples drawn through, for those who can't do without them.
fn filled(log: &Log) -> Log {
    let mut log = log.clone();
    for run in &mut log.runs {
        let channels = [&mut run.torque_nm, &mut run.pressure_drop_pa, &mut run.oil_temperature_c];
        channels.into_iter().flatten().chain([&mut run.angle_rad]).for_each(|values| fill(values));
    }
    log
}

fn fill(values: &mut [f64]) {
    let mut last = values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
    for value in values {
        if value.is_finite() {
            last = *value;
        } else {
            *value = last;
        }
    }
}
