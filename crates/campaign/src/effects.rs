//! How much of a metric's variance one varied quantity explains, and how the metric's mean goes with it.
//!
//! The first-order index of Sobol, S = Var(E[y | x]) / Var(y), is estimated from the runs that there are: they are put into groups
//! by x, and the variance between the groups' means is compared with that of all. It needs no design of its own (as Saltelli's does,
//! with d + 2 runs a point), only inputs that are independent, which all designs here have. By chance alone k groups of n runs explain
//! (k−1)/(n−1) of the variance; that is taken off (ε², Kelley 1935; for such bins see Plischke, RESS 95 (2010) 354).
//! In a full grid the groups are balanced over all other quantities, and nothing is taken off.

use std::collections::BTreeMap;

/// A number with at most so many values is taken value by value.
const MOST_LEVELS: usize = 12;
/// Runs of a group of a number with more values, at least.
const LEAST_RUNS: usize = 8;
/// Fewer groups than this show no course.
const LEAST_GROUPS: usize = 3;
/// More than this show nothing but scatter.
const MOST_GROUPS: usize = 16;

/// Runs with like values of a quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Their value: the mean of a number, or a word.
    pub x: Result<f64, String>,
    /// How many there are.
    pub runs: usize,
    /// The metric's mean.
    pub mean: f64,
}

/// What a quantity does to a metric.
#[derive(Debug, Clone, PartialEq)]
pub struct Influence {
    /// Runs with like values, in the order of the value.
    pub groups: Vec<Group>,
    /// The first-order index, 0 to 1; `None` where there are too few runs, or the metric is the same in all.
    pub first_order: Option<f64>,
}

/// The influence of a quantity (numbers or words) on a metric, over runs of which both are known. `balanced`: the runs are a full grid.
pub fn influence(x: &[Result<f64, String>], y: &[f64], balanced: bool) -> Influence {
    let known: Vec<(&Result<f64, String>, f64)> =
        x.iter().zip(y.iter().copied()).filter(|(x, y)| y.is_finite() && *x != &Ok(f64::NAN)).collect();
    let members = grouped(&known);
    let ys: Vec<f64> = known.iter().map(|(_, y)| *y).collect();
    let first_order = first_order(&ys, &members, balanced);
    let groups = members.into_iter().map(|(x, ys)| Group { x, runs: ys.len(), mean: mean(&ys) }).collect();
    Influence { groups, first_order }
}

type Members = Vec<(Result<f64, String>, Vec<f64>)>;

fn grouped(known: &[(&Result<f64, String>, f64)]) -> Members {
    let mut words: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    let mut numbers: Vec<(f64, f64)> = Vec::new();
    for (x, y) in known {
        match x {
            Err(word) => words.entry(word).or_default().push(*y),
            Ok(number) => numbers.push((*number, *y)),
        }
    }
    numbers.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut groups: Members = numeric(&numbers);
    groups.extend(words.into_iter().map(|(word, ys)| (Err(word.to_owned()), ys)));
    groups
}

/// By value where there are few, else in groups of equally many.
fn numeric(sorted: &[(f64, f64)]) -> Members {
    let levels: Vec<&[(f64, f64)]> = sorted.chunk_by(|a, b| a.0 == b.0).collect();
    let parts: Vec<&[(f64, f64)]> = if levels.len() <= MOST_LEVELS {
        levels
    } else {
        let groups = (sorted.len() / LEAST_RUNS).min(MOST_GROUPS);
        if groups < LEAST_GROUPS {
            return Vec::new();
        }
        let at = |group: usize| group * sorted.len() / groups;
        (0..groups).filter_map(|group| sorted.get(at(group)..at(group + 1))).collect()
    };
    let group = |part: &[(f64, f64)]| {
        let (x, y): (Vec<f64>, Vec<f64>) = part.iter().copied().unzip();
        (Ok(mean(&x)), y)
    };
    parts.into_iter().map(group).collect()
}

fn first_order(all: &[f64], groups: &Members, balanced: bool) -> Option<f64> {
    let (n, k) = (all.len() as f64, groups.len() as f64);
    let grand = mean(all);
    let total: f64 = all.iter().map(|y| (y - grand).powi(2)).sum();
    // A metric that is the same in all runs but for rounding has no variance to share out.
    let scale = all.iter().fold(0.0, |most: f64, y| most.max(y.abs()));
    let is_same = total <= n * (scale * 1e-12).powi(2);
    if groups.len() < 2 || n <= k || is_same {
        return None;
    }
    let between: f64 = groups.iter().map(|(_, ys)| ys.len() as f64 * (mean(ys) - grand).powi(2)).sum();
    let by_chance = if balanced { 0.0 } else { (k - 1.0) * (total - between) / (n - k) };
    Some(((between - by_chance) / total).clamp(0.0, 1.0))
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

    fn numbers(values: impl Iterator<Item = f64>) -> Vec<Result<f64, String>> {
        values.map(Ok).collect()
    }

    /// Ishigami's function, whose indices are known: 0.3139, 0.4424 and 0 (a = 7, b = 0.1).
    #[test]
    fn ishigami_s_indices() {
        for kind in [DesignKind::Random, DesignKind::LatinHypercube, DesignKind::Sobol] {
            let design = Points::new(kind, 3, 4096, 3);
            let points: Vec<Vec<f64>> = (0..4096)
                .map(|point| design.at(point, 3).iter().map(|unit| PI * (2.0 * unit - 1.0)).collect())
                .collect();
            let y: Vec<f64> = points
                .iter()
                .map(|x| x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin())
                .collect();
            for (quantity, expected) in [0.3139, 0.4424, 0.0].into_iter().enumerate() {
                let x = numbers(points.iter().map(|point| point[quantity]));
                let found = influence(&x, &y, false).first_order.unwrap();
                assert!(
                    (found - expected).abs() < 0.03,
                    "{kind:?}, {quantity}: {found}, {expected} is right"
                );
            }
        }
    }

    #[test]
    fn chance_explains_nothing() {
        let design = Points::new(DesignKind::Random, 11, 400, 2);
        let points: Vec<Vec<f64>> = (0..400).map(|point| design.at(point, 2)).collect();
        let y: Vec<f64> = points.iter().map(|point| point[1]).collect();
        let found = influence(&numbers(points.iter().map(|point| point[0])), &y, false);
        assert!(found.first_order.unwrap() < 0.05, "{:?}", found.first_order);
        assert_eq!(found.groups.len(), MOST_GROUPS);
    }

    #[test]
    fn a_grid_s_shares_are_exact() {
        // y = x1 + 2·x2 on a grid of 3 by 3: the variances are 1 to 4.
        let grid: Vec<(f64, f64)> = (0..9).map(|k| (f64::from(k % 3), f64::from(k / 3))).collect();
        let y: Vec<f64> = grid.iter().map(|(a, b)| a + 2.0 * b).collect();
        let share = |x: Vec<Result<f64, String>>| influence(&x, &y, true).first_order.unwrap();
        assert!((share(numbers(grid.iter().map(|of| of.0))) - 0.2).abs() < 1e-12);
        let words = grid.iter().map(|of| Err(format!("level {}", of.1))).collect();
        assert!((share(words) - 0.8).abs() < 1e-12);
    }

    #[test]
    fn too_few_or_the_same_have_no_index() {
        let x = numbers((0..20).map(f64::from));
        assert_eq!(influence(&x, &[1.0; 20], false).first_order, None);
        let y: Vec<f64> = (0..20).map(f64::from).collect();
        assert_eq!(influence(&x, &y, false).first_order, None, "20 values, no two alike");
        assert_eq!(influence(&[], &[], false).groups, []);
    }
}
