//! The loss of a fit: the sum of squares for torque logs, a likelihood with a variance for each group for angle logs.
//!
//! A rotor that slips a moment earlier or later than the model leaves a group with many times its noise, and such groups would
//! dominate a sum of squares. With an unknown variance s of at least the noise's for each group, the likelihood is largest at
//! s = max(1, u), where u is the group's mean square relative to the noise; its loss is n·(1 + ln u) for u > 1, else n·u.

use crate::numerics::gram::Gram;

/// A group counts as misfitted if its mean square exceeds the noise variance by this factor.
const WRONG: f64 = 1.21;

/// How the groups of samples count in a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Loss {
    Squares,
    OwnNoise,
}

impl Loss {
    /// The loss over all groups.
    pub fn total(self, groups: &[Gram]) -> f64 {
        groups.iter().map(|group| self.of_group(group.square(), group.count)).sum()
    }

    /// The root of the mean loss per sample, for groups given by sum of squares and count. In angle logs it is an RMS in which
    /// badly fitted groups count less.
    pub fn rms(self, groups: impl Iterator<Item = (f64, f64)>) -> f64 {
        let (total, all) = groups.fold((0.0, 0.0), |(total, all), (square, count)| {
            (total + self.of_group(square, count), all + count)
        });
        f64::sqrt(total / f64::max(all, 1.0))
    }

    /// Least share of the excess over noise that a further cause must explain beside `causes` accepted ones: a smaller gain may
    /// only fit their misfit. With the logarithmic loss the first of two equal causes explains a sixth of the excess (half with
    /// squares), so the first two need a tenth. A third cause competes with the misfit of two.
    pub fn least_part(self, causes: usize) -> f64 {
        if self == Self::OwnNoise && causes < 2 { 0.1 } else { 0.25 }
    }

    /// The share of the excess over noise that is explained, for groups given by their first sum of squares, their present one
    /// and their count. It is taken over all groups. In angle logs, where few groups may dominate the sum, it is that of the
    /// median misfitted group if that is larger.
    pub fn share_explained(self, groups: impl Iterator<Item = (f64, f64, f64)>) -> f64 {
        let groups: Vec<(f64, f64, f64)> = groups.filter(|(_, _, count)| *count > 0.0).collect();
        let [first, now, count] = groups
            .iter()
            .fold([0.0; 3], |[first, now, count], group| [first + group.0, now + group.1, count + group.2]);
        let of_all = share(first, now, count);
        if self == Self::Squares {
            return of_all;
        }
        let wrong = groups.iter().filter(|(first, _, count)| *first > WRONG * count);
        let mut each: Vec<(f64, f64)> =
            wrong.map(|(first, now, count)| (share(*first, *now, *count), *count)).collect();
        each.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut ahead = 0.5 * each.iter().map(|(_, count)| count).sum::<f64>();
        let middle = each.iter().find(|(_, count)| {
            ahead -= count;
            ahead <= 0.0
        });
        middle.map_or(of_all, |(share, _)| of_all.max(*share))
    }

    /// A change counts as an improvement only if the ratio of the residuals, after to before, is at most this.
    pub fn hardly_less(self) -> f64 {
        match self {
            Self::Squares => 0.95,
            Self::OwnNoise => 0.98,
        }
    }

    fn of_group(self, square: f64, count: f64) -> f64 {
        match self {
            Self::OwnNoise if square > count && count > 0.0 => count * (1.0 + (square / count).ln()),
            _ => square,
        }
    }

    /// The groups weighted for a Gauss-Newton step, by the slope of the loss at their present squares.
    pub fn weighted(self, groups: &[Gram]) -> Vec<Gram> {
        let weight = |group: &Gram| match self {
            Self::OwnNoise if group.count > 0.0 => 1.0 / (group.square() / group.count).max(1.0),
            _ => 1.0,
        };
        groups.iter().map(|group| group.times(weight(group))).collect()
    }
}

fn share(first: f64, now: f64, count: f64) -> f64 {
    if first > count { (first - now) / (first - count) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A residual of `residual` against a column of ones times `column`, over `count` samples.
    fn group(count: f64, residual: f64, column: f64) -> Gram {
        let products = [column * column, column * residual, column * residual, residual * residual];
        Gram { matrix: count * DMatrix::from_row_slice(2, 2, &products), count }
    }

    /// Where iteratively reweighted steps from 0 converge, for a model that is a constant.
    fn settle(loss: Loss, residuals: &[f64]) -> f64 {
        let mut at = 0.0;
        for _ in 0..50 {
            let groups: Vec<Gram> =
                residuals.iter().map(|residual| group(100.0, residual - at, 1.0)).collect();
            let sum = loss.weighted(&groups).iter().fold(DMatrix::zeros(2, 2), |sum, one| sum + &one.matrix);
            let step = sum.as_slice().get(1).zip(sum.as_slice().first()).map_or(0.0, |(b, a)| b / a);
            let moved: Vec<Gram> = groups
                .iter()
                .zip(residuals)
                .map(|(_, residual)| group(100.0, residual - at - step, 1.0))
                .collect();
            assert!(loss.total(&moved) <= loss.total(&groups) + 1e-9, "a step of {step} makes it worse");
            at += step;
        }
        at
    }

    #[test]
    fn one_group_far_off_rules_the_squares_and_not_the_rest() {
        let residuals = [1.0, 1.2, 0.8, 1.0, 40.0];
        assert!(settle(Loss::Squares, &residuals) > 8.0);
        let settled = settle(Loss::OwnNoise, &residuals);
        assert!((0.8..1.3).contains(&settled), "{settled}");
    }

    #[test]
    fn near_the_noise_both_count_alike() {
        let groups = [group(100.0, 1.05, 1.0), group(50.0, 0.9, 1.0)];
        let [squares, own] = [Loss::Squares, Loss::OwnNoise].map(|loss| loss.total(&groups));
        assert!((squares - own).abs() < 0.01 * squares, "{squares} {own}");
        let beta = DVector::from_element(1, 0.1);
        let plain: f64 = groups.iter().map(|group| group.square_after(&[0], &beta)).sum();
        let weighted: f64 =
            Loss::OwnNoise.weighted(&groups).iter().map(|group| group.square_after(&[0], &beta)).sum();
        assert!((plain - weighted).abs() < 0.1 * plain, "{plain} {weighted}");
    }

    #[test]
    fn the_middle_group_speaks_where_a_few_slip_at_another_moment() {
        let groups = || [(400.0, 110.0, 100.0), (900.0, 120.0, 100.0), (8000.0, 9000.0, 100.0)].into_iter();
        assert!(Loss::Squares.share_explained(groups()) < 0.1);
        assert!(Loss::OwnNoise.share_explained(groups()) > 0.9);
    }
}
