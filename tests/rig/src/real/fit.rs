//! Least squares with bounds: how much of a change of the measurement other changes can stand for.

/// Columns of the same samples, run by run, with the bounds of their coefficients.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    /// Column, run, sample.
    pub values: Vec<Vec<Vec<f64>>>,
    /// The coefficient's largest magnitude.
    pub bounds: Vec<f64>,
}

/// What no combination of some columns can stand for.
pub struct Left {
    /// Over σ, RMS over the runs where it acts.
    pub seen: f64,
    /// In runs of those numbers.
    pub acts_in: Vec<usize>,
    /// The weighted sum of squares over all runs.
    pub square: f64,
    /// The coefficients, in the order of the columns asked for.
    pub coefficients: Vec<f64>,
}

/// A run counts where its mean square is this part of the largest, or more: as in the exact family.
const ACTS: f64 = 0.25 * 0.25;
const SWEEPS: usize = 400;

/// The normal equations of all columns, a change to be explained last.
pub struct Normal<'a> {
    columns: &'a Columns,
    change: &'a [Vec<f64>],
    weights: &'a [Vec<f64>],
    gram: Vec<Vec<f64>>,
    right: Vec<f64>,
}

fn product(a: &[Vec<f64>], b: &[Vec<f64>], weights: &[Vec<f64>]) -> f64 {
    let run = |((a, b), w): ((&Vec<f64>, &Vec<f64>), &Vec<f64>)| -> f64 {
        if a.is_empty() || b.is_empty() {
            return 0.0;
        }
        a.iter().zip(b).zip(w).map(|((a, b), w)| a * b * w).sum()
    };
    a.iter().zip(b).zip(weights).map(run).sum()
}

impl<'a> Normal<'a> {
    /// Columns, a change of the same runs and samples, and each sample's weight.
    pub fn new(columns: &'a Columns, change: &'a [Vec<f64>], weights: &'a [Vec<f64>]) -> Self {
        let all = &columns.values;
        let mut gram = vec![vec![0.0; all.len()]; all.len()];
        for i in 0..all.len() {
            for j in 0..=i {
                gram[i][j] = product(&all[i], &all[j], weights);
                gram[j][i] = gram[i][j];
            }
        }
        let right = all.iter().map(|column| product(column, change, weights)).collect();
        Self { columns, change, weights, gram, right }
    }

    /// What is left of the change beside the best of some columns, by their numbers.
    pub fn left(&self, which: &[usize]) -> Left {
        let mut found = vec![0.0; which.len()];
        for _ in 0..SWEEPS {
            for (at, &i) in which.iter().enumerate() {
                let diagonal = self.gram[i][i];
                if diagonal <= 0.0 {
                    continue;
                }
                let others: f64 = which
                    .iter()
                    .zip(&found)
                    .enumerate()
                    .filter(|(other, _)| *other != at)
                    .map(|(_, (&j, value))| self.gram[i][j] * value)
                    .sum();
                let bound = self.columns.bounds[i];
                found[at] = ((self.right[i] - others) / diagonal).clamp(-bound, bound);
            }
        }
        let mut squares = Vec::with_capacity(self.change.len());
        for (run, change) in self.change.iter().enumerate() {
            let mut rest = change.clone();
            for (&column, value) in which.iter().zip(&found) {
                let column = &self.columns.values[column][run];
                rest.iter_mut().zip(column).for_each(|(rest, column)| *rest -= value * column);
            }
            let square: f64 = rest.iter().zip(&self.weights[run]).map(|(rest, w)| rest * rest * w).sum();
            squares.push((square, change.len()));
        }
        let mean = |(square, count): &(f64, usize)| square / (*count).max(1) as f64;
        let largest = squares.iter().map(mean).fold(0.0, f64::max);
        let acts_in: Vec<usize> =
            (0..squares.len()).filter(|run| mean(&squares[*run]) >= ACTS * largest).collect();
        let (sum, count) = acts_in
            .iter()
            .fold((0.0, 0), |(sum, count), run| (sum + squares[*run].0, count + squares[*run].1));
        Left {
            seen: (sum / count.max(1) as f64).sqrt(),
            acts_in,
            square: squares.iter().map(|(square, _)| square).sum(),
            coefficients: found,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two runs of 200 samples: a wave, a line, and their sum.
    fn columns() -> (Columns, Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let run = |value: &dyn Fn(f64) -> f64| (0..200).map(|k| value(f64::from(k) / 200.0)).collect();
        let both = |value: &dyn Fn(f64) -> f64| vec![run(value), run(&|x| value(x + 0.3))];
        let (wave, line) = (both(&|x| (40.0 * x).sin()), both(&|x| x));
        let change = both(&|x| 2.0 * (40.0 * x).sin() + 0.5 * x);
        let columns = Columns { values: vec![wave, line], bounds: vec![f64::INFINITY, f64::INFINITY] };
        (columns, change, vec![vec![1.0; 200]; 2])
    }

    #[test]
    fn a_sum_of_columns_leaves_nothing() {
        let (columns, change, weights) = columns();
        let normal = Normal::new(&columns, &change, &weights);
        assert!(normal.left(&[0, 1]).seen < 1e-6);
        let alone = normal.left(&[1]);
        assert!((alone.seen - 2f64.sqrt()).abs() < 0.1, "the wave of amplitude 2 is left: {}", alone.seen);
        assert_eq!(alone.acts_in, [0, 1]);
    }

    #[test]
    fn a_coefficient_stays_within_its_bound() {
        let (mut columns, change, weights) = columns();
        columns.bounds[0] = 1.5;
        let left = Normal::new(&columns, &change, &weights).left(&[0, 1]).seen;
        assert!((left - 0.5 / 2f64.sqrt()).abs() < 0.02, "half a wave is left: {left}");
    }

    #[test]
    fn a_column_that_is_in_one_run_alone_acts_there() {
        let (mut columns, change, weights) = columns();
        columns.values[0][1].clear();
        assert_eq!(Normal::new(&columns, &change, &weights).left(&[0, 1]).acts_in, [1]);
    }
}
