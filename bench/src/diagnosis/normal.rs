//! Normal equations of the library's terms, and what a regression on some of them leaves.

use super::library::{CAUSES, Terms};
use nalgebra::{DMatrix, DVector};

/// Samples that count as one: residuals of neighbours are alike.
pub const ALIKE: f64 = 20.0;

/// Normal equations of some runs.
pub struct Normal {
    /// Products of terms.
    pub gram: DMatrix<f64>,
    /// Products of terms and the residual.
    pub right: DVector<f64>,
    /// The residual's sum of squares.
    pub square: f64,
    /// Samples.
    pub count: f64,
}

impl Normal {
    /// Of the runs that are wanted.
    pub fn of(runs: &[Terms], wanted: impl Fn(usize) -> bool) -> Self {
        let size: usize = CAUSES.iter().map(|(_, terms)| terms).sum();
        let mut normal =
            Self { gram: DMatrix::zeros(size, size), right: DVector::zeros(size), square: 0.0, count: 0.0 };
        for run in runs.iter().enumerate().filter(|(index, _)| wanted(*index)).map(|(_, run)| run) {
            let rows = run.rows.len();
            let matrix = DMatrix::from_row_iterator(rows, size, run.rows.iter().flatten().copied());
            let residual = DVector::from_column_slice(&run.residual);
            normal.gram += matrix.tr_mul(&matrix);
            normal.right += matrix.tr_mul(&residual);
            normal.square += residual.norm_squared();
            normal.count += rows as f64;
        }
        normal
    }

    /// The sum of squares of `judged` with coefficients fitted on these.
    pub fn held_out(&self, judged: &Self, columns: &[usize]) -> f64 {
        if columns.is_empty() {
            return judged.square;
        }
        let Some(weights) = self.solved(columns) else { return judged.square };
        let gram = judged.gram.select_rows(columns).select_columns(columns);
        judged.square - 2.0 * weights.dot(&judged.right.select_rows(columns))
            + weights.dot(&(gram * &weights))
    }

    /// The coefficients of some columns.
    pub fn solved(&self, columns: &[usize]) -> Option<DVector<f64>> {
        let mut matrix = self.gram.select_rows(columns).select_columns(columns);
        // Columns to the same size, and a touch of ridge against those that say the same.
        let scale = matrix.diagonal().map(|value| 1.0 / value.max(1e-300).sqrt());
        matrix = DMatrix::from_diagonal(&scale) * matrix * DMatrix::from_diagonal(&scale);
        matrix += DMatrix::identity(columns.len(), columns.len()) * 1e-9;
        let right = self.right.select_rows(columns);
        Some(matrix.cholesky()?.solve(&right.component_mul(&scale)).component_mul(&scale))
    }
}

/// The columns of these causes' terms.
pub fn columns(causes: &[usize]) -> Vec<usize> {
    let begins: Vec<usize> = CAUSES
        .iter()
        .scan(0, |next, (_, terms)| {
            let begin = *next;
            *next += terms;
            Some(begin)
        })
        .collect();
    let of = |cause: &usize| {
        let begin = begins.get(*cause).copied().unwrap_or(0);
        begin..begin + CAUSES.get(*cause).map_or(0, |(_, terms)| *terms)
    };
    causes.iter().flat_map(of).collect()
}
