//! Entry point: log and model in, diagnosis out.

use crate::DiagnosisError;
use crate::found::{Event, Found};
use crate::left_out::stand_out;
use crate::options::Options;
use crate::outcome::Verdict;
use crate::pass::pass;
use crate::workers::Workers;
use log_data::Log;
use std::collections::BTreeSet;
use valve_model::Model;

/// Diagnoses a log against a model.
///
/// ```
/// use diagnosis::{OneAfterTheOther, Options, Verdict, diagnose};
/// use log_data::{Log, Run};
/// use prediction::{Past, predict};
/// use valve_model::{Effect, EffectId, EffectValue, Model};
///
/// // The rig has 20 % more friction than the model, and is measured eight times.
/// let model = Model { motor: None, ..Model::bench_rig() };
/// let more = Effect::new(EffectId::CoulombLevel, &[("factor", EffectValue::Number(1.2))])?;
/// let rig = Model { effects: vec![more], ..model.clone() };
/// let run = |number: u32| -> Result<Run, prediction::PredictionError> {
///     let time_s: Vec<f64> = (0..1000).map(|k| 5.0 * f64::from(number) + 1e-3 * f64::from(k)).collect();
///     let angle_rad = time_s.iter().map(|time_s| 0.3 * ((3.0 + f64::from(number)) * time_s).sin()).collect();
///     let torque_nm = Some(vec![0.0; time_s.len()]);
///     let mut run = Run { name: format!("{number}"), time_s, angle_rad, torque_nm, ..Run::default() };
///     predict(&mut run, &rig, &Past::default())?;
///     // A transducer with noise of 10 mN·m.
///     let mut random = number + 1;
///     for torque_nm in run.torque_nm.iter_mut().flatten() {
///         random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
///         *torque_nm += 0.01 * 12f64.sqrt() * (f64::from(random >> 8) / f64::from(1 << 24) - 0.5);
///     }
///     Ok(run)
/// };
/// let log = Log { runs: (0..8).map(run).collect::<Result<_, _>>()?, ..Log::default() };
///
/// let found = diagnose(&log, &model, &Options::default(), &OneAfterTheOther, &mut |_| {})?;
/// assert_eq!(found.diagnosis.verdict, Verdict::Explained);
/// assert_eq!(found.diagnosis.causes[0].id, EffectId::CoulombLevel);
/// let factor = &found.diagnosis.causes[0].parameters["factor"];
/// assert!((factor.value - 1.2).abs() < 0.01, "{}", factor.value);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`DiagnosisError`]: a run or a model that can't be used.
pub fn diagnose(
    log: &Log,
    model: &Model,
    options: &Options,
    workers: &dyn Workers,
    tell: &mut dyn FnMut(Event<'_>),
) -> Result<Found, DiagnosisError> {
    let first = pass(log, model, options, &BTreeSet::new(), workers, tell)?;
    let Some(fitted) = first.fitted.filter(|_| is_noise(&first.found) && !workers.is_over()) else {
        return Ok(first.found);
    };
    tell(Event::Step("looking at what was not fitted"));
    let mut also = stand_out(log, &first.found.extended, &fitted, options, workers)?;
    if also.is_empty() {
        return Ok(first.found);
    }
    tell(Event::Again("once more, with the pieces that hold more than noise"));
    also.extend(fitted);
    Ok(pass(log, model, options, &also, workers, tell)?.found)
}

/// Whether nothing but noise is said to be left.
fn is_noise(found: &Found) -> bool {
    matches!(found.diagnosis.verdict, Verdict::NoDiscrepancy | Verdict::Explained)
}
