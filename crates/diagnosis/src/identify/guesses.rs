//! The numbers of a model as first guesses, fitted all at once.

use crate::DiagnosisError;
use crate::begin::{begin, check_finite};
use crate::corrected::without_idle_corrections;
use crate::error::if_possible;
use crate::extend::candidate::Candidate;
use crate::extend::catalogue::candidates;
use crate::extend::hypothesis::{Correction, Free, Hypothesis, Member};
use crate::extend::tolerance::corrections;
use crate::fit::equations::{Nuisances, Point, Setting};
use crate::fit::gauss_newton::fit;
use crate::fit::spread::spread;
use crate::log::campaign::Campaign;
use crate::log::excitation::excitation;
use crate::log::noise::estimate;
use crate::log::piece::Piece;
use crate::name::threshold::FLOOR;
use crate::name::tried::Tried;
use crate::numbers::GUESSED;
use crate::options::Options;
use crate::workers::Workers;
use log_data::Log;
use valve_model::{EffectId, Model};

/// The relative standard deviation of a number that data sheets give. A motion shows torques in parts of the holding torque
/// alone, so that one of them must be known.
const DATA_SHEET: f64 = 0.03;

/// Steps of a fit of all numbers.
const STEPS: usize = 12;

/// A fit that has not come to its end is continued, so many times at most.
const AGAIN: usize = 4;

/// Finite-difference steps of the errors, in parts of a fit's. A fit's steps are as wide as it may have to go, and over those the prediction
/// bends.
const FINER: f64 = 0.02;

/// A delay must cut the held-out error by this share.
const LATE: f64 = 0.02;

/// What is fitted to what.
#[derive(Clone, Copy)]
pub(super) struct Asked<'a> {
    pub log: &'a Log,
    pub options: &'a Options,
    pub workers: &'a dyn Workers,
}

/// A model with its numbers fitted.
pub(super) struct Fit {
    pub model: Model,
    /// The effects that are factors on its numbers, and the relative standard error of each.
    pub errors: Vec<(EffectId, f64)>,
    /// Numbers that went as far as one fit may take them.
    pub at_bound: Vec<EffectId>,
}

impl Asked<'_> {
    /// A campaign with its noise, weighted by a model.
    pub fn campaign(&self, model: &Model) -> Result<(Campaign, Point), DiagnosisError> {
        let mut campaign = Campaign::new(self.log, model, self.options.seed, self.workers)?;
        let ready = campaign.ready(model)?;
        let first = begin(&campaign, &ready);
        check_finite(&campaign, &ready, &first, self.workers)?;
        let noise = estimate(&mut campaign, &ready, &first.starts, self.options, self.workers);
        campaign.facts.excitation = excitation(&campaign, noise.channel);
        campaign.allow_all();
        Ok((campaign, first))
    }

    /// Fits all numbers that the log could show, from those of a model on.
    pub fn fit(&self, model: &Model) -> Result<Fit, DiagnosisError> {
        let (campaign, first) = self.campaign(model)?;
        let (able, _) = candidates(&campaign.facts, model, &self.options.fixed, &[]);
        let setting = Setting::new(&campaign, model, Nuisances::of(&campaign), self.workers);
        let hypothesis =
            Hypothesis { corrections: self.guesses(&campaign, &able), ..first.hypothesis.clone() };
        let starts = first.starts;
        let mut fitted = fit(&setting, Point { hypothesis, starts }, &Piece::is_fitted, STEPS)?;
        for _ in 1..AGAIN {
            if fitted.ended || setting.is_over() {
                break;
            }
            fitted = fit(&setting, fitted.point, &Piece::is_fitted, STEPS)?;
        }
        let tried = without_idle_corrections(&setting, Tried::judged(&setting, fitted))?;
        let tried = later(&setting, &able, tried)?;
        let hypothesis = &tried.fitted.point.hypothesis;
        let refused = |source| campaign.refused(source);
        let fitted = hypothesis.model(model).map_err(refused)?;
        let model = fitted.with_factors_in_its_numbers().map_err(refused)?;
        let errors = self.errors(&setting, &tried, &model)?;
        let at_bound = hypothesis.corrections.iter().filter(|of| of.is_at_bound()).map(|of| of.id).collect();
        Ok(Fit { model, errors, at_bound })
    }

    /// The relative standard error of each number of the `model` that was found: by the record, beside what data sheets give, and by those.
    fn errors(
        &self,
        setting: &Setting<'_>,
        tried: &Tried,
        model: &Model,
    ) -> Result<Vec<(EffectId, f64)>, DiagnosisError> {
        let mut hypothesis = tried.fitted.point.hypothesis.clone();
        for of in &mut hypothesis.corrections {
            of.free = !self.is_of_data_sheet(of.id);
            of.finer *= FINER;
        }
        let point = Point { hypothesis: hypothesis.clone(), starts: tried.fitted.point.starts.clone() };
        let free = fit(setting, point, &Piece::is_fitted, 0)?;
        let spread = spread(&free, setting.loss());
        let places = hypothesis.free();
        let place = |index: usize| places.iter().position(|free| *free == Free::Correction(index));
        let covariance = |one: usize, two: usize| {
            spread.as_ref().and_then(|spread| spread.covariance.get((place(one)?, place(two)?)).copied())
        };
        let of_coulomb = hypothesis.corrections.iter().position(|of| of.id == EffectId::CoulombLevel);
        let error = |(index, of): (usize, &Correction)| {
            let own = covariance(index, index).unwrap_or(of.deviation * of.deviation);
            // T_s goes with both factors.
            let shared = of_coulomb
                .filter(|_| of.id == EffectId::StaticLevel)
                .and_then(|coulomb| Some(covariance(coulomb, coulomb)? + 2.0 * covariance(coulomb, index)?));
            let by_record =
                if of.free { (own + shared.unwrap_or(0.0)).max(0.0).sqrt() / of.value } else { 0.0 };
            // A torque that was measured has its own scale.
            let by_data_sheets = if setting.campaign.kind.residual_is_torque() {
                0.0
            } else {
                self.by_data_sheets(of.id, model)
            };
            (of.id, by_record.hypot(by_data_sheets))
        };
        Ok(hypothesis.corrections.iter().enumerate().map(error).collect())
    }

    /// Whether a number stays as its data sheet has it: the rotor's inertia, and the holding torque unless the load's inertia is known.
    fn is_of_data_sheet(&self, id: EffectId) -> bool {
        id == EffectId::RotorInertia || id == EffectId::HoldingTorqueLevel && !self.knows_load()
    }

    /// Whether the load's inertia is known, which tells the scale of all torques.
    pub fn knows_load(&self) -> bool {
        self.options.fixed.contains(&EffectId::LoadInertia)
    }

    /// The relative standard error that data sheets' numbers bring to a number. A motion tells torques and inertias in parts of the holding
    /// torque; if the load's inertia is known, in parts of that and the rotor's together.
    fn by_data_sheets(&self, id: EffectId, model: &Model) -> f64 {
        let Some(motor) = &model.motor else { return 0.0 };
        let rotor = motor.rotor_inertia_kg_m2;
        let load = model.load.map_or(0.0, |load| load.inertia_kg_m2);
        let scale = if self.knows_load() { DATA_SHEET * rotor / (rotor + load) } else { DATA_SHEET };
        let viscous = model.friction.viscous_nm_s_per_rad();
        match id {
            EffectId::RotorInertia => DATA_SHEET,
            EffectId::LoadInertia => (scale * (rotor + load)).hypot(DATA_SHEET * rotor) / load,
            // The motor's damping is as it was given, and does the same.
            EffectId::ViscousLevel => scale * (viscous + motor.damping_nm_s_per_rad) / viscous,
            EffectId::StribeckVelocity => 0.0,
            _ => scale,
        }
    }

    /// Every number as a first guess, but those that data sheets give. The motor's damping stays as it is: a viscous friction does
    /// the same. With a load's inertia that is known, the holding torque is what the motion shows.
    fn guesses(&self, campaign: &Campaign, able: &[Candidate]) -> Vec<Correction> {
        let known = |id: EffectId| self.options.fixed.contains(&id);
        let mut guesses = corrections(&campaign.facts, able, GUESSED);
        guesses.retain(|of| {
            of.neutral != 0.0
                && !known(of.id)
                && !matches!(of.id, EffectId::MotorDamping | EffectId::TorqueGain)
        });
        for of in &mut guesses {
            // A scale of all torques and inertias changes no motion: free, the data sheet's numbers would wander along with it.
            of.free = !self.is_of_data_sheet(of.id);
            if !of.free {
                of.deviation = DATA_SHEET;
            }
        }
        guesses
    }
}

/// The same with a delay between command and encoder, if that cuts the held-out error.
fn later(setting: &Setting<'_>, able: &[Candidate], tried: Tried) -> Result<Tried, DiagnosisError> {
    let late = able.iter().find(|candidate| candidate.id == EffectId::SensorDelay);
    let Some(late) = late.filter(|_| !setting.campaign.kind.residual_is_torque()) else { return Ok(tried) };
    let member = Member::new(late, late.neutral(), late.free.clone());
    let begin = Point {
        hypothesis: tried.fitted.point.hypothesis.with(member),
        starts: tried.fitted.point.starts.clone(),
    };
    let with = if_possible(Tried::from(setting, begin, STEPS))?;
    Ok(with.filter(|with| with.rms < tried.rms - FLOOR.max(LATE * tried.rms)).unwrap_or(tried))
}
