//! The measurement's noise: the transducer's, and the encoder's propagated to the prediction.
//!
//! The transducer's noise is the larger of two estimates, from fourth differences of the residual (motion hardly shows in them)
//! and from repeated holds (which alone show noise slower than the sampling). The encoder's part is found by a second
//! prediction, from the smoothed motion or the first angle measured once more. Samples are weighted by both.

use crate::Options;
use crate::log::at_most_seen::{Seen, at_most_seen};
use crate::log::campaign::Campaign;
use crate::log::error_model::of_at_least;
use crate::log::holds;
use crate::log::initial_state::InitialState;
use crate::log::kind::LogKind;
use crate::log::piece::Piece;
use crate::log::ready::Ready;
use crate::workers::{Workers, map};
use log_data::median;

/// Variance of white noise's fourth difference over that of the noise: 1 + 16 + 36 + 16 + 1.
const FOURTH: f64 = 70.0;
/// Samples of a block of the noise estimate.
const BLOCK: usize = 128;
/// Blocks on either side over which the encoder's part is compared with the residual.
const BLOCKS_AROUND: usize = 2;
/// If the residual's fourth differences in a block of a torque log exceed the estimated variance by this factor,
/// their variance is used: in fast motion the smoother passes more encoder noise.
const LOUDER: f64 = 1.5;
/// Share of the largest squared fourth differences that is left out of that variance. At a reversal the friction of a
/// model without presliding jumps, which is not noise; otherwise every block with a reversal would lose its weight,
/// and the faster direction with them.
const JUMPS: f64 = 0.1;
/// Mean square of Gaussian numbers of variance 1 whose greatest tenth is left out.
const WITHOUT_JUMPS: f64 = 0.623;
/// Within `AROUND` samples of a friction jump, the residual's own variance replaces the estimate if it exceeds it by
/// `JUMPING`: the residual there depends on when the reversal happens, hardly on the friction's size.
const AROUND: usize = 16;
const JUMPING: f64 = 2.5;
/// The error estimate from every other sample is used only where its variance is this multiple of the other errors' (the motion
/// between samples matters there): it contains the encoder's noise too, which is counted already.
const COARSE: f64 = 4.0;
/// Bisection steps that find the variance of a misfit.
const HALVINGS: usize = 60;
/// Samples on either side over which the encoder's part is averaged.
const REACH: usize = 50;

/// The measurement's noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NoiseLevel {
    /// Standard deviation of the measured channel alone.
    pub channel: f64,
    /// With the encoder's part of the prediction's error; root mean square over all samples.
    pub total: f64,
    /// Autocorrelated samples that count as one independent sample; 1 for white noise.
    pub per_independent: f64,
    /// The noise's mean share of a sample's variance; the rest is misfit. 1 without misfit.
    pub share: f64,
    /// True if the user gave it; it is then not estimated.
    pub given: bool,
}

impl NoiseLevel {
    /// The noise to report beside a residual of RMS `left`. It is the estimate, but at most the residual, which contains the noise (the
    /// encoder's part is overestimated where its readings are filtered). A noise that the user gave is reported as given.
    pub fn told(&self, left: f64) -> f64 {
        if self.given { self.total } else { self.total.min(left) }
    }
}

/// Estimates the noise where the user gave none, and sets the pieces' weights.
pub(crate) fn estimate(
    campaign: &mut Campaign,
    ready: &Ready,
    starts: &[InitialState],
    options: &Options,
    workers: &dyn Workers,
) -> NoiseLevel {
    let (pieces, kind) = (&campaign.pieces, campaign.kind);
    let found = map(workers, pieces.len(), |index| {
        let start = starts.get(index).copied().unwrap_or_default();
        pieces.get(index).map(|piece| look(piece, ready, start, options.seed, kind)).unwrap_or_default()
    });
    let pool = |blocks: &mut dyn Iterator<Item = f64>| {
        let mut all: Vec<f64> = blocks.filter(|variance| variance.is_finite()).collect();
        median(&mut all).unwrap_or(0.0)
    };
    let fast = pool(&mut found.iter().flat_map(|of| of.fast.iter().copied()));
    let fast_of_motion = pool(&mut found.iter().flat_map(|of| of.fast_of_motion.iter().copied()));
    let steps = pieces.iter().map(|piece| piece.noise.step_rad).fold(0.0, f64::max);
    let least = kind.least_variance(steps);
    let of_holds = holds::pooled(found.iter().flat_map(|of| of.holds.iter().copied()).collect());
    let estimated = (fast - fast_of_motion).max(0.1 * fast).max(least).max(of_holds.unwrap_or(0.0));
    let channel = options.noise.map_or(estimated, |known| known * known);
    let mut computed: Vec<Vec<f64>> =
        pieces.iter().zip(&found).map(|(piece, look)| look.computed(piece.len(), channel)).collect();
    if kind.motion_errs {
        let seen = pieces.iter().zip(&found).zip(&mut computed).map(|((piece, look), variances)| Seen {
            residual: &look.residual,
            variances,
            stretches: of_at_least(AROUND, piece.rests()),
        });
        at_most_seen(&mut seen.collect::<Vec<_>>(), channel);
    }
    let (mut sum, mut count) = (0.0, 0.0);
    for ((piece, look), computed) in campaign.pieces.iter_mut().zip(&found).zip(&computed) {
        let variances: Vec<f64> = (computed.iter().enumerate())
            .map(|(index, computed)| look.with_what_is_louder(index, *computed))
            .collect();
        piece.information = piece.information_of(kind, &variances, channel);
        for (index, ((weight, information), variance)) in
            piece.weights.iter_mut().zip(&piece.information).zip(&variances).enumerate()
        {
            // No neighbour shares the error of an onset.
            let variance = variance + look.of_onset.get(index).copied().unwrap_or(0.0);
            *weight = (information / variance).sqrt();
            sum += variance;
            count += 1.0;
        }
        for unknown in [&piece.mask, &look.indefinite] {
            for (weight, _) in piece.weights.iter_mut().zip(unknown).filter(|(_, unknown)| **unknown) {
                *weight = 0.0;
            }
        }
        // The prediction starts from the first sample, which therefore gets no weight.
        if let Some(first) = piece.weights.first_mut() {
            *first = 0.0;
        }
    }
    NoiseLevel {
        channel: channel.sqrt(),
        total: (sum / f64::max(count, 1.0)).sqrt(),
        per_independent: 1.0,
        share: 1.0,
        given: options.noise.is_some(),
    }
}

/// Increases the channel's noise until it equals the residual: differences between neighbours underestimate autocorrelated
/// noise. `per_independent` of its samples count as one independent sample. `left` is the residual of each piece.
pub(crate) fn with_colour(
    campaign: &mut Campaign,
    noise: NoiseLevel,
    left: &[Vec<f64>],
    per_independent: f64,
) -> NoiseLevel {
    let slow = extra_variance(campaign, left);
    add_to_all(campaign, slow, per_independent);
    let with = |deviation: f64| (deviation * deviation + slow).sqrt();
    NoiseLevel {
        channel: with(noise.channel),
        total: with(noise.total),
        per_independent: noise.per_independent * per_independent,
        ..noise
    }
}

/// Counts the misfit of the accepted causes as an error of every sample, with `per_independent` samples as one independent
/// sample. Otherwise the samples with the least noise would decide the fit for all, though they share the same misfit. `left`
/// is the residual of each piece.
pub(crate) fn with_misfit(
    campaign: &mut Campaign,
    noise: NoiseLevel,
    left: &[Vec<f64>],
    per_independent: f64,
) -> NoiseLevel {
    let misfit = extra_variance(campaign, left);
    campaign.has_misfit = true;
    NoiseLevel { share: add_to_all(campaign, misfit, per_independent), ..noise }
}

/// Adds a variance to every sample's and counts `per_independent` samples as one. Returns the earlier variance's mean share of the sum.
fn add_to_all(campaign: &mut Campaign, more: f64, per_independent: f64) -> f64 {
    let (mut own, mut all) = (0.0, 0.0);
    for piece in &mut campaign.pieces {
        for (weight, information) in piece.weights.iter_mut().zip(&mut piece.information) {
            if *weight > 0.0 {
                let variance = *information / (*weight * *weight);
                let whole = variance + more;
                *information /= per_independent.max(1.0);
                *weight = (*information / whole).sqrt();
                (own, all) = (own + *information * variance / whole, all + *information);
            }
        }
    }
    if all > 0.0 { own / all } else { 1.0 }
}

/// The variance that, added to every sample's, makes the weighted mean square of the normalised residual 1.
fn extra_variance(campaign: &Campaign, left: &[Vec<f64>]) -> f64 {
    let samples: Vec<(f64, f64, f64)> = campaign
        .pieces
        .iter()
        .zip(left)
        .flat_map(|(piece, left)| left.iter().zip(&piece.weights).zip(&piece.information))
        .filter(|((residual, weight), _)| **weight > 0.0 && residual.is_finite())
        .map(|((residual, weight), information)| {
            (residual * residual, information / (weight * weight), *information)
        })
        .collect();
    let count: f64 = samples.iter().map(|(_, _, information)| information).sum();
    let excess = |misfit: f64| {
        let parts =
            samples.iter().map(|(square, variance, information)| information * square / (variance + misfit));
        parts.sum::<f64>() - count
    };
    let (mut low, mut high) = (0.0, samples.iter().map(|(square, _, _)| *square).fold(0.0, f64::max));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 { low = middle } else { high = middle }
    }
    high
}

#[derive(Default)]
struct PieceVariances {
    /// Noise variance by block, of the residual and of the encoder's part of the prediction's error.
    fast: Vec<f64>,
    fast_of_motion: Vec<f64>,
    /// The residual's variance in each hold.
    holds: Vec<f64>,
    /// The residual's noise variance by block without jumps, and by sample with them; empty for an angle log, whose slips are no noise.
    steady: Vec<f64>,
    around: Vec<f64>,
    /// Variance of the encoder's part, by sample.
    of_motion: Vec<f64>,
    /// Variance of the error due to the unknown motion between samples, by sample.
    of_sampling: Vec<f64>,
    /// Square of the error where a motion may have begun before it shows, by sample.
    of_onset: Vec<f64>,
    /// Whether the model's torque at a sample is any, by sample; empty if it is not at all.
    indefinite: Vec<bool>,
    /// What the model leaves, by sample; no number where that is any.
    residual: Vec<f64>,
}

impl PieceVariances {
    /// The variance of each sample: the channel's with the encoder's part, or that of the unknown motion between samples where it is
    /// clearly larger.
    fn computed(&self, samples: usize, channel: f64) -> Vec<f64> {
        let one = |index: usize| {
            let known = channel + self.of_motion.get(index).copied().unwrap_or(0.0);
            self.of_sampling.get(index).copied().filter(|sampled| *sampled > COARSE * known).unwrap_or(known)
        };
        (0..samples).map(one).collect()
    }

    /// The variance of a sample: the computed one, or the observed one where that is clearly larger.
    fn with_what_is_louder(&self, index: usize, computed: f64) -> f64 {
        let more = |seen: Option<&f64>, factor: f64| seen.copied().filter(|seen| *seen > factor * computed);
        let steady = more(self.steady.get(index / BLOCK), LOUDER);
        let around = more(self.around.get(index), JUMPING);
        steady.into_iter().chain(around).fold(computed, f64::max)
    }
}

fn look(piece: &Piece, ready: &Ready, start: InitialState, seed: u64, kind: LogKind) -> PieceVariances {
    let predicted = piece.predict(ready, start);
    let mut residual: Vec<f64> =
        piece.measured.iter().zip(predicted).map(|(measured, model)| measured - model).collect();
    let mut errors = piece.errors_of_motion(ready, start, seed);
    let (mut about, mut steady) = Default::default();
    if kind.motion_errs {
        about = around(&residual);
    } else {
        leave_out_rests(piece, &mut residual);
    }
    let holds = holds::variances(piece, &residual, kind);
    let indefinite = indefinite(piece, ready);
    for (residual, _) in residual.iter_mut().zip(&indefinite).filter(|(_, indefinite)| **indefinite) {
        *residual = f64::NAN;
    }
    let fast = blocks(&residual, mean);
    if kind.motion_errs {
        steady = blocks(&residual, without_jumps);
        errors.iter_mut().for_each(|error| no_more_than_seen(error, &fast));
    }
    let fast_of_motion = errors.iter().flat_map(|error| blocks(error, mean)).collect();
    let of_motion: Vec<Vec<f64>> = errors.iter().map(|error| local_mean_square(error, REACH)).collect();
    let [one, other] = piece.error_of_sampling(ready, start).map(|error| local_mean_square(&error, REACH));
    let of_onset = piece.error_of_onset(ready, start).iter().map(|error| error * error).collect();
    PieceVariances {
        of_onset,
        of_sampling: one.iter().zip(&other).map(|(one, other)| one.max(*other)).collect(),
        fast,
        fast_of_motion,
        holds,
        steady,
        around: about,
        of_motion: mean_of_each(&of_motion),
        indefinite,
        residual,
    }
}

/// Where a torque says nothing about the friction: at rest, if its law has no bristles. Such friction then takes any torque up to
/// its static level, and a model's zero there is no prediction.
fn indefinite(piece: &Piece, ready: &Ready) -> Vec<bool> {
    if !ready.starts_with_a_torque() || ready.start_bound(&piece.driven) > 0.0 {
        return Vec::new();
    }
    piece.motions.iter().map(|motion| motion.speed_rad_per_s == 0.0).collect()
}

/// The encoder's part can't exceed the residual, which contains it: where its fast part does, it is scaled down to the residual's.
fn no_more_than_seen(error: &mut [f64], fast: &[f64]) {
    let fast_of_motion = blocks(error, mean);
    let around = |values: &[f64], block: usize| -> f64 {
        let near = values.iter().skip(block.saturating_sub(BLOCKS_AROUND)).take(2 * BLOCKS_AROUND + 1);
        near.filter(|value| value.is_finite()).sum()
    };
    for (block, errors) in error.chunks_mut(BLOCK).enumerate() {
        let (seen, of_motion) = (around(fast, block), around(&fast_of_motion, block));
        if seen > 0.0 && of_motion > seen {
            let scale = (seen / of_motion).sqrt();
            errors.iter_mut().for_each(|error| *error *= scale);
        }
    }
}

/// Leaves out blocks in which an encoder passes few of its steps: its rounding error is not white there.
fn leave_out_rests(piece: &Piece, residual: &mut [f64]) {
    for (angles, residual) in piece.measured.chunks(BLOCK).zip(residual.chunks_mut(BLOCK)) {
        if !prediction::goes_through_steps(angles, piece.noise.step_rad) {
            residual.fill(f64::NAN);
        }
    }
}

/// The noise variance of each block, from a mean of its squared fourth differences, without values left out.
fn blocks(values: &[f64], mean: fn(&mut [f64]) -> f64) -> Vec<f64> {
    let variance = |block: &[f64]| {
        let squares = block.windows(5).map(|five| fourth_difference(five).powi(2));
        let mut squares: Vec<f64> = squares.filter(|square| square.is_finite()).collect();
        if squares.len() > 20 { mean(&mut squares) / FOURTH } else { f64::NAN }
    };
    values.chunks(BLOCK).map(variance).collect()
}

/// The noise variance around each sample.
fn around(values: &[f64]) -> Vec<f64> {
    let inner = values.windows(5).map(|five| fourth_difference(five) / FOURTH.sqrt());
    let differences: Vec<f64> = [0.0; 2].into_iter().chain(inner).chain([0.0; 2]).collect();
    local_mean_square(&differences, AROUND)
}

fn fourth_difference(five: &[f64]) -> f64 {
    five.iter().zip([1.0, -4.0, 6.0, -4.0, 1.0]).map(|(value, weight)| weight * value).sum()
}

fn mean(squares: &mut [f64]) -> f64 {
    squares.iter().sum::<f64>() / squares.len() as f64
}

fn without_jumps(squares: &mut [f64]) -> f64 {
    squares.sort_unstable_by(f64::total_cmp);
    let kept = squares.len() - (JUMPS * squares.len() as f64) as usize;
    squares.iter().take(kept).sum::<f64>() / (kept as f64 * WITHOUT_JUMPS)
}

/// The mean over all of the values at each place.
fn mean_of_each(all: &[Vec<f64>]) -> Vec<f64> {
    let places = all.iter().map(Vec::len).min().unwrap_or(0);
    let at = |place: usize| all.iter().filter_map(|of| of.get(place)).sum::<f64>() / all.len() as f64;
    (0..places).map(at).collect()
}

fn local_mean_square(values: &[f64], reach: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    let mut sum = 0.0;
    for value in values {
        sum += value * value;
        sums.push(sum);
    }
    let mean = |index: usize| {
        let (from, to) = (index.saturating_sub(reach), (index + reach + 1).min(values.len()));
        let at = |place: usize| sums.get(place).copied().unwrap_or(0.0);
        (at(to) - at(from)) / (to - from) as f64
    };
    (0..values.len()).map(mean).collect()
}
