//! Screening: ranks every candidate by how much its linearised optimum cuts the held-out error.

use crate::DiagnosisError;
use crate::extend::candidate::{Candidate, Probe};
use crate::extend::catalogue::{high_orders, look_for_orders, takes_orders};
use crate::extend::hypothesis::Member;
use crate::extend::stroke::{tells_apart, turns};
use crate::fit::equations::{Column, Point, Setting, by_group};
use crate::fit::gauss_newton::{Fitted, sum};
use crate::fit::law_column::LawColumn;
use crate::log::campaign::Campaign;
use crate::log::piece::Piece;
use crate::name::own::{AtBounds, Own};
use crate::numerics::gram::{Gram, HeldOut, leave_out, solve};
use crate::numerics::loss::Loss;
use crate::show::geared::is_over_the_angle;
use crate::show::orders::standing_out;
use crate::show::residual::{PieceResidual, left};
use nalgebra::DVector;
use valve_model::EffectId;

/// Least cut of the held-out RMS by a harmonic, relative to the noise.
pub(crate) const ORDER_FLOOR: f64 = 0.004;

/// Where the residual of an angle log exceeds the noise by this factor, the model slips at other moments than the rotor, and a
/// small change says little about a large one. Secants over these numbers of steps are then screened too.
const FAR: f64 = 1.1;
const SECANTS: [f64; 4] = [1.0, -5.0, 5.0, 15.0];
/// For a factor with a step of at most `FINE` of it, secants to these multiples: a stick-slip rotor may show a stiffness three
/// times as large only near that value.
const FINE: f64 = 0.1;
const FACTORS: [f64; 9] = [0.35, 0.5, 0.7, 0.87, 1.15, 1.45, 1.9, 2.4, 3.0];

/// In a long log the screening uses only these folds: they contain every kind of run, and the fit decides.
const LOOKED_AT: [usize; 2] = [0, 2];

/// A candidate as ranked by the screening.
#[derive(Debug, Clone)]
pub(crate) struct Screened {
    /// Cut of the held-out RMS, relative to the noise, linearised.
    pub gain: f64,
    pub member: Member,
}

/// A screening: the ranking, and what it was made from.
pub(crate) struct Screening<'a> {
    /// The candidates as they were screened.
    pub candidates: Vec<Candidate>,
    /// Best first.
    pub ranked: Vec<Screened>,
    pub tally: Tally<'a>,
    pub places: Vec<Place>,
}

impl Screening<'_> {
    /// Names and gains, best first.
    pub fn ranking(&self) -> Vec<(EffectId, f64)> {
        self.ranked.iter().map(|of| (of.member.candidate.id, of.gain)).collect()
    }
}

/// Screens every candidate that is not accepted yet; numbers at their bounds stay there.
pub(crate) fn screen<'a>(
    setting: &Setting<'a>,
    candidates: &[Candidate],
    state: &Fitted,
) -> Result<Screening<'a>, DiagnosisError> {
    screen_with(setting, candidates, state, AtBounds::Stay)
}

/// As [`screen`].
pub(crate) fn screen_with<'a>(
    setting: &Setting<'a>,
    candidates: &[Candidate],
    state: &Fitted,
    at_bounds: AtBounds,
) -> Result<Screening<'a>, DiagnosisError> {
    let point = &state.point;
    let hypothesis = &point.hypothesis;
    let candidates = with_orders(setting, candidates, point)?;
    let mut columns = setting.own_columns(hypothesis)?;
    let own = Own::of(hypothesis, columns.len(), at_bounds);
    let mut places: Vec<Place> = Vec::new();
    // A parameter whose correction is free within its bounds is skipped: the candidate would be collinear with it.
    let is_free =
        |id: EffectId| hypothesis.corrections.iter().any(|of| of.id == id && of.free && !of.is_at_bound());
    let wanted = |id: EffectId| !hypothesis.has(id) && !is_free(id);
    for (index, candidate) in candidates.iter().enumerate().filter(|(_, of)| wanted(of.id)) {
        let secants = secants(setting, candidate, state);
        for (number, probe) in candidate.probes.iter().enumerate() {
            let secants = secants.iter().take(if probe.jump { 1 } else { secants.len() });
            for part in secants.filter(|part| may_go(candidate, probe, **part)) {
                let of = |(parameter, step): &(usize, f64)| {
                    probe_column(setting, candidate, probe, *parameter, part * step, point)
                };
                let Some(own) = probe.columns.iter().map(of).collect::<Option<Vec<Column>>>() else {
                    continue;
                };
                let at = (columns.len()..columns.len() + own.len()).collect();
                places.push(Place { candidate: index, probe: number, part: *part, columns: at });
                columns.extend(own);
            }
        }
    }
    let equations = setting.equations(point, &columns, looked_at(setting.campaign))?;
    let groups = by_group(setting.campaign, &point.hypothesis, &equations, columns.len());
    let tally = Tally::new(setting, groups, own);
    let mut ranked = Vec::new();
    for (index, candidate) in candidates.iter().enumerate() {
        let probes: Vec<_> = places.iter().filter(|place| place.candidate == index).collect();
        let screened = if candidate.series {
            screen_series(candidate, &probes, &tally, turns(&setting.campaign.facts))
        } else {
            screen_plain(candidate, &probes, &tally)
        };
        ranked.extend(screened.map(|(gain, member)| Screened { gain, member }));
    }
    ranked.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Ok(Screening { candidates, ranked, tally, places })
}

/// The candidates, a torque over the angle with the orders that stand out of the residual at `point`.
fn with_orders(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    point: &Point,
) -> Result<Vec<Candidate>, DiagnosisError> {
    let mut candidates = candidates.to_vec();
    if !candidates.iter().any(takes_orders) {
        return Ok(candidates);
    }
    let orders = orders_left(setting, point)?;
    candidates.iter_mut().for_each(|candidate| look_for_orders(candidate, &orders));
    Ok(candidates)
}

/// The high orders that stand out of the residual at a point.
pub(crate) fn orders_left(setting: &Setting<'_>, point: &Point) -> Result<Vec<usize>, DiagnosisError> {
    Ok(orders_of(setting, &left(setting, point)?))
}

/// The high orders that stand out of a residual.
pub(crate) fn orders_of(setting: &Setting<'_>, left: &[PieceResidual]) -> Vec<usize> {
    let facts = &setting.campaign.facts;
    standing_out(setting, left, high_orders(facts), facts.kind.most_high_orders)
}

/// The pieces that the screening uses.
fn looked_at(campaign: &Campaign) -> impl Fn(&Piece) -> bool + Sync + '_ {
    let fitted = campaign.pieces.iter().filter(|piece| piece.is_fitted());
    let samples: usize = fitted.map(Piece::len).sum();
    let all = samples <= campaign.kind.most_screened_whole;
    move |piece| {
        let fold = campaign.fold_of.get(piece.group);
        piece.is_fitted() && (all || fold.is_some_and(|fold| LOOKED_AT.contains(fold)))
    }
}

/// The secants of a candidate, in numbers of its finite-difference step.
fn secants(setting: &Setting<'_>, candidate: &Candidate, state: &Fitted) -> Vec<f64> {
    let total = sum(&state.groups);
    let far = total.square() > FAR * FAR * total.count;
    if !far || setting.campaign.kind.smooth || candidate.series {
        return vec![1.0];
    }
    match candidate.parameters.as_slice() {
        [of] if of.key == "factor" && of.step <= FINE * of.neutral => {
            let far = FACTORS.iter().map(|factor| (factor - 1.0) * of.neutral / of.step);
            std::iter::once(1.0).chain(far).collect()
        }
        _ => SECANTS.to_vec(),
    }
}

/// Whether a secant moves the parameters: false if a neutral value is the bound on that side.
fn may_go(candidate: &Candidate, probe: &Probe, part: f64) -> bool {
    let bound = |(parameter, step): &(usize, f64)| {
        let of = candidate.parameters.get(*parameter);
        of.is_some_and(|of| {
            let nearest = if part * step < 0.0 { of.lower } else { of.upper };
            nearest == of.neutral
        })
    };
    probe.jump || !probe.columns.iter().any(bound)
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
        let place = |id: EffectId| setting.kept?.place(id);
        if setting.adds_torques(&point.hypothesis)
            && let Some(law) = LawColumn::of(setting.given, candidate, (&numbers, parameter, step), place)
        {
            return Some(Column::Law(Box::new(law)));
        }
        *numbers.get_mut(parameter)? += step;
    }
    let member = Member::new(candidate, numbers, Vec::new());
    // A model that refuses the change has no such effect.
    let ready = setting.ready(&point.hypothesis.with(member)).ok()?;
    Some(Column::Simulated(ready, if probe.jump { 1.0 } else { step }))
}

/// The normal equations of all columns, and the held-out error of any subset of them.
pub(crate) struct Tally<'a> {
    loss: Loss,
    groups: Vec<Gram>,
    /// The groups as a fit weights them.
    weighted: Vec<Gram>,
    /// Their sum.
    pub total: Gram,
    folds: &'a [usize],
    pub own: Own,
    /// Held-out RMS with those alone, relative to the noise.
    pub base: f64,
}

impl<'a> Tally<'a> {
    fn new(setting: &Setting<'a>, groups: Vec<Gram>, own: Own) -> Self {
        let loss = setting.loss();
        let weighted = loss.weighted(&groups);
        let (total, folds) = (sum(&weighted), &setting.campaign.fold_of);
        let mut tally = Self { loss, groups, weighted, total, folds, own, base: f64::INFINITY };
        tally.base = tally.left(&tally.own.columns).unwrap_or(f64::INFINITY);
        tally
    }

    /// Held-out RMS with these columns, relative to the noise.
    pub fn left(&self, columns: &[usize]) -> Option<f64> {
        leave_out(&self.weighted, &self.groups, self.folds, columns)
            .map(|held| self.loss.rms(held.each(&self.groups)))
    }

    /// RMS once the columns change by `beta`, relative to the noise.
    fn after(&self, columns: &[usize], beta: &DVector<f64>) -> f64 {
        let squares = self.groups.iter().map(|group| group.square_after(columns, beta)).collect();
        self.loss.rms(HeldOut { squares }.each(&self.groups))
    }
}

/// The columns of a candidate's probe, and the secant that they are taken over.
pub(crate) struct Place {
    pub candidate: usize,
    pub probe: usize,
    pub part: f64,
    pub columns: Vec<usize>,
}

impl Place {
    /// The candidate's numbers for the coefficients `betas`; `None` if they are out of bounds, or on the other side of the secant.
    pub fn numbers(&self, candidate: &Candidate, betas: &[f64]) -> Option<Vec<f64>> {
        let probe = candidate.probes.get(self.probe)?;
        let mut numbers = probe.shape.clone();
        for ((parameter, step), beta) in probe.columns.iter().zip(betas) {
            let of = candidate.parameters.get(*parameter)?;
            if probe.jump {
                if *beta <= 0.0 {
                    return None;
                }
                continue;
            }
            let wanted = of.neutral + beta;
            // A secant holds only on the side on which it was taken.
            let ahead = self.part == 1.0 || beta * self.part * step > 0.0;
            if !ahead || !at_most(wanted, of.lower, of.upper, of.step) {
                return None;
            }
            *numbers.get_mut(*parameter)? = wanted.clamp(of.lower, of.upper);
        }
        Some(numbers)
    }
}

impl Place {
    /// The part of the way to the optimum `betas` that the bounds allow, and the candidate's numbers there; `None` if that is none of it, or if the
    /// place holds for one step alone.
    ///
    /// A large change of a number that the prediction follows less and less (a stiffness, a speed) has its linear optimum beyond any bound.
    fn towards(&self, candidate: &Candidate, betas: &[f64]) -> Option<(f64, Vec<f64>)> {
        let probe = candidate.probes.get(self.probe).filter(|probe| !probe.jump && self.part == 1.0)?;
        let of = |(parameter, _): &(usize, f64)| candidate.parameters.get(*parameter);
        let mut part: f64 = 1.0;
        for (column, beta) in probe.columns.iter().zip(betas).filter(|(_, beta)| **beta != 0.0) {
            let of = of(column)?;
            let bound = if *beta < 0.0 { of.lower } else { of.upper };
            part = part.min((bound - of.neutral) / beta);
        }
        let mut numbers = probe.shape.clone();
        for (column, beta) in probe.columns.iter().zip(betas) {
            *numbers.get_mut(column.0)? = of(column)?.neutral + part * beta;
        }
        (part > 0.0).then_some((part, numbers))
    }
}

fn screen_plain(candidate: &Candidate, places: &[&Place], tally: &Tally<'_>) -> Option<(f64, Member)> {
    if let Some(begun) = best_jump(candidate, places, tally) {
        return Some(begun);
    }
    let mut best: Option<(f64, Member)> = None;
    for place in places {
        let own = tally.own.beside(&tally.total, candidate.id, &place.columns);
        let columns: Vec<usize> = own.iter().chain(&place.columns).copied().collect();
        let Some(left) = tally.left(&columns) else { continue };
        let Some((beta, _)) = solve(&tally.total, &columns) else { continue };
        let betas: Vec<f64> = beta.iter().skip(own.len()).copied().collect();
        let (gain, numbers) = match place.numbers(candidate, &betas) {
            Some(numbers) => (tally.base - left, numbers),
            None => match place.towards(candidate, &betas) {
                Some((part, numbers)) => (tally.base - part_of_the_way(tally.base, left, part), numbers),
                None => (-1.0, candidate.neutral()),
            },
        };
        if best.as_ref().is_none_or(|(most, _)| gain > *most) {
            best = Some((gain, Member::new(candidate, numbers, candidate.free.clone())));
        }
    }
    best
}

/// The RMS where parameters go only this part of the way from `base` to the optimum, which leaves `left`: squares are a parabola on that line.
fn part_of_the_way(base: f64, left: f64, part: f64) -> f64 {
    (base.powi(2) - (base.powi(2) - left.powi(2)) * part * (2.0 - part)).max(0.0).sqrt()
}

/// The shape with the least residual, if it is below the present one. The shape is taken as it is, because a jump is not linearised.
fn best_jump(candidate: &Candidate, places: &[&Place], tally: &Tally<'_>) -> Option<(f64, Member)> {
    let whole = DVector::from_element(1, 1.0);
    let mut best: Option<(f64, &Probe)> = None;
    for place in places {
        let Some(probe) = candidate.probes.get(place.probe).filter(|probe| probe.jump) else { continue };
        let gain = tally.base - tally.after(&place.columns, &whole);
        if best.is_none_or(|(most, _)| gain > most) {
            best = Some((gain, probe));
        }
    }
    let (gain, probe) = best.filter(|(gain, _)| *gain > 0.0)?;
    let member = Member::new(candidate, probe.shape.clone(), candidate.free.clone());
    Some((gain, member))
}

/// True if a linear estimate is within its bounds, or near enough.
fn at_most(wanted: f64, lower: f64, upper: f64, step: f64) -> bool {
    wanted > lower - 0.5 * step && wanted < upper + step.max(0.5 * upper.abs())
}

/// Adds harmonics one at a time while each gains; those of the angle only if they can be told apart on a stroke of `turns` turns.
fn screen_series(
    candidate: &Candidate,
    places: &[&Place],
    tally: &Tally<'_>,
    turns: f64,
) -> Option<(f64, Member)> {
    let order = |place: &Place| {
        let first = candidate.probes.get(place.probe).and_then(|probe| probe.columns.first());
        first.map_or(0, |(number, _)| number / 2 + 1)
    };
    let mut columns = tally.own.columns.clone();
    let (mut taken, mut reached): (Vec<&Place>, f64) = (Vec::new(), tally.base);
    let mut first_cut = 0.0;
    loop {
        let mut best: Option<(f64, &Place)> = None;
        let held: Vec<usize> = taken.iter().map(|place| order(place)).collect();
        let is_new = |place: &&&Place| {
            !taken.iter().any(|taken| taken.probe == place.probe)
                && (!is_over_the_angle(candidate.id)
                    || tells_apart(&[&held[..], &[order(place)]].concat(), turns))
        };
        for place in places.iter().filter(is_new) {
            let wider: Vec<usize> = columns.iter().chain(&place.columns).copied().collect();
            let Some(left) = tally.left(&wider) else { continue };
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
        columns.extend(&place.columns);
        taken.push(place);
        reached = left;
        if taken.len() >= 6 || cut <= 0.0 {
            break;
        }
    }
    let (beta, _) = solve(&tally.total, &columns)?;
    let mut numbers = candidate.neutral();
    let mut free: Vec<usize> = Vec::new();
    let betas: Vec<f64> = beta.iter().skip(tally.own.columns.len()).copied().collect();
    for (place, pair) in taken.iter().zip(betas.chunks(2)) {
        let columns = candidate.probes.get(place.probe).map_or(&[][..], |probe| &probe.columns);
        for ((at, _), value) in columns.iter().zip(pair) {
            let at = *at;
            free.push(at);
            if let (Some(number), Some(of)) = (numbers.get_mut(at), candidate.parameters.get(at)) {
                *number = (of.neutral + value).clamp(of.lower, of.upper);
            }
        }
    }
    free.sort_unstable();
    Some((tally.base - reached, Member::new(candidate, numbers, free)))
}
