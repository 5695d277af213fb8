//! How much of a metric's variance each varied quantity explains alone, and how the metric's mean goes with it.
//!
//! The first-order index of Sobol, S = Var(E[y | x]) / Var(y), is estimated from the runs that there are; inputs are independent in all
//! designs here. The main effects of all quantities are fitted together by least squares: polynomials in the rank of a number, a level
//! each for words and for numbers with few values (polynomial chaos without its interactions: Sudret, RESS 93 (2008) 964). What one
//! quantity does is so no scatter in the effect of another. The degree is the one with the least generalised cross-validation error
//! (Golub, Heath and Wahba, Technometrics 21 (1979) 215). The variance of an effect by chance is taken off. Standard errors are the
//! jackknife's over groups of runs.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;
use std::collections::BTreeMap;

/// A number with at most so many values is taken value by value.
const MOST_LEVELS: usize = 12;
/// Runs of a group of a number with more values, at least.
const LEAST_RUNS: usize = 8;
/// Fewer groups than this show no course.
const LEAST_GROUPS: usize = 3;
/// More than this show nothing but scatter.
const MOST_GROUPS: usize = 16;
/// The highest degree of a polynomial: a sine of a whole period needs 7 for one per cent.
const MOST_DEGREE: usize = 10;
/// Runs for each number that is fitted, at least.
const RUNS_A_NUMBER: usize = 3;
/// Groups of the jackknife.
const JACKKNIFE: usize = 20;

/// A quantity's value in a run: a number, or a word.
pub type Level = Result<f64, String>;

/// Runs with like values of a quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Their value: the mean of a number, or a word.
    pub x: Level,
    /// How many there are.
    pub runs: usize,
    /// The metric's mean.
    pub mean: f64,
}

/// A part of a metric's variance, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// The part.
    pub part: f64,
    /// Its standard error.
    pub std_error: f64,
}

/// What decides a metric.
#[derive(Debug, Clone, PartialEq)]
pub struct Shares {
    /// The first-order index of each quantity, in their order.
    pub alone: Vec<Share>,
    /// What all of them leave: effects of several together, and of more than their number of runs can show.
    pub rest: f64,
}

/// The means of a metric over runs with like values of a quantity, in the order of the value; runs of which one is unknown don't count.
/// None where there are too few runs.
pub fn course(x: &[Level], y: &[f64]) -> Vec<Group> {
    let known = x.iter().zip(y).filter(|(x, y)| y.is_finite() && is_known(x)).map(|(x, y)| (x, *y));
    let mut words: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    let mut numbers: Vec<(f64, f64)> = Vec::new();
    for (x, y) in known {
        match x {
            Err(word) => words.entry(word).or_default().push(y),
            Ok(number) => numbers.push((*number, y)),
        }
    }
    numbers.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let group = |x, ys: &[f64]| Group { x, runs: ys.len(), mean: mean(ys) };
    let of_numbers = numeric(&numbers).into_iter().map(|part| {
        let (x, ys): (Vec<f64>, Vec<f64>) = part.iter().copied().unzip();
        group(Ok(mean(&x)), &ys)
    });
    of_numbers.chain(words.into_iter().map(|(word, ys)| group(Err(word.to_owned()), &ys))).collect()
}

fn is_known(x: &Level) -> bool {
    x.as_ref().map_or(true, |number| number.is_finite())
}

/// By value where there are few, else in groups of about equally many. Runs with the same value are in one group.
fn numeric(sorted: &[(f64, f64)]) -> Vec<&[(f64, f64)]> {
    let levels: Vec<&[(f64, f64)]> = sorted.chunk_by(|a, b| a.0 == b.0).collect();
    if levels.len() <= MOST_LEVELS {
        return levels;
    }
    let groups = (sorted.len() / LEAST_RUNS).min(MOST_GROUPS);
    if groups < LEAST_GROUPS {
        return Vec::new();
    }
    let (mut parts, mut begin, mut end) = (Vec::new(), 0, 0);
    for level in levels {
        end += level.len();
        if end >= (parts.len() + 1) * sorted.len() / groups {
            parts.extend(sorted.get(begin..end));
            begin = end;
        }
    }
    parts
}

/// What decides a metric; `None` where it is the same in all runs, or where there are too few runs for a straight line each. `balanced`:
/// the runs are a full grid, whose effects are exact.
pub fn shares(quantities: &[Vec<Level>], y: &[f64], balanced: bool) -> Option<Shares> {
    let known: Vec<usize> = (0..y.len())
        .filter(|run| {
            y.get(*run).is_some_and(|y| y.is_finite())
                && quantities.iter().all(|x| x.get(*run).is_some_and(is_known))
        })
        .collect();
    let ys: Vec<f64> = known.iter().filter_map(|run| y.get(*run).copied()).collect();
    if is_constant(&ys) {
        return None;
    }
    let bases: Vec<Basis> = quantities
        .iter()
        .map(|x| Basis::of(&known.iter().filter_map(|run| x.get(*run).cloned()).collect::<Vec<_>>()))
        .collect();
    let sums = Sums::of(&bases, &ys);
    let all: DMatrix<f64> = sums.groups.iter().sum();
    let fits = (1..=MOST_DEGREE).map_while(|degree| {
        let columns = columns(&bases, degree);
        let needed = if balanced { columns.len() + 2 } else { columns.len() * RUNS_A_NUMBER };
        (needed <= ys.len()).then(|| Fit::of(&all, columns, degree)).flatten()
    });
    let best = fits.min_by(|a, b| a.error().total_cmp(&b.error()))?;
    let parts = best.parts(&bases, balanced);
    let again: Vec<Vec<f64>> = sums
        .groups
        .iter()
        .filter_map(|group| Fit::of(&(&all - group), best.columns.clone(), best.degree))
        .map(|fit| fit.parts(&bases, balanced))
        .collect();
    let count = again.len() as f64;
    let std_error = |quantity: usize| {
        let of = |parts: &Vec<f64>| parts.get(quantity).copied().unwrap_or(0.0);
        let middle = again.iter().map(of).sum::<f64>() / count;
        ((count - 1.0) / count * again.iter().map(|parts| (of(parts) - middle).powi(2)).sum::<f64>()).sqrt()
    };
    let alone = parts
        .iter()
        .enumerate()
        .map(|(quantity, part)| Share { part: part.clamp(0.0, 1.0), std_error: std_error(quantity) });
    let rest = (1.0 - parts.iter().sum::<f64>()).clamp(0.0, 1.0);
    Some(Shares { alone: alone.collect(), rest })
}

/// Whether all are the same but for rounding.
fn is_constant(values: &[f64]) -> bool {
    let grand = mean(values);
    let variance = values.iter().map(|y| (y - grand).powi(2)).sum::<f64>() / values.len().max(1) as f64;
    let scale = values.iter().fold(0.0, |most: f64, y| most.max(y.abs()));
    variance <= (scale * 1e-12).powi(2)
}

/// Functions of one quantity, of mean 0 over the runs.
struct Basis {
    /// Values of each function, run by run.
    functions: Vec<Vec<f64>>,
    /// Whether all are needed at any degree: levels.
    is_levels: bool,
}

impl Basis {
    fn of(x: &[Level]) -> Self {
        let order = |a: &&Level, b: &&Level| match (a, b) {
            (Ok(a), Ok(b)) => a.total_cmp(b),
            (Err(a), Err(b)) => a.cmp(b),
            (Ok(_), Err(_)) => std::cmp::Ordering::Less,
            (Err(_), Ok(_)) => std::cmp::Ordering::Greater,
        };
        let mut sorted: Vec<&Level> = x.iter().collect();
        sorted.sort_by(order);
        let mut levels = sorted.clone();
        levels.dedup();
        let is_levels = levels.len() <= MOST_LEVELS || x.iter().any(Result::is_err);
        let functions = if is_levels {
            // The first level is the others' absence.
            let is_level =
                |level: &Level| centred(x.iter().map(|x| f64::from(u8::from(x == level))).collect());
            levels.iter().skip(1).map(|level| is_level(level)).collect()
        } else {
            let rank = |x: &Level| {
                let below = sorted.partition_point(|of| order(of, &x).is_lt());
                let up_to = sorted.partition_point(|of| order(of, &x).is_le());
                (below + up_to) as f64 / sorted.len() as f64 - 1.0
            };
            let ranks: Vec<f64> = x.iter().map(rank).collect();
            let power = |degree: usize| centred(ranks.iter().map(|rank| legendre(degree, *rank)).collect());
            (1..=MOST_DEGREE).map(power).collect()
        };
        Self { functions, is_levels }
    }

    /// How many functions a degree takes.
    fn len(&self, degree: usize) -> usize {
        if self.is_levels { self.functions.len() } else { degree.min(self.functions.len()) }
    }
}

fn centred(mut values: Vec<f64>) -> Vec<f64> {
    let middle = mean(&values);
    values.iter_mut().for_each(|value| *value -= middle);
    values
}

/// Legendre's polynomial on −1 to 1, by Bonnet's recursion, of variance 1.
fn legendre(degree: usize, x: f64) -> f64 {
    let (mut last, mut this) = (1.0, x);
    for n in 1..degree {
        let n = n as f64;
        (last, this) = (this, ((2.0 * n + 1.0) * x * this - n * last) / (n + 1.0));
    }
    this * (2.0 * degree as f64 + 1.0).sqrt()
}

/// The places of a degree's functions among all of all quantities.
fn columns(bases: &[Basis], degree: usize) -> Vec<usize> {
    let mut begin = 0;
    let mut columns = Vec::new();
    for basis in bases {
        columns.extend(begin..begin + basis.len(degree));
        begin += basis.functions.len();
    }
    columns
}

/// Sums of products of all functions, of the metric (last but one) and of 1 (last), group by group.
struct Sums {
    groups: Vec<DMatrix<f64>>,
}

impl Sums {
    fn of(bases: &[Basis], y: &[f64]) -> Self {
        let (y, one) = (centred(y.to_vec()), vec![1.0; y.len()]);
        let all: Vec<&[f64]> = bases
            .iter()
            .flat_map(|basis| basis.functions.iter().map(Vec::as_slice))
            .chain([y.as_slice(), one.as_slice()])
            .collect();
        let mut runs: Vec<usize> = (0..y.len()).collect();
        runs.shuffle(&mut Pcg64::seed_from_u64(0));
        let group = |number: usize| {
            let mut sums = DMatrix::zeros(all.len(), all.len());
            for run in runs.iter().skip(number).step_by(JACKKNIFE) {
                let row = DVector::from_iterator(
                    all.len(),
                    all.iter().map(|of| of.get(*run).copied().unwrap_or(0.0)),
                );
                sums.syger(1.0, &row, &row, 1.0);
            }
            sums.fill_upper_triangle_with_lower_triangle();
            sums
        };
        Self { groups: (0..JACKKNIFE.min(y.len())).map(group).collect() }
    }
}

/// Main effects of one degree, fitted.
struct Fit {
    columns: Vec<usize>,
    degree: usize,
    coefficients: DVector<f64>,
    /// Covariance of the functions over the runs.
    functions: DMatrix<f64>,
    /// Covariance of the coefficients, but for the variance of what is left.
    inverse: DMatrix<f64>,
    runs: f64,
    /// Mean square of what is left.
    left: f64,
}

impl Fit {
    fn of(sums: &DMatrix<f64>, columns: Vec<usize>, degree: usize) -> Option<Self> {
        let one = sums.nrows().checked_sub(1)?;
        let y = one.checked_sub(1)?;
        let at = |row: usize, column: usize| sums.get((row, column)).copied().unwrap_or(0.0);
        let runs = at(one, one);
        let centred = |row: usize, column: usize| at(row, column) - at(row, one) * at(column, one) / runs;
        let place = |index: usize| columns.get(index).copied().unwrap_or(0);
        let count = columns.len();
        let matrix = DMatrix::from_fn(count, count, |row, column| centred(place(row), place(column)));
        let right = DVector::from_fn(count, |row, _| centred(place(row), y));
        let inverse = matrix.clone().cholesky()?.inverse();
        let coefficients = &inverse * &right;
        let left = (centred(y, y) - right.dot(&coefficients)).max(0.0) / runs;
        Some(Self { columns, degree, coefficients, functions: matrix / runs, inverse, runs, left })
    }

    /// Generalised cross-validation.
    fn error(&self) -> f64 {
        let free = 1.0 - (self.columns.len() + 1) as f64 / self.runs;
        self.left / free.powi(2)
    }

    /// Each quantity's part of the variance, less what chance makes of it. The whole is the sum of all and of what is left, and not the variance
    /// of these runs: in a random design the quantities of some runs go together by chance.
    fn parts(&self, bases: &[Basis], balanced: bool) -> Vec<f64> {
        let free = (self.runs - self.columns.len() as f64 - 1.0).max(1.0);
        let left = if balanced { self.left } else { self.left * self.runs / free };
        let noise = if balanced { 0.0 } else { left };
        let mut begin = 0;
        let part = |basis: &Basis| {
            let count = basis.len(self.degree);
            let own = self.coefficients.rows(begin, count);
            let functions = self.functions.view((begin, begin), (count, count));
            let by_chance = noise * (functions * self.inverse.view((begin, begin), (count, count))).trace();
            begin += count;
            (own.transpose() * functions * own).sum() - by_chance
        };
        let parts: Vec<f64> = bases.iter().map(part).collect();
        let whole = parts.iter().sum::<f64>() + left;
        parts.into_iter().map(|part| part / whole).collect()
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::design::Points;
    use config::DesignKind;
    use std::f64::consts::PI;

    const DESIGNS: [DesignKind; 3] = [DesignKind::Random, DesignKind::LatinHypercube, DesignKind::Sobol];

    /// The points of a design, quantity by quantity, and a function of them.
    fn tried(
        kind: DesignKind,
        (quantities, runs, seed): (usize, u64, u64),
        of: impl Fn(&[f64]) -> f64,
    ) -> (Vec<Vec<Level>>, Vec<f64>) {
        let design = Points::new(kind, seed, runs, quantities);
        let points: Vec<Vec<f64>> = (0..runs).map(|point| design.at(point, quantities)).collect();
        let quantity = |index: usize| points.iter().map(|point| Ok(point[index])).collect();
        ((0..quantities).map(quantity).collect(), points.iter().map(|point| of(point)).collect())
    }

    /// Each index within `within` of the true one, and within four of its standard errors (of 0.01 at least).
    fn assert_shares(found: &Shares, expected: &[f64], within: f64, told: &str) {
        for (share, right) in found.alone.iter().zip(expected) {
            let off = (share.part - right).abs();
            assert!(off < within, "{told}: {found:?}, {expected:?} is right");
            assert!(off < 4.0 * share.std_error.max(0.01), "{told}: {found:?}, {expected:?} is right");
        }
    }

    #[test]
    fn a_sum_s_shares_are_exact_with_few_runs() {
        for (kind, runs) in DESIGNS.into_iter().flat_map(|kind| [24, 128, 1024].map(|runs| (kind, runs))) {
            let (x, y) = tried(kind, (3, runs, 7), |x| x[0] + 2.0 * x[1] + 3.0 * x[2]);
            let found = shares(&x, &y, false).unwrap();
            // A random design's own variances differ from the distribution's.
            let within = if kind == DesignKind::Random { 0.6 / (runs as f64).sqrt() } else { 0.02 };
            let expected = [1.0 / 14.0, 4.0 / 14.0, 9.0 / 14.0];
            for (share, right) in found.alone.iter().zip(expected) {
                assert!((share.part - right).abs() < within, "{kind:?}, {runs} runs: {found:?}");
            }
        }
    }

    /// Ishigami's function, whose indices are known: 0.3139, 0.4424 and 0 (a = 7, b = 0.1).
    #[test]
    fn ishigami_s_indices() {
        let of = |x: &[f64]| {
            let x: Vec<f64> = x.iter().map(|unit| PI * (2.0 * unit - 1.0)).collect();
            x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin()
        };
        for (runs, within) in [(128, 0.15), (1024, 0.05), (4096, 0.03)] {
            for kind in DESIGNS {
                let (x, y) = tried(kind, (3, runs, 3), of);
                let found = shares(&x, &y, false).unwrap();
                // The draws of a random design scatter more than the others' points.
                let within = if kind == DesignKind::Random { 2.0 * within } else { within };
                assert_shares(&found, &[0.3139, 0.4424, 0.0], within, &format!("{kind:?}, {runs} runs"));
            }
        }
    }

    #[test]
    fn chance_explains_nothing() {
        // 40 trials: the mean of what is said of a quantity without effect.
        let said: Vec<f64> = (0..40)
            .map(|seed| {
                let (x, y) = tried(DesignKind::Random, (3, 60, seed), |x| (1e4 * x[1]).sin() + x[2]);
                shares(&x, &y, false).unwrap().alone[0].part
            })
            .collect();
        assert!(mean(&said) < 0.03, "{said:?}");
    }

    #[test]
    fn a_grid_s_shares_are_exact() {
        // y = x1 + 2·x2 on a grid of 3 by 3: the variances are 1 to 4.
        let grid: Vec<(f64, f64)> = (0..9).map(|k| (f64::from(k % 3), f64::from(k / 3))).collect();
        let y: Vec<f64> = grid.iter().map(|(a, b)| a + 2.0 * b).collect();
        let number = grid.iter().map(|of| Ok(of.0)).collect();
        let words = grid.iter().map(|of| Err(format!("level {}", of.1))).collect();
        let found = shares(&[number, words], &y, true).unwrap();
        assert!((found.alone[0].part - 0.2).abs() < 1e-12, "{found:?}");
        assert!((found.alone[1].part - 0.8).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn too_few_or_the_same_have_no_shares() {
        let x: Vec<Level> = (0..20).map(|k| Ok(f64::from(k))).collect();
        assert_eq!(shares(std::slice::from_ref(&x), &[1.0; 20], false), None);
        let y: Vec<f64> = (0..20).map(f64::from).collect();
        assert_eq!(shares(&vec![x.clone(); 7], &y, false), None, "20 runs, 7 quantities");
        assert_eq!(course(&x, &y), [], "20 values, no two alike");
        assert_eq!(shares(&[], &[], false), None);
        assert_eq!(course(&[], &[]), []);
    }

    #[test]
    fn runs_with_the_same_value_are_in_one_group() {
        // 13 values, one in half of the runs.
        let value = |run: u32| if run.is_multiple_of(2) { 6.0 } else { f64::from(run % 26 / 2) };
        let x: Vec<Level> = (0..260).map(|run| Ok(value(run))).collect();
        let y: Vec<f64> = x.iter().map(|x| *x.as_ref().unwrap()).collect();
        let groups = course(&x, &y);
        assert_eq!(groups.iter().map(|group| group.runs).sum::<usize>(), 260);
        let of = |group: &Group| group.x.clone().unwrap();
        assert!(groups.windows(2).all(|two| of(&two[0]) < of(&two[1])), "{groups:?}");
        assert!(groups.iter().any(|group| group.runs >= 140), "{groups:?}");
    }
}
