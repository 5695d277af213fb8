//! Mains hum: tones of 50 or 60 Hz and their harmonics in the measured channel, found in a residual.
//!
//! A tone is fitted to stretches of at most [`STRETCH_S`], each with an amplitude and a phase of its own, because the mains'
//! frequency wanders. It is hum if its power stands out of that of the frequencies beside it, and if it doesn't follow a line of the
//! motion there: a sine of 10 Hz makes friction oscillate at 50 Hz, and so does a ripple five times a turn at 10 turns a second.
#![allow(clippy::indexing_slicing, reason = "arrays of fixed size")]

use crate::fit::equations::Setting;
use crate::log::hum::Hum;
use crate::log::piece::Piece;
use crate::show::residual::PieceResidual;
use crate::workers::map;
use nalgebra::Complex;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use std::f64::consts::TAU;

/// The mains frequencies in use, and the number of harmonics that are tested.
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
const HARMONICS: u32 = 5;
/// The longest stretch that is fitted with one phase, and the least number of periods in a stretch.
const STRETCH_S: f64 = 4.0;
const PERIODS: f64 = 8.0;
/// Frequencies beside a tone, in multiples of a stretch's resolution (1/length).
const BESIDE: [f64; 8] = [-4.5, -3.5, -2.5, -1.6, 1.6, 2.5, 3.5, 4.5];
/// Significance level for each tested frequency, and the least power of a tone relative to the noise variance.
const CHANCE: f64 = 1e-4;
const LEAST: f64 = 0.01;
/// How far from its nominal value the mains' frequency is searched for, Hz, and in which steps.
const OFF_HZ: f64 = 0.2;
const STEP_HZ: f64 = 0.02;
/// A tone is steady if the lower quartile of its squared amplitudes over parts of this length is at least this fraction of
/// their mean; noise alone has 0.29. It takes at least this many parts.
const PART_S: f64 = 0.5;
const STEADY: f64 = 0.15;
const LEAST_PARTS: usize = 4;
/// A tone is the motion's own where it follows the line that the motion has there: where that accounts for this part of its power.
const FOLLOWS: f64 = 0.5;
/// A ripple is locked to a tone if their phase difference has a mean phasor longer than this.
const LOCKED: f64 = 0.5;

/// The tones of the mains in a residual, and their sum at each sample of each piece.
pub(crate) struct Mains {
    pub hums: Vec<Hum>,
    pub by_piece: Vec<Vec<f64>>,
}

/// Consecutive samples of a piece: times, residual, weights, and the motion.
struct Stretch {
    piece: usize,
    first: usize,
    time_s: Vec<f64>,
    residual: Vec<f64>,
    weight: Vec<f64>,
    direction: Vec<f64>,
    angle_rad: Vec<f64>,
}

/// Selects values of a stretch.
type Values = fn(&Stretch) -> &[f64];

impl Stretch {
    /// The stretch in parts of half a second.
    fn cut_short(&self) -> Vec<Self> {
        let count = ((self.length_s() / PART_S) as usize).max(1);
        let rows = |part: usize| self.time_s.len() * part / count..self.time_s.len() * (part + 1) / count;
        let of = |values: &[f64], part: usize| values.get(rows(part)).unwrap_or_default().to_vec();
        let part = |part: usize| Self {
            piece: self.piece,
            first: self.first + rows(part).start,
            time_s: of(&self.time_s, part),
            residual: of(&self.residual, part),
            weight: of(&self.weight, part),
            direction: Vec::new(),
            angle_rad: Vec::new(),
        };
        (0..count).map(part).collect()
    }

    fn length_s(&self) -> f64 {
        let ends = self.time_s.first().zip(self.time_s.last());
        ends.map_or(0.0, |(first, last)| last - first)
    }
}

/// Finds the mains hum in a residual; `None` if there is none.
pub(crate) fn mains(setting: &Setting<'_>, left: &[PieceResidual]) -> Option<Mains> {
    let pieces = &setting.campaign.pieces;
    let mut stretches: Vec<Stretch> =
        pieces.iter().zip(left).enumerate().flat_map(|(at, (piece, left))| cut(at, piece, left)).collect();
    let rate_hz = 1.0 / setting.campaign.facts.step_s;
    let mut by_piece: Vec<Vec<f64>> = pieces.iter().map(|piece| vec![0.0; piece.len()]).collect();
    let mut hums = Vec::new();
    for mains_hz in MAINS_HZ {
        for harmonic in 1..=HARMONICS {
            let nominal_hz = f64::from(harmonic) * mains_hz;
            if !is_apart(nominal_hz, rate_hz)
                || hums.iter().any(|hum: &Hum| (hum.hz - nominal_hz).abs() < 1.0)
            {
                continue;
            }
            if !stands_out(setting, &stretches, nominal_hz) {
                continue;
            }
            let hz = refined(setting, &stretches, nominal_hz, f64::from(harmonic));
            hums.push(Hum { hz, amplitude: take_out(&mut stretches, hz, &mut by_piece) });
        }
    }
    (!hums.is_empty()).then_some(Mains { hums, by_piece })
}

/// Whether a tone, sampled at this rate, is aliased to a frequency apart from zero and from half the rate.
fn is_apart(hz: f64, rate_hz: f64) -> bool {
    let folded = (hz / rate_hz).rem_euclid(1.0);
    let seen_hz = folded.min(1.0 - folded) * rate_hz;
    seen_hz > 2.0 && 0.5 * rate_hz - seen_hz > 2.0
}

fn cut(at: usize, piece: &Piece, left: &PieceResidual) -> Vec<Stretch> {
    let times = piece.driven.time_s();
    let length_s = times.first().zip(times.last()).map_or(0.0, |(first, last)| last - first);
    let count = (length_s / STRETCH_S).ceil().max(1.0) as usize;
    let rows = |part: usize| times.len() * part / count..times.len() * (part + 1) / count;
    let stretch = |part: usize| {
        let rows = rows(part);
        let kinematics: Vec<(f64, f64, f64)> = rows.clone().map(|row| piece.kinematics(row)).collect();
        Some(Stretch {
            piece: at,
            first: rows.start,
            time_s: times.get(rows.clone())?.to_vec(),
            residual: left.residual.get(rows.clone())?.to_vec(),
            weight: piece.weights.get(rows)?.to_vec(),
            direction: kinematics.iter().map(|of| if of.1 == 0.0 { 0.0 } else { of.1.signum() }).collect(),
            angle_rad: kinematics.iter().map(|of| of.0).collect(),
        })
    };
    (0..count).filter_map(stretch).collect()
}

/// Cosine and sine part of a tone in values, fitted with their mean; `None` where the stretch is too short.
fn fitted(stretch: &Stretch, values: &[f64], hz: f64) -> Option<[f64; 2]> {
    if stretch.length_s() * hz < PERIODS {
        return None;
    }
    let from_s = *stretch.time_s.first()?;
    let (mut matrix, mut right) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
    for ((time_s, value), weight) in stretch.time_s.iter().zip(values).zip(&stretch.weight) {
        if *weight > 0.0 && value.is_finite() {
            let (sin, cos) = (TAU * hz * (time_s - from_s)).sin_cos();
            let row = nalgebra::Vector3::new(1.0, cos, sin);
            let weight = weight * weight;
            matrix += weight * row * row.transpose();
            right += weight * *value * row;
        }
    }
    let found = matrix.cholesky()?.solve(&right);
    Some([found[1], found[2]])
}

/// Sum over the stretches of a tone's weighted power in values, and the number of stretches that are long enough.
fn power(
    setting: &Setting<'_>,
    stretches: &[Stretch],
    hz: impl Fn(&Stretch) -> f64 + Sync,
    values: Values,
) -> (f64, f64) {
    let each = map(setting.workers, stretches.len(), |index| {
        let stretch = stretches.get(index)?;
        let [cos, sin] = fitted(stretch, values(stretch), hz(stretch))?;
        let weights: f64 = stretch.weight.iter().map(|weight| weight * weight).sum();
        Some(0.5 * (cos * cos + sin * sin) * weights)
    });
    each.into_iter().flatten().fold((0.0, 0.0), |(sum, count), power| (sum + power, count + 1.0))
}

/// Whether a tone is steady in the residual and its power stands out of its neighbours', but not in the motion.
fn stands_out(setting: &Setting<'_>, stretches: &[Stretch], hz: f64) -> bool {
    let (ratio, count, at) = ratio(setting, stretches, hz, |of| &of.residual);
    let samples = stretches.iter().flat_map(|of| &of.weight).filter(|weight| **weight > 0.0).count() as f64;
    if count < 1.0 || by_chance(ratio, count) > CHANCE || at < LEAST * samples {
        return false;
    }
    if !is_steady(stretches, hz) {
        return false;
    }
    let (of_motion, count, _) = self::ratio(setting, stretches, hz, |of| &of.direction);
    let locked = stretches.iter().filter(|stretch| is_locked(stretch, hz)).count();
    let follows = by_chance(of_motion, count) <= CHANCE && coherence(stretches, hz) > FOLLOWS;
    !follows && 2 * locked < stretches.len()
}

/// The part of a tone's power in the residual that one complex factor times the direction's tone accounts for. Hum has a phase of its own in each
/// stretch.
fn coherence(stretches: &[Stretch], hz: f64) -> f64 {
    let mut both = Complex::<f64>::default();
    let (mut of_residual, mut of_direction) = (0.0, 0.0);
    for stretch in stretches {
        let tones = fitted(stretch, &stretch.residual, hz).zip(fitted(stretch, &stretch.direction, hz));
        let Some((residual, direction)) = tones else { continue };
        let [residual, direction] = [residual, direction].map(|[cos, sin]| Complex::<f64>::new(cos, sin));
        let weights: f64 = stretch.weight.iter().map(|weight| weight * weight).sum();
        both += weights * residual * direction.conj();
        of_residual += weights * residual.norm_sqr();
        of_direction += weights * direction.norm_sqr();
    }
    let product = of_residual * of_direction;
    if product > 0.0 { both.norm_sqr() / product } else { 0.0 }
}

/// Whether a tone is there at all times: a ripple over the angle passes a frequency only while the speed is right.
fn is_steady(stretches: &[Stretch], hz: f64) -> bool {
    let parts = stretches.iter().flat_map(|of| of.cut_short());
    let mut squares: Vec<f64> = parts
        .filter_map(|part| fitted(&part, &part.residual, hz))
        .map(|[cos, sin]| cos * cos + sin * sin)
        .collect();
    if squares.len() < LEAST_PARTS {
        return false;
    }
    squares.sort_by(f64::total_cmp);
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    squares.get(squares.len() / 4).is_some_and(|quarter| *quarter > STEADY * mean)
}

/// The probability by chance that a tone in this many stretches has `ratio` times the power of its neighbours (F test).
fn by_chance(ratio: f64, stretches: f64) -> f64 {
    let freedom = (2.0 * stretches).max(1.0);
    FisherSnedecor::new(freedom, freedom * BESIDE.len() as f64).map_or(1.0, |f| 1.0 - f.cdf(ratio))
}

/// A tone's power over the mean of its neighbours', the number of stretches, and the power itself.
fn ratio(setting: &Setting<'_>, stretches: &[Stretch], hz: f64, values: Values) -> (f64, f64, f64) {
    let (at, count) = power(setting, stretches, |_| hz, values);
    let beside: f64 = BESIDE
        .iter()
        .map(|off| {
            let there = |of: &Stretch| hz + off / of.length_s().max(f64::MIN_POSITIVE);
            power(setting, stretches, there, values).0
        })
        .sum::<f64>()
        / BESIDE.len() as f64;
    (if beside > 0.0 { at / beside } else { 0.0 }, count, at)
}

/// Whether some order of the angle is phase-locked to a tone over a stretch.
fn is_locked(stretch: &Stretch, hz: f64) -> bool {
    let turned = stretch.angle_rad.first().zip(stretch.angle_rad.last()).map_or(0.0, |(a, b)| b - a);
    let order = (TAU * hz * stretch.length_s() / turned).round();
    if !order.is_finite() || order == 0.0 || order.abs() > 256.0 {
        return false;
    }
    let (mut cos, mut sin) = (0.0, 0.0);
    for (time_s, angle_rad) in stretch.time_s.iter().zip(&stretch.angle_rad) {
        let (s, c) = (TAU * hz * time_s - order * angle_rad).sin_cos();
        (cos, sin) = (cos + c, sin + s);
    }
    f64::hypot(cos, sin) > LOCKED * stretch.time_s.len() as f64
}

/// The frequency near the nominal one that has the most power.
fn refined(setting: &Setting<'_>, stretches: &[Stretch], nominal_hz: f64, harmonic: f64) -> f64 {
    let steps = (OFF_HZ / STEP_HZ) as i32;
    let at = |step: i32| nominal_hz + harmonic * STEP_HZ * f64::from(step);
    let powers =
        (-steps..=steps).map(|step| (power(setting, stretches, |_| at(step), |of| &of.residual).0, step));
    powers.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(nominal_hz, |(_, step)| at(step))
}

/// Subtracts a tone from the stretches' residual and adds it to the pieces' hum. Returns its root-mean-square amplitude.
fn take_out(stretches: &mut [Stretch], hz: f64, by_piece: &mut [Vec<f64>]) -> f64 {
    let (mut square, mut count) = (0.0, 0.0);
    for stretch in stretches {
        let Some([cos_part, sin_part]) = fitted(stretch, &stretch.residual, hz) else { continue };
        let from_s = stretch.time_s.first().copied().unwrap_or(0.0);
        let Some(hum) = by_piece.get_mut(stretch.piece) else { continue };
        let own = hum.iter_mut().skip(stretch.first);
        for ((residual, time_s), hum) in stretch.residual.iter_mut().zip(&stretch.time_s).zip(own) {
            let (sin, cos) = (TAU * hz * (time_s - from_s)).sin_cos();
            let value = cos_part * cos + sin_part * sin;
            *residual -= value;
            *hum += value;
        }
        square += cos_part * cos_part + sin_part * sin_part;
        count += 1.0;
    }
    f64::sqrt(square / f64::max(count, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stretch(amplitude: impl Fn(f64) -> f64) -> Stretch {
        let time_s: Vec<f64> = (0..4000).map(|k| 1e-3 * f64::from(k)).collect();
        // Nearly white: the fractional parts of multiples of the golden ratio, squared.
        let noise = |k: f64| (k * k * 0.618_033_988_75).fract() - 0.5;
        let value = |time: &f64| amplitude(*time) * (TAU * 50.0 * time).sin() + 0.1 * noise(1e3 * time);
        Stretch {
            piece: 0,
            first: 0,
            residual: time_s.iter().map(value).collect(),
            weight: vec![1.0; time_s.len()],
            direction: vec![1.0; time_s.len()],
            angle_rad: time_s.iter().map(|time| TAU * 10.0 * time).collect(),
            time_s,
        }
    }

    #[test]
    fn a_tone_that_comes_and_goes_is_no_hum() {
        assert!(is_steady(&[stretch(|_| 1.0)], 50.0));
        assert!(!is_steady(&[stretch(|time| if time > 3.0 { 1.0 } else { 0.0 })], 50.0));
    }

    #[test]
    fn a_ripple_at_a_constant_speed_is_no_hum() {
        let turning = stretch(|_| 1.0);
        assert!(is_locked(&turning, 50.0), "five times a turn, ten turns a second");
        let still = Stretch { angle_rad: vec![0.3; 4000], ..stretch(|_| 1.0) };
        assert!(!is_locked(&still, 50.0));
    }

    #[test]
    fn a_tone_that_follows_the_motion_is_no_hum() {
        // Eight stretches of a 10 Hz sine, whose direction has a line at 50 Hz; each begins at a phase of its own.
        let begins = |of: usize| 0.7 * (of * of) as f64;
        let stretches = |residual: fn(f64, f64) -> f64| -> Vec<Stretch> {
            let of = |index: usize| {
                let plain = stretch(|_| 0.0);
                let direction: Vec<f64> =
                    plain.time_s.iter().map(|at| (TAU * 10.0 * at + begins(index)).cos().signum()).collect();
                let at = |(time, direction): (&f64, &f64)| residual(TAU * 50.0 * time, *direction);
                let residual = plain.time_s.iter().zip(&direction).map(at).collect();
                Stretch { residual, direction, ..plain }
            };
            (0..8).map(of).collect()
        };
        let (friction, hum) =
            (coherence(&stretches(|_, way| 0.2 * way), 50.0), coherence(&stretches(|at, _| at.sin()), 50.0));
        assert!(friction > 0.99 && hum < 0.5 * FOLLOWS, "{friction} and {hum}");
    }

    #[test]
    fn a_tone_that_sampling_folds_to_rest_is_not_looked_for() {
        assert!(is_apart(50.0, 1000.0) && is_apart(60.0, 100.0));
        assert!(!is_apart(50.0, 100.0) && !is_apart(100.0, 100.0));
    }
}
