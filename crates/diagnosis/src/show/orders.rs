//! Which orders of the angle stand out of a residual: only these are tried as high orders of a series.

use crate::fit::equations::Setting;
use crate::log::piece::Piece;
use crate::show::residual::PieceResidual;
use log_data::median;

/// The highest order tested. A motor has up to 48 slots in a turn; the second harmonic of that is below.
pub(crate) const HIGHEST: usize = 128;
/// An order stands out if its power is this multiple of the median order's. Of 128 exponentially distributed numbers the
/// largest exceeds it by chance once in five times, which only costs a column of the screening.
const OUT: f64 = 9.0;

/// The orders from `from` on, below `below`, whose power stands out of that of the others, strongest first, at most `most`.
pub(crate) fn standing_out(
    setting: &Setting<'_>,
    left: &[PieceResidual],
    (from, below): (usize, usize),
    most: usize,
) -> Vec<usize> {
    let powers = powers(setting, left);
    let Some(usual) = median(&mut powers.clone()).filter(|usual| *usual > 0.0) else { return Vec::new() };
    let at = |order: usize| powers.get(order.wrapping_sub(1)).copied().unwrap_or(0.0);
    let peak = |order: &usize| at(*order) >= at(order - 1).max(at(order + 1)) && at(*order) > OUT * usual;
    let mut found: Vec<usize> = (from..below.min(HIGHEST + 1)).filter(peak).collect();
    found.sort_by(|a, b| at(*b).total_cmp(&at(*a)));
    found.truncate(most);
    found
}

/// The power of each order, from 1 on, in the weighted residual.
fn powers(setting: &Setting<'_>, left: &[PieceResidual]) -> Vec<f64> {
    let (mut total, mut weights) = (0.0, 0.0);
    let fitted = || setting.campaign.pieces.iter().zip(left).filter(|(piece, _)| piece.is_fitted());
    let samples = |piece: &Piece, left: &PieceResidual| -> Vec<(f64, f64, f64)> {
        let each = left.residual.iter().zip(&piece.weights).enumerate();
        let of = |(index, (residual, weight)): (usize, (&f64, &f64))| {
            let angle_rad = piece.kinematics(index).0;
            (*weight > 0.0 && angle_rad.is_finite()).then(|| (angle_rad, *residual, weight * weight))
        };
        each.filter_map(of).collect()
    };
    for (piece, left) in fitted() {
        for (_, residual, weight) in samples(piece, left) {
            (total, weights) = (total + weight * residual, weights + weight);
        }
    }
    let mean = if weights > 0.0 { total / weights } else { 0.0 };
    let values = fitted().flat_map(|(piece, left)| samples(piece, left));
    let values = values.map(|(angle_rad, residual, weight)| (angle_rad, weight * (residual - mean)));
    powers_at(values, (1.0, 1.0, HIGHEST))
}

/// The power of values over a quantity, given as (quantity, value), at so many angular frequencies from one on, a step apart.
pub(crate) fn powers_at(
    values: impl Iterator<Item = (f64, f64)>,
    (from, step, count): (f64, f64, usize),
) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); count];
    for (x, value) in values {
        let (mut sin, mut cos) = (from * x).sin_cos();
        let (turn_sin, turn_cos) = (step * x).sin_cos();
        for (along, across) in &mut sums {
            (*along, *across) = (*along + value * cos, *across + value * sin);
            // The next frequency is one rotation further.
            (sin, cos) = (sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin);
        }
    }
    sums.into_iter().map(|(along, across)| along * along + across * across).collect()
}

/// A ripple of the residual over the angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ripple {
    pub order: usize,
    /// The root mean square over runs of its amplitude, in the channel's unit.
    pub amplitude: f64,
    /// Its standard error.
    pub std_error: f64,
    /// Whether its phase is the same in all runs: only then can it be one torque, or one friction, over the angle.
    pub in_phase: bool,
}

/// Least turns of a run for its orders to be resolved, and least number of such runs for a comparison of phases.
const TURNS: f64 = 2.0;
const LEAST_RUNS: usize = 3;
/// A ripple counts if its mean square over the runs is this multiple of the median order's.
const RIPPLE: f64 = 6.0;
/// Phases are the same if the squared mean of the phasors is more than this fraction of their mean square.
const IN_PHASE: f64 = 0.5;
const MOST_TOLD: usize = 6;

/// The ripples of a residual whose runs may each have a phase of their own: strongest first.
pub(crate) fn ripples_by_run(setting: &Setting<'_>, left: &[PieceResidual]) -> Vec<Ripple> {
    let runs: Vec<Phasors> =
        (0..setting.campaign.runs.len()).filter_map(|run| phasors(setting, left, run)).collect();
    if runs.len() < LEAST_RUNS {
        return Vec::new();
    }
    let count = runs.len() as f64;
    let at = |order: usize| runs.iter().filter_map(move |run| run.of_order.get(order - 1).copied());
    let squares = |order: usize| at(order).map(|(along, across)| along * along + across * across);
    let means: Vec<f64> = (1..=HIGHEST).map(|order| squares(order).sum::<f64>() / count).collect();
    let Some(usual) = median(&mut means.clone()) else { return Vec::new() };
    let ripple = |order: usize| {
        let mean = means.get(order - 1).copied().unwrap_or(0.0);
        let variance = squares(order).map(|square| (square - mean).powi(2)).sum::<f64>() / count;
        // Phasors of a torque agree as they are, those of friction with opposite signs in the two directions.
        let mean_with = |sign: fn(&Phasors) -> f64| {
            let of = |run: &Phasors| {
                let (along, across) = run.of_order.get(order - 1).copied().unwrap_or_default();
                (sign(run) * along, sign(run) * across)
            };
            let (along, across) =
                runs.iter().map(of).fold((0.0, 0.0), |sum, of| (sum.0 + of.0 / count, sum.1 + of.1 / count));
            along * along + across * across
        };
        let agreeing = mean_with(|_| 1.0).max(mean_with(|run| run.direction));
        let amplitude = (mean - usual).max(0.0).sqrt();
        let std_error = (variance / count).sqrt() / (2.0 * amplitude.max(f64::MIN_POSITIVE));
        let in_phase = agreeing > IN_PHASE * mean;
        (mean > RIPPLE * usual).then_some(Ripple { order, amplitude, std_error, in_phase })
    };
    let mut found: Vec<Ripple> = (1..=HIGHEST).filter_map(ripple).collect();
    found.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
    found.truncate(MOST_TOLD);
    found
}

/// A run's phasor of each order.
struct Phasors {
    /// Cosine and sine part, from order 1 on.
    of_order: Vec<(f64, f64)>,
    /// Net motion over the angle's span: 1 or −1 for a run in one direction, less for one that turns back.
    direction: f64,
}

/// Whether a run has enough turns for its orders to be resolved.
pub(crate) fn turns_enough(setting: &Setting<'_>, run: usize) -> bool {
    let pieces = setting.campaign.pieces.iter().filter(|piece| piece.run == run);
    let angles = pieces.flat_map(|piece| (0..piece.len()).map(|index| piece.kinematics(index).0));
    let (least, most) = ends(angles);
    most - least >= TURNS * std::f64::consts::TAU
}

fn ends(angles: impl Iterator<Item = f64>) -> (f64, f64) {
    angles.fold((f64::INFINITY, f64::NEG_INFINITY), |of, at| (of.0.min(at), of.1.max(at)))
}

/// Cosine and sine part of each order in a run; `None` where it turns too little.
fn phasors(setting: &Setting<'_>, left: &[PieceResidual], run: usize) -> Option<Phasors> {
    if !turns_enough(setting, run) {
        return None;
    }
    let mut samples: Vec<(f64, f64)> = Vec::new();
    for (piece, left) in setting.campaign.pieces.iter().zip(left).filter(|(piece, _)| piece.run == run) {
        let each = left.residual.iter().zip(&piece.weights).enumerate();
        let counts = each.filter(|(_, (_, weight))| **weight > 0.0);
        samples.extend(counts.map(|(index, (residual, _))| (piece.kinematics(index).0, *residual)));
    }
    let (least, most) = ends(samples.iter().map(|(at, _)| *at));
    let direction =
        samples.first().zip(samples.last()).map_or(0.0, |(first, last)| (last.0 - first.0) / (most - least));
    // Only whole turns are used: otherwise a mean would look like a ripple.
    let whole = least + ((most - least) / std::f64::consts::TAU).floor() * std::f64::consts::TAU;
    samples.retain(|(at, _)| *at <= whole);
    let count = samples.len().max(1) as f64;
    let mean = samples.iter().map(|(_, value)| value).sum::<f64>() / count;
    let mut of_order = vec![(0.0, 0.0); HIGHEST];
    for (at, value) in samples {
        let value = 2.0 * (value - mean) / count;
        let (sin_one, cos_one) = at.sin_cos();
        let (mut sin, mut cos) = (sin_one, cos_one);
        for (along, across) in &mut of_order {
            (*along, *across) = (*along + value * cos, *across + value * sin);
            (sin, cos) = (sin * cos_one + cos * sin_one, cos * cos_one - sin * sin_one);
        }
    }
    Some(Phasors { of_order, direction })
}
