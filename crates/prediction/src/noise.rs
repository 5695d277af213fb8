//! What an encoder adds to an angle: its step, and noise.

use log_data::median;

/// How far a measured angle is from the true one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation of noise and quantisation together, rad.
    pub deviation_rad: f64,
    /// The encoder's step, rad; 0 where the angles show none.
    pub step_rad: f64,
}

/// The samples looked at; more would say the same.
const SAMPLES: usize = 200_000;
/// Samples whose noise is taken together.
const BLOCK: usize = 256;
/// Variance of white noise's fourth difference over that of the noise: 1 + 16 + 36 + 16 + 1.
const FOURTH: f64 = 70.0;
/// A number's own rounding, in parts of it, and a little more.
const ROUNDING: f64 = 1e3 * f64::EPSILON;

/// Text is taken to be rounded by up to 10 to this times a number's own rounding: to 7 digits.
const FINEST_TO_COARSEST: i32 = 5;

impl Noise {
    /// A sample further from the middle of a rest than so many deviations of the noise beyond quantisation belongs to a motion.
    pub(crate) const BESIDE: f64 = 4.0;

    /// How far a rest's samples are from its middle at most, rad: a motion doesn't show within that.
    pub fn hides_rad(&self) -> f64 {
        1.01 * self.step_rad + Self::BESIDE * self.beyond_quantisation_rad()
    }

    /// Estimates what an encoder adds, from the angles alone (rad, at even times).
    ///
    /// The noise is the median over blocks of that of the fourth differences, in which motion hardly shows.
    pub fn of(angle_rad: &[f64]) -> Self {
        let angles = angle_rad.get(..SAMPLES).unwrap_or(angle_rad);
        let largest = angles.iter().fold(1e-3, |most: f64, angle| most.max(angle.abs()));
        // A file of text rounds its numbers, by how much it does not say.
        let roundings = (0..=FINEST_TO_COARSEST).map(|tens| ROUNDING * largest * 10f64.powi(tens));
        let step_rad = roundings.map(|rounding| encoder_step(angles, rounding)).find(|step| *step > 0.0);
        let step_rad = match step_rad {
            Some(unit) => step_in_text(angles, unit).unwrap_or(unit),
            // Decimals so fine beside the step that no unit of theirs is seen.
            None => step_in_text(angles, least_difference(angles, 1e2 * ROUNDING * largest) / FINE_UNITS)
                .unwrap_or(0.0),
        };
        let quantisation_rad = step_rad / 12f64.sqrt();
        let deviation_rad = block_deviation(angles, step_rad).max(quantisation_rad).max(ROUNDING * largest);
        Self { deviation_rad, step_rad }
    }

    /// The part of the noise that is no quantisation, rad.
    pub fn beyond_quantisation_rad(&self) -> f64 {
        let quantisation = self.step_rad * self.step_rad / 12.0;
        (self.deviation_rad * self.deviation_rad - quantisation).max(0.0).sqrt()
    }
}

/// An angle goes through so many steps of its encoder in a block before its rounding counts as noise.
const STEPS: f64 = 8.0;

/// Whether an angle goes through so many of its encoder's steps that their rounding is noise; rests and slow motions would
/// show less of it, or more.
pub fn goes_through_steps(angle_rad: &[f64], step_rad: f64) -> bool {
    let (least, most) = angle_rad
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), angle| (angle.min(least), angle.max(most)));
    most - least >= STEPS * step_rad
}

fn block_deviation(angles: &[f64], step_rad: f64) -> f64 {
    let moving: Vec<&[f64]> =
        angles.chunks(BLOCK).filter(|block| goes_through_steps(block, step_rad)).collect();
    if moving.is_empty() {
        middle_deviation(angles.chunks(BLOCK))
    } else {
        middle_deviation(moving.into_iter())
    }
}

fn middle_deviation<'a>(blocks: impl Iterator<Item = &'a [f64]>) -> f64 {
    let variance = |block: &[f64]| {
        let (sum, count) = block.windows(5).fold((0.0, 0.0), |(sum, count), five| {
            let fourth: f64 =
                five.iter().zip([1.0, -4.0, 6.0, -4.0, 1.0]).map(|(angle, weight)| weight * angle).sum();
            (sum + fourth * fourth, count + 1.0)
        });
        if count > 0.0 { sum / (count * FOURTH) } else { 0.0 }
    };
    let mut variances: Vec<f64> = blocks.map(variance).filter(|variance| *variance > 0.0).collect();
    median(&mut variances).unwrap_or(0.0).sqrt()
}

/// The step that fits the differences best, those of few steps first: Euclid's algorithm adds up what they were rounded by.
fn refined(angles: &[f64], step_rad: f64) -> f64 {
    [8.0, 64.0, 1e9].iter().fold(step_rad, |step, most| {
        let (mut products, mut squares) = (0.0, 0.0);
        for difference in differences(angles) {
            let whole = (difference / step).round();
            if whole <= *most {
                products += difference * whole;
                squares += whole * whole;
            }
        }
        if squares > 0.0 { products / squares } else { step }
    })
}

/// An encoder's step has so many units of the last decimal at least: fewer are the text's own.
const UNITS: f64 = 20.0;
/// The least difference that occurs is at most so many steps.
const LEAST_STEPS: i32 = 4;
/// Of so many units in a step their rounding is nothing.
const FINE_UNITS: f64 = 200.0;
/// So many differences that are no rest, and so many sizes of them, or as many turns between rest and motion, show a step.
const LEAST_DIFFERENCES: usize = 20;
const LEAST_SIZES: usize = 3;

/// How far neighbours are apart.
fn differences(angles: &[f64]) -> impl Iterator<Item = f64> {
    angles.windows(2).map(|pair| pair.iter().fold(0.0, |before, after| after - before).abs())
}

/// The least difference of neighbours above a floor.
fn least_difference(angles: &[f64], floor_rad: f64) -> f64 {
    differences(angles).filter(|difference| *difference > floor_rad).fold(f64::INFINITY, f64::min)
}

/// An encoder's step in a text whose numbers are whole multiples of `unit_rad`, the last decimal: all differences are whole multiples of it,
/// each rounded by up to one unit. `None` where there is none: the unit itself is what rounds the angle.
fn step_in_text(angles: &[f64], unit_rad: f64) -> Option<f64> {
    let moves = |difference: &f64| *difference > 1.5 * unit_rad;
    let moving = || differences(angles).filter(moves);
    let least = least_difference(angles, 1.5 * unit_rad);
    if !least.is_finite() || least < UNITS * unit_rad || moving().count() < LEAST_DIFFERENCES {
        return None;
    }
    // An encoder slower than a step a sample stands and moves in turn; a motion at one speed, between rests, does so a few times.
    let turns = differences(angles).zip(differences(angles).skip(1)).filter(|(a, b)| moves(a) != moves(b));
    let is_slow = turns.count() >= LEAST_DIFFERENCES;
    let tried = (1..=LEAST_STEPS).map(|parts| refined(angles, least / f64::from(parts)));
    let explains = |step: &f64| {
        let off = |difference: f64| (difference / step - (difference / step).round()).abs();
        let mut sizes: Vec<i64> = moving().map(|difference| (difference / step).round() as i64).collect();
        sizes.sort_unstable();
        sizes.dedup();
        *step >= UNITS * unit_rad
            && (is_slow || sizes.len() >= LEAST_SIZES)
            && moving().all(|difference| off(difference) < WHOLE + 1.5 * unit_rad / step)
    };
    tried.into_iter().find(explains)
}

/// A difference is a whole number of steps up to this part of one.
const WHOLE: f64 = 0.05;

/// The greatest step that all differences are whole multiples of; 0 where there is none beyond rounding.
fn encoder_step(angles: &[f64], rounding_rad: f64) -> f64 {
    let mut step = 0.0;
    for pair in angles.windows(2) {
        let [before, after] = pair else { continue };
        let (mut larger, mut smaller) = (step, (after - before).abs());
        // Euclid's algorithm, up to rounding.
        while smaller > 100.0 * rounding_rad {
            (larger, smaller) = (smaller, (larger - smaller * (larger / smaller).round()).abs());
        }
        step = larger;
        if step > 0.0 && step < 1e4 * rounding_rad {
            return 0.0;
        }
    }
    if step == 0.0 {
        return 0.0;
    }
    let step = refined(angles, step);
    // A motion at one constant speed is no encoder's, nor one whose speed changes little from sample to sample.
    let mut steps = differences(angles).map(|difference| difference / step);
    let varied = steps.any(|steps| !(0.5..1.5).contains(&steps));
    let whole = |difference: f64| (difference / step - (difference / step).round()).abs() < WHOLE;
    if varied && differences(angles).all(whole) { step } else { 0.0 }
}
