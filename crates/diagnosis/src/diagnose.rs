//! Entry point: log and model in, diagnosis out. Prepares the campaign, fits, searches for causes, and concludes.

use crate::DiagnosisError;
use crate::conclude::verdict::conclude;
use crate::error::if_possible;
use crate::extend::candidate::Candidate;
use crate::extend::catalogue::candidates;
use crate::extend::hypothesis::{Correction, Free, Hypothesis};
use crate::extend::tolerance::corrections;
use crate::fit::equations::{Nuisances, Point, Setting};
use crate::fit::gauss_newton::{Fitted, fit};
use crate::fit::spread::spread;
use crate::found::{Event, Found};
use crate::log::campaign::Campaign;
use crate::log::excitation::excitation;
use crate::log::noise::{NoiseLevel, estimate, with_colour, with_misfit};
use crate::log::piece::Piece;
use crate::log::ready::Ready;
use crate::measure::doubt::{is_noise, misfit};
use crate::measure::judgement::Judgement;
use crate::name::refine::{fewer_orders, refine};
use crate::name::round::next_cause;
use crate::name::screen::screen;
use crate::name::select::{nothing_yet, select};
use crate::name::selection::Selection;
use crate::name::tried::{EQUAL, Tried};
use crate::options::Options;
use crate::show::colour::colour;
use crate::show::mains::{Mains, mains};
use crate::show::residual::{Jumps, left, left_with, rms_left, settled};
use crate::show::structure::structure;
use crate::show::whiteness::is_white;
use crate::workers::{Workers, map};
use log_data::{AngleZero, Log};
use valve_model::{EffectId, Model};

/// Steps of a fit of the corrections within their tolerance.
const CORRECTING: usize = 6;
/// Causes that are looked for beside corrections.
const FEW: usize = 2;
/// A correction is clear from so many of its standard errors on.
const CLEAR: f64 = 2.0;
/// Where a residual is below this part of the noise, the noise was that of a worse model: its motion's errors are estimated once more
/// with the model that was found.
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
    let (able, unable) = candidates(&campaign.facts, model, &options.fixed);
    let nuisances = Nuisances { zero_nm: 0.0, angle_zero: campaign.angle_zero == Some(AngleZero::PerRun) };
    let setting = Setting { campaign: &campaign, given: model, nuisances, workers };
    let corrected = corrections(&campaign.facts, &able, options.tolerance);
    let first = (first, corrected);
    let judged = judge(setting, noise, &first, None, &able, options.seed, tell)?;
    if setting.is_over() {
        return conclude(&judged, &able, &unable);
    }
    let zero_nm = judged.zero_from_run_to_run(&judged.selection.fitted)?;
    let nuisances = Nuisances { zero_nm, ..nuisances };
    let judged = if zero_nm == 0.0 {
        judged
    } else {
        tell(Event::Step("once more, with a zero of the torque that differs from run to run"));
        let setting = Setting { nuisances, ..setting };
        judge(setting, noise, &first, Some(&judged.selection), &able, options.seed, tell)?
    };
    let found =
        if judged.leaves_less_than(QUIETER)? { Some(judged.selection.fitted.point.clone()) } else { None };
    let (judged, noise) = match found {
        None => (judged, noise),
        Some(found) => {
            tell(Event::Step("once more, with the noise that the model found leaves"));
            let earlier = judged.selection;
            let ready = setting.ready(&found.hypothesis)?;
            let noise = estimate(&mut campaign, &ready, &found.starts, options, workers);
            let setting = Setting { campaign: &campaign, given: model, nuisances, workers };
            (judge(setting, noise, &first, Some(&earlier), &able, options.seed, tell)?, noise)
        }
    };
    if judged.setting.is_over() {
        return conclude(&judged, &able, &unable);
    }
    let (_, left_by_all) = judged.everywhere(&judged.selection.fitted)?;
    let (judged, noise) = match mains(&judged.setting, &left_by_all) {
        None => (judged, noise),
        Some(hum) => {
            tell(Event::Step("once more, without the mains' hum"));
            let earlier = judged.selection;
            let found = earlier.fitted.point.clone();
            let ready = judged.setting.ready(&found.hypothesis)?;
            campaign.take_out_hum(hum.hums, &hum.by_piece);
            let noise = estimate(&mut campaign, &ready, &found.starts, options, workers);
            let setting = Setting { campaign: &campaign, given: model, nuisances, workers };
            (judge(setting, noise, &first, Some(&earlier), &able, options.seed, tell)?, noise)
        }
    };
    if let Some(misfit) = misfit(&judged)? {
        tell(Event::Step("once more, with what the causes leave as an error of every sample"));
        let noise = with_misfit(&mut campaign, noise, &misfit.left, misfit.per_independent);
        let setting = Setting { campaign: &campaign, given: model, nuisances, workers };
        let judged = judge(setting, noise, &first, None, &able, options.seed, tell)?;
        return conclude(&judged, &able, &unable);
    }
    let Some(colour) = judged.colour()? else { return conclude(&judged, &able, &unable) };
    tell(Event::Step("once more, with noise whose neighbours are alike"));
    let earlier = judged.selection;
    let noise = with_colour(&mut campaign, noise, colour.louder, colour.per_independent);
    let setting = Setting { campaign: &campaign, given: model, nuisances, workers };
    let judged = judge(setting, noise, &first, Some(&earlier), &able, options.seed, tell)?;
    conclude(&judged, &able, &unable)
}

/// Fits the given model, searches for causes, and collects what the conclusion needs.
fn judge<'a>(
    setting: Setting<'a>,
    noise: NoiseLevel,
    (first, corrections): &(Point, Vec<Correction>),
    earlier: Option<&Selection>,
    able: &[Candidate],
    seed: u64,
    tell: &mut dyn FnMut(Event<'_>),
) -> Result<Judgement<'a>, DiagnosisError> {
    let given = fit(&setting, first.clone(), &Piece::is_fitted, 4)?;
    let begun = given.point.clone();
    let seen = left_with(&setting, &begun, Jumps::Seen)?;
    tell(Event::Noise { rms: rms_left(&setting, &seen, &Piece::is_fitted), noise: noise.total });
    tell(Event::Step("screening causes"));
    let corrected = within_tolerance(&setting, &given, corrections)?;
    let enough = corrected.as_ref().map(|corrected| leaves_noise(&setting, corrected)).transpose()?;
    let mut ranked = |ranking: &[(EffectId, f64)]| tell(Event::Ranking(ranking));
    let few = match &corrected {
        Some(corrected) if enough == Some(false) => {
            few_beside_corrections(&setting, able, (&given, corrected), &mut ranked)?
        }
        _ => None,
    };
    let selection = match few {
        Some(few) => few,
        None if enough == Some(true) => nothing_yet(&setting, given),
        None => select(&setting, able, given, earlier, &mut ranked)?,
    };
    let selection = with_corrections(&setting, selection, corrected, corrections)?;
    tell(Event::Step("measuring the gain"));
    // Only now: who waits for the first ranking need not wait for this.
    let everything = |_: &Piece| true;
    let before = left_with(&setting, &settled(&setting, &begun, &everything)?, Jumps::Seen)?;
    let rms = rms_left(&setting, &before, &everything);
    let structure_before = structure(&setting, &before);
    Ok(Judgement { setting, noise, selection, before, structure_before, rms, seed })
}

/// The given model refitted with corrections; `None` if its residual is white without, or none are allowed.
fn within_tolerance(
    setting: &Setting<'_>,
    given: &Fitted,
    corrections: &[Correction],
) -> Result<Option<Fitted>, DiagnosisError> {
    if corrections.is_empty() || is_white(setting, &left(setting, &given.point)?) {
        return Ok(None);
    }
    let hypothesis = Hypothesis { corrections: corrections.to_vec(), ..given.point.hypothesis.clone() };
    let begin = Point { hypothesis, starts: given.point.starts.clone() };
    fit(setting, begin, &Piece::is_fitted, CORRECTING).map(Some)
}

/// Whether a fit leaves no more than noise, coloured or not.
fn leaves_noise(setting: &Setting<'_>, fitted: &Fitted) -> Result<bool, DiagnosisError> {
    let left = left(setting, &fitted.point)?;
    Ok(is_white(setting, &left) || is_noise(&structure(setting, &left)) || colour(setting, &left).is_some())
}

/// One cause or two that leave no more than noise together with corrections of the model's numbers; `None` where it takes more.
///
/// Asked first: against numbers that are off by their tolerance, a search without corrections finds causes for those too.
fn few_beside_corrections(
    setting: &Setting<'_>,
    able: &[Candidate],
    (given, corrected): (&Fitted, &Fitted),
    ranked: &mut dyn FnMut(&[(EffectId, f64)]),
) -> Result<Option<Selection>, DiagnosisError> {
    let first = nothing_yet(setting, given.clone());
    let mut state = nothing_yet(setting, corrected.clone());
    for causes in 0..FEW {
        if setting.is_over() {
            return Ok(None);
        }
        let screening = screen(setting, able, &state.fitted)?;
        if causes == 0 {
            state.first_ranking = screening.ranking();
            ranked(&state.first_ranking);
        }
        if !next_cause(setting, &screening.ranked, &mut state)? {
            return Ok(None);
        }
        refine(setting, &mut state)?;
        if leaves_noise(setting, &state.fitted)? {
            (state.rms_first, state.held_out_first) = (first.rms_first, first.held_out_first);
            return Ok(Some(state));
        }
    }
    Ok(None)
}

/// The mains' hum in what the given model leaves.
fn hum_of_first(
    campaign: &Campaign,
    given: &Model,
    first: &Point,
    workers: &dyn Workers,
) -> Result<Option<Mains>, DiagnosisError> {
    let setting = Setting { campaign, given, nuisances: Nuisances::default(), workers };
    Ok(mains(&setting, &left(&setting, first)?))
}

/// Refits the selected causes together with corrections of the model's parameters, so that their intervals include
/// the tolerances. Removes a cause that only changes a parameter within its tolerance.
fn with_corrections(
    setting: &Setting<'_>,
    mut selection: Selection,
    corrected: Option<Fitted>,
    corrections: &[Correction],
) -> Result<Selection, DiagnosisError> {
    let Some(corrected) = corrected else { return Ok(selection) };
    let mut point = selection.fitted.point.clone();
    point.hypothesis.members.retain(|member| {
        let number = member.numbers.first().copied().unwrap_or(f64::NAN);
        !corrections.iter().any(|of| of.id == member.candidate.id && of.holds(number))
    });
    selection.ambiguous.retain(|(best, _)| point.hypothesis.has(*best));
    if point.hypothesis.members.is_empty() {
        selection.take(Tried::judged(setting, corrected));
        return Ok(selection);
    }
    let others = corrections.iter().filter(|of| !point.hypothesis.has(of.id)).cloned();
    point.hypothesis.corrections = others.collect();
    let fitted = fit(setting, point, &Piece::is_fitted, CORRECTING)?;
    selection.take(without_idle_corrections(setting, Tried::judged(setting, fitted))?);
    // Beside the corrections some harmonics may be within their own errors.
    for index in (0..selection.fitted.point.hypothesis.members.len()).rev() {
        if selection.fitted.point.hypothesis.members.get(index).is_some_and(|member| member.candidate.series)
        {
            fewer_orders(setting, &mut selection, index)?;
        }
    }
    Ok(selection)
}

/// The same with corrections held at none where they are no larger than their own errors, if the held-out error stays the same: a
/// number moves only where the data ask for it. How well the causes are known takes all of them as uncertain all the same.
fn without_idle_corrections(setting: &Setting<'_>, joint: Tried) -> Result<Tried, DiagnosisError> {
    let Some(spread) = spread(&joint.fitted, setting.loss()) else { return Ok(joint) };
    let hypothesis = &joint.fitted.point.hypothesis;
    let places: Vec<Free> = hypothesis.free();
    let idle = |index: usize| {
        let place = places.iter().position(|free| *free == Free::Correction(index));
        let of = hypothesis.corrections.get(index).zip(place);
        of.is_none_or(|(of, place)| {
            let variance = spread.covariance.get((place, place)).copied().unwrap_or(f64::INFINITY);
            (of.value - of.neutral).powi(2) < CLEAR * CLEAR * variance
        })
    };
    let held = hypothesis.with_corrections_free(idle);
    if held.corrections.iter().all(|of| of.free) {
        return Ok(joint);
    }
    let begin = Point { hypothesis: held, starts: joint.fitted.point.starts.clone() };
    let tried = if_possible(Tried::from(setting, begin, CORRECTING))?;
    Ok(tried.filter(|tried| tried.rms <= joint.rms + EQUAL).unwrap_or(joint))
}

fn begin(campaign: &Campaign, ready: &Ready) -> Point {
    let common = campaign.angle_zero == Some(AngleZero::Common);
    let hypothesis = Hypothesis { zero_rad: common.then_some(0.0), ..Hypothesis::default() };
    Point { hypothesis, starts: campaign.pieces.iter().map(|piece| piece.first_start(ready)).collect() }
}

/// Refuses a model whose prediction is not finite.
fn check_finite(
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
