//! The smoothest curve through samples: minimises Σ(y − x)² + Σ λ_k·(D³x)_k², D³ the third divided difference.
//!
//! A banded system of seven diagonals, factored as L·D·Lᵀ. It is solved for the correction x − y: that stays small
//! however large the angles are, and with it the rounding error at strong smoothing.

/// Number of samples that a third difference spans.
const SPAN: usize = 4;

/// The third differences of a grid of times, in units of rad at an even grid.
#[derive(Debug, Default)]
pub(crate) struct Differences {
    rows: Vec<[f64; SPAN]>,
}

/// Work space of the factorisation.
#[derive(Debug, Default)]
pub(crate) struct Solver {
    pivots: Vec<[f64; SPAN]>,
    solution: Vec<f64>,
}

impl Differences {
    /// Sets up the grid; `step_s` is its usual distance.
    pub fn set(&mut self, time_s: &[f64], step_s: f64) {
        self.rows.clear();
        self.rows.extend(time_s.windows(SPAN).map(|times| weights(times, step_s)));
    }
}

fn weights(times: &[f64], step_s: f64) -> [f64; SPAN] {
    let mut weights = [0.0; SPAN];
    for (index, weight) in weights.iter_mut().enumerate() {
        let own = times.get(index).copied().unwrap_or(0.0);
        let product: f64 = times
            .iter()
            .enumerate()
            .filter(|other| other.0 != index)
            .map(|other| (own - other.1) / step_s)
            .product();
        *weight = 6.0 / product;
    }
    weights
}

impl Solver {
    /// The correction x − y for the penalties λ (one for each third difference).
    pub fn correction(&mut self, differences: &Differences, penalties: &[f64], values: &[f64]) -> &[f64] {
        self.solve(differences.rows.iter().zip(penalties.iter().copied()), values)
    }

    /// The same for one penalty throughout, of `values` that begin at the grid's sample `first`.
    pub fn even_correction(
        &mut self,
        differences: &Differences,
        first: usize,
        penalty: f64,
        values: &[f64],
    ) -> &[f64] {
        let rows = differences.rows.iter().skip(first).take(values.len() + 1 - SPAN);
        self.solve(rows.map(|row| (row, penalty)), values)
    }

    #[allow(
        clippy::indexing_slicing,
        reason = "bands at fixed offsets, bounded by the loops; in the innermost loop"
    )]
    fn solve<'a>(&mut self, rows: impl Iterator<Item = (&'a [f64; SPAN], f64)>, values: &[f64]) -> &[f64] {
        let count = values.len();
        self.pivots.clear();
        self.pivots.resize(count, [1.0, 0.0, 0.0, 0.0]);
        self.solution.clear();
        self.solution.resize(count, 0.0);
        // I + DᵀΛD by its upper bands, and −DᵀΛDy.
        for (k, ((row, penalty), near)) in rows.zip(values.windows(SPAN)).enumerate() {
            let third: f64 = row.iter().zip(near).map(|(weight, value)| weight * value).sum();
            for i in 0..SPAN {
                let weighted = penalty * row[i];
                for (band, other) in row[i..].iter().enumerate() {
                    self.pivots[k + i][band] += weighted * other;
                }
                self.solution[k + i] -= weighted * third;
            }
        }
        self.factor_and_solve();
        &self.solution
    }

    #[allow(
        clippy::indexing_slicing,
        reason = "bands at fixed offsets, bounded by the loops; in the innermost loop"
    )]
    fn factor_and_solve(&mut self) {
        let count = self.solution.len();
        let (pivots, solution) = (&mut self.pivots, &mut self.solution);
        for k in 0..count {
            let [pivot, a, b, c] = pivots[k];
            let per_pivot = 1.0 / pivot;
            let (la, lb, lc) = (a * per_pivot, b * per_pivot, c * per_pivot);
            pivots[k] = [per_pivot, la, lb, lc];
            let right = solution[k];
            if k + 3 < count {
                pivots[k + 3][0] -= lc * c;
                solution[k + 3] -= lc * right;
            }
            if k + 2 < count {
                pivots[k + 2][0] -= lb * b;
                pivots[k + 2][1] -= lb * c;
                solution[k + 2] -= lb * right;
            }
            if k + 1 < count {
                pivots[k + 1][0] -= la * a;
                pivots[k + 1][1] -= la * b;
                pivots[k + 1][2] -= la * c;
                solution[k + 1] -= la * right;
            }
        }
        let (mut one, mut two, mut three) = (0.0, 0.0, 0.0);
        for k in (0..count).rev() {
            let [per_pivot, la, lb, lc] = pivots[k];
            let value = solution[k] * per_pivot - la * one - lb * two - lc * three;
            solution[k] = value;
            (three, two, one) = (two, one, value);
        }
    }
}
