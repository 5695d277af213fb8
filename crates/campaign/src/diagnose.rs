//! A run's diagnosis: what the belief gets wrong about the record, with the options that `stepvalve diagnose` has by default.

use crate::row::Diagnosed;
use diagnosis::{DiagnosisError, OneAfterTheOther, Options, diagnose};
use log_data::{Channel, Log, cut_to_known};
use valve_model::Model;

/// The tolerance of the model's numbers where a user says none.
const TOLERANCE: f64 = 0.03;

/// Diagnoses a record in this thread.
pub(crate) fn diagnosed(mut log: Log, belief: &Model) -> Result<Diagnosed, DiagnosisError> {
    let needed = [Channel::Angle, Channel::AngleCommand];
    let useful = [Channel::PressureDrop, Channel::OilTemperature];
    for run in &mut log.runs {
        // What was done is told of a user's log; of a simulated one it follows from the scenario.
        cut_to_known(run, &needed, &useful);
    }
    let options = Options { tolerance: TOLERANCE, ..Options::default() };
    let found = diagnose(&log, belief, &options, &OneAfterTheOther, &mut |_| {})?.diagnosis;
    let names = |ids: &[valve_model::EffectId]| ids.iter().map(|id| id.name().to_owned()).collect();
    Ok(Diagnosed {
        verdict: found.verdict.name().to_owned(),
        causes: found.causes.iter().map(|cause| cause.id.name().to_owned()).collect(),
        ambiguous: found.ambiguous.iter().map(|group| names(&group.ids)).collect(),
        residual_rms_rad: found.residual.first().map_or(f64::NAN, |residual| residual.rms),
        gain_ratio: found.gain.ratio,
    })
}
