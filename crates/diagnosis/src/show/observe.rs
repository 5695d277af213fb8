//! Observations on the runs that are no cause on the list: speed that follows pressure, and offset or friction that
//! differs from run to run.

use crate::log::campaign::Campaign;
use crate::log::piece::Piece;
use crate::numerics::line::{Line, Weighted};
use crate::show::residual::PieceResidual;
use log_data::median;
use statrs::statistics::Statistics;

/// Slower than this part of the fastest speed counts as rest.
const MOVING: f64 = 0.1;
/// Least number of runs for comparing speeds.
const LEAST_RUNS: usize = 5;
/// Least change of speed over the span of pressures (relative), largest p-value, and least share of the differences
/// between runs that pressure accounts for.
const CHANGE: f64 = 0.15;
const CHANCE: f64 = 1e-3;
const ACCOUNTS: f64 = 0.8;

/// Least samples in each direction for a run that moves both ways, and least number of such runs for zeros to be told from friction.
const BOTH_WAYS: usize = 50;
const LEAST_ZEROS: usize = 2;

/// A run in one direction.
struct Stroke {
    pressure_mpa: f64,
    speed_rad_per_s: f64,
}

/// Sentences on speed that follows pressure, for each direction. The commanded speed of a run has no reason to follow
/// the pressure, so the drive causes it.
pub(crate) fn speed_with_pressure(campaign: &Campaign) -> Vec<String> {
    if !campaign.kind.residual_is_torque() {
        return Vec::new();
    }
    [(1.0, "positive"), (-1.0, "negative")]
        .into_iter()
        .filter_map(|(sign, direction)| follows(&strokes(campaign, sign), direction))
        .collect()
}

fn strokes(campaign: &Campaign, sign: f64) -> Vec<Stroke> {
    let slow = MOVING * campaign.facts.fastest_rad_per_s;
    (0..campaign.runs.len())
        .filter_map(|run| {
            let pieces = || campaign.pieces.iter().filter(|piece| piece.run == run);
            let speeds = |piece: &Piece| -> Vec<f64> {
                piece.motions.iter().map(|motion| sign * motion.speed_rad_per_s).collect()
            };
            let mut moving: Vec<f64> = pieces().flat_map(speeds).filter(|speed| *speed > slow).collect();
            let pressures: Vec<f64> =
                pieces().flat_map(|piece| piece.driven.pressure_pa().to_vec()).collect();
            if moving.len() < 50 || pressures.is_empty() {
                return None;
            }
            let speed_rad_per_s = median(&mut moving)?;
            let pressure_mpa = pressures.iter().sum::<f64>() / pressures.len() as f64 / 1e6;
            Some(Stroke { pressure_mpa, speed_rad_per_s })
        })
        .collect()
}

fn follows(strokes: &[Stroke], direction: &str) -> Option<String> {
    if strokes.len() < LEAST_RUNS {
        return None;
    }
    let least = strokes.iter().map(|of| of.pressure_mpa).fold(f64::INFINITY, f64::min);
    let most = strokes.iter().map(|of| of.pressure_mpa).fold(f64::NEG_INFINITY, f64::max);
    let point = |of: &Stroke| Weighted { weight: 1.0, x: of.pressure_mpa, y: of.speed_rad_per_s };
    let points: Vec<Weighted> = strokes.iter().map(point).collect();
    let line = Line::through(&points)?;
    let (first, last) = (line.at(least), line.at(most));
    if (last - first).abs() < CHANGE * first.abs() || line.accounts < ACCOUNTS || line.p_value > CHANCE {
        return None;
    }
    let way = if last < first { "falls" } else { "rises" };
    Some(format!(
        "The speed in the {direction} direction {way} with pressure: {first:.3} rad/s at {least:.2} MPa, {last:.3} rad/s at \
         {most:.2} MPa. Nothing in the model sets that speed; it is the drive's."
    ))
}

/// Whether zeros that differ from run to run can be told from friction: enough runs move both ways.
pub(crate) fn shows_zeros(campaign: &Campaign) -> bool {
    if !campaign.kind.residual_is_torque() {
        return false;
    }
    let both_ways = |run: usize| {
        let mut samples = (0, 0);
        for piece in campaign.pieces.iter().filter(|piece| piece.run == run) {
            for index in 1..piece.len() {
                let speed = piece.kinematics(index).1;
                samples.0 += usize::from(speed > 0.0);
                samples.1 += usize::from(speed < 0.0);
            }
        }
        samples.0.min(samples.1) > BOTH_WAYS
    };
    (0..campaign.runs.len()).filter(|run| both_ways(*run)).count() >= LEAST_ZEROS
}

/// A run's mean residual: the part equal in both directions, and the part against the motion.
fn offset_and_friction(campaign: &Campaign, left: &[PieceResidual], run: usize) -> Option<(f64, f64)> {
    let mut sides = [(0.0, 0.0); 2];
    for (piece, left) in campaign.pieces.iter().zip(left).filter(|(piece, _)| piece.run == run) {
        for (index, residual) in left.residual.iter().enumerate().skip(1) {
            let speed = piece.kinematics(index).1;
            let side = if speed > 0.0 { sides.first_mut() } else { sides.last_mut() };
            if let Some(side) = side.filter(|_| speed != 0.0) {
                *side = (side.0 + residual, side.1 + 1.0);
            }
        }
    }
    let [(up, ups), (down, downs)] = sides;
    (ups > BOTH_WAYS as f64 && downs > BOTH_WAYS as f64)
        .then(|| (0.5 * (up / ups + down / downs), 0.5 * (up / ups - down / downs)))
}

/// Standard deviation of offset and friction from run to run, N·m; `None` if too few runs have both directions.
fn scatter(campaign: &Campaign, left: &[PieceResidual]) -> Option<(f64, f64)> {
    let runs: Vec<(f64, f64)> =
        (0..campaign.runs.len()).filter_map(|run| offset_and_friction(campaign, left, run)).collect();
    if runs.len() < LEAST_RUNS {
        return None;
    }
    Some((runs.iter().map(|run| run.0).std_dev(), runs.iter().map(|run| run.1).std_dev()))
}

/// Standard deviation of the runs' mean residuals, N·m, each run counting as one; `None` of a single run.
pub(crate) fn between_runs(campaign: &Campaign, left: &[PieceResidual]) -> Option<f64> {
    let mut means = vec![(0.0, 0.0); campaign.runs.len()];
    for (piece, left) in campaign.pieces.iter().zip(left) {
        let Some(mean) = means.get_mut(piece.run) else { continue };
        for (residual, _) in left.residual.iter().zip(&piece.weights).filter(|(_, weight)| **weight > 0.0) {
            *mean = (mean.0 + residual, mean.1 + 1.0);
        }
    }
    let means: Vec<f64> = means.iter().filter(|of| of.1 > 0.0).map(|(sum, count)| sum / count).collect();
    (means.len() > 1).then(|| means.iter().std_dev())
}

/// The sentence on friction and offset that differ between runs, and on the channels missing to explain it. `zero_nm`
/// is the zero that was subtracted from each run.
pub(crate) fn runs_differ(campaign: &Campaign, left: &[PieceResidual], zero_nm: f64) -> Option<String> {
    let (offset_nm, friction_nm) = scatter(campaign, left)?;
    let offset_nm = offset_nm.hypot(zero_nm);
    let missing: Vec<&str> = [
        (campaign.facts.pressure_mpa.is_none(), "pressure_drop"),
        (campaign.facts.temperature_c.is_none(), "oil_temperature"),
    ]
    .into_iter()
    .filter_map(|(missing, name)| missing.then_some(name))
    .collect();
    let why = if missing.is_empty() {
        "no cause of the list follows what was recorded".to_owned()
    } else {
        let were = if missing.len() > 1 { "were" } else { "was" };
        format!("{} {were} not recorded", missing.join(" and "))
    };
    Some(format!(
        "Friction and offset differ between runs: friction by ±{}, the offset by ±{}. Why, these data can't say: {why}.",
        torque(friction_nm),
        torque(offset_nm),
    ))
}

/// A torque in words: a small one is no zero.
pub(crate) fn torque(nm: f64) -> String {
    if nm < 0.1 { format!("{nm:.2e} N·m") } else { format!("{nm:.3} N·m") }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn strokes(speeds: &[f64]) -> Vec<Stroke> {
        let pressures = [0.1, 0.3, 0.5, 0.7, 0.1, 0.3, 0.5, 0.7];
        let stroke = |(pressure_mpa, speed_rad_per_s): (f64, &f64)| Stroke {
            pressure_mpa,
            speed_rad_per_s: *speed_rad_per_s,
        };
        pressures.into_iter().zip(speeds).map(stroke).collect()
    }

    #[test]
    fn a_speed_that_follows_the_pressure_is_said_and_a_chosen_one_is_not() {
        let slowing = strokes(&[1.07, 0.89, 0.72, 0.53, 1.13, 0.94, 0.79, 0.62]);
        let said = follows(&slowing, "positive").unwrap();
        assert!(said.contains("falls with pressure"), "{said}");
        let chosen = strokes(&[0.5, 2.0, 0.5, 2.0, 2.0, 0.5, 2.0, 0.5]);
        assert_eq!(follows(&chosen, "positive"), None);
        let steady = strokes(&[1.00, 0.99, 0.98, 0.97, 1.00, 0.99, 0.98, 0.97]);
        assert_eq!(follows(&steady, "positive"), None, "3 % are not worth a word");
    }
}
