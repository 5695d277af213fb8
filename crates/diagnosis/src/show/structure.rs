//! Where a residual has structure: by run, motion, angle, speed, and so on, and by order of the angle; with tests corrected
//! for their number by Holm's method.

use crate::fit::equations::Setting;
use crate::log::classes::Class;
use crate::log::piece::Piece;
use crate::numerics::line::{Line, Weighted};
use crate::numerics::statistics::{CHANCE, SHARE_LEFT, holm};
use crate::outcome::{Dependence, Order};
use crate::show::residual::PieceResidual;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use std::collections::BTreeMap;

/// Covariate, residual as in [`Sample`], and what the sample counts for.
type Counted = (f64, f64, f64);

/// Bins of a covariate; of the angle one for so many rad, where that is not too many.
const BINS: usize = 12;
const ANGLE_BIN_RAD: f64 = 0.3;
const MOST_BINS: usize = 120;
/// Lags over which neighbours are compared.
const LAGS: usize = 400;
/// Samples of a piece that are compared.
const LOOKED_AT: usize = 4096;
/// Orders over a turn that are tested, and that are shown; of angle logs the rotor's teeth times these beside them.
const ORDERS: usize = 16;
const SHOWN_ORDERS: usize = 32;
const TEETH_TIMES: usize = 10;

/// Covariates constant within a run: one degree of freedom a run.
const OF_RUNS: [&str; 2] = ["pressure", "temperature"];
/// Runs that this takes; of fewer the pieces stand for them.
const LEAST_RUNS: usize = 4;

/// A sample as the tests see it.
struct Sample {
    /// The run, or the piece where there are few runs.
    unit: usize,
    /// Residual in parts of its noise, times the root of what the sample counts for.
    residual: f64,
    /// What it counts for.
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

/// What was found of a residual.
#[derive(Debug, Clone)]
pub(crate) struct Structure {
    pub dependences: Vec<Dependence>,
    pub orders: Vec<Order>,
    /// RMS in parts of the noise.
    pub rms: f64,
    /// As how many independent samples all of them count.
    pub count: f64,
    /// How many of those are worth one, since neighbours are alike.
    pub per_independent: f64,
}

/// Whether some covariate explains a part of a residual.
pub(crate) fn depends(of: &Structure) -> bool {
    of.dependences.iter().any(|of| of.share > SHARE_LEFT && of.p_value < CHANCE)
}

/// Tests a residual against everything that is known beside it.
pub(crate) fn structure(setting: &Setting<'_>, left: &[PieceResidual]) -> Structure {
    let per_independent = correlation(setting, left);
    let samples = samples(setting, left);
    let count: f64 = samples.iter().map(|sample| sample.information).sum();
    let square: f64 = samples.iter().map(|sample| sample.residual * sample.residual).sum();
    let independent = (count / per_independent).max(4.0);
    let mut dependences = Vec::new();
    for (index, name) in COVARIATES.iter().enumerate() {
        for as_friction in [false, true] {
            let of = |sample: &Sample| {
                let sign = if as_friction { sample.direction } else { 1.0 };
                (sample.covariates.get(index).copied().unwrap_or(f64::NAN), sign * sample.residual)
            };
            let counts = |(covariate, value, _): &Counted| covariate.is_finite() && *value != 0.0;
            let counted = |sample: &Sample| {
                let (covariate, value) = of(sample);
                (covariate, value, sample.information)
            };
            let values: Vec<Counted> = samples.iter().map(counted).filter(counts).collect();
            let by_name = index < 2;
            let mut found = binned(name, as_friction, values, by_name, square, independent);
            if let Some(found) = found.as_mut().filter(|_| OF_RUNS.contains(name)) {
                found.p_value = chance_over_runs(&samples, of);
            }
            dependences.extend(found);
        }
    }
    for order in 1..=ORDERS {
        for as_friction in [false, true] {
            dependences.extend(harmonic(order, as_friction, &samples, square, independent));
        }
    }
    holm(dependences.iter_mut().map(|found| &mut found.p_value));
    dependences.sort_by(|a, b| b.share.total_cmp(&a.share));
    let rms = (square / count.max(1.0)).sqrt();
    let teeth = setting.campaign.facts.rotor().map(|(_, teeth)| teeth);
    let orders = orders(&samples, teeth, square, independent, rms);
    Structure { dependences, orders, rms, count, per_independent }
}

/// The probability that the runs' means go with a covariate like this by chance: a line through them, each with the weight
/// of its samples, tested with as many degrees of freedom as there are runs.
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

/// Amplitudes by order of the angle, in parts of the noise.
fn orders(samples: &[Sample], teeth: Option<f64>, square: f64, independent: f64, rms: f64) -> Vec<Order> {
    let of_rotor = teeth.into_iter().flat_map(|teeth| (1..=TEETH_TIMES).map(move |k| k * teeth as usize));
    let amplitude = |order: usize, as_friction: bool| {
        let found = harmonic(order, as_friction, samples, square, independent)?;
        Some(((2.0 * found.share).sqrt() * rms, found.p_value))
    };
    let mut found: Vec<Order> = (1..=SHOWN_ORDERS)
        .chain(of_rotor)
        .filter_map(|order| {
            let ((both_ways, p_both), (against, p_against)) =
                (amplitude(order, false)?, amplitude(order, true)?);
            Some(Order {
                order,
                both_ways,
                p_both_ways: p_both,
                against_motion: against,
                p_against_motion: p_against,
            })
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
    let mut rest_s = 0.0;
    let mut distance = piece.past.contact.distance_rad;
    let mut before_s = f64::NAN;
    let mut direction = 0.0;
    for (index, ((residual, weight), time_s)) in
        left.residual.iter().zip(&piece.weights).zip(piece.driven.time_s()).enumerate()
    {
        let dt_s = if before_s.is_finite() { time_s - before_s } else { 0.0 };
        before_s = *time_s;
        let (angle, speed, acceleration) = piece.kinematics(index);
        rest_s = if speed.abs() > 1e-3 { 0.0 } else { rest_s + dt_s };
        distance += speed.abs() * dt_s;
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
                    angle,
                    speed,
                    acceleration,
                    covariate(piece.driven.pressure_pa()),
                    covariate(piece.driven.temperature_c()),
                    rest_s,
                    distance,
                ],
            });
        }
    }
}

fn binned(
    name: &str,
    as_friction: bool,
    mut values: Vec<Counted>,
    by_value: bool,
    square: f64,
    independent: f64,
) -> Option<Dependence> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
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
    Some(tested(name, as_friction, (between, total), bins.len() as f64, square, independent))
}

fn harmonic(
    order: usize,
    as_friction: bool,
    samples: &[Sample],
    square: f64,
    independent: f64,
) -> Option<Dependence> {
    let (mut cc, mut ss, mut cs, mut rc, mut rs) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for sample in samples {
        let angle = sample.covariates.get(2).copied().unwrap_or(f64::NAN);
        if !angle.is_finite() {
            return None;
        }
        (least, most) = (least.min(angle), most.max(angle));
        let value = sample.residual * if as_friction { sample.direction } else { 1.0 };
        let root = sample.information.sqrt();
        let (sin, cos) = (order as f64 * angle).sin_cos();
        let (sin, cos) = (root * sin, root * cos);
        (cc, ss, cs, rc, rs) =
            (cc + cos * cos, ss + sin * sin, cs + cos * sin, rc + value * cos, rs + value * sin);
    }
    let determinant = cc * ss - cs * cs;
    if (most - least) * (order as f64) < std::f64::consts::TAU || determinant <= 1e-6 * cc * ss {
        return None;
    }
    let explained = (rc * (ss * rc - cs * rs) + rs * (cc * rs - cs * rc)) / determinant;
    Some(tested(&format!("angle, order {order}"), as_friction, (explained, square), 2.0, square, independent))
}

fn tested(
    on: &str,
    as_friction: bool,
    (between, total): (f64, f64),
    groups: f64,
    square: f64,
    independent: f64,
) -> Dependence {
    let within = (total - between).max(1e-12 * total);
    let freedom = (independent - groups).max(1.0);
    let statistic = (between / groups) / (within / freedom);
    let p_value = FisherSnedecor::new(groups, freedom).map_or(1.0, |f| 1.0 - f.cdf(statistic.max(0.0)));
    let by_chance = groups / independent;
    let share = ((between / square) - by_chance).max(0.0);
    Dependence { on: on.to_owned(), as_friction, share, p_value }
}

/// How many samples are worth one independent one: 1 + 2·Σ autocorrelation.
fn correlation(setting: &Setting<'_>, left: &[PieceResidual]) -> f64 {
    let mut sums = vec![0.0; LAGS];
    for (piece, left) in setting.campaign.pieces.iter().zip(left) {
        let mut values = piece.together(&left.residual);
        values.truncate(LOOKED_AT);
        // Less the mean: a run's offset is no noise that decorrelates.
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        values.iter_mut().for_each(|value| *value -= mean);
        let some = &values;
        for (lag, sum) in sums.iter_mut().enumerate() {
            *sum += some.iter().zip(some.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
        }
    }
    let none = sums.first().copied().unwrap_or(0.0);
    let mut total = 1.0;
    // Until it first falls below a twentieth.
    for sum in sums.iter().skip(1) {
        let correlation = sum / none.max(f64::MIN_POSITIVE);
        if correlation < 0.05 {
            break;
        }
        total += 2.0 * correlation;
    }
    total
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_pressure_counts_once_a_run_however_many_samples_it_has() {
        // Six runs whose means scatter by themselves: of a thousand samples each every test by samples would be sure.
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
