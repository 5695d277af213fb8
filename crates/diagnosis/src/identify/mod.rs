//! The numbers of a model from a record: friction, inertia, delay, all of them first guesses.
//!
//! A record of command and angle is read twice: as the torque that the motor exerts, which is blurred but smooth in every
//! number, then as the angle itself, from the numbers found so. What is returned predicts runs that were held out better than
//! the given model, or is the given model.

mod guesses;
mod motor_torque;

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::fit::equations::{Nuisances, Setting};
use crate::found::Event;
use crate::log::campaign::Campaign;
use crate::log::piece::Piece;
use crate::measure::gain::{gain, part_left_as_fitted};
use crate::name::tried::NEARLY;
use crate::options::Options;
use crate::outcome::Gain;
use crate::show::residual::{PieceResidual, left, settled};
use crate::workers::Workers;
use guesses::{Asked, Fit};
use log_data::{Channel, Log};
use motor_torque::as_torques;
use valve_model::{Effect, EffectId, EffectValue, Model};

/// Fits, at most, each from the last one's numbers. One goes at most 60 % of them: to a number that is 20 times the given one it takes seven.
const FITS: usize = 12;

/// From this many times the noise on a fit has not found the minimum, and is begun elsewhere.
const FAR: f64 = 1.2;

/// A number counts as shown if its standard error is below this part of it.
const SHOWN: f64 = 0.2;

/// Factors on the static torque to begin with. When a rotor breaks away is the roughest question to an angle.
const BREAK_AWAY: [f64; 3] = [0.8, 1.25, 0.65];

/// Factors on all torques to begin with, where the load's inertia is known: slow motion shows torques in parts of the holding torque alone,
/// and a swing whose frequency is off by more shows nothing.
const SCALES: [f64; 4] = [0.9, 1.1, 0.8, 1.25];
/// What they are factors on; the static torque goes with the Coulomb torque.
const TORQUES: [EffectId; 5] = [
    EffectId::HoldingTorqueLevel,
    EffectId::CoulombLevel,
    EffectId::ViscousLevel,
    EffectId::BristleStiffness,
    EffectId::BristleDamping,
];

/// A number of the model, and how well the record shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Identified {
    /// The effect that is a factor on it.
    pub id: EffectId,
    /// Its standard error in parts of it; that of a first guess where the record doesn't show it.
    pub std_error: f64,
}

impl Identified {
    /// Whether the record shows it: its standard error is below a fifth of it.
    pub fn is_shown(&self) -> bool {
        self.std_error < SHOWN
    }
}

/// The numbers that a record shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
    /// The model with them; the given one where they predict held-out runs no better than its own.
    pub model: Model,
    /// Whether they do.
    pub better: bool,
    /// Every number that the record could show, of the model that was found.
    pub numbers: Vec<Identified>,
    /// Numbers that wanted to go further still.
    pub unfinished: Vec<EffectId>,
    /// Errors on held-out runs with the given numbers, and with those found.
    pub gain: Gain,
    /// The channel that the model predicts.
    pub channel: Channel,
}

/// Fits the numbers of a model to a log: friction's levels, stiffness, damping and Stribeck speed, the load's inertia, a delay
/// between command and angle. The holding torque stays as a data sheet has it, known within 3 %, unless the load's inertia is known.
///
/// # Errors
/// [`DiagnosisError`]: a run or a model that can't be used.
pub fn identify(
    log: &Log,
    model: &Model,
    options: &Options,
    workers: &dyn Workers,
    tell: &mut dyn FnMut(Event<'_>),
) -> Result<Identification, DiagnosisError> {
    let asked = Asked { log, options, workers };
    let mut from = model.clone();
    let torques = as_torques(log, model, workers);
    if let Some(torques) = &torques {
        tell(Event::Step("reading the motor's torque off lag and motion"));
        let coarse = if_possible(converge(Asked { log: torques, ..asked }, model))?;
        from = coarse.map_or(from, |coarse| coarse.model);
    }
    tell(Event::Step("fitting all numbers through the model"));
    let mut best = judged(asked, model, converge(asked, &from)?)?;
    let scales = SCALES.into_iter().filter(|_| asked.knows_load());
    let scaled = scales.map(|factor| with_factors(&from, &TORQUES, factor));
    let broken_away = BREAK_AWAY.map(|factor| with_factors(&from, &[EffectId::StaticLevel], factor));
    let others = scaled.chain([Some(model.clone())]).chain(broken_away);
    for other in others.flatten().filter(|_| torques.is_some()) {
        if best.gain.over_noise_after <= FAR || workers.is_over() {
            break;
        }
        tell(Event::Step("once more, from other numbers"));
        if let Some(fit) = if_possible(converge(asked, &other))? {
            let found = judged(asked, model, fit)?;
            if found.gain.over_noise_after < best.gain.over_noise_after {
                best = found;
            }
        }
    }
    without_what_is_not_shown(asked, model, best)
}

/// The same with the given numbers in place of those that the record doesn't show, if that predicts the runs held out as well. What went far
/// in many fits without being shown made up for what is no number of the model.
fn without_what_is_not_shown(
    asked: Asked<'_>,
    given: &Model,
    found: Identification,
) -> Result<Identification, DiagnosisError> {
    let not_shown: Vec<EffectId> = found.numbers.iter().filter(|of| !of.is_shown()).map(|of| of.id).collect();
    let mut model = found.model.clone();
    for id in &not_shown {
        let (Some(before), Some(now)) = (given.number_of(*id), model.number_of(*id)) else { continue };
        if before != now {
            model = with_factors(&model, &[*id], before / now).unwrap_or(model);
        }
    }
    if model == found.model || asked.workers.is_over() {
        return Ok(found);
    }
    let errors = found.numbers.iter().map(|of| (of.id, of.std_error / beyond(&found.gain))).collect();
    let at_bound = found.unfinished.iter().copied().filter(|id| !not_shown.contains(id)).collect();
    let put_back = judged(asked, given, Fit { model, errors, at_bound })?;
    let as_good = put_back.gain.over_noise_after <= found.gain.over_noise_after + NEARLY;
    Ok(if put_back.better && as_good { put_back } else { found })
}

/// What leaves more than noise is not known as well as noise alone would let it be: so many times the error.
fn beyond(gain: &Gain) -> f64 {
    gain.over_noise_after.max(1.0)
}

/// A model with these of its numbers changed, those that it has; `None` where it has none of them.
fn with_factors(model: &Model, ids: &[EffectId], factor: f64) -> Option<Model> {
    let with = |model: &Model, id: EffectId| {
        let mut model = model.clone();
        model.effects.push(Effect::new(id, &[("factor", EffectValue::Number(factor))]).ok()?);
        model.with_factors_in_its_numbers().ok()
    };
    ids.iter().fold(None, |so_far, id| with(so_far.as_ref().unwrap_or(model), *id).or(so_far))
}

/// Fits until no number goes as far as one fit may take it.
fn converge(asked: Asked<'_>, model: &Model) -> Result<Fit, DiagnosisError> {
    let mut fit = asked.fit(model)?;
    for _ in 1..FITS {
        if fit.at_bound.is_empty() || asked.workers.is_over() {
            break;
        }
        match if_possible(asked.fit(&fit.model))? {
            Some(further) => fit = further,
            None => break,
        }
    }
    Ok(fit)
}

/// A fit against the given model, on runs that it was not fitted on, both weighted by the fitted model's errors.
fn judged(asked: Asked<'_>, given: &Model, fit: Fit) -> Result<Identification, DiagnosisError> {
    let (campaign, _) = asked.campaign(&fit.model)?;
    let (before, after) = (left_by(asked, &campaign, given)?, left_by(asked, &campaign, &fit.model)?);
    let setting = Setting::new(&campaign, given, Nuisances::of(&campaign), asked.workers);
    let gain = gain(&setting, &before, &after, asked.options.seed);
    let part = part_left_as_fitted(&setting, &before, &after, asked.options.seed);
    // Beyond what chance makes of it, and in plain units too.
    let better = part.ci95[1] < 1.0 && gain.ratio < 1.0;
    let numbers = fit
        .errors
        .iter()
        .map(|(id, std_error)| Identified { id: *id, std_error: std_error * beyond(&gain) })
        .collect();
    let (model, unfinished) = if better { (fit.model, fit.at_bound) } else { (given.clone(), Vec::new()) };
    Ok(Identification { model, better, numbers, unfinished, gain, channel: campaign.kind.channel })
}

fn left_by(
    asked: Asked<'_>,
    campaign: &Campaign,
    model: &Model,
) -> Result<Vec<PieceResidual>, DiagnosisError> {
    let setting = Setting::new(campaign, model, Nuisances::of(campaign), asked.workers);
    let ready = campaign.ready(model)?;
    let first = crate::begin::begin(campaign, &ready);
    let point = campaign.with_reserve(|| settled(&setting, &first, &|_: &Piece| true))?;
    left(&setting, &point)
}
