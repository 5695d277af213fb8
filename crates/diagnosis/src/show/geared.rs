//! Detects a torque whose period over the angle is no whole fraction of a turn, as that of a gear. Harmonics of a turn can
//! imitate it within the angles visited, but no effect of the list is its cause.
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use crate::extend::hypothesis::Member;
use crate::log::campaign::Campaign;
use crate::log::piece::Piece;
use crate::numerics::statistics::SHARE_LEFT;
use crate::show::residual::PieceResidual;
use nalgebra::{Matrix3, Vector3};
use valve_model::EffectId;

/// Series over the spool's angle.
const OVER_THE_ANGLE: [EffectId; 3] =
    [EffectId::PositionTorque, EffectId::FlowTorque, EffectId::AngleDependentFriction];
/// A series stands in for a gear if one sine of non-integer order leaves at most `LEFT` of the series' variance (beyond the
/// series' own residual), and the best integer order leaves at least `TIMES` as much and at least `LEFT_BY_WHOLE`.
const LEFT: f64 = 0.04;
const TIMES: f64 = 4.0;
const LEFT_BY_WHOLE: f64 = 0.03;
/// The gear's order is at least `BESIDE` from an integer, and at least `PERIODS` of its periods lie within the angles
/// visited.
const BESIDE: f64 = 0.1;
const PERIODS: f64 = 1.5;
/// Beside a series that leaves no more than noise, the sine may differ from it by this part of the noise's mean square: more would be seen in what a
/// series leaves that only imitates a gear, where a covariate that explains half as much counts.
const OF_NOISE: f64 = 2.0 * SHARE_LEFT;
/// Orders tried.
const ORDER_STEP: f64 = 0.02;
const MOST_ORDER: f64 = 16.0;
/// Samples used, approximately.
const SAMPLES: usize = 3000;

/// A sample: its angle, the series there, and the residual. The residual counts as zero unless it is the same kind of torque, a
/// `position-torque` in a torque log.
#[derive(Debug, Clone, Copy)]
struct Sample {
    angle_rad: f64,
    series: f64,
    left: f64,
    /// What the series' unit is in standard deviations of the measured channel; 0 where that is not known.
    deviations: f64,
}

/// True if an effect is a series over the spool's angle.
pub(crate) fn is_over_the_angle(id: EffectId) -> bool {
    OVER_THE_ANGLE.contains(&id)
}

/// The non-integer order of the one sine that explains what a series does, if there is one; `left` is the residual by
/// piece, `is_noise` whether that is no more than noise.
pub(crate) fn order_of_a_gear(
    campaign: &Campaign,
    member: &Member,
    left: &[PieceResidual],
    is_noise: bool,
) -> Option<f64> {
    let harmonics = member.numbers.chunks(2).filter(|pair| pair.iter().any(|number| *number != 0.0)).count();
    if !is_over_the_angle(member.candidate.id) || harmonics < 2 {
        return None;
    }
    order_beside_whole_ones(&samples(campaign, member, left), is_noise)
}

fn order_beside_whole_ones(samples: &[Sample], is_noise: bool) -> Option<f64> {
    let angles = samples.iter().map(|sample| sample.angle_rad);
    let (least, most) = angles
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), angle| (angle.min(least), angle.max(most)));
    let turns = (most - least) / std::f64::consts::TAU;
    let count = samples.len() as f64;
    let mean = samples.iter().map(|sample| sample.series).sum::<f64>() / count;
    let variance = samples.iter().map(|sample| (sample.series - mean).powi(2)).sum::<f64>();
    let by_series = samples.iter().map(|sample| sample.left * sample.left).sum::<f64>();
    let beyond = |order: f64| Some((sine(samples, order)?.left - by_series) / variance);
    let best = |orders: &mut dyn Iterator<Item = f64>| {
        orders.filter_map(|order| Some((beyond(order)?, order))).min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let (left, order) =
        best(&mut (1..(MOST_ORDER / ORDER_STEP) as usize).map(|step| step as f64 * ORDER_STEP))?;
    let (left_by_whole, _) = best(&mut (1..=MOST_ORDER as usize).map(|order| order as f64))?;
    let clear = left < LEFT && left_by_whole > LEFT_BY_WHOLE.max(TIMES * left);
    let is_seen = || sine(samples, order).is_some_and(|sine| sine.off_in_variances(samples) > OF_NOISE);
    let is_gear = clear && (order - order.round()).abs() > BESIDE && order * turns >= PERIODS;
    (is_gear && !(is_noise && is_seen())).then_some(order)
}

fn samples(campaign: &Campaign, member: &Member, left: &[PieceResidual]) -> Vec<Sample> {
    let count: usize = campaign.pieces.iter().map(Piece::len).sum();
    let in_torque = campaign.kind.residual_is_torque();
    let is_torque = in_torque && member.candidate.id == EffectId::PositionTorque;
    let unit_nm = |piece: &Piece, index: usize| match member.candidate.id {
        _ if !in_torque => 0.0,
        EffectId::PositionTorque => 1.0,
        EffectId::AngleDependentFriction => campaign.facts.coulomb_nm,
        _ => piece.driven.pressure_pa().get(index).copied().unwrap_or(0.0),
    };
    let of_piece = |(piece, left): (&Piece, &PieceResidual)| -> Vec<Sample> {
        let residuals = left.residual.iter().zip(&piece.weights).enumerate();
        residuals
            .map(|(index, (residual, weight))| {
                let angle_rad = if *weight > 0.0 { piece.kinematics(index).0 } else { f64::NAN };
                let left = if is_torque { *residual } else { 0.0 };
                let deviations = weight * unit_nm(piece, index);
                Sample { angle_rad, series: value(member, angle_rad), left, deviations }
            })
            .collect()
    };
    let all = campaign.pieces.iter().zip(left).flat_map(of_piece);
    all.step_by(count.div_ceil(SAMPLES).max(1)).filter(|sample| sample.angle_rad.is_finite()).collect()
}

fn value(member: &Member, angle_rad: f64) -> f64 {
    let pairs = member.numbers.chunks(2).zip(1..);
    pairs
        .map(|(pair, order)| {
            let (sin, cos) = (f64::from(order) * angle_rad).sin_cos();
            pair.first().unwrap_or(&0.0) * cos + pair.get(1).unwrap_or(&0.0) * sin
        })
        .sum()
}

/// A constant and a sine of one order, fitted to a series plus its residual.
struct Sine {
    order: f64,
    numbers: Vector3<f64>,
    /// The residual sum of squares.
    left: f64,
}

impl Sine {
    fn row(order: f64, sample: &Sample) -> Vector3<f64> {
        let (sin, cos) = (order * sample.angle_rad).sin_cos();
        Vector3::new(1.0, cos, sin)
    }

    /// The mean square by which it differs from the series, in variances of the channel.
    fn off_in_variances(&self, samples: &[Sample]) -> f64 {
        let off = |sample: &Sample| sample.series - Self::row(self.order, sample).dot(&self.numbers);
        let squares = samples.iter().map(|sample| (sample.deviations * off(sample)).powi(2));
        squares.sum::<f64>() / samples.len() as f64
    }
}

fn sine(samples: &[Sample], order: f64) -> Option<Sine> {
    let (mut matrix, mut right, mut square) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    for sample in samples {
        let (row, torque) = (Sine::row(order, sample), sample.series + sample.left);
        matrix += row * row.transpose();
        right += row * torque;
        square += torque * torque;
    }
    let numbers = matrix.cholesky()?.solve(&right);
    let left = (square - right.dot(&numbers)).max(0.0);
    Some(Sine { order, numbers, left })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn angles(turns: f64) -> Vec<f64> {
        (0..1000).map(|k| -2.0 + turns * std::f64::consts::TAU * f64::from(k) / 1000.0).collect()
    }

    fn found(turns: f64, torque: impl Fn(f64) -> f64) -> Option<f64> {
        found_in_noise(turns, torque, 0.0)
    }

    /// The same where the channel's noise is one over `deviations`.
    fn found_in_noise(turns: f64, torque: impl Fn(f64) -> f64, deviations: f64) -> Option<f64> {
        let sample = |angle_rad: f64| Sample { angle_rad, series: torque(angle_rad), left: 0.0, deviations };
        order_beside_whole_ones(&angles(turns).into_iter().map(sample).collect::<Vec<_>>(), true)
    }

    /// As in a torque log, where a fit of two harmonics leaves a residual.
    fn found_by_harmonics(turns: f64, torque: impl Fn(f64) -> f64) -> Option<f64> {
        let angles_rad = angles(turns);
        let row = |angle: &f64| [1, 2].map(|half| (f64::from(half + 1) * angle).sin_cos());
        let rows = nalgebra::DMatrix::from_fn(angles_rad.len(), 4, |index, column| {
            let (sin, cos) = row(&angles_rad[index])[column / 2];
            if column % 2 == 0 { cos } else { sin }
        });
        let wanted = nalgebra::DVector::from_iterator(1000, angles_rad.iter().map(|angle| torque(*angle)));
        let series = &rows * rows.clone().svd(true, true).solve(&wanted, 1e-12).unwrap();
        let samples = (0..1000).map(|index| Sample {
            angle_rad: angles_rad[index],
            series: series[index],
            left: wanted[index] - series[index],
            deviations: 0.0,
        });
        order_beside_whole_ones(&samples.collect::<Vec<_>>(), true)
    }

    #[test]
    fn a_gear_is_told_from_what_turns_with_the_spool() {
        let order = found(0.8, |angle| 0.3 * (2.45 * angle + 0.4).sin() + 0.1).unwrap();
        assert!((order - 2.45).abs() < 0.03, "{order}");
        assert_eq!(found(0.8, |angle| (2.0 * angle).sin()), None);
        assert_eq!(found(0.8, |angle| (2.0 * angle).sin() + 0.4 * (3.0 * angle + 1.0).sin()), None);
        assert_eq!(found(1.1, |angle| (angle.cos() - 1.0).exp()), None);
        // The harmonics fit it badly, in a torque log.
        let order = found_by_harmonics(1.3, |angle| (2.45 * angle).sin()).unwrap();
        assert!((order - 2.45).abs() < 0.03, "{order}");
        assert_eq!(found_by_harmonics(1.3, |angle| (2.0 * angle).sin() + 0.3 * (4.0 * angle).sin()), None);
        // Two harmonics that are nearly one sine on 0.6 turns: what they differ by is seen where the noise is small.
        let harmonics = |angle: f64| {
            let (sin_3, cos_3) = (3.0 * (angle + 2.0)).sin_cos();
            let (sin_4, cos_4) = (4.0 * (angle + 2.0)).sin_cos();
            0.171 * cos_3 + 0.029 * sin_3 - 0.042 * cos_4 + 0.045 * sin_4
        };
        for (deviations, is_gear) in [(0.0, true), (5.0, true), (30.0, false)] {
            let order = found_in_noise(0.6, harmonics, deviations);
            assert_eq!(order.is_some(), is_gear, "{deviations}: {order:?}");
        }
        // Too small a part of a turn to decide.
        assert_eq!(found(0.4, |angle| (2.45 * angle).sin()), None);
    }
}
