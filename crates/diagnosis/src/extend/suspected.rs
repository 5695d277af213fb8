//! A law that a user suspects, as a candidate.

use crate::extend::candidate::{Candidate, Map, Parameter, Probe};
use crate::log::facts::Facts;
use crate::suspect::{PLACES, Ranges, Suspect};
use valve_model::{ActsOn, Condition, Covariate};

/// Finite-difference step of an amplitude: the change that it makes, as a fraction of T_c, of the levels or of σ2.
const STEP: f64 = 0.02;

/// The law as a candidate, screened from each of the shapes that it may begin with.
pub(crate) fn candidate_of(suspect: &Suspect, facts: &Facts) -> Candidate {
    let numbers = 0..suspect.parameters.len();
    let parameters: Vec<Parameter> =
        numbers.clone().filter_map(|index| parameter(suspect, index, facts)).collect();
    let column = |index: &usize| parameters.get(*index).map(|of| (*index, of.step));
    let columns: Vec<(usize, f64)> = suspect.amplitudes().iter().filter_map(column).collect();
    let probe = |shape| Probe { shape, columns: columns.clone(), jump: false };
    let probes = suspect.shapes().into_iter().map(probe).collect();
    let (free, own) = (numbers.collect(), Some(suspect.clone()));
    let id = suspect.effect.id();
    Candidate { id, parameters, probes, free, optional: Vec::new(), series: false, own }
}

fn parameter(suspect: &Suspect, index: usize, facts: &Facts) -> Option<Parameter> {
    /// Finite-difference step of a parameter that is no amplitude, as a fraction of its start; absolute if that is zero.
    const PART: f64 = 0.05;
    let of = suspect.parameters.get(index)?;
    let neutral = suspect.begin(index);
    let is_amplitude = suspect.amplitudes().contains(&index);
    let step = if is_amplitude { amplitude_step(suspect, index, facts) } else { PART * neutral.abs() };
    let step = if step > 0.0 { step } else { PART };
    let (lower, upper) = (of.min, of.max);
    let step = step.min(0.1 * (upper - lower));
    Some(Parameter { key: of.key, slot: None, map: Map::Plain, neutral, lower, upper, step })
}

/// Why the data can't show it; `None` if they can.
pub(crate) fn why_not_suspected(suspect: &Suspect, facts: &Facts) -> Option<String> {
    let effect = &suspect.effect;
    if effect.needs(Condition::PressureDrop) && facts.pressure_mpa.is_none() {
        return Some("no pressure_drop channel".to_owned());
    }
    if effect.needs(Condition::OilTemperature) && facts.temperature_c.is_none() {
        return Some("no oil_temperature channel".to_owned());
    }
    let driven = !facts.kind.motion_is_measured && !adds_torque(suspect);
    let reason = "friction by acceleration is predicted from a measured motion alone";
    (driven && effect.depends_on(Covariate::Acceleration)).then(|| reason.to_owned())
}

fn adds_torque(suspect: &Suspect) -> bool {
    suspect.effect.custom().is_some_and(|law| law.acts_on == ActsOn::Torque)
}

/// Finite-difference step of an amplitude, from the law's root mean square over the ranges of the data.
fn amplitude_step(suspect: &Suspect, index: usize, facts: &Facts) -> f64 {
    let Some(of) = suspect.parameters.get(index) else { return 0.0 };
    let unit = match of.start {
        Some(start) if start != 0.0 => start.abs(),
        _ => 1.0_f64.min(of.max.max(-of.min)),
    };
    let mut numbers: Vec<f64> = (0..suspect.parameters.len()).map(|index| suspect.begin(index)).collect();
    numbers.iter_mut().skip(index).take(1).for_each(|number| *number = unit);
    let square: f64 = suspect.values(&numbers, &ranges(facts)).iter().map(|value| value * value).sum();
    let size = (square / f64::from(PLACES)).sqrt();
    let wanted = STEP * if adds_torque(suspect) { facts.coulomb_nm } else { 1.0 };
    if size > 0.0 && size.is_finite() { unit * wanted / size } else { 0.01 * unit }
}

/// The ranges of the covariates in the data, in the covariates' order.
fn ranges(facts: &Facts) -> Ranges {
    let fastest = facts.fastest_rad_per_s.max(0.1);
    let angle = if facts.angle_rad.0 < facts.angle_rad.1 { facts.angle_rad } else { (-3.0, 3.0) };
    let pressure_pa = facts.pressure_mpa.map_or((0.0, 1e7), |mpa| (1e6 * mpa.0, 1e6 * mpa.1));
    [
        angle,
        (-fastest, fastest),
        (-10.0 * fastest, 10.0 * fastest),
        (0.0, 100.0),
        pressure_pa,
        facts.temperature_c.unwrap_or((20.0, 70.0)),
        (0.0, facts.longest_rest_s.max(0.1)),
        (0.0, facts.travel_rad.max(0.1)),
    ]
}
