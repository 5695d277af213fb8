//! The zero of each run's own: its size, and whether such offsets are what zeros are.

use crate::DiagnosisError;
use crate::extend::hypothesis::{Correction, Hypothesis};
use crate::fit::equations::{Additive, Column, Nuisances, PieceEquations, Point, Setting};
use crate::numerics::statistics::CHANCE;
use crate::show::observe::shows_zeros;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::collections::BTreeMap;
use valve_model::EffectId;

/// Offsets of each run beyond so many standard deviations of the model's own, as RMS, are no zeros: of two runs one in 10,000 has them by chance.
const PLAUSIBLE: f64 = 3.0;
/// A common zero beyond so many standard deviations is off by more than its tolerance.
const MOST_COMMON: f64 = Correction::MOST;

/// A run's own zero, N·m or rad, and what the run tells of it beside its initial state, 0 to 1: a spool that rests keeps the torque that it
/// began with, and that is no zero.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OwnZero {
    pub zero: f64,
    pub told: f64,
}

/// The own zeros of all runs: pieces of one run have one zero, and are no further witnesses of what zeros scatter about.
pub(crate) fn own_zeros(setting: &Setting<'_>, point: &Point) -> Result<Vec<OwnZero>, DiagnosisError> {
    Ok(zeros_of_runs(setting, point)?.into_iter().map(|(_, zero)| zero).collect())
}

/// The own zeros, each with its run.
pub(crate) fn zeros_of_runs(
    setting: &Setting<'_>,
    point: &Point,
) -> Result<Vec<(usize, OwnZero)>, DiagnosisError> {
    let runs = zeros_of_pieces(setting, point)?;
    Ok(runs.into_iter().filter_map(|(run, pieces)| Some((run, zero_of_run(&pieces)?))).collect())
}

/// The own zeros of each run's pieces, as if each piece had one.
fn zeros_of_pieces(
    setting: &Setting<'_>,
    point: &Point,
) -> Result<BTreeMap<usize, Vec<OwnZero>>, DiagnosisError> {
    let plain = Setting { nuisances: Nuisances { zero_nm: 0.0, angle_zero: false }, ..*setting };
    let equations = plain.equations(point, &[Column::Direct(Additive::Constant)], |_| true)?;
    let ridge = setting.nuisances.zero_ridge();
    let zero = |piece: PieceEquations| {
        let at = |column: usize| piece.gram.matrix.get((0, column)).copied().unwrap_or(0.0);
        let (data, cross) = (at(0), at(1));
        let all = (data + ridge).max(f64::MIN_POSITIVE);
        OwnZero { zero: cross / all, told: data / all }
    };
    let mut runs: BTreeMap<usize, Vec<OwnZero>> = BTreeMap::new();
    for (piece, equations) in setting.campaign.pieces.iter().zip(equations) {
        runs.entry(piece.run).or_default().extend(equations.map(zero));
    }
    Ok(runs)
}

/// A run's zero: the mean of its pieces', each by what it tells. The run tells what the best of them does.
fn zero_of_run(pieces: &[OwnZero]) -> Option<OwnZero> {
    let told: f64 = pieces.iter().map(|of| of.told).sum();
    let sum: f64 = pieces.iter().map(|of| of.told * of.zero).sum();
    let best = pieces.iter().map(|of| of.told).reduce(f64::max)?;
    Some(OwnZero { zero: sum / told.max(f64::MIN_POSITIVE), told: best })
}

/// Whether offsets of each run are what zeros are: as small, about none, and the same throughout the run. One offset of them all beyond the
/// transducer's tolerance, or friction that the model has too much of in one direction, is in every run's offset, and these would take the place of
/// it; and so they would of a torque by the angle, which differs from stretch to stretch as the angle does.
pub(crate) fn zeros_hold(setting: &Setting<'_>, point: &Point) -> Result<bool, DiagnosisError> {
    let zero_nm = setting.nuisances.zero_nm;
    if zero_nm == 0.0 {
        return Ok(true);
    }
    let pieces: Vec<Vec<OwnZero>> = zeros_of_pieces(setting, point)?.into_values().collect();
    let zeros: Vec<OwnZero> = pieces.iter().filter_map(|pieces| zero_of_run(pieces)).collect();
    // Runs that go one way each tell no zero from friction: no common offset of theirs is the transducer's.
    let room = if shows_zeros(setting.campaign) {
        Room { taken: common_zero(&point.hypothesis), most: MOST_COMMON * zero_nm }
    } else {
        Room::default()
    };
    let plausible = rms_of_zeros(&zeros) < PLAUSIBLE * zero_nm;
    Ok(plausible && are_about_none(&zeros, room) && !wander(&pieces, zero_nm))
}

/// Whether what would be zeros of runs differs within the runs by more than a zero may be off by.
pub(crate) fn zeros_wander(setting: &Setting<'_>, point: &Point) -> Result<bool, DiagnosisError> {
    let pieces: Vec<Vec<OwnZero>> = zeros_of_pieces(setting, point)?.into_values().collect();
    Ok(wander(&pieces, setting.nuisances.zero_nm))
}

/// Whether the zeros of runs' pieces scatter within the runs by more than what a zero may be off by: what differs from piece to piece is none of
/// the run's.
fn wander(runs: &[Vec<OwnZero>], zero_nm: f64) -> bool {
    let (mut squares, mut pieces) = (0.0, 0.0);
    for run in runs {
        let told: f64 = run.iter().map(|of| of.told).sum();
        squares += told * mean_and_scatter(run).1.powi(2);
        pieces += told;
    }
    let freedom = pieces - runs.len() as f64;
    freedom >= 1.0 && squares / freedom > zero_nm * zero_nm
}

/// What the transducer's tolerance leaves for a common zero.
#[derive(Debug, Clone, Copy, Default)]
struct Room {
    /// The part that a correction took.
    taken: f64,
    /// The largest common zero within the tolerance.
    most: f64,
}

/// The common zero that a correction within the tolerance took.
fn common_zero(hypothesis: &Hypothesis) -> f64 {
    let own = hypothesis.corrections.iter().find(|of| of.id == EffectId::TorqueOffset);
    own.map_or(0.0, |of| of.value)
}

/// Student's test of their mean beyond the room for it, each by what it tells.
fn are_about_none(zeros: &[OwnZero], room: Room) -> bool {
    let told: f64 = zeros.iter().map(|of| of.told).sum();
    let (mean, scatter) = mean_and_scatter(zeros);
    let freedom = told - 1.0;
    let Ok(student) = StudentsT::new(0.0, 1.0, freedom) else { return true };
    let beyond = (mean + room.taken).abs() - room.most;
    let t = beyond.max(0.0) * freedom.sqrt() / scatter;
    t.is_nan() || 2.0 * student.sf(t) >= CHANCE
}

/// RMS of own zeros, each by what its run tells of it.
fn rms_of_zeros(zeros: &[OwnZero]) -> f64 {
    let (squares, told) = zeros
        .iter()
        .fold((0.0, 0.0), |(squares, told), of| (squares + of.told * of.zero.powi(2), told + of.told));
    (squares / f64::max(told, f64::MIN_POSITIVE)).sqrt()
}

/// Mean of own zeros, and their standard deviation about it, each by what its run tells of it.
pub(crate) fn mean_and_scatter(zeros: &[OwnZero]) -> (f64, f64) {
    let told = zeros.iter().map(|of| of.told).sum::<f64>().max(f64::MIN_POSITIVE);
    let mean = zeros.iter().map(|of| of.told * of.zero).sum::<f64>() / told;
    let square = zeros.iter().map(|of| of.told * (of.zero - mean).powi(2)).sum::<f64>() / told;
    (mean, square.sqrt())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::fixtures;
    use crate::log::campaign::Campaign;
    use crate::log::piece::Piece;
    use crate::workers::OneAfterTheOther;
    use log_data::{Log, Run};
    use prediction::{Past, predict};
    use valve_model::Model;

    const ZERO_NM: f64 = 0.02;

    /// A run of 2 s whose torque is the model's and `more_nm`.
    fn run(model: &Model, number: usize, angle: impl Fn(f64) -> f64, more_nm: f64) -> Run {
        let times: Vec<f64> = (0..1000).map(|k| 2e-3 * f64::from(k)).collect();
        let mut run = Run {
            name: format!("{number}"),
            angle_rad: times.iter().map(|at| angle(*at)).collect(),
            time_s: times.iter().map(|at| at + 10.0 * number as f64).collect(),
            torque_nm: Some(vec![0.0; times.len()]),
            ..Run::default()
        };
        predict(&mut run, model, &Past::default()).unwrap();
        run.torque_nm.iter_mut().flatten().for_each(|torque| *torque += more_nm);
        run
    }

    /// A torque from before the run is no zero of a spool that rests through it.
    #[test]
    fn what_a_resting_spool_keeps_is_no_zero_of_its_run() {
        let given = fixtures::model(Vec::new());
        let swing = |at: f64| 0.3 * (4.0 * at).sin();
        let zeros = [ZERO_NM, -ZERO_NM, ZERO_NM, -ZERO_NM];
        let mut runs: Vec<Run> =
            zeros.iter().enumerate().map(|(number, zero)| run(&given, number, swing, *zero)).collect();
        runs.extend((4..8).map(|number| run(&given, number, |_| 0.1, 0.7)));
        let mut campaign =
            Campaign::new(&Log { runs, ..Log::default() }, &given, 0, &OneAfterTheOther).unwrap();
        campaign.pieces.iter_mut().for_each(|piece| piece.weights.fill(1e3));
        let nuisances = Nuisances { zero_nm: ZERO_NM, angle_zero: false };
        let setting = Setting::new(&campaign, &given, nuisances, &OneAfterTheOther);
        let hypothesis = Hypothesis::default();
        let ready = setting.ready(&hypothesis).unwrap();
        // A search leaves starts where they were found under other levels.
        let start = |piece: &Piece| {
            let first = piece.first_start(&ready);
            if piece.run < zeros.len() { first } else { first.shifted(0.4) }
        };
        let starts = campaign.pieces.iter().map(start).collect();
        let found = rms_of_zeros(&own_zeros(&setting, &Point { hypothesis, starts }).unwrap());
        assert!((0.8 * ZERO_NM..1.2 * ZERO_NM).contains(&found), "{found} N·m");
    }

    #[test]
    fn zeros_of_runs_scatter_about_none() {
        let zeros = |mean: f64, told: f64, count: usize| -> Vec<OwnZero> {
            let side = |index: usize| if index.is_multiple_of(2) { 1.0 } else { -1.0 };
            (0..count).map(|index| OwnZero { zero: mean + side(index), told }).collect()
        };
        for (mean, told, count, about_none) in [
            (0.0, 1.0, 16, true),
            (0.5, 1.0, 16, true),
            (1.0, 1.0, 16, false),
            (-1.0, 1.0, 16, false),
            // Of two runs, or of runs that hardly tell of their zeros, nothing is known.
            (1.0, 1.0, 2, true),
            (1.0, 0.1, 16, true),
        ] {
            assert_eq!(
                are_about_none(&zeros(mean, told, count), Room::default()),
                about_none,
                "{mean}, {told}, {count}"
            );
        }
    }

    #[test]
    fn a_zero_of_a_run_is_the_same_in_all_of_it() {
        let run = |zeros: [f64; 4]| zeros.map(|zero| OwnZero { zero, told: 1.0 }).to_vec();
        let runs = |of_runs: f64, of_pieces: f64| -> Vec<Vec<OwnZero>> {
            let own = [1.1, -0.8, 0.9, -1.2, 0.7, -0.9];
            let pieces = [[0.9, -1.1, 0.4, -0.2], [-1.3, 0.8, 0.6, -0.1], [0.2, 1.2, -0.9, -0.5]];
            (0..6).map(|at| run(pieces[at % 3].map(|piece| of_runs * own[at] + of_pieces * piece))).collect()
        };
        for (of_runs, of_pieces, zero_nm, wanders) in [
            (1.0, 0.1, 1.0, false),
            (0.3, 1.5, 1.0, true),
            (4.0, 1.5, 1.0, true),
            // Less than a zero may be off by.
            (0.1, 0.5, 1.0, false),
        ] {
            assert_eq!(
                wander(&runs(of_runs, of_pieces), zero_nm),
                wanders,
                "{of_runs} {of_pieces} {zero_nm}"
            );
        }
        assert!(
            !wander(&[run([2.0; 4])[..1].to_vec(), run([-2.0; 4])[..1].to_vec()], 0.1),
            "one piece a run"
        );
    }

    #[test]
    fn a_common_zero_within_the_tolerance_is_none_of_each_run() {
        let zeros = |mean: f64| {
            [mean - 0.1, mean + 0.1, mean - 0.1, mean + 0.1, mean].map(|zero| OwnZero { zero, told: 1.0 })
        };
        for (mean, taken, most, about_none) in [
            (0.9, 0.0, 1.0, true),
            (1.9, 0.0, 1.0, false),
            (0.9, 1.0, 1.0, false),
            (-0.9, 1.0, 1.0, true),
            (0.0, 1.0, 1.0, true),
        ] {
            assert_eq!(
                are_about_none(&zeros(mean), Room { taken, most }),
                about_none,
                "{mean} {taken} {most}"
            );
        }
    }
}
