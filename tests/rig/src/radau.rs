//! Radau IIA of order 5 (three stages) with step control, after Hairer and Wanner, Solving Ordinary Differential
//! Equations II, IV.8: stiff equations to high accuracy, the whole stage system solved by simplified Newton.

const STAGES: usize = 3;

/// A right-hand side: time, state, and where its rates go.
pub(crate) type Rates<'a> = dyn FnMut(f64, &[f64], &mut [f64]) + 'a;

/// The integrator's memory between calls: its next step and its arrays.
#[derive(Debug, Clone)]
pub(crate) struct Radau {
    size: usize,
    absolute: Vec<f64>,
    relative: f64,
    next_s: f64,
    jacobian: Vec<f64>,
    stages: Vec<f64>,
    stage_lu: Lu,
    error_lu: Lu,
    work: Vec<Vec<f64>>,
}

/// A dense matrix, decomposed.
#[derive(Debug, Clone, Default)]
struct Lu {
    size: usize,
    entries: Vec<f64>,
    pivots: Vec<usize>,
}

struct Tableau {
    nodes: [f64; STAGES],
    weights: [[f64; STAGES]; STAGES],
    error: [f64; STAGES],
    gamma: f64,
}

fn tableau() -> Tableau {
    let s = 6f64.sqrt();
    let gamma = 0.274_888_829_595_676_7;
    Tableau {
        nodes: [(4.0 - s) / 10.0, (4.0 + s) / 10.0, 1.0],
        weights: [
            [(88.0 - 7.0 * s) / 360.0, (296.0 - 169.0 * s) / 1800.0, (-2.0 + 3.0 * s) / 225.0],
            [(296.0 + 169.0 * s) / 1800.0, (88.0 + 7.0 * s) / 360.0, (-2.0 - 3.0 * s) / 225.0],
            [(16.0 - s) / 36.0, (16.0 + s) / 36.0, 1.0 / 9.0],
        ],
        error: [-13.0 - 7.0 * s, -13.0 + 7.0 * s, -1.0].map(|e| e * gamma / 3.0),
        gamma,
    }
}

impl Lu {
    fn decompose(&mut self) {
        let n = self.size;
        self.pivots.clear();
        for k in 0..n {
            let pivot = (k..n)
                .max_by(|a, b| self.entries[a * n + k].abs().total_cmp(&self.entries[b * n + k].abs()))
                .unwrap();
            self.pivots.push(pivot);
            if pivot != k {
                (0..n).for_each(|c| self.entries.swap(k * n + c, pivot * n + c));
            }
            let per = 1.0 / self.entries[k * n + k];
            for r in k + 1..n {
                let factor = self.entries[r * n + k] * per;
                self.entries[r * n + k] = factor;
                if factor != 0.0 {
                    for c in k + 1..n {
                        self.entries[r * n + c] -= factor * self.entries[k * n + c];
                    }
                }
            }
        }
    }

    fn solve(&self, right: &mut [f64]) {
        let n = self.size;
        for (k, &pivot) in self.pivots.iter().enumerate() {
            right.swap(k, pivot);
        }
        for r in 0..n {
            for c in 0..r {
                right[r] -= self.entries[r * n + c] * right[c];
            }
        }
        for r in (0..n).rev() {
            for c in r + 1..n {
                right[r] -= self.entries[r * n + c] * right[c];
            }
            right[r] /= self.entries[r * n + r];
        }
    }
}

impl Radau {
    /// For states with the given absolute tolerances, and one relative.
    pub fn new(absolute: Vec<f64>, relative: f64) -> Self {
        let n = absolute.len();
        let lu = |size: usize| Lu { size, entries: vec![0.0; size * size], pivots: Vec::new() };
        Self {
            size: n,
            absolute,
            relative,
            next_s: 1e-5,
            jacobian: vec![0.0; n * n],
            stages: vec![0.0; STAGES * n],
            stage_lu: lu(STAGES * n),
            error_lu: lu(n),
            work: vec![vec![0.0; n]; 5],
        }
    }

    /// Takes `y` from `from_s` to `to_s`.
    pub fn integrate(&mut self, rates: &mut Rates<'_>, from_s: f64, to_s: f64, y: &mut [f64]) {
        let table = tableau();
        let mut time_s = from_s;
        let mut begun = vec![0.0; self.size];
        let mut fresh = false;
        while to_s - time_s > 1e-12 * to_s.abs().max(1.0) {
            let wanted = self.next_s;
            let last = wanted >= 0.999 * (to_s - time_s);
            let step_s = if last { to_s - time_s } else { wanted };
            assert!(step_s > 1e-13, "the rig's integrator stands still at {time_s} s: {y:?}");
            if !fresh {
                rates(time_s, y, &mut begun);
                self.differentiate(rates, time_s, y, &begun);
                fresh = true;
            }
            let newton = self.newton(rates, &table, time_s, step_s, y);
            let error = if newton { self.error(rates, &table, time_s, step_s, y, &begun) } else { f64::NAN };
            if error < 1.0 {
                for (k, value) in y.iter_mut().enumerate() {
                    *value += self.stages[2 * self.size + k];
                }
                time_s = if last { to_s } else { time_s + step_s };
                fresh = false;
            }
            let change =
                if error.is_nan() { 0.25 } else { (0.9 * error.max(1e-8).powf(-0.25)).clamp(0.1, 5.0) };
            // A step cut short by the end says little about the next one.
            self.next_s = if last && error < 1.0 { wanted.max(step_s * change) } else { step_s * change };
        }
    }

    fn differentiate(&mut self, rates: &mut Rates<'_>, time_s: f64, y: &[f64], begun: &[f64]) {
        let n = self.size;
        let mut shifted = y.to_vec();
        for c in 0..n {
            let delta = (1e-7 * y[c].abs()).max(10.0 * self.absolute[c]).max(1e-12);
            shifted[c] += delta;
            rates(time_s, &shifted, &mut self.work[0]);
            shifted[c] = y[c];
            for (r, (shifted_rate, rate)) in self.work[0].iter().zip(begun).enumerate() {
                self.jacobian[r * n + c] = (shifted_rate - rate) / delta;
            }
        }
    }

    /// Solves for the stages; whether that converged.
    fn newton(
        &mut self,
        rates: &mut Rates<'_>,
        table: &Tableau,
        time_s: f64,
        step_s: f64,
        y: &[f64],
    ) -> bool {
        let (n, full) = (self.size, STAGES * self.size);
        for (i, row) in table.weights.iter().enumerate() {
            for (j, weight) in row.iter().enumerate() {
                for r in 0..n {
                    for c in 0..n {
                        let unit = if i == j && r == c { 1.0 } else { 0.0 };
                        self.stage_lu.entries[(i * n + r) * full + j * n + c] =
                            unit - step_s * weight * self.jacobian[r * n + c];
                    }
                }
            }
        }
        self.stage_lu.decompose();
        self.stages.fill(0.0);
        let mut right = vec![0.0; full];
        let (mut before, mut point) = (f64::INFINITY, vec![0.0; n]);
        for iteration in 0..12 {
            for j in 0..STAGES {
                (0..n).for_each(|k| point[k] = y[k] + self.stages[j * n + k]);
                let (work, nodes) = (&mut self.work[1 + j], table.nodes[j]);
                rates(time_s + nodes * step_s, &point, work);
            }
            for (i, row) in table.weights.iter().enumerate() {
                for k in 0..n {
                    let sum: f64 = (0..STAGES).map(|j| row[j] * self.work[1 + j][k]).sum();
                    right[i * n + k] = step_s * sum - self.stages[i * n + k];
                }
            }
            self.stage_lu.solve(&mut right);
            let mut size = 0f64;
            for (k, change) in right.iter().enumerate() {
                self.stages[k] += change;
                size = size.max(change.abs() / self.scale(k % n, y[k % n]));
            }
            if !size.is_finite() || (iteration > 2 && size > before) {
                return size < 1e-3;
            }
            if size < 1e-3 {
                return true;
            }
            before = size;
        }
        false
    }

    fn scale(&self, k: usize, y: f64) -> f64 {
        self.absolute[k] + self.relative * y.abs()
    }

    /// The step's error over the tolerance.
    fn error(
        &mut self,
        rates: &mut Rates<'_>,
        table: &Tableau,
        time_s: f64,
        step_s: f64,
        y: &[f64],
        begun: &[f64],
    ) -> f64 {
        let n = self.size;
        for r in 0..n {
            for c in 0..n {
                let unit = if r == c { 1.0 } else { 0.0 };
                self.error_lu.entries[r * n + c] = unit - step_s * table.gamma * self.jacobian[r * n + c];
            }
        }
        self.error_lu.decompose();
        let estimate = |lu: &Lu, stages: &[f64], rate: &[f64]| {
            let mut error: Vec<f64> = (0..n)
                .map(|k| {
                    let sum: f64 = (0..STAGES).map(|i| table.error[i] * stages[i * n + k]).sum();
                    step_s * table.gamma * rate[k] + sum
                })
                .collect();
            lu.solve(&mut error);
            error
        };
        let mut error = estimate(&self.error_lu, &self.stages, begun);
        let size = |error: &[f64]| {
            (0..n)
                .map(|k| (error[k] / self.scale(k, y[k])).abs())
                .fold(0.0, |a: f64, b| if b.is_nan() { b } else { a.max(b) })
        };
        let mut found = size(&error);
        if found >= 1.0 {
            // Once more, filtered: for stiff components the first estimate is too large.
            let point: Vec<f64> = (0..n).map(|k| y[k] + error[k]).collect();
            let mut rate = vec![0.0; n];
            rates(time_s, &point, &mut rate);
            error = estimate(&self.error_lu, &self.stages, &rate);
            found = size(&error);
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn van_der_pol_agrees_with_the_known_solution() {
        // µ = 1000 in fast time at t = 1, ε = 1e-6: the book's problem and its reference values at x = 1.
        let mut rates = |_: f64, y: &[f64], out: &mut [f64]| {
            out[0] = y[1];
            out[1] = ((1.0 - y[0] * y[0]) * y[1] - y[0]) * 1e6;
        };
        let mut y = [2.0, -0.66];
        let mut radau = Radau::new(vec![1e-9, 1e-9], 1e-9);
        for k in 0..10 {
            radau.integrate(&mut rates, 0.1 * f64::from(k), 0.1 * f64::from(k + 1), &mut y);
        }
        assert!((y[0] + 1.863_646_254_808_130_3).abs() < 1e-6, "{y:?}");
        assert!((y[1] - 0.753_543_086_543_546).abs() < 1e-6, "{y:?}");
    }

    #[test]
    fn an_oscillator_keeps_its_energy() {
        let mut rates = |_: f64, y: &[f64], out: &mut [f64]| {
            out[0] = y[1];
            out[1] = -1e4 * y[0];
        };
        let mut y = [1.0, 0.0];
        Radau::new(vec![1e-10, 1e-8], 1e-10).integrate(&mut rates, 0.0, 1.0, &mut y);
        assert!((y[0] - 100f64.cos()).abs() < 1e-6, "{y:?}");
    }
}
