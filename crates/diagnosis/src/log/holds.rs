//! The measurement's noise from repeated holds: while the valve rests, the measured values differ by noise alone. Unlike
//! differences between neighbours, a hold also shows noise that is slower than the sampling.

use crate::log::kind::LogKind;
use crate::log::piece::Piece;
use log_data::median;

/// Samples of one hold, and the least number of holds for a median.
const LENGTH: usize = 64;
const REPEATED: usize = 8;

/// The variance of the residual in each hold of a piece, a straight line subtracted.
pub(crate) fn variances(piece: &Piece, residual: &[f64], kind: LogKind) -> Vec<f64> {
    let count = residual.len() / LENGTH;
    (0..count)
        .filter(|hold| rests(piece, hold * LENGTH, kind))
        .filter_map(|hold| residual.get(hold * LENGTH..(hold + 1) * LENGTH))
        .map(about_a_line)
        .collect()
}

/// Whether the valve rests. In a torque log the angle stays within the encoder's resolution. In an angle log the command is
/// constant, in the hold and for as long before it.
fn rests(piece: &Piece, from: usize, kind: LogKind) -> bool {
    let still = |from: usize, most_rad: f64, angle: &dyn Fn(usize) -> f64| {
        let angles = (from..from + LENGTH).map(angle);
        let (least, most) = angles
            .fold((f64::INFINITY, f64::NEG_INFINITY), |span, angle| (span.0.min(angle), span.1.max(angle)));
        most - least <= most_rad
    };
    let angle = |index: usize| piece.kinematics(index).0;
    if kind.motion_is_measured {
        let unseen_rad = piece.noise.step_rad.max(2.0 * piece.noise.beyond_quantisation_rad());
        return still(from, unseen_rad, &angle);
    }
    from >= LENGTH && still(from, 0.0, &angle) && still(from - LENGTH, 0.0, &angle)
}

fn about_a_line(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let mean = values.iter().sum::<f64>() / count;
    let (xy, xx) = values.iter().zip(0..).fold((0.0, 0.0), |(xy, xx), (value, index)| {
        let x = f64::from(index) - middle;
        (xy + x * (value - mean), xx + x * x)
    });
    let slope = xy / xx;
    let left = values.iter().zip(0..).map(|(value, index)| {
        let x = f64::from(index) - middle;
        (value - mean - slope * x).powi(2)
    });
    left.sum::<f64>() / (count - 2.0)
}

/// The median variance of the holds; `None` if there are too few.
pub(crate) fn pooled(mut variances: Vec<f64>) -> Option<f64> {
    if variances.len() < REPEATED {
        return None;
    }
    median(&mut variances)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_drift_is_no_noise_and_few_holds_say_nothing() {
        let drifting: Vec<f64> = (0..LENGTH).map(|k| 3.0 * k as f64).collect();
        assert!(about_a_line(&drifting) < 1e-20);
        let scattering: Vec<f64> = (0..LENGTH).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert!((about_a_line(&scattering) - 1.0).abs() < 0.05);
        assert_eq!(pooled(vec![1.0; REPEATED - 1]), None);
        assert_eq!(pooled(vec![1.0, 1.0, 1.0, 1.0, 2.0, 9.0, 9.0, 9.0, 9.0]), Some(2.0));
    }
}
