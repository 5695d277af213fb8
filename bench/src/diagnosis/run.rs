//! Draws each campaign, has it diagnosed by the program, and judges the finding.

use super::baseline;
use super::cases::{Case, Class};
use crate::programs::beside;
use crate::progress::Progress;
use anyhow::{Context, Result, bail};
use hidden_effect_rig::{Campaign, Finding, Hidden, Interval, LogKind, Outcome, Truth, intervals};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs::File;
use std::num::NonZero;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A campaign with what was found in it.
#[derive(Debug, Clone)]
pub struct Judged {
    /// What was drawn.
    pub case: Case,
    /// What is true.
    pub truth: Truth,
    /// What was found.
    pub finding: Finding,
    /// What that is worth.
    pub outcome: Outcome,
    /// What the regression named, and what that is worth; torque logs alone.
    pub baseline: Option<(BTreeSet<String>, Outcome)>,
    /// Intervals of parameters whose form rig and product share.
    pub intervals: Vec<Interval>,
    /// Intervals of the others, the best fit to noise-free data standing for the truth.
    pub best_fits: Vec<Interval>,
    /// Held-out RMS after extension, over the rig's noise; where causes can't be told apart, with what fitted best.
    pub rms_over_noise: f64,
    /// Time for the diagnosis, s.
    pub wall_s: f64,
}

impl Judged {
    /// For machines.
    pub fn json(&self) -> Value {
        let truth = self.truth.json();
        json!({
            "seed": self.case.seed, "class": format!("{:?}", self.case.class), "log": truth.get("log"),
            "hidden": truth.get("hidden"), "without": format!("{:?}", self.case.hidden.without),
            "verdict": self.finding.verdict, "named": self.finding.named, "ambiguous": self.finding.groups,
            "outcome": format!("{:?}", self.outcome),
            "baseline": self.baseline.as_ref().map(|(named, outcome)| json!({"named": named, "outcome": format!("{outcome:?}")})),
            "intervals": self.intervals.iter().chain(&self.best_fits).map(|i| json!({"of": i.of, "truth": i.truth, "value": i.value, "ci95": i.ci95})).collect::<Vec<_>>(),
            "rms_over_noise": self.rms_over_noise, "wall_s": self.wall_s,
        })
    }
}

/// How long things may take.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// No further campaign is begun after so long.
    pub all: Option<Duration>,
    /// A diagnosis is ended after so long, and counts as one that found nothing.
    pub each: Duration,
}

/// All cases, as many at a time as there are processors; each is told to `record` once it is judged.
///
/// # Errors
/// The first failure.
pub fn all(
    cases: &[Case],
    progress: &Mutex<Progress>,
    limits: Limits,
    record: &(dyn Fn(&Judged) -> Result<()> + Sync),
) -> Result<Vec<Judged>> {
    let begun = Instant::now();
    let in_time = || limits.all.is_none_or(|limit| begun.elapsed() < limit);
    let queue = Mutex::new(cases.iter().enumerate());
    let done: Mutex<Vec<(usize, Result<Option<Judged>>)>> = Mutex::new(Vec::new());
    let workers = std::thread::available_parallelism().map_or(1, NonZero::get);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                let next =
                    || queue.lock().unwrap_or_else(PoisonError::into_inner).next().filter(|_| in_time());
                while let Some((index, case)) = next() {
                    let what = format!("seed {}, {:?}", case.seed, case.hidden.effects);
                    progress.lock().unwrap_or_else(PoisonError::into_inner).next(what.clone());
                    let judged = one(case, limits.each).with_context(|| what).and_then(|judged| {
                        if let Some(judged) = &judged {
                            report(judged);
                            record(judged)?;
                        }
                        Ok(judged)
                    });
                    done.lock().unwrap_or_else(PoisonError::into_inner).push((index, judged));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().filter_map(|(_, judged)| judged.transpose()).collect()
}

/// What is not as it should be is said at once: it is what one looks at next.
fn report(judged: &Judged) {
    if judged.outcome != Outcome::Right {
        eprintln!(
            "{:?}: seed {} {:?} {:?} without {:?}: {}: named {:?}, groups {:?}",
            judged.outcome,
            judged.case.seed,
            judged.case.class,
            judged.case.hidden.effects,
            judged.case.hidden.without,
            judged.finding.verdict,
            judged.finding.named,
            judged.finding.groups,
        );
    }
}

/// `None` where the rig can't be drawn from the seed.
fn one(case: &Case, limit: Duration) -> Result<Option<Judged>> {
    let Some(campaign) = Campaign::try_draw(case.seed, &case.hidden) else {
        eprintln!("left out: seed {}, {:?}: the rotor loses steps whatever is drawn", case.seed, case.hidden);
        return Ok(None);
    };
    let begun = Instant::now();
    let diagnosis = diagnose(&campaign, None, limit)?;
    let wall_s = begun.elapsed().as_secs_f64();
    let finding = Finding::of(&diagnosis);
    let outcome = finding.judge(&campaign.truth);
    let baseline = match campaign.truth.log {
        LogKind::Torque => {
            let named = baseline::named(&campaign.log, &campaign.model_toml)?;
            let verdict = if named.is_empty() { "no-discrepancy" } else { "explained" };
            let finding = Finding { verdict: verdict.to_owned(), named: named.clone(), groups: Vec::new() };
            Some((named, finding.judge(&campaign.truth)))
        }
        LogKind::Angle => None,
    };
    let single = matches!(case.class, Class::Strong | Class::Weak) && outcome == Outcome::Right;
    let best_fits = if case.best_fit && single {
        best_fits(case, &campaign.truth, &diagnosis, limit)?
    } else {
        Vec::new()
    };
    Ok(Some(Judged {
        case: case.clone(),
        intervals: if single { intervals(&campaign.truth, &diagnosis, true) } else { Vec::new() },
        best_fits,
        rms_over_noise: rms_after(&diagnosis) / campaign.truth.noise,
        truth: campaign.truth,
        finding,
        outcome,
        baseline,
        wall_s,
    }))
}

/// Held-out RMS with the extended model; with what fitted best of a group, where that is all that is said.
fn rms_after(diagnosis: &Value) -> f64 {
    let extended = diagnosis.pointer("/gain/rms_after");
    let best =
        diagnosis.pointer("/ambiguous/0/best/rms_after").filter(|_| diagnosis["verdict"] == "ambiguous");
    best.or(extended).and_then(Value::as_f64).unwrap_or(f64::NAN)
}

/// The same campaign without noise, fitted by the product: what its own form makes of the rig's. It is told the noise of the
/// other: how much a run counts that is off by more than noise goes by that.
fn best_fits(case: &Case, truth: &Truth, diagnosis: &Value, limit: Duration) -> Result<Vec<Interval>> {
    let mut found = intervals(truth, diagnosis, false);
    if found.is_empty() {
        return Ok(found);
    }
    let quiet = Campaign::draw(case.seed, &Hidden { noise_free: true, ..case.hidden.clone() });
    let best = intervals(&quiet.truth, &diagnose(&quiet, Some(truth.noise), limit)?, false);
    found.retain_mut(|interval| match best.iter().find(|other| other.of == interval.of) {
        Some(other) => {
            interval.truth = other.value;
            true
        }
        None => false,
    });
    Ok(found)
}

/// What `stepvalve diagnose` says of a campaign. It sees the log and the model, no more, but for a noise that it is told.
fn diagnose(campaign: &Campaign, noise: Option<f64>, limit: Duration) -> Result<Value> {
    let folder = tempfile::Builder::new().prefix("stepvalve-bench-").tempdir()?;
    let (given, out) = (folder.path().join("given"), folder.path().join("out"));
    let said = folder.path().join("said");
    std::fs::create_dir(&given)?;
    run_given(campaign, &given)?;
    let mut child = Command::new(beside("stepvalve")?)
        .args(["diagnose", "--seed", "0", "--log"])
        .arg(given.join("log.h5"))
        .arg("--model")
        .arg(given.join("model.toml"))
        .arg("--out")
        .arg(&out)
        .args(noise.map(|noise| format!("--noise={noise:e}")))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(File::create(&said)?)
        .spawn()?;
    let Some(status) = wait(&mut child, limit)? else {
        return Ok(json!({ "verdict": format!("no answer in {} s", limit.as_secs()) }));
    };
    if !status.success() {
        bail!("stepvalve diagnose: {status}: {}", std::fs::read_to_string(&said)?.trim());
    }
    serde_json::from_slice(&std::fs::read(out.join("diagnosis.json"))?).context("diagnosis.json")
}

/// Waits for a program's end; ends it where that takes longer than `limit`.
fn wait(child: &mut Child, limit: Duration) -> Result<Option<ExitStatus>> {
    let begun = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if begun.elapsed() > limit {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Log and model, without the truth.
fn run_given(campaign: &Campaign, folder: &Path) -> Result<()> {
    campaign.write(folder)?;
    Ok(std::fs::remove_file(folder.join("truth.json"))?)
}
