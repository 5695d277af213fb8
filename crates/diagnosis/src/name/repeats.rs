//! Repeated levels: if a log returns to a pressure and a temperature, friction that has changed by wear doesn't return to its level.
//!
//! Two numbers of each run are compared: the mean friction in the residual of the causes so far, and the friction that a cause that grows
//! with time would add. Among runs under the same conditions the first must follow the second, whatever else depends on the conditions.

use crate::DiagnosisError;
use crate::fit::equations::{Point, Setting};
use crate::log::classes::Class;
use crate::log::piece::Piece;
use crate::workers::map;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::collections::BTreeMap;
use valve_model::EffectId;

/// Pressures (MPa) and temperatures (K) closer than this are the same, or than this part of the greatest pressure.
const SAME_MPA: f64 = 0.02;
const SAME_PART: f64 = 0.1;
const SAME_K: f64 = 3.0;
/// Least number of repeated runs: those beyond the first under each condition.
const LEAST_REPEATS: usize = 3;
/// Among repeated runs the trend must vary by at least this fraction of its variation among all runs.
const SPANS: f64 = 0.3;
/// Significance level at which the runs contradict a trend, and the least fraction of it that they must show.
const CHANCE: f64 = 0.05;
const LEAST_PART: f64 = 0.5;

/// A run: the friction in its residual, and what the trend would add to it.
#[derive(Debug, Clone, Copy)]
struct Level {
    left_nm: f64,
    trend_nm: f64,
}

type Condition = (Class, i8, i64, i64);

/// True if runs under repeated conditions contradict a cause that depends on the distance travelled alone.
pub(crate) fn contradict(
    setting: &Setting<'_>,
    id: EffectId,
    base: &Point,
    with: &Point,
) -> Result<bool, DiagnosisError> {
    if id != EffectId::WearDrift {
        return Ok(false);
    }
    let (before, after) = (setting.ready(&base.hypothesis)?, setting.ready(&with.hypothesis)?);
    let found = map(setting.workers, setting.campaign.pieces.len(), |index| {
        let piece = setting.campaign.pieces.get(index)?;
        let [before, after] =
            [(&before, base), (&after, with)].map(|(ready, of)| piece.predict(ready, of.start(index)));
        Some((piece.run, sums(piece, &before, &after)))
    });
    let mut runs: BTreeMap<usize, [f64; 3]> = BTreeMap::new();
    for (run, [left, trend, weight]) in found.into_iter().flatten() {
        let sums = runs.entry(run).or_default();
        *sums = [sums[0] + left, sums[1] + trend, sums[2] + weight];
    }
    let level = |(run, [left, trend, weight]): (&usize, &[f64; 3])| {
        let level = Level { left_nm: left / weight, trend_nm: trend / weight };
        (*weight > 0.0).then(|| (condition(setting, *run), level))
    };
    Ok(is_contradicted(&runs.iter().filter_map(level).collect::<Vec<_>>()))
}

/// Weighted sums over a piece's moving samples: residual friction, added friction, weight.
fn sums(piece: &Piece, before: &[f64], after: &[f64]) -> [f64; 3] {
    let mut sums = [0.0; 3];
    let samples = piece.measured.iter().zip(before).zip(after).zip(&piece.weights).enumerate();
    for (index, (((measured, before), after), weight)) in samples {
        let speed = piece.kinematics(index).1;
        if *weight > 0.0 && speed != 0.0 {
            let (sign, weight) = (speed.signum(), weight * weight);
            let [left, trend, all] = &mut sums;
            *left += weight * sign * (measured - before);
            *trend += weight * sign * (after - before);
            *all += weight;
        }
    }
    sums
}

/// The conditions of a run: class of motion, direction, pressure and temperature.
fn condition(setting: &Setting<'_>, run: usize) -> Condition {
    let campaign = setting.campaign;
    let pieces = || campaign.pieces.iter().filter(|piece| piece.run == run);
    let mean = |of: fn(&Piece) -> &[f64]| {
        let (sum, count) =
            pieces().flat_map(of).fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
        sum / f64::from(count.max(1))
    };
    let same_mpa = SAME_MPA.max(SAME_PART * campaign.facts.greatest_pressure_mpa());
    let pressure_mpa = mean(|piece| piece.driven.pressure_pa()) / 1e6;
    let temperature_c = mean(|piece| piece.driven.temperature_c());
    let ends = pieces().next().zip(pieces().next_back());
    let turn = ends
        .map_or(0.0, |(first, last)| last.kinematics(last.len().saturating_sub(1)).0 - first.kinematics(0).0);
    let span = campaign.facts.angle_rad.1 - campaign.facts.angle_rad.0;
    let direction = if turn.abs() < 0.5 * span { 0 } else { turn.signum() as i8 };
    let class = campaign.classes.get(run).copied().unwrap_or_default();
    (class, direction, (pressure_mpa / same_mpa).round() as i64, (temperature_c / SAME_K).round() as i64)
}

/// True if, among repetitions of the same condition, the friction level follows less than half of the trend that was fitted.
fn is_contradicted(levels: &[(Condition, Level)]) -> bool {
    let mut conditions: BTreeMap<Condition, Vec<Level>> = BTreeMap::new();
    levels.iter().for_each(|(condition, level)| conditions.entry(*condition).or_default().push(*level));
    let freedom = levels.len().saturating_sub(conditions.len() + 1);
    if freedom + 1 < LEAST_REPEATS {
        return false;
    }
    let count = levels.len() as f64;
    let mean = levels.iter().map(|(_, level)| level.trend_nm).sum::<f64>() / count;
    let whole = levels.iter().map(|(_, level)| (level.trend_nm - mean).powi(2)).sum::<f64>();
    let apart: Vec<(f64, f64)> = conditions.values().flat_map(|alike| about_their_mean(alike)).collect();
    let (xx, xy) = apart.iter().fold((0.0, 0.0), |(xx, xy), (x, y)| (xx + x * x, xy + x * y));
    if xx < SPANS * SPANS * whole || xx <= 0.0 {
        return false;
    }
    let slope = xy / xx;
    let left: f64 = apart.iter().map(|(x, y)| (y - slope * x).powi(2)).sum();
    let freedom = freedom.max(1) as f64;
    let error = (left / freedom / xx).sqrt();
    let factor = StudentsT::new(0.0, 1.0, freedom).map_or(3.0, |t| t.inverse_cdf(1.0 - CHANCE));
    slope + factor * error < LEAST_PART
}

fn about_their_mean(levels: &[Level]) -> Vec<(f64, f64)> {
    let count = levels.len() as f64;
    let (x, y) =
        levels.iter().fold((0.0, 0.0), |(x, y), of| (x + of.trend_nm / count, y + of.left_nm / count));
    levels.iter().map(|of| (of.trend_nm - x, of.left_nm - y)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three times four pressures; friction by pressure and by wear, with a scatter.
    fn levels(by_pressure: f64, by_wear: f64) -> Vec<(Condition, Level)> {
        let scatter = [0.3, -0.4, 0.1, 0.5, -0.2, -0.3, 0.4, -0.1, 0.2, -0.5, 0.0, 0.1];
        let run = |(run, scatter): (usize, &f64)| {
            let (pressure, trend_nm) = ((run % 4) as i64, run as f64);
            let left_nm = by_pressure * pressure as f64 + by_wear * trend_nm + scatter;
            ((Class::default(), 0, pressure, 0), Level { left_nm, trend_nm })
        };
        scatter.iter().enumerate().map(run).collect()
    }

    #[test]
    fn friction_that_comes_back_with_the_pressure_is_no_wear() {
        assert!(is_contradicted(&levels(2.0, 0.0)));
        assert!(!is_contradicted(&levels(0.0, 1.0)));
        assert!(!is_contradicted(&levels(2.0, 1.0)), "both at once");
        assert!(!is_contradicted(levels(2.0, 0.0).get(..4).unwrap_or_default()), "nothing is repeated");
    }
}
