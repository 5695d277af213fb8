//! What a residual depends on: run, motion, angle, speed, and so on, and order of the angle. The p-values are corrected for the
//! number of tests by Holm's method.

use crate::fit::equations::Setting;
use crate::log::classes::Class;
use crate::log::moments::moments;
use crate::log::piece::Piece;
use crate::numerics::line::{Line, Weighted};
use crate::numerics::statistics::{CHANCE, SHARE_LEFT, holm, standardised};
use crate::outcome::{Dependence, Order};
use crate::show::residual::PieceResidual;
use crate::workers::map;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use std::collections::BTreeMap;

/// Covariate, residual as in [`Sample`], and the sample's information.
type Counted = (f64, f64, f64);

/// Bins of a covariate. The angle has one for each `ANGLE_BIN_RAD` instead, if that is at least `BINS` and below `MOST_BINS`.
const BINS: usize = 12;
const ANGLE_BIN_RAD: f64 = 0.3;
const MOST_BINS: usize = 120;
/// Lags of the autocorrelation.
const LAGS: usize = 400;
/// Samples of a piece that the autocorrelation is taken from.
const LOOKED_AT: usize = 4096;
/// Orders of the angle that are tested, and that are shown. Angle logs show as many multiples of the rotor's teeth as `TEETH_TIMES`.
const ORDERS: usize = 16;
const SHOWN_ORDERS: usize = 32;
const TEETH_TIMES: usize = 10;

/// Covariates constant within a run: one degree of freedom a run.
const OF_RUNS: [&str; 2] = ["pressure", "temperature"];
/// Least number of runs for that; with fewer, pieces take the place of runs.
const LEAST_RUNS: usize = 4;

/// A sample as the tests use it.
struct Sample {
    /// The run, or the piece where there are few runs.
    unit: usize,
    /// The residual divided by its standard deviation, times the root of the sample's information.
    residual: f64,
    /// The part of an independent sample that it counts as.
    information: f64,
    direction: f64,
    covariates: [f64; COVARIATES.len()],
}

const COVARIATES: [&str; 9] = [
    "run",
    "motion",
    "angle",
    "speed",
    "acceleration",
    "pressure",
    "temperature",
    "time since rest",
    "distance travelled",
];

/// The angle's index among them.
const ANGLE: usize = 2;

/// Covariates that act together in some machines: each alone may then account for nothing.
const PAIRS: [[&str; 2]; 4] = [
    ["pressure", "temperature"],
    ["speed", "pressure"],
    ["speed", "temperature"],
    ["acceleration", "temperature"],
];

/// The result of the tests of a residual.
#[derive(Debug, Clone)]
pub(crate) struct Structure {
    pub dependences: Vec<Dependence>,
    /// RMS of the normalised residual.
    pub rms: f64,
    /// The sum of the samples' information.
    pub count: f64,
    /// How many of these count as one independent sample, because the residual is autocorrelated.
    pub per_independent: f64,
}

/// Whether some covariate explains a part of a residual, significantly and by more than `SHARE_LEFT`.
pub(crate) fn depends(of: &Structure) -> bool {
    of.dependences.iter().any(counts)
}

/// Whether a dependence is significant, and of more than `SHARE_LEFT`.
pub(crate) fn counts(of: &Dependence) -> bool {
    of.share > SHARE_LEFT && of.p_value < CHANCE
}

/// Tests a residual against all covariates and orders of the angle.
pub(crate) fn structure(setting: &Setting<'_>, left: &[PieceResidual]) -> Structure {
    let per_independent = correlation(setting, left);
    let samples = samples(setting, left);
    let (square, count) = size(&samples);
    let independent = (count / per_independent).max(4.0);
    let tested =
        map(setting.workers, COVARIATES.len(), |index| by_covariate(index, &samples, square, independent));
    let mut dependences: Vec<Dependence> = tested.into_iter().flatten().collect();
    let together = map(setting.workers, PAIRS.len(), |index| {
        PAIRS.get(index).map_or_else(Vec::new, |pair| by_pair(pair, &samples, square, independent))
    });
    dependences.extend(together.into_iter().flatten());
    let orders = Progression { first: 1, count: ORDERS };
    for harmonic in harmonics(&samples, orders, square, independent) {
        dependences.extend([harmonic.both_ways, harmonic.against_motion].map(
            |(share, p_value, as_friction)| Dependence {
                on: format!("angle, order {}", harmonic.order),
                as_friction,
                share,
                p_value,
            },
        ));
    }
    holm(dependences.iter_mut().map(|found| &mut found.p_value));
    dependences.sort_by(|a, b| b.share.total_cmp(&a.share));
    Structure { dependences, rms: (square / count.max(1.0)).sqrt(), count, per_independent }
}

/// RMS of the normalised residual.
pub(crate) fn rms(setting: &Setting<'_>, left: &[PieceResidual]) -> f64 {
    let (square, count) = size(&samples(setting, left));
    (square / count.max(1.0)).sqrt()
}

/// Sum of squares and sum of information.
fn size(samples: &[Sample]) -> (f64, f64) {
    samples.iter().fold((0.0, 0.0), |(square, count), sample| {
        (square + sample.residual * sample.residual, count + sample.information)
    })
}

/// The tests of the residual against one covariate: as it is, and as friction (times the direction of motion).
fn by_covariate(index: usize, samples: &[Sample], square: f64, independent: f64) -> Vec<Dependence> {
    let Some(name) = COVARIATES.get(index) else { return Vec::new() };
    let covariate = |sample: &Sample| sample.covariates.get(index).copied().unwrap_or(f64::NAN);
    let mut sorted: Vec<&Sample> =
        samples.iter().filter(|sample| covariate(sample).is_finite() && sample.residual != 0.0).collect();
    sorted.sort_by(|a, b| covariate(a).total_cmp(&covariate(b)));
    let mut found = Vec::new();
    for as_friction in [false, true] {
        let of = |sample: &Sample| {
            let sign = if as_friction { sample.direction } else { 1.0 };
            (covariate(sample), sign * sample.residual)
        };
        let counted = |sample: &&Sample| {
            let (covariate, value) = of(sample);
            (covariate, value, sample.information)
        };
        let values: Vec<Counted> = sorted.iter().map(counted).filter(|(_, value, _)| *value != 0.0).collect();
        let mut dependence = binned(name, as_friction, &values, index < 2, square, independent);
        if let Some(found) = dependence.as_mut().filter(|_| OF_RUNS.contains(name)) {
            found.p_value = chance_over_runs(samples, of);
        }
        found.extend(dependence);
    }
    found
}

/// The tests of the residual against the product of two covariates, as it is and as friction: a line through what both do within the runs,
/// so that zeros of runs and their drift count for nothing.
fn by_pair(pair: &[&str; 2], samples: &[Sample], square: f64, independent: f64) -> Vec<Dependence> {
    let [first, second] = pair;
    let over_samples = |name: &str| {
        let index = COVARIATES.iter().position(|covariate| *covariate == name)?;
        let values: Option<Vec<f64>> =
            samples.iter().map(|sample| sample.covariates.get(index).copied()).collect();
        standardised(&values?)
    };
    let Some((x, y)) = over_samples(first).and_then(|x| Some((x, over_samples(second)?))) else {
        return Vec::new();
    };
    let test = |as_friction: bool| {
        let sign = |sample: &Sample| if as_friction { sample.direction } else { 1.0 };
        let product = samples.iter().zip(&x).zip(&y).map(|((sample, x), y)| sign(sample) * x * y).collect();
        let (between, groups) = explained_within_runs(samples, product)?;
        let freedom = independent - groups;
        let (share, p_value) = tested((between, square), 1.0, square, freedom.max(4.0));
        Some(Dependence { on: format!("{first} and {second}"), as_friction, share, p_value })
    };
    [false, true].into_iter().filter_map(test).collect()
}

/// The sum of squares of the residual that a multiple of a quantity accounts for, the mean of either taken off in each run, and the number of
/// runs. `None` where the quantity is the same within every run.
fn explained_within_runs(samples: &[Sample], of: Vec<f64>) -> Option<(f64, f64)> {
    let mut runs: BTreeMap<usize, (f64, f64, f64)> = BTreeMap::new();
    for (sample, value) in samples.iter().zip(&of) {
        let sums = runs.entry(sample.unit).or_default();
        let information = sample.information;
        *sums = (
            sums.0 + information,
            sums.1 + information * value,
            sums.2 + information.sqrt() * sample.residual,
        );
    }
    let (mut xx, mut xy, mut all) = (0.0, 0.0, 0.0);
    for (sample, value) in samples.iter().zip(&of) {
        let Some((count, x, y)) = runs.get(&sample.unit) else { continue };
        let root = sample.information.sqrt();
        let (x, y) = (root * (value - x / count), sample.residual - root * y / count);
        (xx, xy, all) = (xx + x * x, xy + x * y, all + sample.information * value * value);
    }
    (xx > 1e-9 * all).then(|| (xy * xy / xx, runs.len() as f64))
}

/// The p-value of a line through the runs' means over a covariate, each with the weight of its samples. Its degrees of freedom
/// are those of the runs.
fn chance_over_runs(samples: &[Sample], of: impl Fn(&Sample) -> (f64, f64)) -> f64 {
    let mut units: BTreeMap<usize, (f64, f64, f64)> = BTreeMap::new();
    for sample in samples {
        let (covariate, value) = of(sample);
        if covariate.is_finite() && value != 0.0 {
            let sums = units.entry(sample.unit).or_default();
            let information = sample.information;
            *sums =
                (sums.0 + information, sums.1 + information * covariate, sums.2 + information.sqrt() * value);
        }
    }
    if units.len() < LEAST_RUNS {
        return 1.0;
    }
    let point = |(count, covariates, values): &(f64, f64, f64)| Weighted {
        weight: *count,
        x: covariates / count,
        y: values / count,
    };
    let points: Vec<Weighted> = units.values().map(point).collect();
    Line::through(&points).map_or(1.0, |line| line.p_value)
}

/// Amplitudes by order of the angle, relative to the noise; in angle logs also of multiples of the rotor's teeth.
pub(crate) fn orders(setting: &Setting<'_>, left: &[PieceResidual], per_independent: f64) -> Vec<Order> {
    let samples = samples(setting, left);
    let (square, count) = size(&samples);
    let (rms, independent) = ((square / count.max(1.0)).sqrt(), (count / per_independent).max(4.0));
    let teeth = setting.campaign.facts.rotor().map(|(_, teeth)| teeth as usize);
    let of_rotor = teeth.map(|teeth| Progression { first: teeth, count: TEETH_TIMES });
    let wanted = std::iter::once(Progression { first: 1, count: SHOWN_ORDERS }).chain(of_rotor);
    let found = wanted.flat_map(|orders| harmonics(&samples, orders, square, independent));
    let amplitude = |share: f64| (2.0 * share).sqrt() * rms;
    let mut found: Vec<Order> = found
        .map(|Harmonic { order, both_ways, against_motion }| Order {
            order,
            both_ways: amplitude(both_ways.0),
            p_both_ways: both_ways.1,
            against_motion: amplitude(against_motion.0),
            p_against_motion: against_motion.1,
        })
        .collect();
    holm(found.iter_mut().flat_map(|of| [&mut of.p_both_ways, &mut of.p_against_motion]));
    found
}

fn samples(setting: &Setting<'_>, left: &[PieceResidual]) -> Vec<Sample> {
    let mut classes: BTreeMap<Class, f64> = BTreeMap::new();
    for class in &setting.campaign.classes {
        let next = classes.len() as f64;
        classes.entry(*class).or_insert(next);
    }
    let few = setting.campaign.runs.len() < LEAST_RUNS;
    let mut samples = Vec::new();
    for (index, (piece, left)) in setting.campaign.pieces.iter().zip(left).enumerate() {
        let class = setting.campaign.classes.get(piece.run).and_then(|class| classes.get(class).copied());
        let unit = if few { index } else { piece.run };
        of_piece(piece, left, (unit, class.unwrap_or(0.0)), &mut samples);
    }
    samples
}

fn of_piece(piece: &Piece, left: &PieceResidual, (unit, class): (usize, f64), samples: &mut Vec<Sample>) {
    let mut direction = 0.0;
    for (index, ((residual, weight), at)) in
        left.residual.iter().zip(&piece.weights).zip(moments(piece)).enumerate()
    {
        let speed = at.speed_rad_per_s;
        if speed.abs() > 1e-4 {
            direction = speed.signum();
        }
        if *weight > 0.0 {
            let covariate = |values: &[f64]| values.get(index).copied().unwrap_or(f64::NAN);
            samples.push(Sample {
                unit,
                residual: residual * weight,
                information: piece.information.get(index).copied().unwrap_or(1.0),
                direction,
                covariates: [
                    piece.run as f64,
                    class,
                    at.angle_rad,
                    speed,
                    at.acceleration_rad_per_s2,
                    covariate(piece.driven.pressure_pa()),
                    covariate(piece.driven.temperature_c()),
                    at.rest_s,
                    at.distance_rad,
                ],
            });
        }
    }
}

/// The test of values that are sorted by their covariate.
fn binned(
    name: &str,
    as_friction: bool,
    values: &[Counted],
    by_value: bool,
    square: f64,
    independent: f64,
) -> Option<Dependence> {
    let (first, last) = (values.first()?.0, values.last()?.0);
    if first == last {
        return None;
    }
    let bins: Vec<&[Counted]> = if by_value {
        values.chunk_by(|a, b| a.0 == b.0).collect()
    } else {
        let fine = ((last - first) / ANGLE_BIN_RAD) as usize;
        let wanted = if name == "angle" && (BINS..MOST_BINS).contains(&fine) { fine } else { BINS };
        values.chunks(values.len().div_ceil(wanted)).collect()
    };
    let within = |bin: &&[Counted]| {
        let add = |(sum, count): (f64, f64), (_, value, information): &Counted| {
            (sum + information.sqrt() * value, count + information)
        };
        let (sum, count) = bin.iter().fold((0.0, 0.0), add);
        sum * sum / count
    };
    let between: f64 = bins.iter().map(within).sum();
    let total: f64 = values.iter().map(|(_, value, _)| value * value).sum();
    let (share, p_value) = tested((between, total), bins.len() as f64, square, independent);
    Some(Dependence { on: name.to_owned(), as_friction, share, p_value })
}

/// Orders `first`, 2·`first`, ..., as many as `count`.
#[derive(Clone, Copy)]
struct Progression {
    first: usize,
    count: usize,
}

/// A harmonic of the residual over the angle: share of its sum of squares, p-value, and whether it is taken as friction.
struct Harmonic {
    order: usize,
    both_ways: (f64, f64, bool),
    against_motion: (f64, f64, bool),
}

/// Sums over the samples: products of an order's cosine and sine, and of these with the residual.
#[derive(Clone, Copy, Default)]
struct Sums {
    cc: f64,
    ss: f64,
    cs: f64,
    /// With the residual, and with the residual times the direction.
    with_cos: [f64; 2],
    with_sin: [f64; 2],
}

/// The harmonics of these orders that have a whole period within the angles; empty if an angle is not known.
fn harmonics(samples: &[Sample], orders: Progression, square: f64, independent: f64) -> Vec<Harmonic> {
    let angle = |sample: &Sample| sample.covariates.get(ANGLE).copied().unwrap_or(f64::NAN);
    let mut sums = vec![Sums::default(); orders.count];
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for sample in samples {
        let at = angle(sample);
        if !at.is_finite() {
            return Vec::new();
        }
        (least, most) = (least.min(at), most.max(at));
        let (first_sin, first_cos) = (orders.first as f64 * at).sin_cos();
        let root = sample.information.sqrt();
        let values = [sample.residual, sample.residual * sample.direction];
        let (mut sin, mut cos) = (first_sin, first_cos);
        for of in &mut sums {
            let (weighted_sin, weighted_cos) = (root * sin, root * cos);
            of.cc += weighted_cos * weighted_cos;
            of.ss += weighted_sin * weighted_sin;
            of.cs += weighted_cos * weighted_sin;
            for (value, (with_cos, with_sin)) in
                values.iter().zip(of.with_cos.iter_mut().zip(&mut of.with_sin))
            {
                *with_cos += value * weighted_cos;
                *with_sin += value * weighted_sin;
            }
            // The next order is one rotation further.
            (sin, cos) = (sin * first_cos + cos * first_sin, cos * first_cos - sin * first_sin);
        }
    }
    let harmonic = |(index, of): (usize, &Sums)| {
        let order = orders.first * (index + 1);
        let determinant = of.cc * of.ss - of.cs * of.cs;
        if (most - least) * (order as f64) < std::f64::consts::TAU || determinant <= 1e-6 * of.cc * of.ss {
            return None;
        }
        let found = |([rc, _], [rs, _]): ([f64; 2], [f64; 2]), as_friction| {
            let explained = (rc * (of.ss * rc - of.cs * rs) + rs * (of.cc * rs - of.cs * rc)) / determinant;
            let (share, p_value) = tested((explained, square), 2.0, square, independent);
            (share, p_value, as_friction)
        };
        let turned = |[one, other]: [f64; 2]| [other, one];
        Some(Harmonic {
            order,
            both_ways: found((of.with_cos, of.with_sin), false),
            against_motion: found((turned(of.with_cos), turned(of.with_sin)), true),
        })
    };
    sums.iter().enumerate().filter_map(harmonic).collect()
}

/// The share of the residual's sum of squares beyond what chance explains, and the p-value of the F test.
fn tested((between, total): (f64, f64), groups: f64, square: f64, independent: f64) -> (f64, f64) {
    let within = (total - between).max(1e-12 * total);
    let freedom = (independent - groups).max(1.0);
    let statistic = (between / groups) / (within / freedom);
    let p_value = FisherSnedecor::new(groups, freedom).map_or(1.0, |f| 1.0 - f.cdf(statistic.max(0.0)));
    let by_chance = groups / independent;
    (((between / square) - by_chance).max(0.0), p_value)
}

/// The number of samples that count as one independent sample: 1 + 2·Σ autocorrelation.
fn correlation(setting: &Setting<'_>, left: &[PieceResidual]) -> f64 {
    let centred = |(piece, left): (&Piece, &PieceResidual)| {
        let mut values = piece.together(&left.residual);
        values.truncate(LOOKED_AT);
        // The mean is subtracted: a run's offset is no noise, and never decorrelates.
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        values.iter_mut().for_each(|value| *value -= mean);
        values
    };
    let pieces: Vec<Vec<f64>> = setting.campaign.pieces.iter().zip(left).map(centred).collect();
    let at = |lag: usize| -> f64 {
        let of = |some: &Vec<f64>| some.iter().zip(some.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
        pieces.iter().map(of).sum()
    };
    let none = at(0).max(f64::MIN_POSITIVE);
    let correlations = (1..LAGS).map(|lag| at(lag) / none);
    // The sum ends where it first falls below a twentieth.
    1.0 + 2.0 * correlations.take_while(|correlation| *correlation >= 0.05).sum::<f64>()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn what_two_covariates_do_together_is_seen_where_neither_does_anything() {
        // Twelve runs, each with a zero of its own; pressure and temperature swing within each.
        let sample = |index: usize, law: f64| {
            let (run, at) = (index / 500, (index % 500) as f64 / 500.0);
            let mut covariates = [0.0; COVARIATES.len()];
            covariates[5] = (12.0 * at + run as f64).sin();
            covariates[6] = (7.0 * at + 2.0 * run as f64).cos();
            let noise = (index.wrapping_mul(2_654_435_761) % 1000) as f64 / 500.0 - 1.0;
            let residual = (run as f64).cos() + law * covariates[5] * covariates[6] + noise;
            Sample { unit: run, residual, information: 1.0, direction: 1.0, covariates }
        };
        let test = |law: f64| {
            let samples: Vec<Sample> = (0..6000).map(|index| sample(index, law)).collect();
            let (square, count) = size(&samples);
            by_pair(&["pressure", "temperature"], &samples, square, count / 10.0)[0].clone()
        };
        assert!(test(0.0).p_value > 0.05, "{:?}", test(0.0));
        assert!(test(0.5).p_value < 1e-4 && test(0.5).share > 0.02, "{:?}", test(0.5));
    }

    #[test]
    fn a_pressure_counts_once_a_run_however_many_samples_it_has() {
        // Six runs whose means scatter by themselves. With a thousand samples in each, every test by samples would be significant.
        let offsets = [0.3, -0.4, 0.1, 0.5, -0.2, -0.3];
        let sample = |unit: usize, noise: f64, slope: f64| {
            let mut covariates = [f64::NAN; COVARIATES.len()];
            covariates[5] = unit as f64;
            let residual = offsets[unit] + slope * unit as f64 + 0.01 * noise;
            Sample { unit, residual, information: 1.0, direction: 1.0, covariates }
        };
        let chance = |slope: f64| {
            let samples: Vec<Sample> = (0..6000)
                .map(|index: usize| {
                    sample(index / 1000, if index.is_multiple_of(2) { 1.0 } else { -1.0 }, slope)
                })
                .collect();
            chance_over_runs(&samples, |sample| (sample.covariates[5], sample.residual))
        };
        assert!(chance(0.0) > 0.2, "{}", chance(0.0));
        assert!(chance(2.0) < 1e-3, "{}", chance(2.0));
    }
}
