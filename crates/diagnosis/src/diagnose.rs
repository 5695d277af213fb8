//! Entry point: log and model in, diagnosis out. Prepares the campaign, fits, searches for causes, and concludes.

use crate::DiagnosisError;
use crate::asked::Asked;
use crate::conclude::verdict::conclude;
use crate::extend::catalogue::candidates;
use crate::extend::hypothesis::Hypothesis;
use crate::extend::tolerance::corrections;
use crate::fit::equations::{Nuisances, Point, Setting};
use crate::found::{Event, Found};
use crate::judge::{judge, judge_few};
use crate::log::campaign::Campaign;
use crate::log::excitation::excitation;
use crate::log::noise::{estimate, with_colour, with_misfit};
use crate::log::ready::Ready;
use crate::measure::doubt::misfit;
use crate::measure::judgement::Judgement;
use crate::options::Options;
use crate::outcome::Verdict;
use crate::show::loose::loose;
use crate::show::mains::{Mains, mains};
use crate::show::observe::shows_zeros;
use crate::show::residual::left;
use crate::workers::{Workers, map};
use log_data::{AngleZero, Log};
use valve_model::Model;

/// If a residual is below this fraction of the noise, the noise was estimated with a worse model: the motion's errors are then
/// estimated once more with the model that was found.
const QUIETER: f64 = 0.7;

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
    tell(Event::Step("reading the motion"));
    let mut campaign = Campaign::new(log, model, options.seed, workers)?;
    let ready = campaign.ready(model)?;
    let first = begin(&campaign, &ready);
    check_finite(&campaign, &ready, &first, workers)?;
    tell(Event::Step("estimating the noise"));
    let mut noise = estimate(&mut campaign, &ready, &first.starts, options, workers);
    let hum = hum_of_first(&campaign, model, &first, workers)?;
    if let Some(hum) = hum {
        campaign.take_out_hum(hum.hums, &hum.by_piece);
        noise = estimate(&mut campaign, &ready, &first.starts, options, workers);
    }
    campaign.facts.excitation = excitation(&campaign, noise.channel);
    let (able, unable) = candidates(&campaign.facts, model, &options.fixed, &options.suspects);
    let nuisances = Nuisances { zero_nm: 0.0, angle_zero: campaign.angle_zero == Some(AngleZero::PerRun) };
    let setting = Setting::new(&campaign, model, nuisances, workers);
    let mut corrected = corrections(&campaign.facts, &able, options.tolerance);
    corrected.retain(|of| !options.fixed.contains(&of.id));
    let asked = Asked { first: &first, corrections: &corrected, able: &able, seed: options.seed };
    let judged = judge(setting, noise, asked, None, tell)?;
    campaign.allow_all();
    if setting.is_over() {
        return conclude(&judged, &able, &unable);
    }
    let nuisances = judged.setting.nuisances;
    let zero_nm = nuisances.zero_nm.max(judged.zero_from_run_to_run(&judged.selection.fitted)?);
    let judged = if zero_nm == nuisances.zero_nm {
        judged
    } else {
        tell(Event::Again("once more, with a zero of the torque that differs from run to run"));
        let nuisances = Nuisances { zero_nm, ..nuisances };
        let setting = Setting { nuisances, ..setting };
        judge(setting, noise, asked, Some(&judged.selection), tell)?
    };
    let found =
        if judged.leaves_less_than(QUIETER)? { Some(judged.selection.fitted.point.clone()) } else { None };
    let (judged, noise) = match found {
        None => (judged, noise),
        Some(found) => {
            tell(Event::Again("once more, with the noise that the model found leaves"));
            let earlier = judged.selection;
            let ready = setting.ready(&found.hypothesis)?;
            let noise = estimate(&mut campaign, &ready, &found.starts, options, workers);
            let setting = Setting::new(&campaign, model, nuisances, workers);
            (judge(setting, noise, asked, Some(&earlier), tell)?, noise)
        }
    };
    if judged.setting.is_over() {
        return conclude(&judged, &able, &unable);
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
            let noise = estimate(&mut campaign, &ready, &found.starts, options, workers);
            let setting = Setting::new(&campaign, model, nuisances, workers);
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
            let noise = estimate(&mut campaign, &ready, &point.starts, options, workers);
            let setting = Setting::new(&campaign, model, nuisances, workers);
            (judge(setting, noise, asked, None, tell)?, noise)
        }
    };
    if let Some(misfit) = misfit(&judged)? {
        tell(Event::Again("once more, with what the causes leave as an error of every sample"));
        let first = judged.selection;
        let noise = with_misfit(&mut campaign, noise, &misfit.left, misfit.per_independent);
        let setting = Setting::new(&campaign, model, nuisances, workers);
        let judged = judge(setting, noise, asked, None, tell)?;
        let judged = if setting.is_over() && first.has_more_than(&judged.selection) {
            judge(setting, noise, asked, Some(&first), tell)?
        } else {
            judged
        };
        return conclude(&judged, &able, &unable);
    }
    let Some(colour) = judged.colour()? else {
        let found = conclude(&judged, &able, &unable)?;
        // Tried last, and only if nothing else is found: a zero for each block can absorb the effect of a slow cause.
        let zero_nm = zeros_in_doubt(&judged, options.tolerance, found.diagnosis.verdict);
        let setting = Setting { nuisances: Nuisances { zero_nm, ..nuisances }, ..judged.setting };
        let few = if zero_nm > 0.0 { judge_few(setting, noise, asked)? } else { None };
        let Some(few) = few else { return Ok(found) };
        let with_zeros = conclude(&few, &able, &unable)?;
        let explains = with_zeros.diagnosis.verdict != Verdict::Unexplained;
        return Ok(if explains { with_zeros } else { found });
    };
    tell(Event::Again("once more, with noise whose neighbours are alike"));
    let earlier = judged.selection;
    let noise = with_colour(&mut campaign, noise, &colour.left, colour.per_independent);
    let setting = Setting::new(&campaign, model, nuisances, workers);
    let judged = judge(setting, noise, asked, Some(&earlier), tell)?;
    conclude(&judged, &able, &unable)
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

pub(crate) fn begin(campaign: &Campaign, ready: &Ready) -> Point {
    let common = campaign.angle_zero == Some(AngleZero::Common);
    let hypothesis = Hypothesis { zero_rad: common.then_some(0.0), ..Hypothesis::default() };
    Point { hypothesis, starts: campaign.pieces.iter().map(|piece| piece.first_start(ready)).collect() }
}

/// Refuses a model whose prediction is not finite.
pub(crate) fn check_finite(
    campaign: &Campaign,
    ready: &Ready,
    first: &Point,
    workers: &dyn Workers,
) -> Result<(), DiagnosisError> {
    let bad = map(workers, campaign.pieces.len(), |index| {
        let piece = campaign.pieces.get(index)?;
        let predicted = piece.predict(ready, first.start(index));
        let row = predicted.iter().position(|value| !value.is_finite())?;
        Some((piece.run, piece.rows.start + row + 1, predicted.get(row).copied().unwrap_or(f64::NAN)))
    });
    match bad.into_iter().flatten().next() {
        None => Ok(()),
        Some((run, row, found)) => Err(DiagnosisError::NotFinite {
            run: campaign.runs.get(run).map_or(String::new(), |run| run.0.clone()),
            row,
            channel: campaign.kind.channel,
            found,
        }),
    }
}
