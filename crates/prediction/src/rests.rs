//! Rests in a measured angle: stretches that do not differ from a constant by more than the encoder's noise.

use crate::noise::Noise;
use log_data::median;
use std::ops::Range;

/// A rest's samples lie within two steps and so many deviations of the noise beyond quantisation; the means of its halves
/// differ by no more than so many of their deviations.
const STILL_NOISE: f64 = 8.0;
const STILL_TREND: f64 = 4.0;

/// The fewest samples of a rest between motions. A slow motion through the noise's width is shorter, or shows its trend.
const LEAST: usize = 16;
/// A motion goes on to so many times that within this part of the rest's length. An encoder's next step in a slow motion takes as long as the one
/// before, and about a turning point the angle goes with the square of the time: to 2.25 times.
const MOVES: f64 = 3.0;
const SOON: usize = 4;
/// Up to this part of a rest, at either end, a motion begins or ends within the noise: there the mean of the outermost samples is
/// further from that of the others than so many of its deviations.
const ENDS: usize = 8;
const OUTERMOST: usize = 3;
const APART: f64 = 2.5;
/// The scatter of a rest in parts of the noise's deviation, whose estimate may be off, and by so many standard errors of a variance.
const SCATTER: f64 = 1.1;
const BY_CHANCE: f64 = 2.0;

/// How far the samples of a window may lie apart that is taken for a rest, rad.
pub(crate) fn still_spread_rad(noise: Noise) -> f64 {
    2.01 * noise.step_rad + STILL_NOISE * noise.beyond_quantisation_rad()
}

/// Rests between motions, one after the other, as long as the samples stay: neither a trend nor a scatter beyond the noise, and a clear
/// motion before and behind.
///
/// As many samples as there are decide, where windows of one length would miss the rests of a slow record, or take a slow motion for one.
pub(crate) fn rests_between_motions(angles: &[f64], noise: Noise) -> Vec<Range<usize>> {
    let mut rests = Vec::new();
    let mut from = 0;
    while from + LEAST <= angles.len() {
        let to = from + stays(angles.get(from..).unwrap_or_default(), noise);
        let rest = without_ends(angles, from..to, noise);
        let is_rest = || {
            is_noise(angles.get(rest.clone()).unwrap_or_default(), noise)
                && is_between_motions(angles, &rest, noise)
        };
        if rest.len() >= LEAST && is_rest() {
            from = rest.end;
            rests.push(rest);
        } else {
            // The longer a stretch stays, the further on the next try begins: a slow motion is not tried at each of its samples.
            from += 1 + (to - from) / ENDS;
        }
    }
    rests
}

/// How many of the samples stay within noise of the middle of the first; none if those don't.
fn stays(angles: &[f64], noise: Noise) -> usize {
    let first = angles.get(..LEAST).unwrap_or_default();
    let (least, most) = least_and_most(first);
    if most - least > spread_rad(noise) {
        return 0;
    }
    let Some(middle) = median(&mut first.to_vec()) else { return 0 };
    angles.iter().take_while(|angle| (**angle - middle).abs() <= noise.hides_rad()).count()
}

/// How far they are apart at most, rad: one step, and the noise to either side of a middle that is not quite known.
fn spread_rad(noise: Noise) -> f64 {
    1.01 * noise.step_rad + (2.0 * Noise::BESIDE + 1.0) * noise.beyond_quantisation_rad()
}

/// Whether the angle moves clearly away soon after a stretch, and before it; where the record ends nothing is known of that.
fn is_between_motions(angles: &[f64], rest: &Range<usize>, noise: Noise) -> bool {
    let soon = (rest.len() / SOON).max(1);
    let inner = angles.get(rest.clone()).unwrap_or_default();
    let mean = inner.iter().sum::<f64>() / inner.len() as f64;
    let moves = |beside: Option<&[f64]>| {
        let beside = beside.unwrap_or_default();
        beside.is_empty() || beside.iter().any(|angle| (angle - mean).abs() > MOVES * noise.hides_rad())
    };
    moves(angles.get(rest.start.saturating_sub(soon)..rest.start))
        && moves(angles.get(rest.end..(rest.end + soon).min(angles.len())))
}

/// A stretch without the ends in which a motion begins or ends within the noise.
fn without_ends(angles: &[f64], stretch: Range<usize>, noise: Noise) -> Range<usize> {
    let most = stretch.len() / ENDS;
    let inner = angles.get(stretch.start + most..stretch.end - most).unwrap_or_default();
    let first = inner.first().copied().unwrap_or(f64::NAN);
    let mean = |of: &[f64]| mean_beyond(of, first);
    let middle = mean(inner);
    let apart = APART * noise.deviation_rad / (OUTERMOST as f64).sqrt();
    let moves = |outermost: Option<&[f64]>| outermost.is_some_and(|of| (mean(of) - middle).abs() > apart);
    let begins = (0..most).take_while(|skipped| {
        let start = stretch.start + skipped;
        moves(angles.get(start..start + OUTERMOST))
    });
    let ends = (0..most).take_while(|skipped| {
        let end = stretch.end - skipped;
        moves(angles.get(end.saturating_sub(OUTERMOST)..end))
    });
    stretch.start + begins.count()..stretch.end - ends.count()
}

/// Whether samples scatter as the noise does, about one value: between two of the encoder's steps, where there is hardly any other noise.
fn is_noise(angles: &[f64], noise: Noise) -> bool {
    let beyond = noise.beyond_quantisation_rad();
    let count = angles.len() as f64;
    let first = angles.first().copied().unwrap_or(f64::NAN);
    let mean = mean_beyond(angles, first);
    let variance = angles.iter().map(|angle| (angle - first - mean).powi(2)).sum::<f64>() / count;
    let most = (SCATTER * beyond).powi(2) * (1.0 + BY_CHANCE * (2.0 / count).sqrt());
    variance <= most + noise.step_rad.powi(2) / 4.0 && is_still(angles, spread_rad(noise))
}

/// The mean beyond one of the angles: after many turns little of a small difference is left of a sum.
fn mean_beyond(angles: &[f64], first: f64) -> f64 {
    angles.iter().map(|angle| angle - first).sum::<f64>() / angles.len() as f64
}

pub(crate) fn least_and_most(angles: &[f64]) -> (f64, f64) {
    let wider = |(least, most): (f64, f64), angle: &f64| (angle.min(least), angle.max(most));
    angles.iter().fold((f64::INFINITY, f64::NEG_INFINITY), wider)
}

/// Whether samples stay within a spread and show no trend beyond their own scatter.
pub(crate) fn is_still(angles: &[f64], spread_rad: f64) -> bool {
    let (Some(first), Some(last)) = (angles.first(), angles.last()) else { return false };
    if (last - first).abs() > spread_rad {
        return false;
    }
    let (least, most) = least_and_most(angles);
    let (before, after) = angles.split_at(angles.len() / 2);
    let (mean_before, mean_after) = (mean_beyond(before, *first), mean_beyond(after, *first));
    let square =
        |half: &[f64], mean: f64| half.iter().map(|angle| (angle - first - mean).powi(2)).sum::<f64>();
    let variance = (square(before, mean_before) + square(after, mean_after)) / angles.len() as f64;
    let deviation = 2.0 * (variance / angles.len() as f64).sqrt();
    most - least <= spread_rad && (mean_after - mean_before).abs() <= STILL_TREND * deviation
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::prelude::*;
    use rand_distr::Normal;

    const STEP_RAD: f64 = 1e-4;

    /// Angles as an encoder of `step_rad` sees them, with noise; what was estimated of them is exact here.
    fn seen(seed: u64, (step_rad, noise_rad): (f64, f64), truth: &[f64]) -> (Vec<f64>, Noise) {
        let mut generator = rand_pcg::Pcg64::seed_from_u64(seed);
        let normal = Normal::new(0.0, noise_rad).unwrap();
        let round = |angle: f64| if step_rad > 0.0 { (angle / step_rad).round() * step_rad } else { angle };
        let angles = truth.iter().map(|angle| round(angle + normal.sample(&mut generator))).collect();
        let deviation_rad = (noise_rad.powi(2) + step_rad.powi(2) / 12.0).sqrt();
        (angles, Noise { deviation_rad, step_rad })
    }

    /// Steps, and noise in parts of them: flicker, both, noise alone.
    const ENCODERS: [(f64, f64); 4] = [
        (STEP_RAD, 0.01 * STEP_RAD),
        (STEP_RAD, 0.1 * STEP_RAD),
        (STEP_RAD, STEP_RAD),
        (0.0, 0.5 * STEP_RAD),
    ];

    #[test]
    fn rests_between_moves_are_found_as_long_as_they_are() {
        for (rest, encoder) in [20, 40, 75, 300].into_iter().flat_map(|rest| ENCODERS.map(|of| (rest, of))) {
            // Moves of 30 samples by some hundred steps.
            let period = rest + 30;
            let moved = |k: usize| {
                let (number, part) = (k / period, (k % period).saturating_sub(rest) as f64 / 30.0);
                let turned = (0.5 * std::f64::consts::PI * part).sin().powi(2);
                300.3 * STEP_RAD * (number as f64 + turned) + 0.47 * STEP_RAD * (number % 3) as f64
            };
            let truth: Vec<f64> = (0..50 * period).map(moved).collect();
            let (angles, noise) = seen(rest as u64, encoder, &truth);
            let mut found = vec![0; 50];
            for range in rests_between_motions(&angles, noise) {
                let own = &truth[range.clone()];
                let mean = own.iter().sum::<f64>() / own.len() as f64;
                let moved_rad =
                    (own.iter().map(|angle| (angle - mean).powi(2)).sum::<f64>() / own.len() as f64).sqrt();
                assert!(moved_rad < 2.0 * noise.deviation_rad, "a motion in {range:?}: {encoder:?}");
                found[(range.start + range.end) / 2 / period] += range.len();
            }
            let most = found.iter().filter(|of| **of as f64 > 0.7 * rest as f64).count();
            assert!(most >= 40, "{most} of 50 rests of {rest} samples: {encoder:?}, {found:?}");
        }
    }

    #[test]
    fn slow_motions_and_turning_points_are_no_rests() {
        let over =
            |motion: &dyn Fn(f64) -> f64| (0..5000).map(|k| motion(f64::from(k))).collect::<Vec<f64>>();
        let sweep = |slope: f64| over(&|k| slope * k);
        let shake =
            |amplitude: f64, period: f64| over(&|k| amplitude * (std::f64::consts::TAU * k / period).sin());
        for (number, encoder) in ENCODERS.into_iter().enumerate() {
            let unit = encoder.0.max(encoder.1);
            for (name, truth) in [
                ("a fast sweep", sweep(0.5 * unit)),
                ("a slow sweep", sweep(0.1 * unit)),
                ("a slower sweep", sweep(0.02 * unit)),
                ("a shake", shake(5.0 * unit, 100.0)),
                ("a slow shake", shake(20.0 * unit, 1000.0)),
                ("a small shake", shake(3.0 * unit, 50.0)),
            ] {
                let (angles, noise) = seen(number as u64, encoder, &truth);
                let rests = rests_between_motions(&angles, noise);
                let moved = |range: &Range<usize>| (truth[range.end - 1] - truth[range.start]).abs();
                let within: usize = rests.iter().map(Range::len).sum();
                let most = rests.iter().map(moved).fold(0.0, f64::max);
                println!(
                    "{name}, {encoder:?}: {within} of 5000 samples rest, at most {:.2} units moved in one",
                    most / unit
                );
                // What goes through less than a step is not seen.
                assert!(
                    within < 250 || most < 1.01 * encoder.0,
                    "{name}, {encoder:?}: {within} samples, {most} rad"
                );
            }
        }
    }
}
