//! How a piece begins, found by itself: one number, along which the prediction bends too much for a linear estimate.

use crate::linear::Setting;
use crate::piece::{Piece, Ready};
use log_data::Channel;

/// Steps towards the best, and how often one that overshoots is halved.
const STEPS: usize = 4;
const HALVINGS: usize = 4;
/// A step that cuts the sum of squares by less than this ends the search.
const ENOUGH: f64 = 0.5;
/// Where a piece is left with more than this many times its noise's mean square, other starts are tried first, so many
/// deviations of a sample's angle away: a rotor that rests at the edge of breaking away slips or holds by less than that.
const UNSETTLED: f64 = 1.2;
const OTHERS: [f64; 6] = [-4.0, -2.0, -1.0, 1.0, 2.0, 4.0];

/// The start (the torque that friction carries, N·m, or the shift of the first angle, rad) near the given ones from which the model
/// comes closest to what was measured; `zero_rad` is the angle's zero.
pub(crate) fn best_start(
    setting: &Setting<'_>,
    piece: &Piece,
    ready: &Ready,
    (first, fitted): (f64, f64),
    zero_rad: f64,
) -> f64 {
    let bound = piece.start_bound(ready);
    let step = piece.start_step(ready);
    let left = |start: f64| left_from(setting, piece, ready, start, zero_rad);
    let [one, two] = [first, fitted].map(|start| (start, left(start)));
    let mut best = if square(&one.1) < square(&two.1) { one } else { two };
    if setting.campaign.channel == Channel::Angle && square(&best.1) > UNSETTLED * piece.len() as f64 {
        for other in OTHERS.map(|part| part * piece.noise.deviation_rad) {
            let there = left(other);
            if square(&there) < square(&best.1) {
                best = (other, there);
            }
        }
    }
    for _ in 0..STEPS {
        if step <= 0.0 {
            break;
        }
        let (start, here) = &best;
        let size = if *start > 0.0 { -step } else { step };
        let beside = left(start + size);
        let slope: Vec<f64> = here.iter().zip(&beside).map(|(here, beside)| (here - beside) / size).collect();
        let steepness = square(&slope);
        let downhill: f64 = slope.iter().zip(here).map(|(slope, left)| slope * left).sum();
        let mut change = if steepness > 0.0 { downhill / steepness } else { break };
        let mut better = None;
        for _ in 0..HALVINGS {
            let trial = (start + change).clamp(-bound, bound);
            let there = left(trial);
            if square(&there) < square(here) {
                better = Some((trial, there));
                break;
            }
            change *= 0.5;
        }
        let Some(better) = better else { break };
        let gained = square(here) - square(&better.1);
        best = better;
        if gained < ENOUGH {
            break;
        }
    }
    best.0
}

/// The better of two starts.
pub(crate) fn better_start(
    setting: &Setting<'_>,
    piece: &Piece,
    ready: &Ready,
    (one, two): (f64, f64),
    zero_rad: f64,
) -> f64 {
    let left = |start: f64| square(&left_from(setting, piece, ready, start, zero_rad));
    if one == two || left(one) <= left(two) { one } else { two }
}

/// What a start leaves; the last value draws one that makes no difference towards none, as in the fit.
fn left_from(setting: &Setting<'_>, piece: &Piece, ready: &Ready, start: f64, zero_rad: f64) -> Vec<f64> {
    let mut left = weighted(setting, piece, &piece.predict(ready, start), zero_rad);
    left.push(start / piece.start_bound(ready).max(f64::MIN_POSITIVE));
    left
}

/// Measured less predicted in parts of the noise; less their mean where a zero of the run's own is a nuisance.
fn weighted(setting: &Setting<'_>, piece: &Piece, predicted: &[f64], zero_rad: f64) -> Vec<f64> {
    let mut left: Vec<f64> = piece
        .measured
        .iter()
        .zip(predicted)
        .zip(&piece.weights)
        .map(|((measured, predicted), weight)| {
            let value = (measured - predicted - zero_rad) * weight;
            if *weight > 0.0 && value.is_finite() { value } else { 0.0 }
        })
        .collect();
    if setting.nuisances.angle_zero || setting.nuisances.zero_nm > 0.0 {
        let (sum, weights) = left
            .iter()
            .zip(&piece.weights)
            .fold((0.0, 0.0), |(sum, all), (value, weight)| (sum + value * weight, all + weight * weight));
        let mean = if weights > 0.0 { sum / weights } else { 0.0 };
        left.iter_mut().zip(&piece.weights).for_each(|(value, weight)| *value -= mean * weight);
    }
    left
}

fn square(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}
