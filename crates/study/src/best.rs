//! Which reading of a log tells more, where some runs lack a channel: all runs without it, or those that have it alone.

use crate::readings::{Reading, needs};
use diagnosis::{Diagnosis, DiagnosisError, Event, Found, Options, Verdict, Workers, diagnose};
use valve_model::Model;

/// Diagnoses the first reading, and the other one if that finds no explanation. The other one's answer is taken if it explains all
/// by something that depends on the channel: without that it is the same question, asked of fewer runs.
pub fn diagnose_best(
    readings: Vec<Reading>,
    model: &Model,
    options: &Options,
    workers: &dyn Workers,
    tell: &mut dyn FnMut(Event<'_>),
) -> Result<Option<(Found, Reading)>, DiagnosisError> {
    let mut best: Option<(Found, Reading)> = None;
    for reading in readings {
        if let Some((found, _)) = &best {
            if is_settled(found.diagnosis.verdict) || workers.is_over() {
                break;
            }
            tell(Event::Step("once more, with the runs alone that have all channels"));
        }
        let found = diagnose(&reading.log, model, options, workers, tell)?;
        let better = best.as_ref().is_none_or(|(other, _)| {
            is_settled(found.diagnosis.verdict)
                && !is_settled(other.diagnosis.verdict)
                && names_what_needs(&found.diagnosis, &reading)
        });
        if better {
            best = Some((found, reading));
        }
    }
    Ok(best)
}

/// Whether nothing is left to explain.
fn is_settled(verdict: Verdict) -> bool {
    matches!(verdict, Verdict::Explained | Verdict::NoDiscrepancy)
}

/// Whether a cause, or a member of a group, depends on a channel that runs were left out for.
fn names_what_needs(diagnosis: &Diagnosis, reading: &Reading) -> bool {
    let causes = diagnosis.causes.iter().map(|cause| cause.id);
    let groups = diagnosis.ambiguous.iter().flat_map(|group| group.ids.iter().copied());
    causes.chain(groups).any(|id| reading.cut_for.iter().any(|channel| needs(id, *channel)))
}
