//! The best initial state of a piece, by a search of its own: the prediction is too nonlinear in it for a linear estimate.

use crate::fit::equations::Setting;
use crate::log::initial_state::InitialState;
use crate::log::piece::Piece;
use crate::log::ready::Ready;

/// Most Gauss-Newton steps, and most halvings of one that overshoots.
const STEPS: usize = 4;
const HALVINGS: usize = 4;
/// The search ends if a step reduces the normalised sum of squares by less.
const ENOUGH: f64 = 0.5;
/// If a piece's mean square exceeds this multiple of the noise variance, other starts are tried first.
const UNSETTLED: f64 = 1.2;

/// Sides that are tried then, and the refinements beside the best of them.
const SIDES: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];
const BESIDE: [f64; 2] = [0.25, 0.125];

/// The start near the given ones with the smallest residual; `zero_rad` is the angle's zero.
pub(crate) fn best_start(
    setting: &Setting<'_>,
    piece: &Piece,
    ready: &Ready,
    (first, fitted): (InitialState, InitialState),
    zero_rad: f64,
) -> InitialState {
    if !piece.depends_on_its_start(ready) {
        return fitted;
    }
    let mut search = Search { setting, piece, ready, zero_rad, best: (fitted, Vec::new()) };
    search.best.1 = search.left(fitted);
    search.try_all([first]);
    let other_starts = setting.campaign.kind.other_starts;
    if !other_starts.is_empty() && search.is_unsettled() {
        let near = search.best.0;
        let others = other_starts.iter().map(|part| near.shifted(part * piece.noise.deviation_rad));
        search.try_all(others);
    }
    if ready.has_sides() && search.is_unsettled() {
        search.try_sides();
    }
    search.descend();
    search.best.0
}

/// A search for the best start.
struct Search<'a> {
    setting: &'a Setting<'a>,
    piece: &'a Piece,
    ready: &'a Ready,
    zero_rad: f64,
    /// The best start so far, and its residual.
    best: (InitialState, Vec<f64>),
}

impl Search<'_> {
    fn left(&self, start: InitialState) -> Vec<f64> {
        left_from(self.setting, self.piece, self.ready, start, self.zero_rad)
    }

    fn is_unsettled(&self) -> bool {
        square(&self.best.1) > UNSETTLED * self.piece.count()
    }

    fn try_all(&mut self, others: impl IntoIterator<Item = InitialState>) {
        for other in others {
            let there = self.left(other);
            if square(&there) < square(&self.best.1) {
                self.best = (other, there);
            }
        }
    }

    fn try_sides(&mut self) {
        let shift = self.best.0.shift;
        let on = |side: f64| InitialState { shift, side: Some(side.clamp(-1.0, 1.0)) };
        self.try_all(SIDES.map(on));
        for step in BESIDE {
            if let Some(side) = self.best.0.side {
                self.try_all([side - step, side + step].map(on));
            }
        }
    }

    /// Gauss-Newton steps along the shift.
    fn descend(&mut self) {
        let bound = self.piece.start_bound(self.ready);
        let step = self.piece.start_step(self.ready);
        for _ in 0..if step > 0.0 { STEPS } else { 0 } {
            let (start, here) = &self.best;
            let size = if start.shift > 0.0 { -step } else { step };
            let beside = self.left(start.shifted(start.shift + size));
            let slope: Vec<f64> =
                here.iter().zip(&beside).map(|(here, beside)| (here - beside) / size).collect();
            let steepness = square(&slope);
            if steepness <= 0.0 {
                break;
            }
            let downhill: f64 = slope.iter().zip(here).map(|(slope, left)| slope * left).sum();
            let trial = |halvings: usize| {
                let change = downhill / steepness * 0.5f64.powi(halvings as i32);
                let there = start.shifted((start.shift + change).clamp(-bound, bound));
                Some((there, self.left(there))).filter(|(_, left)| square(left) < square(here))
            };
            let Some(better) = (0..HALVINGS).find_map(trial) else { break };
            let gained = square(here) - square(&better.1);
            self.best = better;
            if gained < ENOUGH {
                break;
            }
        }
    }
}

/// The better of two starts.
pub(crate) fn better_start(
    setting: &Setting<'_>,
    piece: &Piece,
    ready: &Ready,
    (one, two): (InitialState, InitialState),
    zero_rad: f64,
) -> InitialState {
    let left = |start: InitialState| square_left(setting, piece, ready, start, zero_rad);
    if one == two || left(one) <= left(two) { one } else { two }
}

/// The normalised residual's sum of squares from a start.
pub(crate) fn square_left(
    setting: &Setting<'_>,
    piece: &Piece,
    ready: &Ready,
    start: InitialState,
    zero_rad: f64,
) -> f64 {
    square(&left_from(setting, piece, ready, start, zero_rad))
}

/// The normalised residual from a start. Its last value is the prior that draws a start without influence to zero, as in the fit.
fn left_from(
    setting: &Setting<'_>,
    piece: &Piece,
    ready: &Ready,
    start: InitialState,
    zero_rad: f64,
) -> Vec<f64> {
    let mut left = weighted(setting, piece, &piece.predict(ready, start), zero_rad);
    left.push(start.shift / piece.start_bound(ready).max(f64::MIN_POSITIVE));
    left
}

/// The normalised residual, less its weighted mean if each run has a zero of its own as a nuisance parameter.
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
