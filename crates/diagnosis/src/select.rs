//! Which causes are accepted: rivals screened by sensitivities, fitted through the model, judged on runs that they were
//! not fitted on, one after the other; earlier ones are dropped when they no longer pay.

use crate::DiagnosisError;
use crate::candidate::{Candidate, Probe};
use crate::fit::{Fitted, fit, sum};
use crate::gram::{Gram, HeldOut, leave_out, solve};
use crate::hypothesis::{Free, Member};
use crate::linear::{Column, Point, Setting, by_group};
use crate::piece::Piece;
use crate::workers::map;

/// A cause must cut the held-out RMS by so much, in parts of the noise.
pub(crate) const FLOOR: f64 = 0.01;
/// ... and by so much of what all causes of an open form explain, as a mean square: below it lies the misfit of a form.
const SHARE: f64 = 0.02;
/// Causes whose form leaves nothing open: nothing that they leave is a misfit of theirs.
const EXACT: [&str; 2] = ["pressure-torque", "torque-offset"];
/// ... and by so much of what is left beyond noise: less is picked from what another cause leaves.
const OF_THE_REST: f64 = 0.1;
/// A rival is fitted where its linearised gain is at least this part of what it would have to be.
const PROMISING: f64 = 0.3;
/// Harmonics are taken where they cut the RMS by so much, in parts of the noise, and by this share of the series' gain.
const ORDER_FLOOR: f64 = 0.004;
/// A shape is freed where it cuts the RMS by so much, in parts of the noise.
const REFINED: f64 = 0.003;
/// Rivals fitted through the model in a round.
const SHORT_LIST: usize = 6;
/// Causes at most.
const MOST: usize = 6;
/// Fits are as good as equal within this RMS, in parts of the noise, or within this one where groups disagree.
const EQUAL: f64 = 0.003;
const NEARLY: f64 = 0.01;
const DISAGREE: f64 = 1.5;

/// A candidate as the screening sees it.
#[derive(Debug, Clone)]
pub(crate) struct Screened {
    pub candidate: usize,
    /// Cut of the held-out RMS, in parts of the noise, linearised.
    pub gain: f64,
    pub member: Member,
}

/// A candidate fitted.
#[derive(Debug, Clone)]
pub(crate) struct Rival {
    pub candidate: usize,
    pub fitted: Fitted,
    pub held_out: HeldOut,
    /// Held-out RMS in parts of the noise.
    pub rms: f64,
}

/// What was decided in one round.
#[derive(Debug, Clone)]
pub(crate) struct Round {
    pub rms_before: f64,
    /// Name and held-out RMS of every rival that was fitted, best first.
    pub rivals: Vec<(&'static str, f64)>,
    /// The names that can't be told apart from the best; empty where it stands alone.
    pub equals: Vec<&'static str>,
    pub accepted: Option<&'static str>,
}

/// What came out.
#[derive(Debug, Clone)]
pub(crate) struct Selection {
    pub fitted: Fitted,
    pub held_out: HeldOut,
    pub rms_first: f64,
    pub rms: f64,
    /// What causes of an open form explain, as a mean square in parts of the noise's.
    pub explained_by_form: f64,
    pub rounds: Vec<Round>,
    /// Groups of names of which one is needed; its representative is a member of the hypothesis.
    pub ambiguous: Vec<(&'static str, Vec<&'static str>)>,
    /// For each pair of names that can't be told apart, the angle between what they change, degrees.
    pub angles: Vec<(&'static str, &'static str, f64)>,
    /// Gains of the first screening, best first.
    pub first_ranking: Vec<(&'static str, f64)>,
    pub dropped: Vec<(&'static str, String)>,
}

impl Selection {
    /// By how much a cause must cut the held-out RMS, in parts of the noise.
    fn least_cut(&self) -> f64 {
        let square = self.rms.powi(2);
        let least = (SHARE * self.explained_by_form).max(OF_THE_REST * (square - 1.0));
        FLOOR.max(self.rms - (square - least).max(0.0).sqrt())
    }
}

/// Names that section "twins" of the docs pairs, for torque logs and for angle logs.
const TORQUE_TWINS: [&[&str]; 8] = [
    &["direction-asymmetry", "torque-offset"],
    &["coupling-compliance", "bristle-stiffness"],
    &["flow-torque", "position-torque"],
    &["pressure-torque", "torque-offset"],
    &["pressure-dependent-friction", "coulomb-level"],
    &["dwell-stiction", "hydraulic-lock"],
    &["load-inertia", "sensor-delay", "friction-lag"],
    &["temperature-dependent-viscosity", "viscous-level"],
];
const ANGLE_TWINS: [&[&str]; 8] = [
    &["encoder-eccentricity", "position-torque", "flow-torque"],
    &["viscous-level", "sensor-delay"],
    &["coulomb-level", "backlash", "holding-torque-level"],
    &["pressure-dependent-friction", "coulomb-level"],
    &["flow-torque", "position-torque"],
    &["dwell-stiction", "hydraulic-lock"],
    &["microstep-error", "detent-torque"],
    &["temperature-dependent-viscosity", "viscous-level"],
];

pub(crate) fn are_twins(a: &str, b: &str, torque: bool) -> bool {
    let lists: &[&[&str]] = if torque { &TORQUE_TWINS } else { &ANGLE_TWINS };
    let drifts = |id: &str| id == "wear-drift";
    a != b && (drifts(a) || drifts(b) || lists.iter().any(|list| list.contains(&a) && list.contains(&b)))
}

/// Who is told a ranking: the effects, and how well each explains the residual.
pub(crate) type Tell<'a> = dyn FnMut(&[(&'static str, f64)]) + 'a;

/// Looks for causes from `begin` on; those of `earlier` are in at first, and stay as far as they pay.
pub(crate) fn select(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    begin: Fitted,
    earlier: Option<&Selection>,
    tell: &mut Tell<'_>,
) -> Result<Selection, DiagnosisError> {
    let held_out = judge(setting, &begin.groups);
    let rms_first = rms(&held_out, &begin.groups);
    let mut state = Selection {
        fitted: begin,
        held_out,
        rms_first,
        rms: rms_first,
        explained_by_form: 0.0,
        rounds: Vec::new(),
        ambiguous: Vec::new(),
        angles: Vec::new(),
        first_ranking: Vec::new(),
        dropped: Vec::new(),
    };
    if let Some(earlier) = earlier {
        take_over(setting, earlier, &mut state)?;
    }
    for round in 0..MOST {
        let screened = screen(setting, candidates, &state.fitted.point)?;
        if round == 0 {
            state.first_ranking =
                screened.iter().filter_map(|s| candidates.get(s.candidate).map(|c| (c.id, s.gain))).collect();
            tell(&state.first_ranking);
        }
        if !next_cause(setting, candidates, screened, &mut state)? {
            break;
        }
        refine(setting, &mut state)?;
        drop_idle(setting, &mut state)?;
    }
    Ok(state)
}

/// Begins with causes that were found before, fitted anew.
fn take_over(
    setting: &Setting<'_>,
    earlier: &Selection,
    state: &mut Selection,
) -> Result<(), DiagnosisError> {
    let fitted = fit(setting, earlier.fitted.point.clone(), &fitted_pieces, 8)?;
    let held_out = judge(setting, &fitted.groups);
    let rms = rms(&held_out, &fitted.groups);
    let open = fitted.point.hypothesis.members.iter().any(|member| !EXACT.contains(&member.candidate.id));
    if open {
        state.explained_by_form = earlier.explained_by_form.min(state.rms.powi(2) - rms.powi(2)).max(0.0);
    }
    (state.fitted, state.held_out, state.rms) = (fitted, held_out, rms);
    state.ambiguous.clone_from(&earlier.ambiguous);
    state.angles.clone_from(&earlier.angles);
    state.rounds.clone_from(&earlier.rounds);
    drop_idle(setting, state)
}

fn fitted_pieces(piece: &Piece) -> bool {
    !piece.hold_out
}

/// Held-out squares at a fit, by one step of the fit without each fold.
pub(crate) fn judge(setting: &Setting<'_>, groups: &[Gram]) -> HeldOut {
    let width = groups.first().map_or(0, |group| group.matrix.nrows().saturating_sub(1));
    let columns: Vec<usize> = (0..width).collect();
    leave_out(groups, &setting.campaign.fold_of, &columns)
        .unwrap_or_else(|| HeldOut { squares: groups.iter().map(Gram::square).collect() })
}

pub(crate) fn rms(held_out: &HeldOut, groups: &[Gram]) -> f64 {
    let count: f64 = groups.iter().map(|group| group.count).sum();
    (held_out.total() / count.max(1.0)).sqrt()
}

/// Every candidate by what its linearised best cuts, best first.
pub(crate) fn screen(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    point: &Point,
) -> Result<Vec<Screened>, DiagnosisError> {
    let hypothesis = &point.hypothesis;
    let mut columns = setting.own_columns(hypothesis)?;
    let own: Vec<usize> = (0..columns.len()).collect();
    let mut places: Vec<(usize, usize, Vec<usize>)> = Vec::new();
    for (index, candidate) in candidates.iter().enumerate().filter(|(_, c)| !hypothesis.has(c.id)) {
        for (number, probe) in candidate.probes.iter().enumerate() {
            let mut at = Vec::new();
            for (parameter, step) in &probe.columns {
                if let Some(column) = probe_column(setting, candidate, probe, *parameter, *step, point) {
                    at.push(columns.len());
                    columns.push(column);
                }
            }
            if at.len() == probe.columns.len() {
                places.push((index, number, at));
            }
        }
    }
    let equations = setting.equations(point, &columns, fitted_pieces)?;
    let groups = by_group(setting.campaign, &equations, columns.len());
    let folds = &setting.campaign.fold_of;
    let base = leave_out(&groups, folds, &own).map_or(f64::INFINITY, |held| rms(&held, &groups));
    let mut found = Vec::new();
    for (index, candidate) in candidates.iter().enumerate() {
        let probes: Vec<_> = places.iter().filter(|place| place.0 == index).collect();
        let screened = if candidate.series {
            screen_series(candidate, &probes, &groups, folds, &own, base)
        } else {
            screen_plain(candidate, &probes, &groups, folds, &own, base)
        };
        found.extend(screened.map(|(gain, member)| Screened { candidate: index, gain, member }));
    }
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Ok(found)
}

fn probe_column(
    setting: &Setting<'_>,
    candidate: &Candidate,
    probe: &Probe,
    parameter: usize,
    step: f64,
    point: &Point,
) -> Option<Column> {
    if let Some(additive) = setting.additive(&point.hypothesis, candidate.id, parameter) {
        return Some(Column::Direct(additive));
    }
    let mut numbers = probe.shape.clone();
    if !probe.jump {
        *numbers.get_mut(parameter)? += step;
    }
    let member = Member { candidate: candidate.clone(), numbers, free: Vec::new() };
    // A model that refuses the change has no such effect.
    let ready = setting.ready(&point.hypothesis.with(member)).ok()?;
    Some(Column::Simulated(ready, if probe.jump { 1.0 } else { step }))
}

type Place = (usize, usize, Vec<usize>);

fn screen_plain(
    candidate: &Candidate,
    places: &[&Place],
    groups: &[Gram],
    folds: &[usize],
    own: &[usize],
    base: f64,
) -> Option<(f64, Member)> {
    let mut best: Option<(f64, Member)> = None;
    for (_, number, at) in places {
        let Some(probe) = candidate.probes.get(*number) else { continue };
        let columns: Vec<usize> = own.iter().chain(at).copied().collect();
        let Some(held) = leave_out(groups, folds, &columns) else { continue };
        let Some((beta, _)) = solve(&sum(groups), &columns) else { continue };
        let mut numbers = probe.shape.clone();
        let mut allowed = true;
        for ((parameter, _), beta) in probe.columns.iter().zip(beta.iter().skip(own.len())) {
            let (Some(number), Some(of)) =
                (numbers.get_mut(*parameter), candidate.parameters.get(*parameter))
            else {
                continue;
            };
            if probe.jump {
                allowed = *beta > 0.0;
            } else {
                let wanted = of.neutral + beta;
                allowed &= at_most(wanted, of.lower, of.upper, of.step);
                *number = wanted.clamp(of.lower, of.upper);
            }
        }
        let gain = if allowed { base - rms(&held, groups) } else { -1.0 };
        if best.as_ref().is_none_or(|(most, _)| gain > *most) {
            best =
                Some((gain, Member { candidate: candidate.clone(), numbers, free: candidate.free.clone() }));
        }
    }
    best
}

/// Within its bounds, or near enough for a linear estimate.
fn at_most(wanted: f64, lower: f64, upper: f64, step: f64) -> bool {
    wanted > lower - 0.5 * step && wanted < upper + step.max(0.5 * upper.abs())
}

/// Harmonics one after the other, each where it pays.
fn screen_series(
    candidate: &Candidate,
    places: &[&Place],
    groups: &[Gram],
    folds: &[usize],
    own: &[usize],
    base: f64,
) -> Option<(f64, Member)> {
    let mut columns = own.to_vec();
    let (mut taken, mut reached): (Vec<&Place>, f64) = (Vec::new(), base);
    let mut first_cut = 0.0;
    loop {
        let mut best: Option<(f64, &Place)> = None;
        for place in places.iter().filter(|place| !taken.iter().any(|taken| taken.1 == place.1)) {
            let wider: Vec<usize> = columns.iter().chain(&place.2).copied().collect();
            let Some(held) = leave_out(groups, folds, &wider) else { continue };
            let left = rms(&held, groups);
            if best.is_none_or(|(least, _)| left < least) {
                best = Some((left, place));
            }
        }
        let Some((left, place)) = best else { break };
        let cut = reached - left;
        if !taken.is_empty() && (cut < ORDER_FLOOR || cut < 0.02 * first_cut) {
            break;
        }
        first_cut = if taken.is_empty() { cut } else { first_cut };
        columns.extend(&place.2);
        taken.push(place);
        reached = left;
        if taken.len() >= 6 || cut <= 0.0 {
            break;
        }
    }
    let (beta, _) = solve(&sum(groups), &columns)?;
    let mut numbers = candidate.neutral();
    let mut free: Vec<usize> = Vec::new();
    let betas: Vec<f64> = beta.iter().skip(own.len()).copied().collect();
    for (place, pair) in taken.iter().zip(betas.chunks(2)) {
        for (offset, value) in pair.iter().enumerate() {
            free.push(2 * place.1 + offset);
            if let Some(number) = numbers.get_mut(2 * place.1 + offset) {
                *number = *value;
            }
        }
    }
    free.sort_unstable();
    Some((base - reached, Member { candidate: candidate.clone(), numbers, free }))
}

/// Fits the best of the screening through the model and takes the one that is best on what it was not fitted on.
fn next_cause(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    screened: Vec<Screened>,
    state: &mut Selection,
) -> Result<bool, DiagnosisError> {
    let mut rivals = fit_rivals(setting, candidates, screened, state)?;
    rivals.sort_by(|a, b| a.rms.total_cmp(&b.rms));
    let name = |rival: &Rival| candidates.get(rival.candidate).map_or("", |candidate| candidate.id);
    let mut round = Round {
        rms_before: state.rms,
        rivals: rivals.iter().map(|rival| (name(rival), rival.rms)).collect(),
        equals: Vec::new(),
        accepted: None,
    };
    let torque = setting.campaign.facts.is_torque();
    let chosen = rivals.first().and_then(|best| {
        let equal = |rival: &&Rival| as_good(best, rival);
        // Of equals the one with the fewest numbers.
        rivals.iter().filter(equal).min_by(|a, b| {
            (numbers(a), a.rms).partial_cmp(&(numbers(b), b.rms)).unwrap_or(std::cmp::Ordering::Equal)
        })
    });
    let paying = chosen.filter(|rival| state.rms - rival.rms >= state.least_cut());
    let Some(chosen) = paying else {
        state.rounds.push(round);
        return Ok(false);
    };
    let equals: Vec<&'static str> = rivals
        .iter()
        .filter(|rival| rival.candidate != chosen.candidate && as_good(chosen, rival))
        .filter(|rival| numbers(rival) <= numbers(chosen) || are_twins(name(rival), name(chosen), torque))
        .map(name)
        .collect();
    round.equals.clone_from(&equals);
    round.accepted = Some(name(chosen));
    for rival in rivals.iter().filter(|rival| equals.contains(&name(rival))) {
        let angle = angle_between(setting, &state.fitted.point, &chosen.fitted.point, &rival.fitted.point)?;
        state.angles.push((name(chosen), name(rival), angle));
    }
    if !equals.is_empty() {
        state.ambiguous.push((name(chosen), equals));
    }
    if !EXACT.contains(&name(chosen)) {
        state.explained_by_form += state.rms.powi(2) - chosen.rms.powi(2);
    }
    state.fitted = chosen.fitted.clone();
    state.held_out = chosen.held_out.clone();
    state.rms = chosen.rms;
    state.rounds.push(round);
    Ok(true)
}

/// The angle between what two hypotheses add to the prediction, degrees; samples weighted as in the fit.
fn angle_between(
    setting: &Setting<'_>,
    base: &Point,
    one: &Point,
    two: &Point,
) -> Result<f64, DiagnosisError> {
    let ready = [&base.hypothesis, &one.hypothesis, &two.hypothesis].map(|of| setting.ready(of));
    let [base_ready, one_ready, two_ready] = ready;
    let (base_ready, one_ready, two_ready) = (base_ready?, one_ready?, two_ready?);
    let products = map(setting.workers, setting.campaign.pieces.len(), |index| {
        let piece = setting.campaign.pieces.get(index).filter(|piece| !piece.hold_out)?;
        let start = base.starts.get(index).copied().unwrap_or(0.0);
        let [none, one, two] = [&base_ready, &one_ready, &two_ready].map(|ready| piece.predict(ready, start));
        let samples = none.iter().zip(&one).zip(&two).zip(&piece.weights);
        Some(samples.fold((0.0, 0.0, 0.0), |(aa, ab, bb), (((none, one), two), weight)| {
            let (a, b) = (weight * (one - none), weight * (two - none));
            (aa + a * a, ab + a * b, bb + b * b)
        }))
    });
    let (aa, ab, bb) = products
        .into_iter()
        .flatten()
        .fold((0.0, 0.0, 0.0), |sum, of| (sum.0 + of.0, sum.1 + of.1, sum.2 + of.2));
    let cosine: f64 = ab / f64::sqrt(aa * bb).max(f64::MIN_POSITIVE);
    Ok(cosine.clamp(-1.0, 1.0).acos().to_degrees())
}

/// The last cause's shape, where the data ask for another; its numbers that don't pay are left at rest.
fn refine(setting: &Setting<'_>, state: &mut Selection) -> Result<(), DiagnosisError> {
    let Some(index) = state.fitted.point.hypothesis.members.len().checked_sub(1) else { return Ok(()) };
    let Some(member) = state.fitted.point.hypothesis.members.get(index).cloned() else { return Ok(()) };
    for number in &member.candidate.optional {
        let mut point = state.fitted.point.clone();
        if let Some(of) = point.hypothesis.members.get_mut(index) {
            of.free.push(*number);
        }
        take_if(setting, state, point, |now, then| then < now - REFINED)?;
    }
    if member.candidate.series {
        more_orders(setting, state, index)?;
    }
    if member.candidate.id == "direction-asymmetry" {
        for number in 0..member.numbers.len() {
            let mut point = state.fitted.point.clone();
            let Some(of) = point.hypothesis.members.get_mut(index) else { continue };
            if of.free.len() < 2 {
                break;
            }
            of.free.retain(|free| *free != number);
            if let (Some(value), Some(parameter)) =
                (of.numbers.get_mut(number), member.candidate.parameters.get(number))
            {
                *value = parameter.neutral;
            }
            take_if(setting, state, point, |now, then| then < now + 0.3 * REFINED)?;
        }
    }
    Ok(())
}

/// Further harmonics of a series that is in already, each where it pays beside those.
fn more_orders(setting: &Setting<'_>, state: &mut Selection, index: usize) -> Result<(), DiagnosisError> {
    let point = state.fitted.point.clone();
    let Some(member) = point.hypothesis.members.get(index) else { return Ok(()) };
    let mut columns = setting.own_columns(&point.hypothesis)?;
    let mut taken: Vec<usize> = (0..columns.len()).collect();
    let mut places: Vec<(usize, usize)> = Vec::new();
    for order in (0..member.numbers.len() / 2).filter(|order| !member.free.contains(&(2 * order))) {
        places.push((order, columns.len()));
        for number in [2 * order, 2 * order + 1] {
            columns.push(setting.own_column(&point.hypothesis, Free::Number(index, number))?);
        }
    }
    let equations = setting.equations(&point, &columns, fitted_pieces)?;
    let groups = by_group(setting.campaign, &equations, columns.len());
    let left = |columns: &[usize]| {
        leave_out(&groups, &setting.campaign.fold_of, columns)
            .map_or(f64::INFINITY, |held| rms(&held, &groups))
    };
    let mut reached = left(&taken);
    let mut wider = point.clone();
    while let Some((best, cut)) = places
        .iter()
        .map(|(order, at)| ((*order, *at), reached - left(&[&taken[..], &[*at, at + 1]].concat())))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|(_, cut)| *cut >= ORDER_FLOOR)
    {
        reached -= cut;
        taken.extend([best.1, best.1 + 1]);
        places.retain(|place| *place != best);
        if let Some(of) = wider.hypothesis.members.get_mut(index) {
            of.free.extend([2 * best.0, 2 * best.0 + 1]);
        }
    }
    if let Some(of) = wider.hypothesis.members.get_mut(index) {
        of.free.sort_unstable();
    }
    if wider == point {
        return Ok(());
    }
    take_if(setting, state, wider, |now, then| then < now - REFINED)
}

fn take_if(
    setting: &Setting<'_>,
    state: &mut Selection,
    begin: Point,
    better: impl Fn(f64, f64) -> bool,
) -> Result<(), DiagnosisError> {
    let fitted = fit(setting, begin, &fitted_pieces, 6)?;
    let held_out = judge(setting, &fitted.groups);
    let then = rms(&held_out, &fitted.groups);
    if better(state.rms, then) {
        (state.fitted, state.held_out, state.rms) = (fitted, held_out, then);
    }
    Ok(())
}

fn numbers(rival: &Rival) -> usize {
    rival.fitted.point.hypothesis.free().len()
}

/// Whether `other` is as good as `best` on what neither was fitted on.
fn as_good(best: &Rival, other: &Rival) -> bool {
    let difference = other.rms - best.rms;
    if difference <= EQUAL {
        return true;
    }
    let apart: Vec<f64> = other
        .held_out
        .squares
        .iter()
        .zip(&best.held_out.squares)
        .zip(&best.fitted.groups)
        .filter(|(_, group)| group.count > 0.0)
        .map(|((other, best), _)| other - best)
        .collect();
    let count = apart.len().max(2) as f64;
    let mean = apart.iter().sum::<f64>() / count;
    let variance = apart.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    difference < NEARLY && mean < DISAGREE * (variance / count).sqrt()
}

fn fit_rivals(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    screened: Vec<Screened>,
    state: &Selection,
) -> Result<Vec<Rival>, DiagnosisError> {
    let most = screened.first().map_or(0.0, |best| best.gain);
    let mut rivals = Vec::new();
    if most < PROMISING * state.least_cut() {
        return Ok(rivals);
    }
    let torque = setting.campaign.facts.is_torque();
    let leader = screened.first().and_then(|best| candidates.get(best.candidate)).map_or("", |best| best.id);
    let mut taken = 0;
    for screened in screened {
        let id = candidates.get(screened.candidate).map_or("", |candidate| candidate.id);
        let twin = are_twins(id, leader, torque);
        let promising = screened.gain > 0.25 * most && taken < SHORT_LIST;
        if !(promising || twin && screened.gain > 0.1 * most) {
            continue;
        }
        taken += 1;
        let begin = Point {
            hypothesis: state.fitted.point.hypothesis.with(screened.member),
            ..state.fitted.point.clone()
        };
        let fitted = fit(setting, begin, &fitted_pieces, 8)?;
        let held_out = judge(setting, &fitted.groups);
        let rms = rms(&held_out, &fitted.groups);
        rivals.push(Rival { candidate: screened.candidate, fitted, held_out, rms });
    }
    Ok(rivals)
}

/// Drops causes that no longer pay beside the others.
fn drop_idle(setting: &Setting<'_>, state: &mut Selection) -> Result<(), DiagnosisError> {
    while state.fitted.point.hypothesis.members.len() > 1 {
        let mut idlest: Option<(usize, f64, Fitted, HeldOut)> = None;
        for index in 0..state.fitted.point.hypothesis.members.len() {
            let begin = Point {
                hypothesis: state.fitted.point.hypothesis.without(index),
                starts: state.fitted.point.starts.clone(),
            };
            let fitted = fit(setting, begin, &fitted_pieces, 6)?;
            let held_out = judge(setting, &fitted.groups);
            let without = rms(&held_out, &fitted.groups);
            if idlest.as_ref().is_none_or(|(_, least, _, _)| without < *least) {
                idlest = Some((index, without, fitted, held_out));
            }
        }
        let Some((index, without, fitted, held_out)) = idlest else { break };
        let worth = without.powi(2) - state.rms.powi(2);
        if without - state.rms >= FLOOR && worth >= SHARE * state.explained_by_form {
            break;
        }
        if let Some(member) = state.fitted.point.hypothesis.members.get(index) {
            let id = member.candidate.id;
            let reason = "no longer cuts the error on held-out runs once the other causes are in".to_owned();
            state.dropped.push((id, reason));
            state.ambiguous.retain(|(representative, _)| *representative != id);
        }
        (state.fitted, state.held_out, state.rms) = (fitted, held_out, without);
    }
    Ok(())
}
