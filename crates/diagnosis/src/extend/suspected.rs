//! The candidate of a law that a user suspects.

use crate::extend::candidate::{Candidate, Map, Parameter, Probe};
use crate::extend::suspect::{Suspect, UNKNOWN};
use crate::log::facts::Facts;

/// The law as a candidate, screened from each of the shapes that it may begin with.
pub(crate) fn candidate_of(suspect: &Suspect, facts: &Facts) -> Candidate {
    let numbers = 0..suspect.parameters.len();
    let parameters: Vec<Parameter> =
        numbers.clone().filter_map(|index| parameter(suspect, index, facts)).collect();
    let column = |index: &usize| parameters.get(*index).map(|of| (*index, of.step));
    let columns: Vec<(usize, f64)> = suspect.amplitudes().iter().filter_map(column).collect();
    let mut probes: Vec<Probe> = Vec::new();
    for trial in 0..UNKNOWN.len() {
        let shape = numbers.clone().map(|index| suspect.begin(index, trial)).collect();
        let probe = Probe { shape, columns: columns.clone(), jump: false };
        if !probes.contains(&probe) {
            probes.push(probe);
        }
    }
    let (free, own) = (numbers.collect(), Some(suspect.clone()));
    let id = suspect.effect.id();
    Candidate { id, parameters, probes, free, optional: Vec::new(), series: false, own }
}

fn parameter(suspect: &Suspect, index: usize, facts: &Facts) -> Option<Parameter> {
    /// The first step of what is no amplitude, in parts of it; and of one that begins at zero.
    const PART: f64 = 0.05;
    let of = suspect.parameters.get(index)?;
    let neutral = suspect.begin(index, 0);
    let is_amplitude = suspect.amplitudes().contains(&index);
    let step = if is_amplitude { suspect.step(index, facts) } else { PART * neutral.abs() };
    let step = if step > 0.0 { step } else { PART };
    let (lower, upper) = (of.min, of.max);
    let step = step.min(0.1 * (upper - lower));
    Some(Parameter { key: of.key, slot: None, map: Map::Plain, neutral, lower, upper, step })
}
