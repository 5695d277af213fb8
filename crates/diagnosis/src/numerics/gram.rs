//! Normal equations by group of samples: all that least squares, cross-validation over groups and the jackknife need.
//!
//! Of a piece's columns X (sensitivities, the residual last) only XᵀX is kept. Least squares, leave-groups-out and the
//! jackknife are then small linear algebra.
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use nalgebra::{Cholesky, DMatrix, DVector};

/// XᵀX of one group: rows and columns 0.. are sensitivities, the last one is the residual.
#[derive(Debug, Clone)]
pub(crate) struct Gram {
    pub matrix: DMatrix<f64>,
    /// Effective number of independent samples.
    pub count: f64,
}

impl Gram {
    pub fn zero(columns: usize) -> Self {
        Self { matrix: DMatrix::zeros(columns + 1, columns + 1), count: 0.0 }
    }

    /// Eliminates the nuisance columns, the first `ridges.len()` of `all` (Schur complement). A ridge is the 1/variance of a
    /// column's prior.
    pub fn without_nuisances(all: &DMatrix<f64>, ridges: &[f64], count: f64) -> Self {
        let nuisances = ridges.len();
        let kept = all.nrows() - nuisances;
        let mut inner = all.view((0, 0), (nuisances, nuisances)).into_owned();
        for (index, ridge) in ridges.iter().enumerate() {
            // Keeps the matrix invertible if a nuisance column is zero.
            inner[(index, index)] += ridge + 1e-12 * inner[(index, index)] + f64::MIN_POSITIVE.sqrt();
        }
        let cross = all.view((0, nuisances), (nuisances, kept)).into_owned();
        let mut matrix = all.view((nuisances, nuisances), (kept, kept)).into_owned();
        if nuisances > 0
            && let Some(factor) = Cholesky::new(inner)
        {
            matrix -= cross.transpose() * factor.solve(&cross);
        }
        Self { matrix, count }
    }

    pub fn add(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.count += other.count;
    }

    /// All products times a weight; the count stays.
    pub fn times(&self, weight: f64) -> Self {
        Self { matrix: weight * &self.matrix, count: self.count }
    }

    /// Sum of squares of the residual before any column is fitted.
    pub fn square(&self) -> f64 {
        let last = self.matrix.nrows() - 1;
        self.matrix[(last, last)].max(0.0)
    }

    /// The normal equations of some columns: A and b of A·β = b.
    pub fn part(&self, columns: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
        let last = self.matrix.nrows() - 1;
        let count = columns.len();
        let at = |index: usize| columns.get(index).copied().unwrap_or(last);
        let a = DMatrix::from_fn(count, count, |i, j| self.matrix[(at(i), at(j))]);
        let b = DVector::from_fn(count, |i, _| self.matrix[(at(i), last)]);
        (a, b)
    }

    /// Sum of squares of the residual minus the columns times β.
    pub fn square_after(&self, columns: &[usize], beta: &DVector<f64>) -> f64 {
        let (a, b) = self.part(columns);
        (self.square() - 2.0 * beta.dot(&b) + beta.dot(&(a * beta))).max(0.0)
    }
}

/// Least squares: β, and the inverse of A.
pub(crate) fn solve(gram: &Gram, columns: &[usize]) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let (a, b) = gram.part(columns);
    invert(a).map(|inverse| (&inverse * b, inverse))
}

/// The inverse of a symmetric positive definite matrix, scaled to a unit diagonal first. A small ridge shares the effect of
/// nearly dependent columns among them.
pub(crate) fn invert(mut a: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = DVector::from_fn(a.nrows(), |i, _| {
        let size = a[(i, i)];
        if size > 0.0 { 1.0 / size.sqrt() } else { 0.0 }
    });
    for i in 0..a.nrows() {
        for j in 0..a.ncols() {
            a[(i, j)] *= scale[i] * scale[j];
        }
        a[(i, i)] += if scale[i] == 0.0 { 1.0 } else { 1e-9 };
    }
    let mut inverse = Cholesky::new(a)?.inverse();
    for i in 0..inverse.nrows() {
        for j in 0..inverse.ncols() {
            inverse[(i, j)] *= scale[i] * scale[j];
        }
    }
    Some(inverse)
}

/// The residual on groups that β was not fitted on.
#[derive(Debug, Clone)]
pub(crate) struct HeldOut {
    /// Sum of squares by group.
    pub squares: Vec<f64>,
}

impl HeldOut {
    pub fn total(&self) -> f64 {
        self.squares.iter().sum()
    }

    /// Square and count of each group.
    pub fn each(&self, groups: &[Gram]) -> impl Iterator<Item = (f64, f64)> {
        self.squares.iter().zip(groups).map(|(square, group)| (*square, group.count))
    }
}

/// Cross-validation: for each fold, β is fitted to the `fitted` equations of the other folds, and the sums of squares of the
/// fold's `groups` are taken at that β. `fold_of` gives each group's fold; `None` if a system can't be solved.
pub(crate) fn leave_out(
    fitted: &[Gram],
    groups: &[Gram],
    fold_of: &[usize],
    columns: &[usize],
) -> Option<HeldOut> {
    let width = groups.first()?.matrix.nrows() - 1;
    if columns.is_empty() {
        return Some(HeldOut { squares: groups.iter().map(Gram::square).collect() });
    }
    let mut all = Gram::zero(width);
    fitted.iter().for_each(|group| all.add(group));
    let (a_all, b_all) = all.part(columns);
    let folds = fold_of.iter().copied().max().map_or(0, |most| most + 1);
    let mut squares = vec![0.0; groups.len()];
    for fold in 0..folds {
        let (mut a, mut b) = (a_all.clone(), b_all.clone());
        for (group, _) in fitted.iter().zip(fold_of).filter(|(_, of)| **of == fold) {
            let (own_a, own_b) = group.part(columns);
            a -= own_a;
            b -= own_b;
        }
        // The ridge keeps a column near zero that only the left-out fold determines.
        for i in 0..a.nrows() {
            a[(i, i)] += 1e-6 * a_all[(i, i)];
        }
        let beta = invert(a)? * b;
        let members = groups.iter().zip(fold_of).zip(&mut squares).filter(|((_, of), _)| **of == fold);
        for ((group, _), square) in members {
            *square = group.square_after(columns, &beta);
        }
    }
    Some(HeldOut { squares })
}
