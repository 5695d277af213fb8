//! How a piece begins, found by itself: one number, along which the prediction bends too much for a linear estimate.

use crate::linear::Setting;
use crate::piece::{Piece, Ready};
use log_data::Channel;

/// How a piece begins.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Begun {
    /// The torque that friction carries, N·m, or the shift of the first angle, rad.
    pub shift: f64,
    /// Angle logs: the side of the encoder's play on which the rotor lies, −1 to 1; without one, where it is drawn to.
    pub side: Option<f64>,
}

impl Begun {
    /// The likely side.
    pub fn at(shift: f64) -> Self {
        Self { shift, side: None }
    }

    /// The same side.
    pub fn shifted(self, shift: f64) -> Self {
        Self { shift, ..self }
    }
}

/// Steps towards the best, and how often one that overshoots is halved.
const STEPS: usize = 4;
const HALVINGS: usize = 4;
/// A step that cuts the sum of squares by less than this ends the search.
const ENOUGH: f64 = 0.5;
/// Where a piece is left with more than this many times its noise's mean square, other starts are tried first, so many
/// deviations of a sample's angle away: a rotor that rests at the edge of breaking away slips or holds by less than that.
const UNSETTLED: f64 = 1.2;
const OTHERS: [f64; 6] = [-4.0, -2.0, -1.0, 1.0, 2.0, 4.0];

/// Sides of the encoder's play that are tried then, and how far beside the best of them, in turn.
const SIDES: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];
const BESIDE: [f64; 2] = [0.25, 0.125];

/// The start near the given ones from which the model comes closest to what was measured; `zero_rad` is the angle's zero.
pub(crate) fn best_start(
    setting: &Setting<'_>,
    piece: &Piece,
    ready: &Ready,
    (first, fitted): (Begun, Begun),
    zero_rad: f64,
) -> Begun {
    let bound = piece.start_bound(ready);
    let step = piece.start_step(ready);
    let left = |start: Begun| left_from(setting, piece, ready, start, zero_rad);
    let [one, two] = [first, fitted].map(|start| (start, left(start)));
    let mut best = if square(&one.1) < square(&two.1) { one } else { two };
    let unsettled = |left: &[f64]| square(left) > UNSETTLED * piece.len() as f64;
    let try_all = |others: &mut dyn Iterator<Item = Begun>, best: &mut (Begun, Vec<f64>)| {
        for other in others {
            let there = left(other);
            if square(&there) < square(&best.1) {
                *best = (other, there);
            }
        }
    };
    if setting.campaign.channel == Channel::Angle && unsettled(&best.1) {
        let beside = OTHERS.map(|part| Begun::at(part * piece.noise.deviation_rad));
        try_all(&mut beside.into_iter(), &mut best);
    }
    if piece.has_play(ready) && unsettled(&best.1) {
        let shift = best.0.shift;
        let on = |side: f64| Begun { shift, side: Some(side.clamp(-1.0, 1.0)) };
        try_all(&mut SIDES.into_iter().map(on), &mut best);
        for step in BESIDE {
            if let Some(side) = best.0.side {
                try_all(&mut [side - step, side + step].into_iter().map(on), &mut best);
            }
        }
    }
    for _ in 0..STEPS {
        if step <= 0.0 {
            break;
        }
        let (start, here) = &best;
        let size = if start.shift > 0.0 { -step } else { step };
        let beside = left(start.shifted(start.shift + size));
        let slope: Vec<f64> = here.iter().zip(&beside).map(|(here, beside)| (here - beside) / size).collect();
        let steepness = square(&slope);
        let downhill: f64 = slope.iter().zip(here).map(|(slope, left)| slope * left).sum();
        let mut change = if steepness > 0.0 { downhill / steepness } else { break };
        let mut better = None;
        for _ in 0..HALVINGS {
            let trial = start.shifted((start.shift + change).clamp(-bound, bound));
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
    (one, two): (Begun, Begun),
    zero_rad: f64,
) -> Begun {
    let left = |start: Begun| square(&left_from(setting, piece, ready, start, zero_rad));
    if one == two || left(one) <= left(two) { one } else { two }
}

/// What a start leaves; the last value draws one that makes no difference towards none, as in the fit.
fn left_from(setting: &Setting<'_>, piece: &Piece, ready: &Ready, start: Begun, zero_rad: f64) -> Vec<f64> {
    let mut left = weighted(setting, piece, &piece.predict(ready, start), zero_rad);
    left.push(start.shift / piece.start_bound(ready).max(f64::MIN_POSITIVE));
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
