//! A straight line through weighted points, and how likely its slope is by chance.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// A point and its weight.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weighted {
    pub weight: f64,
    pub x: f64,
    pub y: f64,
}

/// The least-squares line of y on x.
pub(crate) struct Line {
    mean: (f64, f64),
    slope: f64,
    /// The share of y's variance that it explains (R²).
    pub accounts: f64,
    /// The p-value of the slope, by Student's t with n − 2 degrees of freedom for n points.
    pub p_value: f64,
}

impl Line {
    /// `None` where x or y is the same throughout.
    pub fn through(points: &[Weighted]) -> Option<Self> {
        let (weights, x, y) = points.iter().fold((0.0, 0.0, 0.0), |(weights, x, y), point| {
            (weights + point.weight, x + point.weight * point.x, y + point.weight * point.y)
        });
        let mean = (x / weights, y / weights);
        let (xx, xy, yy) = points.iter().fold((0.0, 0.0, 0.0), |(xx, xy, yy), point| {
            let (x, y) = (point.x - mean.0, point.y - mean.1);
            (xx + point.weight * x * x, xy + point.weight * x * y, yy + point.weight * y * y)
        });
        if xx <= 0.0 || yy <= 0.0 {
            return None;
        }
        let accounts = (xy * xy / (xx * yy)).min(1.0);
        let freedom = points.len() as f64 - 2.0;
        let t = (accounts * freedom / (1.0 - accounts).max(1e-12)).sqrt();
        let p_value = StudentsT::new(0.0, 1.0, freedom).map_or(1.0, |of| 2.0 * (1.0 - of.cdf(t)));
        Some(Self { mean, slope: xy / xx, accounts, p_value })
    }

    pub fn at(&self, x: f64) -> f64 {
        self.mean.1 + self.slope * (x - self.mean.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(of: impl Fn(f64) -> f64) -> Vec<Weighted> {
        (0..9).map(f64::from).map(|x| Weighted { weight: 1.0 + x, x, y: of(x) }).collect()
    }

    #[test]
    fn a_line_is_found_and_scatter_is_not_one() {
        let line = Line::through(&points(|x| 2.0 - 0.5 * x)).unwrap();
        assert!((line.at(3.0) - 0.5).abs() < 1e-12);
        assert!(line.p_value < 1e-9 && line.accounts > 1.0 - 1e-9);
        let values = [0.3, -0.5, 0.6, -0.1, -0.4, 0.5, -0.6, 0.2, 0.1];
        let scatter = Line::through(&points(|x| values[x as usize])).unwrap();
        assert!(scatter.p_value > 0.05, "{}", scatter.p_value);
        assert!(Line::through(&points(|_| 1.0)).is_none());
    }
}
