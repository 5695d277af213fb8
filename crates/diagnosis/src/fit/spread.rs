//! Covariance of fitted parameters, a sum of three parts: a jackknife over groups (errors shared within a run count once), errors of the
//! measured motion (shared by all runs), and model selection (how far parameters move if one that was left out is freed).
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::hypothesis::{Free, Hypothesis};
use crate::fit::equations::{Setting, by_group};
use crate::fit::gauss_newton::{Fitted, sum};
use crate::log::piece::Piece;
use crate::numerics::gram::{Gram, invert, solve};
use crate::numerics::loss::Loss;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Covariance of the free numbers, and the factor from standard error to the 95 % half width.
pub(crate) struct Spread {
    pub covariance: DMatrix<f64>,
    pub half_width: f64,
    /// Degrees of freedom of what the groups scatter by: one less than the groups.
    freedom: f64,
    /// Whether each variance is that of the noise and the priors, which are known: the groups scatter by less.
    known: Vec<bool>,
    /// The part of each variance that only numbers of the same cause bring, which were left out: its exponent, its time constant.
    own_shape: Vec<f64>,
}

/// How many times the motion is measured again: as often as a cause that compensates within itself has numbers.
const AGAIN: u64 = 3;

impl Spread {
    /// A covariance with so many degrees of freedom.
    pub fn of(covariance: DMatrix<f64>, freedom: f64) -> Self {
        let half_width = StudentsT::new(0.0, 1.0, freedom).map_or(1.96, |t| t.inverse_cdf(0.975));
        let known = vec![false; covariance.nrows()];
        Self { covariance, half_width, freedom, known, own_shape: Vec::new() }
    }

    /// Degrees of freedom of the covariance of these numbers: any number of them where it does not come from the groups' scatter.
    pub fn freedom_of(&self, places: &[usize]) -> f64 {
        const MANY: f64 = 1e6;
        let is_known = |place: &usize| self.known.get(*place).copied().unwrap_or(false);
        if places.iter().all(is_known) { MANY } else { self.freedom }
    }

    /// Adds the effect of errors in the measured motion. If the motion is sampled and smoothed again, it differs from the
    /// measured one about as much as that differs from the true one (simulation-extrapolation: Cook and Stefanski, J. Am. Stat.
    /// Assoc. 89, 1994), and the numbers change accordingly. Those of one cause change together: an amplitude and a time constant that make up for
    /// each other are uncertain, what they do is not. The motion between the samples is not known either: samples twice as far apart
    /// change the numbers by no less than what is missing between them does. Angle logs predict from the command, which has no such errors.
    pub fn with_motion(
        mut self,
        setting: &Setting<'_>,
        fitted: &Fitted,
        seed: u64,
    ) -> Result<Self, DiagnosisError> {
        if !setting.campaign.kind.motion_errs {
            return Ok(self);
        }
        // Other draws than the one that the weights were estimated from.
        for turn in 1..=AGAIN {
            let again = |piece: &Piece| piece.again(seed.wrapping_add(turn));
            let change = change_with_motion(setting, fitted, again)?;
            self.add_within_causes(&fitted.point.hypothesis, change, AGAIN as f64);
        }
        for first in [0, 1] {
            let change = change_with_motion(setting, fitted, |piece| piece.at_half_the_rate(first))?;
            self.add_within_causes(&fitted.point.hypothesis, change, 2.0);
        }
        Ok(self)
    }

    /// Adds the square of a change, one of `count`, of the numbers of each cause together, and of each other number alone.
    fn add_within_causes(&mut self, hypothesis: &Hypothesis, change: Option<DVector<f64>>, count: f64) {
        let Some(change) = change else { return };
        let causes: Vec<_> = hypothesis.free().iter().map(|free| free.member()).collect();
        for (row, one) in change.iter().enumerate() {
            for (column, other) in change.iter().enumerate() {
                if row == column || causes[row].is_some() && causes[row] == causes[column] {
                    self.covariance[(row, column)] += one * other / count;
                }
            }
        }
    }

    /// The conditional standard deviation of a number, given the numbers at `given`, and the numbers of its cause that were left out.
    pub fn deviation_given(&self, place: usize, given: &[usize]) -> f64 {
        self.covariance_given(&[place], given)[(0, 0)].sqrt()
    }

    /// The conditional covariance of the numbers at `places`, given those at `given`, and the numbers of their causes that were left out.
    pub fn covariance_given(&self, places: &[usize], given: &[usize]) -> DMatrix<f64> {
        let shape = |row: usize| self.own_shape.get(row).copied().unwrap_or(0.0);
        let at = |row: usize, column: usize| {
            self.covariance[(row, column)] - if row == column { shape(row) } else { 0.0 }
        };
        let of = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |row, column| at(rows[row], columns[column]))
        };
        let own = of(places, places);
        let beside = of(given, places);
        let shared = invert(of(given, given)).map(|inverse| beside.transpose() * inverse * &beside);
        let mut left = shared.map_or_else(|| own.clone(), |shared| &own - shared);
        for place in 0..places.len() {
            let most = own[(place, place)].max(0.0);
            left[(place, place)] = left[(place, place)].clamp(0.0, most);
        }
        left
    }

    /// Adds the uncertainty of model selection: if a weak harmonic or an exponent was left out, the other numbers absorb it.
    /// The square of their change when it is freed is added, times its Akaike weight (Buckland, Burnham and Augustin,
    /// Biometrics 53, 1997); of several, the largest.
    pub fn with_choice(mut self, setting: &Setting<'_>, fitted: &Fitted) -> Result<Self, DiagnosisError> {
        let changes = changes_with_more(setting, fitted)?;
        let places = fitted.point.hypothesis.free();
        for place in 0..self.covariance.nrows() {
            let own = places.get(place).and_then(|free| free.member());
            let of = |more: &More| more.weight * more.change[place] * more.change[place];
            let all = changes.iter().map(of).fold(0.0, f64::max);
            let others = changes.iter().filter(|more| Some(more.member) != own).map(of).fold(0.0, f64::max);
            self.covariance[(place, place)] += all;
            self.own_shape.push(all - others);
        }
        Ok(self)
    }
}

/// What freeing a number of a member changes, in one Gauss-Newton step within its bounds.
struct More {
    member: usize,
    change: DVector<f64>,
    /// Akaike's.
    weight: f64,
}

/// The change of the fitted numbers when each left-out one is freed.
fn changes_with_more(setting: &Setting<'_>, fitted: &Fitted) -> Result<Vec<More>, DiagnosisError> {
    let hypothesis = &fitted.point.hypothesis;
    let mut columns = setting.own_columns(hypothesis)?;
    let own: Vec<usize> = (0..columns.len()).collect();
    let mut others: Vec<(Vec<Free>, Vec<usize>)> = Vec::new();
    for (index, member) in hypothesis.members.iter().enumerate() {
        for numbers in member.left_out() {
            let more: Vec<Free> = numbers.into_iter().map(|number| Free::Number(index, number)).collect();
            let each: Result<Vec<_>, _> =
                more.iter().map(|free| setting.own_column(hypothesis, *free)).collect();
            let Some(each) = if_possible(each)? else { continue };
            others.push((more, (columns.len()..columns.len() + each.len()).collect()));
            columns.extend(each);
        }
    }
    if others.is_empty() {
        return Ok(Vec::new());
    }
    let equations = setting.equations(&fitted.point, &columns, Piece::is_fitted)?;
    let groups = by_group(setting.campaign, &fitted.point.hypothesis, &equations, columns.len());
    let total = sum(&setting.loss().weighted(&groups));
    let Some((alone, _)) = solve(&total, &own) else { return Ok(Vec::new()) };
    let with = |(more, places): &(Vec<Free>, Vec<usize>)| {
        let wider = [&own[..], places].concat();
        let (beta, _) = solve(&total, &wider)?;
        let gain = total.square_after(&own, &alone) - total.square_after(&wider, &beta);
        let weight = 1.0 / (1.0 + (more.len() as f64 - 0.5 * gain).exp());
        let part =
            more.iter().zip(beta.iter().skip(own.len())).map(|(free, by)| within(hypothesis, *free, *by));
        let change = (beta.rows(0, own.len()) - &alone) * part.fold(1.0, f64::min);
        Some(More { member: more.first()?.member()?, change, weight })
    };
    Ok(others.iter().filter_map(with).collect())
}

/// The share of a change that a number's bounds allow.
fn within(hypothesis: &Hypothesis, free: Free, by: f64) -> f64 {
    let at = hypothesis.get(free);
    let mut there = hypothesis.clone();
    there.set(free, at + by);
    if by == 0.0 { 1.0 } else { (there.get(free) - at) / by }
}

/// The change of the fitted numbers with another motion, in one Gauss-Newton step.
fn change_with_motion(
    setting: &Setting<'_>,
    fitted: &Fitted,
    moved: impl Fn(&Piece) -> Piece + Sync,
) -> Result<Option<DVector<f64>>, DiagnosisError> {
    let columns = setting.own_columns(&fitted.point.hypothesis)?;
    let again = |piece: &Piece| Some(moved(piece));
    let equations = setting.equations_as_seen(&fitted.point, &columns, Piece::is_fitted, again)?;
    let there = sum(&by_group(setting.campaign, &fitted.point.hypothesis, &equations, columns.len()));
    let all: Vec<usize> = (0..columns.len()).collect();
    let (_, left_here) = sum(&fitted.groups).part(&all);
    let (a, left_there) = there.part(&all);
    Ok(invert(a).map(|inverse| inverse * (left_there - left_here)))
}

fn sum_of<'a>(groups: impl Iterator<Item = &'a Gram>, columns: usize) -> Gram {
    let mut total = Gram::zero(columns);
    groups.for_each(|group| total.add(group));
    total
}

/// Covariance of a fit's free numbers by the jackknife over groups, at least that of white noise.
pub(crate) fn spread(fitted: &Fitted, loss: Loss) -> Option<Spread> {
    let groups = loss.weighted(&fitted.groups);
    let total = sum(&groups);
    let columns: Vec<usize> = (0..total.matrix.nrows() - 1).collect();
    let (a, b) = total.part(&columns);
    let white = invert(a.clone())?;
    let groups: Vec<&Gram> = groups.iter().filter(|group| group.count > 0.0).collect();
    let count = groups.len() as f64;
    let mut without: Vec<DVector<f64>> = Vec::with_capacity(groups.len());
    for group in &groups {
        let (own_a, own_b) = group.part(&columns);
        let mut rest = &a - own_a;
        for i in 0..rest.nrows() {
            rest[(i, i)] += 1e-3 * a[(i, i)];
        }
        without.push(invert(rest)? * (&b - own_b));
    }
    // Around their mean: where a fit was ended early, or a number is at its bound, all groups ask for the same step.
    let mean = without.iter().sum::<DVector<f64>>() / count.max(1.0);
    let mut clustered = DMatrix::zeros(columns.len(), columns.len());
    for change in &without {
        let off = change - &mean;
        clustered += &off * off.transpose();
    }
    clustered *= (count - 1.0) / count;
    // The prior's own contribution, which the jackknife can't see.
    let prior =
        sum_of(fitted.groups.iter().filter(|group| group.count == 0.0), columns.len()).part(&columns).0;
    clustered += &white * prior * &white;
    // Never better than white noise allows.
    let mut covariance = clustered;
    let mut known = Vec::new();
    for i in 0..covariance.nrows() {
        let least = white[(i, i)];
        known.push(covariance[(i, i)] < least);
        covariance[(i, i)] = covariance[(i, i)].max(least);
    }
    within_tolerance(&fitted.point.hypothesis, &mut covariance);
    Some(Spread { known, ..Spread::of(covariance, (count - 1.0).max(1.0)) })
}

/// Caps each correction's standard error at its prior tolerance.
fn within_tolerance(hypothesis: &Hypothesis, covariance: &mut DMatrix<f64>) {
    for (place, free) in hypothesis.free().into_iter().enumerate() {
        let Some(deviation) = hypothesis.tolerance(free) else { continue };
        let known = deviation / covariance[(place, place)].sqrt();
        if known < 1.0 {
            covariance.row_mut(place).scale_mut(known);
            covariance.column_mut(place).scale_mut(known);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::extend::catalogue::candidate;
    use crate::extend::hypothesis::{Hypothesis, Member};
    use crate::fit::equations::{Nuisances, Point};
    use crate::fit::gauss_newton::fit;
    use crate::fixtures;
    use crate::log::campaign::Campaign;
    use crate::workers::OneAfterTheOther;
    use log_data::{Log, Run};
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use rand_pcg::Pcg64Mcg;
    use valve_model::EffectId;

    const FIRST_NM: f64 = 0.2;
    const SECOND_NM: f64 = 0.02;
    const NOISE_NM: f64 = 1e-3;

    /// Runs at the same speed over the same 1.2 rad, whose torque has two harmonics; measured with noise.
    fn turns(second_nm: f64) -> Log {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let noise = Normal::new(0.0, NOISE_NM).unwrap();
        let run = |number: usize| {
            let time_s: Vec<f64> = (0..600).map(|k| 5.0 * number as f64 + 2e-3 * f64::from(k)).collect();
            let angle_rad: Vec<f64> = (0..600).map(|k| 0.3 + 2e-3 * f64::from(k)).collect();
            let torque = |at_rad: &f64| {
                let wave_nm = FIRST_NM * at_rad.cos() + second_nm * (2.0 * at_rad).cos();
                1.5 + wave_nm + noise.sample(&mut random)
            };
            Run {
                name: format!("{number}"),
                torque_nm: Some(angle_rad.iter().map(torque).collect()),
                angle_rad,
                time_s,
                ..Run::default()
            }
        };
        Log { runs: (0..8).map(run).collect(), ..Log::default() }
    }

    /// The setting of [`turns`], given to `look` with the first harmonic fitted alone, in so many steps.
    fn first_harmonic<T>(second_nm: f64, steps: usize, look: impl FnOnce(&Setting<'_>, &Fitted) -> T) -> T {
        let given = fixtures::model(Vec::new());
        let mut campaign = Campaign::new(&turns(second_nm), &given, 0, &OneAfterTheOther).unwrap();
        campaign.pieces.iter_mut().for_each(|piece| piece.weights.fill(1.0 / NOISE_NM));
        let setting = Setting::new(&campaign, &given, Nuisances::default(), &OneAfterTheOther);
        let series = candidate(EffectId::PositionTorque, &campaign.facts).unwrap();
        let member = Member::new(&series, series.neutral(), vec![0, 1]);
        let hypothesis = Hypothesis { members: vec![member], ..Hypothesis::default() };
        let ready = setting.ready(&hypothesis).unwrap();
        let starts = campaign.pieces.iter().map(|piece: &Piece| piece.first_start(&ready)).collect();
        look(&setting, &fit(&setting, Point { hypothesis, starts }, &Piece::is_fitted, steps).unwrap())
    }

    fn half_width(of: &Spread) -> f64 {
        of.half_width * of.covariance[(0, 0)].sqrt()
    }

    /// Error of the first harmonic, fitted alone, and its half width without and with the uncertainty of model selection.
    fn first_alone(second_nm: f64) -> (f64, f64, f64) {
        first_harmonic(second_nm, 8, |setting, fitted| {
            let off = (fitted.point.hypothesis.get(Free::Number(0, 0)) - FIRST_NM).abs();
            let alone = spread(fitted, setting.loss()).unwrap();
            (off, half_width(&alone), half_width(&alone.with_choice(setting, fitted).unwrap()))
        })
    }

    #[test]
    fn a_fit_that_was_ended_early_is_no_less_certain_for_the_step_that_is_left() {
        let of = |steps: usize| {
            first_harmonic(0.0, steps, |setting, fitted| half_width(&spread(fitted, setting.loss()).unwrap()))
        };
        let (ended, converged) = (of(0), of(8));
        println!("half widths: {ended} N·m before the first step, {converged} at the end");
        assert!((0.5..2.0).contains(&(ended / converged)), "{ended} against {converged} N·m");
    }

    #[test]
    fn what_two_numbers_share_is_none_of_one_if_the_other_is_known() {
        let covariance = DMatrix::from_row_slice(2, 2, &[1.0, 0.96, 0.96, 1.0]);
        let mut spread = Spread::of(covariance, 9.0);
        assert!((spread.deviation_given(0, &[]) - 1.0).abs() < 1e-12);
        assert!((spread.deviation_given(0, &[1]) - 0.28).abs() < 1e-6);
        spread.own_shape = vec![0.75];
        assert!(
            (spread.deviation_given(0, &[]) - 0.5).abs() < 1e-12,
            "an exponent that was left out is given too"
        );
    }

    #[test]
    fn a_harmonic_left_out_widens_the_intervals_of_those_that_stand_for_it() {
        // All runs have the same error, which their scatter therefore doesn't show.
        let (off, narrow, wide) = first_alone(SECOND_NM);
        assert!(off > 2.0 * narrow, "{off} {narrow}");
        assert!((off..10.0 * off).contains(&wide), "{off} {wide}");
        // A left-out harmonic of amplitude zero widens them only a little.
        let (off, narrow, wide) = first_alone(0.0);
        assert!(off < narrow && wide < 3.0 * narrow, "{off} {narrow} {wide}");
    }
}
