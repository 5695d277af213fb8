//! Whether the runs' zeros go by what the runs differ in: then they are no zeros, but a torque that nothing explains yet.

use crate::DiagnosisError;
use crate::fit::equations::{Point, Setting};
use crate::log::campaign::Campaign;
use crate::log::driven::Driven;
use crate::numerics::statistics::{CHANCE, holm, standardised};
use crate::show::own_zeros::{OwnZero, zeros_of_runs};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// Zeros go by the conditions if these account for this part of what the course of time leaves of their squares.
const MOST: f64 = 0.5;
/// The course of time and a curve over a condition are five numbers: of no more runs nothing is left to judge by.
const LEAST_RUNS: usize = 6;
/// A singular value below this part of the largest counts as none: two levels of a condition tell a line and no curve.
const RANK: f64 = 1e-6;

/// What a run's zero is compared with.
#[derive(Debug, Clone, Copy)]
struct Conditions {
    /// The run's place in the log.
    place: f64,
    /// The mean of its times, and the last of them.
    time_s: f64,
    last_s: f64,
    /// The means of what was recorded or set.
    pressure_pa: f64,
    temperature_c: f64,
    angle_rad: f64,
}

/// Whether the zeros of a torque's runs go by pressure, temperature or the angle that the runs are about, and not by the time at which they were
/// made alone, as a transducer that drifts does: a partial F-test of curves of the second degree in each, and of a surface in the first two. Where a condition changed as time went
/// on, nothing tells the two apart; zeros that are larger than the tolerance of the transducer's own are no drift then.
pub(crate) fn go_by_conditions(setting: &Setting<'_>, point: &Point) -> Result<bool, DiagnosisError> {
    if setting.nuisances.zero_nm == 0.0 {
        return Ok(false);
    }
    let runs = runs_of(setting, point)?;
    Ok(go_by(&runs) || with_time(&runs).is_some() && are_larger(&runs, setting.nuisances.zero_nm))
}

/// The condition that the zeros go by where that changed as time went on: a drift and a torque by that condition look the same then.
pub(crate) fn changed_with_time(
    setting: &Setting<'_>,
    point: &Point,
) -> Result<Option<&'static str>, DiagnosisError> {
    Ok(with_time(&runs_of(setting, point)?))
}

fn runs_of(setting: &Setting<'_>, point: &Point) -> Result<Vec<(OwnZero, Conditions)>, DiagnosisError> {
    let zeros = zeros_of_runs(setting, point)?;
    Ok(zeros.into_iter().map(|(run, zero)| (zero, conditions(setting, run))).collect())
}

/// The mean of a channel over a run's pieces; `None` where it was not recorded.
pub(crate) fn mean_in_run(campaign: &Campaign, run: usize, of: fn(&Driven) -> &[f64]) -> Option<f64> {
    let pieces = campaign.pieces.iter().filter(|piece| piece.run == run);
    mean(pieces.flat_map(|piece| of(&piece.driven)).copied())
}

/// The mean of what is known of values; `None` where nothing is.
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let known = values.filter(|value| value.is_finite());
    let (sum, count) = known.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    (count > 0.0).then(|| sum / count)
}

/// The means over a run's pieces; 0 throughout for a channel that was not recorded.
fn conditions(setting: &Setting<'_>, run: usize) -> Conditions {
    let of_channel = |of: fn(&Driven) -> &[f64]| mean_in_run(setting.campaign, run, of).unwrap_or(0.0);
    let pieces = || setting.campaign.pieces.iter().filter(|piece| piece.run == run);
    let angles = pieces().flat_map(|piece| (0..piece.len()).map(|index| piece.kinematics(index).0));
    let last_s = pieces().filter_map(|piece| piece.driven.time_s().last().copied()).fold(f64::MIN, f64::max);
    Conditions {
        place: run as f64,
        time_s: of_channel(|of| of.time_s()),
        last_s,
        pressure_pa: of_channel(|of| of.pressure_pa()),
        temperature_c: of_channel(|of| of.temperature_c()),
        angle_rad: mean(angles).unwrap_or(0.0),
    }
}

/// A condition's values in all runs, standardised; zeros where it is the same in all of them, and tells nothing.
fn column(runs: &[(OwnZero, Conditions)], of: fn(&Conditions) -> f64) -> DVector<f64> {
    let values: Vec<f64> = runs.iter().map(|(_, conditions)| of(conditions)).collect();
    DVector::from_vec(standardised(&values).unwrap_or_else(|| vec![0.0; values.len()]))
}

/// When the runs were made. Where every run's clock begins anew, their order is all that is known of it.
fn times(runs: &[(OwnZero, Conditions)]) -> DVector<f64> {
    let all = |of: fn(&Conditions) -> f64| runs.iter().map(move |(_, conditions)| of(conditions));
    let begins_anew =
        all(|of| of.time_s).fold(f64::MIN, f64::max) <= all(|of| of.last_s).fold(f64::MAX, f64::min);
    column(runs, if begins_anew { |of| of.place } else { |of| of.time_s })
}

fn curve(x: &DVector<f64>) -> Vec<DVector<f64>> {
    vec![x.clone(), x.component_mul(x)]
}

fn one_for_all(runs: &[(OwnZero, Conditions)]) -> Vec<DVector<f64>> {
    vec![DVector::from_element(runs.len(), 1.0)]
}

fn go_by(runs: &[(OwnZero, Conditions)]) -> bool {
    if runs.len() < LEAST_RUNS {
        return false;
    }
    let (pressure, temperature) = (column(runs, |of| of.pressure_pa), column(runs, |of| of.temperature_c));
    let angle = column(runs, |of| of.angle_rad);
    let both = vec![pressure.component_mul(&temperature)];
    let surface = [curve(&pressure), curve(&temperature), both].concat();
    let course = [one_for_all(runs), curve(&times(runs))].concat();
    let tested = [curve(&pressure), curve(&temperature), curve(&angle), surface];
    let mut found: Vec<(f64, f64)> =
        tested.into_iter().filter_map(|added| partial_f(runs, &course, added)).collect();
    holm(found.iter_mut().map(|(_, p_value)| p_value));
    found.iter().any(is_clear)
}

/// Whether zeros of this standard deviation are so large by chance only seldom: a χ² test.
fn are_larger(runs: &[(OwnZero, Conditions)], deviation_nm: f64) -> bool {
    let squares: f64 = runs.iter().map(|(zero, _)| (zero.zero / deviation_nm).powi(2)).sum();
    ChiSquared::new(runs.len() as f64).is_ok_and(|of| of.sf(squares) < CHANCE)
}

/// The first condition of which a curve accounts for the zeros as one of time does.
fn with_time(runs: &[(OwnZero, Conditions)]) -> Option<&'static str> {
    if runs.len() < LEAST_RUNS {
        return None;
    }
    let accounts =
        |of: &DVector<f64>| partial_f(runs, &one_for_all(runs), curve(of)).is_some_and(|of| is_clear(&of));
    let (pressure, temperature) = (column(runs, |of| of.pressure_pa), column(runs, |of| of.temperature_c));
    let known = [("pressure drop", pressure), ("oil temperature", temperature)];
    let found = known.into_iter().find(|(_, column)| accounts(column));
    found.filter(|_| accounts(&times(runs))).map(|(name, _)| name)
}

/// Whether so large a part, with this p-value, is beyond chance.
fn is_clear((accounts, p_value): &(f64, f64)) -> bool {
    *accounts > MOST && *p_value < CHANCE
}

/// The part of the squares left by `course` for which the columns `added` account, and how likely that is by chance. Each zero counts by what
/// its run tells of it. `None` where nothing is added, or nothing is left to judge by.
fn partial_f(
    runs: &[(OwnZero, Conditions)],
    course: &[DVector<f64>],
    added: Vec<DVector<f64>>,
) -> Option<(f64, f64)> {
    let (before, rank_before) = squares_left(runs, course)?;
    let (after, rank) = squares_left(runs, &[course.to_vec(), added].concat())?;
    let freedom = runs.len().checked_sub(rank).filter(|freedom| *freedom > 0)? as f64;
    let added = rank.checked_sub(rank_before).filter(|added| *added > 0)? as f64;
    let ratio = (before - after).max(0.0) / added / (after / freedom).max(f64::MIN_POSITIVE);
    let p_value = FisherSnedecor::new(added, freedom).map_or(1.0, |of| of.sf(ratio));
    Some((1.0 - after / before.max(f64::MIN_POSITIVE), p_value))
}

/// The weighted sum of squares that the columns leave of the zeros, and the columns' rank.
fn squares_left(runs: &[(OwnZero, Conditions)], columns: &[DVector<f64>]) -> Option<(f64, usize)> {
    let roots = DVector::from_iterator(runs.len(), runs.iter().map(|(zero, _)| zero.told.max(0.0).sqrt()));
    let zeros = DVector::from_iterator(runs.len(), runs.iter().map(|(zero, _)| zero.zero));
    let weighted: Vec<DVector<f64>> = columns.iter().map(|column| column.component_mul(&roots)).collect();
    let matrix = DMatrix::from_columns(&weighted);
    let wanted = zeros.component_mul(&roots);
    let svd = matrix.clone().svd(true, true);
    let least = RANK * svd.singular_values.max();
    let numbers = svd.solve(&wanted, least).ok()?;
    Some(((wanted - matrix * numbers).norm_squared(), svd.rank(least)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// Runs at four pressures and three temperatures in random order, with zeros of 1 N·m standard deviation beside `law` (of time from 0 to
    /// 1, pressure and temperature).
    fn runs(count: usize, seed: u64, law: impl Fn(f64, f64, f64) -> f64) -> Vec<(OwnZero, Conditions)> {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let run = |index: usize| {
            let (pressure, temperature) = (random.random_range(0..4), random.random_range(0..3));
            let (pressure, temperature) = (f64::from(pressure), f64::from(temperature));
            let chance: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
            let zero = chance + law(index as f64 / count as f64, pressure, temperature);
            let conditions = Conditions {
                place: index as f64,
                time_s: if seed.is_multiple_of(2) { 60.0 * index as f64 } else { 3.0 + 0.1 * pressure },
                last_s: if seed.is_multiple_of(2) { 60.0 * index as f64 + 3.0 } else { 6.0 },
                pressure_pa: 1e6 * pressure,
                temperature_c: 30.0 + 10.0 * temperature,
                angle_rad: random.random_range(-1.0..1.0),
            };
            (OwnZero { zero, told: 1.0 }, conditions)
        };
        (0..count).map(run).collect()
    }

    fn share(count: usize, law: impl Fn(f64, f64, f64) -> f64 + Copy) -> usize {
        (0..200).filter(|seed| go_by(&runs(count, *seed, law))).count()
    }

    #[test]
    fn zeros_go_by_a_condition_beyond_chance_and_beyond_drift() {
        for count in [5, 6, 12, 24] {
            let by_chance = share(count, |_, _, _| 0.0);
            assert!(by_chance <= 6, "{by_chance} of 200 by chance, {count} runs");
            let drifting = share(count, |time, _, _| 20.0 * time);
            assert!(drifting <= 6, "{drifting} of 200 that drift, {count} runs");
        }
        let by_angle = |seed: &u64| {
            let mut runs = runs(16, *seed, |_, _, _| 0.0);
            runs.iter_mut().for_each(|(zero, conditions)| zero.zero += 8.0 * conditions.angle_rad);
            go_by(&runs)
        };
        assert!((0..200).filter(by_angle).count() > 180);
        assert!(share(16, |_, pressure, _| 4.0 * pressure) > 180);
        assert!(share(16, |_, _, temperature| 4.0 * temperature.powi(2)) > 180);
        assert!(share(24, |_, pressure, temperature| 4.0 * (pressure - 1.5) * (temperature - 1.0)) > 180);
    }

    #[test]
    fn what_changed_with_time_looks_like_a_drift() {
        let rising = |count: usize, by_pressure: f64, by_time: f64| {
            let mut runs = runs(count, 4, |time, _, _| by_time * time);
            for (index, (zero, conditions)) in runs.iter_mut().enumerate() {
                conditions.pressure_pa = 1e6 * index as f64;
                conditions.temperature_c = 40.0;
                zero.zero += by_pressure * index as f64;
            }
            runs
        };
        assert_eq!(with_time(&rising(12, 2.0, 0.0)), Some("pressure drop"));
        assert_eq!(with_time(&rising(12, 0.0, 20.0)), Some("pressure drop"));
        assert_eq!(with_time(&rising(12, 0.0, 0.0)), None, "zeros by chance");
        assert!(!go_by(&rising(12, 2.0, 0.0)), "nothing tells it from a drift");
        // A drift while the pressure goes up and down is one; a torque by the pressure is one then.
        assert_eq!(with_time(&runs(24, 2, |time, _, _| 20.0 * time)), None);
        assert_eq!(with_time(&runs(24, 2, |_, pressure, _| 4.0 * pressure)), None);
    }

    #[test]
    fn zeros_within_their_tolerance_are_no_larger() {
        let of = |deviation_nm: f64| {
            (0..200).filter(|seed| are_larger(&runs(12, *seed, |_, _, _| 0.0), deviation_nm)).count()
        };
        assert!(of(1.0) <= 6 && of(0.5) > 180, "{} and {} of 200", of(1.0), of(0.5));
        assert!(!are_larger(&[], 1.0));
    }

    #[test]
    fn conditions_that_never_change_explain_nothing() {
        let mut same = runs(12, 1, |_, _, _| 0.0);
        for (_, conditions) in &mut same {
            (conditions.pressure_pa, conditions.temperature_c) = (3e6, 40.0);
        }
        assert!(!go_by(&same));
        assert!(!go_by(&[]));
    }
}
