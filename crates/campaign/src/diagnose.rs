//! A run's diagnosis: what the belief gets wrong about the record, with the options that `stepvalve diagnose` has by default.

use crate::row::Diagnosed;
use diagnosis::{DiagnosisError, Options, Workers, diagnose};
use log_data::{Channel, Log, cut_to_known};
use valve_model::Model;

/// The tolerance of the model's numbers where a user says none.
const TOLERANCE: f64 = 0.03;

/// One job after the other, in this thread: the campaign's other threads have runs of their own.
struct Alone<'a>(&'a (dyn Fn() -> bool + Sync));

impl Workers for Alone<'_> {
    fn run(&self, count: usize, job: &(dyn Fn(usize) + Sync)) {
        (0..count).for_each(job);
    }

    fn is_over(&self) -> bool {
        (self.0)()
    }
}

/// Diagnoses a record. Where `is_over` says so meanwhile, the answer is none of the record's, and to be thrown away.
pub(crate) fn diagnosed(
    mut log: Log,
    belief: &Model,
    is_over: &(dyn Fn() -> bool + Sync),
) -> Result<Diagnosed, DiagnosisError> {
    let needed = [Channel::Angle, Channel::AngleCommand];
    let useful = [Channel::PressureDrop, Channel::OilTemperature];
    for run in &mut log.runs {
        // What was done is told of a user's log; of a simulated one it follows from the scenario.
        cut_to_known(run, &needed, &useful);
    }
    let options = Options { tolerance: TOLERANCE, ..Options::default() };
    let found = diagnose(&log, belief, &options, &Alone(is_over), &mut |_| {})?.diagnosis;
    let names = |ids: &[valve_model::EffectId]| ids.iter().map(|id| id.name().to_owned()).collect();
    Ok(Diagnosed {
        verdict: found.verdict.name().to_owned(),
        causes: found.causes.iter().map(|cause| cause.id.name().to_owned()).collect(),
        ambiguous: found.ambiguous.iter().map(|group| names(&group.ids)).collect(),
        residual_rms_rad: found.residual.first().map_or(f64::NAN, |residual| residual.rms),
        gain_ratio: found.gain.ratio,
    })
}
