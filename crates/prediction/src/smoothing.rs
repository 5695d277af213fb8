//! The motion behind a measured angle: angle, speed and acceleration without the encoder's steps and noise.
//!
//! The smoothest curve that the samples allow, everywhere as smooth as they allow there: of a ladder of smoothing
//! strengths each sample takes the strongest whose residuals, nearby, are no larger than the encoder's noise. A rest or
//! a slow loop is then averaged over hundreds of samples, and a slip next to it keeps its edges.

use crate::noise::Noise;
use crate::penalty::{Differences, Solver};
use crate::rests::{is_still, least_and_most, rests_between_motions, still_spread_rad};
use log_data::median;
use std::ops::Range;
use valve_model::MotionSample;

/// Strengths λ of smoothing, from the strongest; the width that is averaged over goes with λ^(1/6) samples.
const STRENGTHS: [f64; 10] = [1e12, 1e11, 1e10, 1e9, 1e8, 1e7, 1e6, 3e4, 1e3, 10.0];
/// Samples smoothed at a time, so that the work space doesn't grow with the run, and those on either side of them that
/// are smoothed too and left out.
const BLOCK: usize = 32_768;
const MARGIN: usize = 2_048;
/// Residuals accepted: their root mean square nearby in parts of the noise's, and the largest, in encoder steps and in
/// parts of the noise beyond quantisation.
const RMS: f64 = 1.1;
/// A strength that hardly smooths. Where no more is borne, the bound is one that normal noise is beyond once in a million times: in a
/// long record clusters of large errors come by chance, and none of the strengths bore them.
const HARDLY: f64 = 1e3;
const BEYOND_CHANCE: f64 = 4.75;
/// So much of a stretch is no cluster: of a thousand samples one takes a tenth with its surroundings, where motion is as loud as noise it is all.
const EXCEPTION: f64 = 0.25;
const LARGEST_STEPS: f64 = 0.75;
const LARGEST_NOISE: f64 = 5.0;
/// A motion within so many standard deviations of the noise that smoothing leaves is taken for a rest.
const REST: f64 = 3.0;
/// Stretches of samples that are looked at for rests, and the samples on either side that show whether they are one: many show slow
/// motions, few show the rests of a slow record.
const STILL: [(usize, usize); 2] = [(64, 128), (16, 32)];
/// The same of a single sample: what the start of an angle's prediction rests on.
pub const MOMENT_REACH: usize = 48;

/// A run's angle, smoothed block by block.
pub struct Smoother<'a> {
    time_s: &'a [f64],
    angle_rad: &'a [f64],
    noise: Noise,
    step_s: f64,
    work: Work,
    /// The block's first sample and the motions from there on.
    first: usize,
    motions: Vec<MotionSample>,
    /// The angle after which the present one is drawn, with a play either way.
    drawn_rad: f64,
    /// Whether noise on top of the encoder's steps makes even strongly smoothed angles wander at rest.
    wanders: bool,
}

#[derive(Default)]
struct Work {
    differences: Differences,
    solver: Solver,
    penalties: Vec<f64>,
    strengths: Vec<f64>,
    /// Whether a sample was seen to be at rest.
    rests: Vec<bool>,
    /// Whether it is at rest where the sample before it is.
    held: Vec<bool>,
    sums: Vec<f64>,
    beyond: Vec<bool>,
    angles: Vec<f64>,
}

/// The motion at one sample (0 is the run's first), from as many around it as bear on it. Where those next to it are at
/// rest, that is a rest, however soon a motion follows: a speed that noise makes there would break a rotor away that holds.
pub fn motion_at(time_s: &[f64], angle_rad: &[f64], noise: Noise, index: usize) -> MotionSample {
    let around = |reach: usize| index.saturating_sub(reach)..(index + reach).min(time_s.len());
    let next = angle_rad.get(around(MOMENT_REACH)).unwrap_or_default();
    if next.len() >= MOMENT_REACH && is_still(next, still_spread_rad(noise)) {
        let angle_rad = next.iter().sum::<f64>() / next.len() as f64;
        return MotionSample { angle_rad, speed_rad_per_s: 0.0, acceleration_rad_per_s2: 0.0 };
    }
    let range = around(MARGIN);
    let (times, angles) = (time_s.get(range.clone()), angle_rad.get(range.clone()));
    let mut smoother = Smoother::new(times.unwrap_or_default(), angles.unwrap_or_default(), noise);
    let mut motion = smoother.motion(0);
    for place in 1..=index - range.start {
        motion = smoother.motion(place);
    }
    motion
}

impl<'a> Smoother<'a> {
    /// Takes a run's times (s, increasing) and angles (rad, finite), as many of one as of the other.
    pub fn new(time_s: &'a [f64], angle_rad: &'a [f64], noise: Noise) -> Self {
        Self {
            time_s,
            angle_rad,
            noise,
            step_s: usual_step_s(time_s),
            work: Work::default(),
            first: 0,
            motions: Vec::new(),
            drawn_rad: f64::NAN,
            wanders: noise.beyond_quantisation_rad() > 0.1 * noise.step_rad,
        }
    }

    /// The motion at sample `index`. To be asked from the first sample on, one after the other.
    pub fn motion(&mut self, index: usize) -> MotionSample {
        let first = index - index % BLOCK;
        if self.motions.is_empty() || self.first != first {
            self.smooth(first);
        }
        let angle_rad = self.angle_rad.get(index).copied().unwrap_or(f64::NAN);
        let unknown = MotionSample { angle_rad, speed_rad_per_s: 0.0, acceleration_rad_per_s2: 0.0 };
        self.motions.get(index - first).copied().unwrap_or(unknown)
    }

    /// The motion at sample `index` with a sharper speed, but at the ends of the run and of a block.
    pub fn sharp_motion(&mut self, index: usize) -> MotionSample {
        let motion = self.motion(index);
        let place = index - self.first;
        let beside = |place: Option<usize>| place.and_then(|place| self.motions.get(place));
        let at = |index: usize| self.time_s.get(index).copied().unwrap_or(f64::NAN);
        match (beside(place.checked_sub(1)), beside(Some(place + 1))) {
            (Some(before), Some(after)) => sharper(before, &motion, after, at(index + 1) - at(index - 1)),
            _ => motion,
        }
    }

    fn smooth(&mut self, first: usize) {
        let last = (first + BLOCK).min(self.time_s.len());
        let range = first.saturating_sub(MARGIN)..(last + MARGIN).min(self.time_s.len());
        let time_s = self.time_s.get(range.clone()).unwrap_or_default();
        let angle_rad = self.angle_rad.get(range.clone()).unwrap_or_default();
        self.work.smooth(time_s, angle_rad, self.noise, self.step_s);
        self.first = first;
        self.motions.clear();
        let (from, to) = (first - range.start, last - range.start);
        self.draw(from, to);
        let angles = &self.work.angles;
        self.motions.extend((from..to).map(|index| motion_through(time_s, angles, index)));
    }

    /// Draws the angles after each other with play, from the block's first sample to the one after its last. What wanders at rest
    /// moves a model's bristles to and fro, and they slip: the torque that they hold would fade. Short rests are smoothed less,
    /// wander more, and have more play; it closes as slowly as the smoothing there lets anything change, and not at all in what was seen to be
    /// a rest, where the curve only finds back from the noise of the motion's end. A rest between motions is held where it begins.
    fn draw(&mut self, from: usize, to: usize) {
        let before = from.checked_sub(1).and_then(|index| self.work.angles.get_mut(index));
        let mut drawn = self.drawn_rad;
        match before {
            Some(before) => *before = drawn,
            None => drawn = self.work.angles.first().copied().unwrap_or(drawn),
        }
        let mut play = 0.0_f64;
        for index in from..=to {
            if self.wanders {
                let strength = self.work.strength(index);
                let closes = if self.work.rests(index) { 0.0 } else { 1.0 / reach(strength) as f64 };
                play = self.work.play(index, strength, self.noise).max(play * (1.0 - closes));
            }
            let held = self.work.held.get(index).is_some_and(|held| *held);
            let Some(angle) = self.work.angles.get_mut(index) else { break };
            if !held {
                drawn = drawn.max(*angle - play).min(*angle + play);
            }
            *angle = drawn;
            if index < to {
                self.drawn_rad = drawn;
            }
        }
    }
}

/// How far a smoothing of this strength averages either way, samples.
fn reach(strength: f64) -> usize {
    ((2.0 * strength.powf(1.0 / 6.0)) as usize).clamp(3, 256)
}

/// Standard deviation of the angle that a smoothing of this strength leaves of white noise, in parts of the noise's. By its response it
/// is √(∫ dω/2π (1 + λω⁶)^-2) = 0.53·λ^(-1/12); where the strength changes, a little more.
fn angle_left(strength: f64) -> f64 {
    0.6 * strength.powf(-1.0 / 12.0)
}

/// The same of the speed, a sample being the unit of time: √(∫ dω/2π ω²(1 + λω⁶)^-2).
fn speed_left(strength: f64) -> f64 {
    (strength.powf(-0.5) / 12.0).sqrt()
}

impl Work {
    /// The strength with which the angle at `index` was smoothed.
    fn strength(&self, index: usize) -> f64 {
        // A third difference has four samples; where a run is too short for one, nothing was smoothed.
        let of = self.penalties.get(index.saturating_sub(2)).or(self.penalties.last());
        of.copied().unwrap_or(1.0).max(1.0)
    }

    /// Whether the sample at `index` was seen to be at rest.
    fn rests(&self, index: usize) -> bool {
        self.rests.get(index).is_some_and(|rests| *rests)
    }

    /// By how much the angle at `index` may be off by noise alone, either way, rad: at rest as much as is left there, in motion as
    /// little as the strongest smoothing leaves.
    fn play(&self, index: usize, strength: f64, noise: Noise) -> f64 {
        // Angles before this one are drawn already.
        let rests = match self.angles.get(index..index + 3) {
            Some([now, _, then]) => {
                (then - now).abs() / 2.0 <= REST * speed_left(strength) * noise.deviation_rad
            }
            _ => false,
        };
        let strength = if rests { strength } else { STRENGTHS[0] };
        REST * angle_left(strength) * noise.deviation_rad
    }

    fn smooth(&mut self, time_s: &[f64], angle_rad: &[f64], noise: Noise, step_s: f64) {
        self.angles.clear();
        self.angles.extend_from_slice(angle_rad);
        self.penalties.clear();
        self.rests.clear();
        self.held.clear();
        if angle_rad.len() < 8 {
            return;
        }
        self.differences.set(time_s, step_s);
        self.choose(angle_rad, noise);
        let correction = self.solver.correction(&self.differences, &self.penalties, angle_rad);
        for (angle, correction) in self.angles.iter_mut().zip(correction) {
            *angle += correction;
        }
    }

    /// The penalties, for each third difference.
    fn choose(&mut self, angle_rad: &[f64], noise: Noise) {
        let count = angle_rad.len();
        self.strengths.clear();
        self.strengths.resize(count, 0.0);
        let largest = LARGEST_STEPS * noise.step_rad + LARGEST_NOISE * noise.beyond_quantisation_rad();
        self.find_rests(angle_rad, noise);
        self.rests.clear();
        self.rests.extend(self.strengths.iter().map(|strength| *strength > 0.0));
        self.climb(angle_rad, noise, largest, 0.0);
        self.spare_clusters(angle_rad, noise, largest);
        let least =
            |four: &[f64]| four.iter().fold(f64::INFINITY, |least: f64, strength| least.min(*strength));
        self.penalties.extend(self.strengths.windows(4).map(least));
    }

    /// Where hardly anything was smoothed, a motion was seen or a cluster of noise: what normal noise is rarely beyond tells, unless
    /// there is too much of that for chance.
    fn spare_clusters(&mut self, angle_rad: &[f64], noise: Noise, largest: f64) {
        let hardly = |strength: &f64| *strength <= HARDLY;
        let count = self.strengths.iter().filter(|strength| hardly(strength)).count();
        if count as f64 > EXCEPTION * self.strengths.len() as f64 {
            return;
        }
        let first = self.strengths.clone();
        self.strengths.iter_mut().filter(|strength| hardly(strength)).for_each(|strength| *strength = 0.0);
        self.climb(angle_rad, noise, largest, noise.beyond_quantisation_rad());
        self.strengths.iter_mut().zip(first).for_each(|(strength, first)| *strength = strength.max(first));
    }

    /// Gives each sample that has none the greatest strength that its surroundings bear, of which `by_chance_rad` is normal noise.
    fn climb(&mut self, angle_rad: &[f64], noise: Noise, largest: f64, by_chance_rad: f64) {
        for strength in STRENGTHS {
            if self.strengths.iter().all(|strength| *strength > 0.0) {
                break;
            }
            let reach = reach(strength);
            let window = (2 * reach + 1) as f64;
            let most = RMS * noise.deviation_rad * (1.0 + 1.0 / window.sqrt());
            let by_chance = by_chance_rad.powi(2) * mean_square_by_chance(window);
            let bounds =
                Bounds { reach, shadow: 3 * reach, mean_square: by_chance.max(most * most), largest };
            let mut next = 0;
            while let Some(open) = open_stretch(&self.strengths, next, 8 * reach) {
                next = open.end;
                self.try_strength(angle_rad, strength, &bounds, open);
            }
        }
    }

    /// Gives rests the greatest strength: flickering between two steps, their residuals would look like motion.
    fn find_rests(&mut self, angle_rad: &[f64], noise: Noise) {
        self.held.resize(angle_rad.len(), false);
        for rest in rests_between_motions(angle_rad, noise) {
            if let Some(strengths) = self.strengths.get_mut(rest.clone()) {
                strengths.fill(STRENGTHS[0]);
            }
            if let Some(held) = self.held.get_mut(rest.start + 1..rest.end) {
                held.fill(true);
            }
        }
        let spread = still_spread_rad(noise);
        for (length, reach) in STILL {
            for (number, stretch) in self.strengths.chunks_mut(length).enumerate() {
                let index = number * length;
                let (from, to) = (index.saturating_sub(reach), index + stretch.len() + reach);
                let window = angle_rad.get(from..to.min(angle_rad.len())).unwrap_or_default();
                if window.len() >= reach && is_still(window, spread) {
                    stretch.fill(STRENGTHS[0]);
                }
            }
        }
        // What flickers between steps is a rest up to its last sample; where noise is more than that, residuals tell.
        if noise.step_rad > noise.beyond_quantisation_rad() {
            extend_rests(&mut self.strengths, angle_rad);
            self.strengths.reverse();
            let backwards: Vec<f64> = angle_rad.iter().rev().copied().collect();
            extend_rests(&mut self.strengths, &backwards);
            self.strengths.reverse();
        }
    }

    /// Gives a strength to the samples of a stretch that have none yet and whose surroundings bear it.
    fn try_strength(&mut self, angle_rad: &[f64], strength: f64, bounds: &Bounds, open: Range<usize>) {
        let margin = 8 * bounds.reach;
        let range = open.start.saturating_sub(margin)..(open.end + margin).min(angle_rad.len());
        let angles = angle_rad.get(range.clone()).unwrap_or_default();
        if angles.len() < 8 {
            return;
        }
        let residuals = self.solver.even_correction(&self.differences, range.start, strength, angles);
        bounds.check(residuals, &mut self.sums, &mut self.beyond);
        let chosen = self.strengths.iter_mut().skip(range.start);
        for (index, (chosen, beyond)) in chosen.zip(&self.beyond).enumerate() {
            if *chosen == 0.0 && !*beyond && open.contains(&(index + range.start)) {
                *chosen = strength;
            }
        }
    }
}

/// Lets each rest go on while the samples stay among its last ones: further than a stretch and its reach the next stretch would tell.
fn extend_rests(strengths: &mut [f64], angles: &[f64]) {
    let [_, (length, reach)] = STILL;
    let is_rest = |strengths: &[f64], index: usize| strengths.get(index).is_some_and(|of| *of > 0.0);
    let ends: Vec<usize> = (length..strengths.len())
        .filter(|index| is_rest(strengths, index - 1) && !is_rest(strengths, *index))
        .collect();
    for end in ends {
        let (least, most) = least_and_most(angles.get(end - length..end).unwrap_or_default());
        let beyond = strengths.iter_mut().zip(angles).skip(end).take(length + reach);
        for (strength, _) in
            beyond.take_while(|(strength, angle)| **strength == 0.0 && (least..=most).contains(*angle))
        {
            *strength = STRENGTHS[0];
        }
    }
}

/// The next stretch of samples without a strength; stretches closer than `apart` count as one.
fn open_stretch(strengths: &[f64], from: usize, apart: usize) -> Option<Range<usize>> {
    let mut open = strengths
        .iter()
        .enumerate()
        .skip(from)
        .filter(|(_, strength)| **strength == 0.0)
        .map(|(index, _)| index);
    let start = open.next()?;
    let mut end = start + 1;
    for index in open {
        if index > end + apart {
            break;
        }
        end = index + 1;
    }
    Some(start..end)
}

/// What the mean square of so many normal errors of unit variance is beyond only as rarely as `BEYOND_CHANCE` deviations of one
/// (Wilson and Hilferty's approximation to χ²).
fn mean_square_by_chance(count: f64) -> f64 {
    let variance = 2.0 / (9.0 * count);
    (1.0 - variance + BEYOND_CHANCE * variance.sqrt()).powi(3)
}

/// What residuals may be where noise explains them.
struct Bounds {
    /// Samples on either side that are judged together.
    reach: usize,
    /// Samples on either side that fall with them: where residuals happen to cross zero, all is not well.
    shadow: usize,
    /// The largest mean square of those, rad².
    mean_square: f64,
    /// The largest single one, rad.
    largest: f64,
}

impl Bounds {
    /// Marks the samples near which the residuals are beyond the bounds.
    fn check(&self, residuals: &[f64], sums: &mut Vec<f64>, beyond: &mut Vec<bool>) {
        let count = residuals.len();
        sums.clear();
        sums.push(0.0);
        let mut sum = 0.0;
        sums.extend(residuals.iter().map(|residual| {
            sum += residual * residual;
            sum
        }));
        beyond.clear();
        beyond.resize(count, false);
        // One place that stands out condemns its surroundings.
        let mut condemned = 0;
        for (index, residual) in residuals.iter().enumerate() {
            let (from, to) = (index.saturating_sub(self.reach), (index + self.reach + 1).min(count));
            let within = sums.get(to).copied().unwrap_or(sum) - sums.get(from).copied().unwrap_or(0.0);
            if within > self.mean_square * (to - from) as f64 || residual.abs() > self.largest {
                let (from, to) = (index.saturating_sub(self.shadow), (index + self.shadow + 1).min(count));
                if let Some(surroundings) = beyond.get_mut(from.max(condemned)..to) {
                    surroundings.fill(true);
                }
                condemned = to;
            }
        }
    }
}

/// The usual distance between samples: the median, of the first few thousand.
fn usual_step_s(time_s: &[f64]) -> f64 {
    let times = time_s.get(..4096).unwrap_or(time_s);
    let mut steps: Vec<f64> =
        times.windows(2).map(|pair| pair.iter().fold(0.0, |before, after| after - before)).collect();
    median(&mut steps).unwrap_or(1.0)
}

/// The motion with what its speed, a difference over the two samples beside it, `length_s` apart, lacks of the third
/// derivative; their accelerations tell that.
pub fn sharper(
    before: &MotionSample,
    at: &MotionSample,
    after: &MotionSample,
    length_s: f64,
) -> MotionSample {
    let rise = after.acceleration_rad_per_s2 - before.acceleration_rad_per_s2;
    MotionSample { speed_rad_per_s: at.speed_rad_per_s - rise * length_s / 24.0, ..*at }
}

/// The motion at a sample, its speed and acceleration from that and the two beside it; one-sided at the ends.
pub fn motion_through(time_s: &[f64], angles: &[f64], index: usize) -> MotionSample {
    let at = |index: usize| time_s.get(index).copied().zip(angles.get(index).copied());
    let angle_rad = angles.get(index).copied().unwrap_or(f64::NAN);
    let here = at(index);
    let slope = |a: Option<(f64, f64)>, b: Option<(f64, f64)>| Some((b?.1 - a?.1) / (b?.0 - a?.0));
    let before = index.checked_sub(1).and_then(at);
    let after = at(index + 1);
    let (left, right) = (slope(before, here), slope(here, after));
    let (speed_rad_per_s, acceleration_rad_per_s2) = match (left, right) {
        (Some(left), Some(right)) => {
            let (short, long) = (
                here.map_or(0.0, |h| h.0 - before.map_or(h.0, |b| b.0)),
                after.map_or(0.0, |a| a.0 - here.map_or(a.0, |h| h.0)),
            );
            let total = short + long;
            ((left * long + right * short) / total, 2.0 * (right - left) / total)
        }
        (Some(one), None) | (None, Some(one)) => (one, 0.0),
        (None, None) => (0.0, 0.0),
    };
    MotionSample { angle_rad, speed_rad_per_s, acceleration_rad_per_s2 }
}
