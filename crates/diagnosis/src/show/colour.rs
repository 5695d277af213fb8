//! Whether a residual is coloured noise: autocorrelated, but dependent on no recorded covariate.

use crate::fit::equations::Setting;
use crate::log::piece::Piece;
use crate::show::repeated::is_repeated;
use crate::show::residual::{PieceResidual, squares_as_fitted};
use crate::show::structure::{Structure, depends, structure};
use crate::show::tone::tone;
use crate::show::waves::goes_with_the_angle;
use crate::show::whiteness::is_white;
use log_data::median;

/// A residual counts as coloured noise if `ALIKE` to `MOST_ALIKE` samples count as one independent sample (more is a drift) and
/// its RMS is below `LOUDEST` times the noise, or below `LOUDEST_STEADY` times if it is as large in every motion. A larger one
/// may be an unmodelled effect, which hardly ever is as large in every motion.
const ALIKE: f64 = 1.2;
const MOST_ALIKE: f64 = 400.0;
const LOUDEST: f64 = 1.5;
const LOUDEST_STEADY: f64 = 6.0;
/// Classes of speed, and of acceleration, whose variances are compared. They count as equal up to this ratio, times what chance
/// allows (three standard deviations).
const CLASSES: usize = 4;
const RATIO: f64 = 1.3;
const DEVIATIONS: f64 = 3.0;
/// A group is much louder than the others beyond twice their RMS: transducers and motions differ by less.
const STANDS_OUT: f64 = 4.0;

/// The noise's colour.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Colour {
    /// The residual, by piece.
    pub left: Vec<Vec<f64>>,
    /// Samples that count as one independent sample.
    pub per_independent: f64,
}

/// The colour of a residual; `None` if it is white, holds a tone or depends on a covariate.
pub(crate) fn colour(setting: &Setting<'_>, left: &[PieceResidual]) -> Option<Colour> {
    if is_white(setting, left) {
        return None;
    }
    let structure = structure(setting, left);
    let residuals = || left.iter().map(|of| of.residual.clone()).collect();
    is_coloured(setting, left, &structure)
        .then(|| Colour { left: residuals(), per_independent: structure.per_independent })
}

/// Whether a residual that is not white, and its structure, are those of coloured noise.
pub(crate) fn is_coloured(setting: &Setting<'_>, left: &[PieceResidual], structure: &Structure) -> bool {
    let alike = (ALIKE..MOST_ALIKE).contains(&structure.per_independent);
    let quiet = structure.rms < LOUDEST;
    let steady = || structure.rms < LOUDEST_STEADY && is_steady(setting, left, structure.per_independent);
    alike
        && !depends(structure)
        && (quiet || steady())
        && is_everywhere(setting, left, structure.per_independent)
        && tone(setting, left).is_none()
        && !is_repeated(setting, left)
        && !goes_with_the_angle(setting, left, structure.per_independent)
}

/// Whether no group is much louder than the others: what is left in one alone, where an angle or a pressure was reached that no other has, is
/// no noise.
fn is_everywhere(setting: &Setting<'_>, left: &[PieceResidual], per_independent: f64) -> bool {
    let groups = squares_as_fitted(setting, left, &|_| true);
    none_stands_out(
        groups.into_iter().map(|(squares, count)| (squares / count, count)).collect(),
        per_independent,
    )
}

/// Whether no mean square of so many samples is above the median by `STANDS_OUT` times what chance allows.
fn none_stands_out(squares: Vec<(f64, f64)>, per_independent: f64) -> bool {
    let Some(middle) = median(&mut squares.iter().map(|of| of.0).collect::<Vec<_>>()) else { return true };
    let chance = |count: f64| by_chance((count / per_independent).max(1.0));
    squares.iter().all(|(square, count)| *square <= STANDS_OUT * chance(*count) * middle.max(1.0))
}

/// The ratio of two variances of so many independent samples up to which chance may be all.
fn by_chance(independent: f64) -> f64 {
    (1.0 + DEVIATIONS * (2.0 / independent).sqrt()).powi(2)
}

/// Whether a residual has the same variance in all classes of speed and of acceleration.
fn is_steady(setting: &Setting<'_>, left: &[PieceResidual], per_independent: f64) -> bool {
    let by = |covariate: fn(&Piece, usize) -> f64| -> Vec<(f64, f64)> {
        let pieces = setting.campaign.pieces.iter().zip(left);
        let samples = pieces.flat_map(|(piece, left)| {
            let values = piece.in_deviations(&left.residual).into_iter().enumerate();
            values.map(move |(index, value)| (covariate(piece, index), value)).collect::<Vec<_>>()
        });
        samples.filter(|(covariate, value)| covariate.is_finite() && *value != 0.0).collect()
    };
    let speed = |piece: &Piece, index: usize| piece.kinematics(index).1.abs();
    let acceleration = |piece: &Piece, index: usize| piece.kinematics(index).2.abs();
    is_even(by(speed), per_independent) && is_even(by(acceleration), per_independent)
}

/// Whether values have the same variance in all classes of a covariate; each class has as many samples.
fn is_even(mut samples: Vec<(f64, f64)>, per_independent: f64) -> bool {
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    let size = samples.len().div_ceil(CLASSES).max(1);
    let squares = samples.chunks(size).map(|class| {
        let square: f64 = class.iter().map(|(_, value)| value * value).sum();
        square / class.len() as f64
    });
    let (least, most) =
        squares.fold((f64::INFINITY, 0.0), |(least, most), of| (f64::min(least, of), f64::max(most, of)));
    let independent = (size as f64 / per_independent).max(1.0);
    most < RATIO * by_chance(independent) * least
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_in_one_group_alone_is_no_noise() {
        for (squares, count, everywhere) in [
            (vec![1.1, 0.9, 1.3, 1.0], 1000.0, true),
            (vec![1.1, 0.9, 10.0, 1.0], 1000.0, false),
            // Of few independent samples a mean square says little.
            (vec![1.1, 0.9, 10.0, 1.0], 60.0, true),
            (vec![1.1, 0.9, 60.0, 1.0], 60.0, false),
            // All loud is everywhere; below the noise nothing stands out.
            (vec![20.0, 25.0, 30.0, 22.0], 1000.0, true),
            (vec![0.1, 0.1, 0.9, 0.1], 1000.0, true),
            (vec![], 1000.0, true),
        ] {
            let told = none_stands_out(squares.iter().map(|square| (*square, count)).collect(), 10.0);
            assert_eq!(told, everywhere, "{squares:?} of {count} samples");
        }
    }

    #[test]
    fn noise_is_even_and_an_error_that_grows_with_speed_is_not() {
        let alternating = |index: usize| if index.is_multiple_of(2) { 1.0 } else { -1.0 };
        let even: Vec<(f64, f64)> = (0..4000).map(|index| (index as f64, alternating(index))).collect();
        let grows = even.iter().map(|(speed, value)| (*speed, value * speed)).collect();
        assert!(is_even(even, 10.0));
        assert!(!is_even(grows, 10.0));
    }
}
