//! The product's own recordings: simulated with a truth, diagnosed with the belief.

use super::ask::{Limits, diagnose};
use super::cases::{Case, Class};
use super::row::Row;
use crate::programs::Workplace;
use anyhow::{Context, Result};
use hidden_effect_rig::{Finding, Outcome, intervals};
use own_recordings::{Mode, Recording, answer};
use serde_json::json;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;
use valve_model::EffectId;

/// One real-time run at a time: each wants the same core.
static CLOCK: Mutex<()> = Mutex::new(());

/// Records, diagnoses and judges.
pub fn one(case: &Case, limits: Limits) -> Result<Row> {
    let change = case.hidden.effects.first().and_then(|name| EffectId::from_name(name));
    let recording = Recording::draw(case.seed, change)?;
    let place = Workplace::new()?;
    let given = place.path("given");
    recording.write(&given)?;
    let simulate = || place.simulate(&given.join("scenario.toml"), recording.mode.name(), &[]);
    match recording.mode {
        Mode::InProcess => simulate(),
        Mode::RealTime => {
            let _alone = CLOCK.lock().unwrap_or_else(PoisonError::into_inner);
            simulate()
        }
    }
    .with_context(|| recording.what.clone())?;
    let run_h5 = place.newest_run().context("a run")?.join("run.h5");
    let key = answer(&recording, &run_h5)?;
    let begun = Instant::now();
    let diagnosis = diagnose(&run_h5, &given.join("belief.toml"), &place.path("out"), &[], limits.each)?;
    let wall_s = begun.elapsed().as_secs_f64();
    let finding = Finding::of(&diagnosis);
    let outcome = finding.judge(&key.truth);
    let class = if key.shows { case.class } else { Class::Unseen };
    let mut row = Row::new(case.key(), (case.family, class), limits.program, &key.truth, &finding, outcome);
    if let Some(truth) = row.truth.as_object_mut() {
        truth.insert("recording".to_owned(), json!(recording.what));
    }
    row.hidden.clone_from(&case.hidden.effects);
    row.wall_s = wall_s;
    row.samples = run_log::read_log(&run_h5)?.runs.iter().map(log_data::Run::len).sum();
    if class == Class::Strong && outcome == Outcome::Right {
        row.intervals = intervals(&key.truth, &diagnosis, true);
    }
    Ok(row)
}
