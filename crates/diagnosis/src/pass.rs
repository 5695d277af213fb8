//! One pass of a diagnosis over chosen pieces of a log: prepares the campaign, fits, searches for causes, and concludes.

use crate::DiagnosisError;
use crate::asked::Asked;
use crate::begin::{begin, check_finite};
use crate::conclude::verdict::conclude;
use crate::extend::candidate::Candidate;
use crate::extend::catalogue::candidates;
use crate::extend::hypothesis::Correction;
use crate::extend::tolerance::corrections;
use crate::extend::untestable::Untestable;
use crate::fit::equations::{Nuisances, Point, Setting};
use crate::found::{Event, Found};
use crate::judge::{given_and_corrected, judge, judge_few};
use crate::left_out::stand_out;
use crate::log::campaign::Campaign;
use crate::log::cut::{Choice, Place};
use crate::log::excitation::excitation;
use crate::log::noise::{NoiseLevel, estimate, with_colour, with_misfit};
use crate::measure::doubt::misfit;
use crate::measure::judgement::Judgement;
use crate::options::Options;
use crate::outcome::Verdict;
use crate::show::loose::loose;
use crate::show::mains::{Mains, mains};
use crate::show::observe::shows_zeros;
use crate::show::residual::left;
use crate::unnamed::laws_leave_noise;
use crate::workers::Workers;
use log_data::Log;
use std::collections::BTreeSet;
use valve_model::Model;

/// If a residual is below this fraction of the noise, the noise was estimated with a worse model: the motion's errors are then
/// estimated once more with the model that was found.
const QUIETER: f64 = 0.7;

/// A diagnosis of the pieces that were chosen.
pub(crate) struct Pass {
    pub found: Found,
    /// What was fitted, of a log in which what was not may stand out.
    pub fitted: Option<BTreeSet<Place>>,
}

/// Diagnoses a log, of a long one a random sample of its pieces and those in `also`; where nothing is, those that stand out.
pub(crate) fn pass(
    log: &Log,
    model: &Model,
    options: &Options,
    also: &BTreeSet<Place>,
    workers: &dyn Workers,
    tell: &mut dyn FnMut(Event<'_>),
) -> Result<Pass, DiagnosisError> {
    tell(Event::Step("reading the motion"));
    let mut campaign = Campaign::of(log, model, Choice::Fitted(also), (options.seed, workers))?;
    let mut prepared = prepare(&mut campaign, model, options, workers, tell)?;
    let mut fitted: BTreeSet<Place> = campaign.places().collect();
    let looks_further = campaign.thinned && campaign.kind.fits_what_stands_out;
    if looks_further && also.is_empty() && !workers.is_over() {
        tell(Event::Step("looking at what is not fitted"));
        let corrected = prepared.corrected(&campaign, model, workers)?;
        let also = stand_out(log, &corrected, &fitted, options, workers)?;
        if !also.is_empty() {
            campaign = Campaign::of(log, model, Choice::Fitted(&also), (options.seed, workers))?;
            prepared = prepare(&mut campaign, model, options, workers, tell)?;
            fitted = campaign.places().collect();
        }
    }
    let found = search(&mut campaign, model, prepared, options, workers, tell)?;
    Ok(Pass { found, fitted: looks_further.then_some(fitted) })
}

/// What a search begins with.
struct Prepared {
    first: Point,
    noise: NoiseLevel,
    able: Vec<Candidate>,
    unable: Vec<Untestable>,
    corrections: Vec<Correction>,
}

impl Prepared {
    fn asked(&self, seed: u64) -> Asked<'_> {
        Asked { first: &self.first, corrections: &self.corrections, able: &self.able, seed }
    }

    /// The given model with its numbers corrected within their tolerance.
    fn corrected(
        &self,
        campaign: &Campaign,
        model: &Model,
        workers: &dyn Workers,
    ) -> Result<Model, DiagnosisError> {
        let setting = Setting::new(campaign, model, Nuisances::of(campaign), workers);
        let (given, corrected) = given_and_corrected(&setting, self.asked(0))?;
        let point = corrected.unwrap_or(given).point;
        point.hypothesis.model(model).map_err(|source| campaign.refused(source))
    }
}

/// Estimates the noise, takes out hum, and lists what can be tested.
fn prepare(
    campaign: &mut Campaign,
    model: &Model,
    options: &Options,
    workers: &dyn Workers,
    tell: &mut dyn FnMut(Event<'_>),
) -> Result<Prepared, DiagnosisError> {
    let ready = campaign.ready(model)?;
    let first = begin(campaign, &ready);
    check_finite(campaign, &ready, &first, workers)?;
    tell(Event::Step("estimating the noise"));
    let mut noise = estimate(campaign, &ready, &first.starts, options, workers);
    let hum = hum_of_first(campaign, model, &first, workers)?;
    if let Some(hum) = hum {
        campaign.take_out_hum(hum.hums, &hum.by_piece);
        noise = estimate(campaign, &ready, &first.starts, options, workers);
    }
    campaign.facts.excitation = excitation(campaign, noise.channel);
    let (able, unable) = candidates(&campaign.facts, model, &options.fixed, &options.suspects);
    let mut corrections = corrections(&campaign.facts, &able, options.tolerance);
    corrections.retain(|of| !options.fixed.contains(&of.id));
    Ok(Prepared { first, noise, able, unable, corrections })
}

fn search(
    campaign: &mut Campaign,
    model: &Model,
    prepared: Prepared,
    options: &Options,
    workers: &dyn Workers,
    tell: &mut dyn FnMut(Event<'_>),
) -> Result<Found, DiagnosisError> {
    let setting = Setting::new(campaign, model, Nuisances::of(campaign), workers);
    let asked = prepared.asked(options.seed);
    let Prepared { noise, able, unable, .. } = &prepared;
    let noise = *noise;
    let judged = judge(setting, noise, asked, None, tell)?;
    campaign.allow_all();
    if setting.is_over() {
        return conclude(&judged, able, unable, tell);
    }
    let nuisances = judged.setting.nuisances;
    let zero_nm = nuisances.zero_nm.max(judged.zero_from_run_to_run(&judged.selection.fitted)?);
    let (judged, nuisances) = if zero_nm == nuisances.zero_nm {
        (judged, nuisances)
    } else {
        tell(Event::Again("once more, with a zero of the torque that differs from run to run"));
        let nuisances = Nuisances { zero_nm, ..nuisances };
        let setting = Setting { nuisances, ..setting };
        (judge(setting, noise, asked, Some(&judged.selection), tell)?, nuisances)
    };
    let found =
        if judged.leaves_less_than(QUIETER)? { Some(judged.selection.fitted.point.clone()) } else { None };
    let (judged, noise) = match found {
        None => (judged, noise),
        Some(found) => {
            tell(Event::Again("once more, with the noise that the model found leaves"));
            let earlier = judged.selection;
            let ready = setting.ready(&found.hypothesis)?;
            let noise = estimate(campaign, &ready, &found.starts, options, workers);
            let setting = Setting::new(campaign, model, nuisances, workers);
            (judge(setting, noise, asked, Some(&earlier), tell)?, noise)
        }
    };
    if judged.setting.is_over() {
        return conclude(&judged, able, unable, tell);
    }
    let (_, left_by_all) = judged.everywhere(&judged.selection.fitted)?;
    let (judged, noise) = match mains(&judged.setting, &left_by_all) {
        None => (judged, noise),
        Some(hum) => {
            tell(Event::Again("once more, without the mains' hum"));
            let earlier = judged.selection;
            let found = earlier.fitted.point.clone();
            let ready = judged.setting.ready(&found.hypothesis)?;
            campaign.take_out_hum(hum.hums, &hum.by_piece);
            let noise = estimate(campaign, &ready, &found.starts, options, workers);
            let setting = Setting::new(campaign, model, nuisances, workers);
            (judge(setting, noise, asked, Some(&earlier), tell)?, noise)
        }
    };
    let (_, left_by_all) = judged.everywhere(&judged.selection.fitted)?;
    let (judged, noise) = match loose(&judged.setting, &left_by_all) {
        None => (judged, noise),
        Some(found) => {
            tell(Event::Again("once more, without ripples that have a phase of their own in each run"));
            let point = judged.selection.fitted.point.clone();
            let ready = judged.setting.ready(&point.hypothesis)?;
            campaign.take_out_ripples(found.ripples, &found.by_piece);
            let noise = estimate(campaign, &ready, &point.starts, options, workers);
            let setting = Setting::new(campaign, model, nuisances, workers);
            (judge(setting, noise, asked, None, tell)?, noise)
        }
    };
    if let Some(misfit) = misfit(&judged)? {
        tell(Event::Step("looking for a law in place of the causes"));
        if laws_leave_noise(&judged, able)? {
            return conclude(&judged, able, unable, tell);
        }
        tell(Event::Again("once more, with what the causes leave as an error of every sample"));
        let first = judged.selection;
        let noise = with_misfit(campaign, noise, &misfit.left, misfit.per_independent);
        let setting = Setting::new(campaign, model, nuisances, workers);
        let judged = judge(setting, noise, asked, None, tell)?;
        let judged = if setting.is_over() && first.has_more_than(&judged.selection) {
            judge(setting, noise, asked, Some(&first), tell)?
        } else {
            judged
        };
        return conclude(&judged, able, unable, tell);
    }
    let Some(colour) = judged.colour()? else {
        let found = conclude(&judged, able, unable, tell)?;
        // Tried last, and only if nothing else is found: a zero for each block can absorb the effect of a slow cause.
        let zero_nm = zeros_in_doubt(&judged, options.tolerance, found.diagnosis.verdict);
        let setting = Setting { nuisances: Nuisances { zero_nm, ..nuisances }, ..judged.setting };
        let few = if zero_nm > 0.0 { judge_few(setting, noise, asked)? } else { None };
        let Some(few) = few else { return Ok(found) };
        let with_zeros = conclude(&few, able, unable, tell)?;
        let explains = with_zeros.diagnosis.verdict != Verdict::Unexplained;
        return Ok(if explains { with_zeros } else { found });
    };
    tell(Event::Again("once more, with noise whose neighbours are alike"));
    let earlier = judged.selection;
    let noise = with_colour(campaign, noise, &colour.left, colour.per_independent);
    let setting = Setting::new(campaign, model, nuisances, workers);
    let judged = judge(setting, noise, asked, Some(&earlier), tell)?;
    conclude(&judged, able, unable, tell)
}

/// The standard deviation of a torque's zero from block to block that is to be tried, N·m, if nothing explains the residual and
/// the runs can show a zero; else 0.
fn zeros_in_doubt(judged: &Judgement<'_>, tolerance: f64, verdict: Verdict) -> f64 {
    let campaign = judged.setting.campaign;
    if verdict != Verdict::Unexplained
        || !shows_zeros(campaign)
        || judged.setting.nuisances.zero_nm > 0.0
        || judged.setting.is_over()
    {
        return 0.0;
    }
    tolerance * campaign.facts.coulomb_nm
}

/// The mains' hum in the residual of the given model.
fn hum_of_first(
    campaign: &Campaign,
    given: &Model,
    first: &Point,
    workers: &dyn Workers,
) -> Result<Option<Mains>, DiagnosisError> {
    let setting = Setting::new(campaign, given, Nuisances::default(), workers);
    Ok(mains(&setting, &left(&setting, first)?))
}
