//! How a log is cut: runs into pieces, pieces into groups, groups into folds and those held out.

use crate::log::classes::Class;
use crate::log::driven::lead_of;
use crate::log::kind::LogKind;
use crate::log::past::Before;
use crate::log::piece::Piece;
use log_data::{Log, Run};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Samples of the longest piece.
const LONGEST: usize = 20_000;
/// Of torques that are not all fitted, long runs are cut so short that so many pieces are: enough to judge by.
const PIECES_OF_TORQUES: usize = 8;
/// Of a longer log's angles this many pieces of each run are fitted.
const PIECES_OF_A_RUN: usize = 2;
/// Least length of such a short piece, samples: long enough to justify the simulation of its lead.
const LEAST_PIECE: usize = 1000;
/// Where this many runs move alike, whole runs are fitted or held out; runs with fewer alike are cut into `BLOCKS` blocks, of which one is held out.
const RUNS_ALIKE: usize = 4;
const BLOCKS: usize = HOLD_OUT;
/// A log of fewer runs is cut into `BLOCKS_IN_ALL` blocks: with six groups the between-group standard error is uncertain by half
/// (Student's t is 2.6), with three it is useless (4.3).
const FEW_RUNS: usize = 8;
const BLOCKS_IN_ALL: usize = 20;
/// Least samples of a block.
const LEAST_BLOCK: usize = 400;
/// Most samples that are predicted to see what the pieces that are not fitted hold: a tenth of what a search may simulate.
const MOST_PREDICTED: usize = 1_000_000;
/// One group in this many is held out.
const HOLD_OUT: usize = 4;
const FOLDS: usize = 5;

/// A piece before its data are prepared.
pub(crate) struct Plan {
    pub run: usize,
    pub rows: Range<usize>,
    /// Where its prediction begins.
    pub lead_row: usize,
    pub group: usize,
    /// The state of the contact before its lead.
    pub past: Before,
}

/// How long pieces are, samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Longest {
    /// A run no longer than this is one piece, fitted whole or not at all: it holds a slow motion's both ways, which tell friction from an
    /// offset.
    pub run: usize,
    /// Pieces of a longer run.
    pub piece: usize,
}

/// The longest pieces. Where a log is not fitted whole, those of long runs are short enough that there are enough of them to judge by.
pub(crate) fn longest(log: &Log, usable: &[bool], kind: LogKind) -> Longest {
    let runs = || log.runs.iter().zip(usable).filter(|(_, usable)| **usable).map(|(run, _)| run);
    let total: usize = runs().map(Run::len).sum();
    let fitted = kind.fitted_samples(total);
    if total <= fitted {
        return Longest { run: LONGEST, piece: LONGEST };
    }
    if kind.motion_is_measured {
        return Longest { run: LONGEST, piece: fitted / PIECES_OF_TORQUES };
    }
    let each = (fitted / runs().count().max(1) / PIECES_OF_A_RUN).clamp(LEAST_PIECE, LONGEST);
    Longest { run: each, piece: each }
}

/// Cuts the runs: into groups of whole runs where enough move alike, into blocks otherwise.
pub(crate) fn plan(
    log: &Log,
    (usable, classes): (&[bool], &[Class]),
    kind: LogKind,
    longest: Longest,
) -> (Vec<Plan>, Vec<String>) {
    let mut alike: BTreeMap<Class, usize> = BTreeMap::new();
    let runs =
        || log.runs.iter().zip(usable).zip(classes).enumerate().filter(|(_, ((_, usable), _))| **usable);
    runs().for_each(|(_, (_, class))| *alike.entry(*class).or_default() += 1);
    let total = runs().count();
    let few = total < FEW_RUNS;
    let blocks_of_each = BLOCKS_IN_ALL.div_ceil(total.max(1)).max(BLOCKS);
    let (mut plans, mut groups) = (Vec::new(), Vec::new());
    for (index, ((run, _), class)) in runs() {
        let whole = !few && alike.get(class).is_some_and(|count| *count >= RUNS_ALIKE);
        let wanted = if whole { 1 } else { blocks_of_each.min(run.len() / LEAST_BLOCK).max(1) };
        let cut = if run.len() > longest.run { run.len().div_ceil(longest.piece) } else { 1 };
        let blocks = wanted.max(cut);
        let group = groups.len();
        for block in 0..blocks {
            let rows = run.len() * block / blocks..run.len() * (block + 1) / blocks;
            let own = if whole { group } else { group + block };
            if !whole || block == 0 {
                let name = if whole || blocks == 1 { run.name.clone() } else { block_name(run, &rows) };
                groups.push(name);
            }
            let past = Before::default();
            // A torque log's motion is measured at every sample. An angle log's state is estimated where the prediction begins.
            let lead_row = if kind.motion_is_measured { rows.start } else { lead_of(run, rows.start) };
            plans.push(Plan { run: index, rows, lead_row, group: own, past });
        }
    }
    (plans, groups)
}

fn block_name(run: &Run, rows: &Range<usize>) -> String {
    let at = |row: usize| run.time_s.get(row).copied().unwrap_or(f64::NAN);
    format!("{}@{:.3}..{:.3}", run.name, at(rows.start), at(rows.end - 1))
}

/// A piece's run and first row.
pub(crate) type Place = (usize, usize);

/// Which pieces of a log that is too long to be fitted whole are taken.
#[derive(Clone, Copy)]
pub(crate) enum Choice<'a> {
    /// A random sample, and these.
    Fitted(&'a BTreeSet<Place>),
    /// As many as one prediction can afford.
    Predicted,
}

/// Chooses pieces: all, or of a log with too many samples some of each run in proportion, at random within the run; of runs that are one
/// piece each, some at random.
pub(crate) fn choose(plans: &[Plan], kind: LogKind, choice: Choice<'_>, seed: u64) -> Vec<bool> {
    let total: usize = plans.iter().map(|plan| plan.rows.len()).sum();
    let (samples, also) = match choice {
        Choice::Fitted(also) => (kind.fitted_samples(total), Some(also)),
        Choice::Predicted => (total.min(MOST_PREDICTED), None),
    };
    let part = samples as f64 / total as f64;
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut due = random.random_range(0.0..1.0);
    let places: Vec<usize> = (0..plans.len()).collect();
    let run = |place: &usize| plans.get(*place).map(|plan| plan.run);
    let mut of_runs: Vec<Vec<usize>> =
        places.chunk_by(|a, b| run(a) == run(b)).map(<[usize]>::to_vec).collect();
    // A plan of measurements goes through its levels in turn: one run of so many in their order would leave out a level.
    of_runs.shuffle(&mut random);
    of_runs.iter_mut().for_each(|of_a_run| of_a_run.shuffle(&mut random));
    let forced = |plan: &Plan| also.is_some_and(|also| also.contains(&(plan.run, plan.rows.start)));
    let mut chosen: Vec<bool> = plans.iter().map(|plan| part >= 1.0 || forced(plan)).collect();
    for place in of_runs.into_iter().flatten().filter(|_| part < 1.0) {
        due += part;
        if due >= 1.0 {
            due -= 1.0;
            chosen.get_mut(place).into_iter().for_each(|chosen| *chosen = true);
        }
    }
    chosen
}

/// Assigns groups to the folds or to those held out. Groups alike in motion, direction and pressure are spread over all of them.
pub(crate) fn deal(
    classes: &[Class],
    pieces: &[Piece],
    (groups, thinned): (usize, bool),
    seed: u64,
) -> (Vec<bool>, Vec<usize>) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut keys: Vec<(Class, i8, i64, u32, usize)> = Vec::new();
    for group in 0..groups {
        let Some(piece) = pieces.iter().find(|piece| piece.group == group) else { continue };
        let class = classes.get(piece.run).copied().unwrap_or_default();
        let turn = piece.kinematics(piece.len().saturating_sub(1)).0 - piece.kinematics(0).0;
        let direction = if turn.abs() < 1e-3 { 0 } else { turn.signum() as i8 };
        let pressure = piece.driven.pressure_pa().first().map_or(0.0, |pressure| pressure / 1e5) as i64;
        keys.push((class, direction, pressure, random.random(), group));
    }
    keys.sort();
    let (mut hold_out, mut fold_of) = (vec![false; groups], vec![0; groups]);
    let alike: Vec<usize> = keys.chunk_by(|a, b| a.0 == b.0).map(<[_]>::len).collect();
    for (key, held) in keys.iter().zip(held_out(&alike, thinned, &mut random)) {
        hold_out.get_mut(key.4).into_iter().for_each(|of| *of = held);
    }
    let ranges: Vec<f64> = (0..groups).map(|group| range_of(pieces, group)).collect();
    hold_out_what_tells(&ranges, &mut hold_out, &mut random);
    let fitted = keys.iter().filter(|key| hold_out.get(key.4) == Some(&false));
    for (place, key) in fitted.enumerate() {
        if let Some(fold) = fold_of.get_mut(key.4) {
            *fold = place % FOLDS;
        }
    }
    (hold_out, fold_of)
}

/// A group in which the measured channel changes by less than this part of what it does in another tells little of what changes it.
const TELLS: f64 = 0.1;

/// The widest range of the measured channel within a piece of a group.
fn range_of(pieces: &[Piece], group: usize) -> f64 {
    let of = |piece: &Piece| {
        let values = piece.measured.iter().filter(|value| value.is_finite());
        let (least, most) = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), at| (least.min(*at), most.max(*at)));
        most - least
    };
    pieces.iter().filter(|piece| piece.group == group).map(of).fold(0.0, f64::max)
}

/// Holds out one of the groups in which something happens, where only others were, a torque at a constant speed or an angle at rest: those
/// judge nothing. What happens in one group alone is left to the fit.
fn hold_out_what_tells(ranges: &[f64], hold_out: &mut [bool], random: &mut Pcg64Mcg) {
    let widest = ranges.iter().copied().fold(0.0, f64::max);
    let telling: Vec<usize> = (0..ranges.len())
        .filter(|group| ranges.get(*group).is_some_and(|range| *range > TELLS * widest))
        .collect();
    let is_held = |group: &usize| hold_out.get(*group) == Some(&true);
    if telling.len() < 2 || telling.iter().any(is_held) || !hold_out.contains(&true) {
        return;
    }
    let chosen = telling.get(random.random_range(0..telling.len()));
    chosen.and_then(|group| hold_out.get_mut(*group)).into_iter().for_each(|of| *of = true);
}

/// Which groups are held out, where `alike` of them move alike, one class after another: one of each `HOLD_OUT` of a class. Of a log that is
/// `thinned` out, classes too small for that would leave nothing to judge by: then one of each `HOLD_OUT` of what is over from all of them,
/// but never the only one of its class, whose motion nothing that is fitted would know.
fn held_out(alike: &[usize], thinned: bool, random: &mut Pcg64Mcg) -> Vec<bool> {
    let (mut held, mut over) = (Vec::new(), Vec::new());
    for count in alike {
        let (begin, complete) = (held.len(), count / HOLD_OUT * HOLD_OUT);
        let chosen = one_of_each(complete, random);
        held.extend(chosen.into_iter().chain(std::iter::repeat_n(false, count - complete)));
        over.extend((begin + complete..begin + count).filter(|_| *count > 1));
    }
    if thinned && held.iter().filter(|held| **held).count() * 2 * HOLD_OUT < held.len() {
        let chosen = one_of_each(over.len() / HOLD_OUT * HOLD_OUT, random);
        for (place, _) in over.iter().zip(chosen).filter(|(_, chosen)| *chosen) {
            held.get_mut(*place).into_iter().for_each(|held| *held = true);
        }
    }
    held
}

/// One of each `HOLD_OUT` of `count` that follow each other, the same place of each.
fn one_of_each(count: usize, random: &mut Pcg64Mcg) -> Vec<bool> {
    let mut places: Vec<usize> = (0..HOLD_OUT).collect();
    places.shuffle(random);
    let chosen = places.first().copied().unwrap_or(0);
    (0..count).map(|place| place % HOLD_OUT == chosen).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use log_data::Channel;

    #[test]
    fn something_that_tells_is_held_out_where_more_than_one_group_does() {
        let (still, tells) = (0.001, 1.0);
        for (ranges, held, expected) in [
            // Groups' ranges, which of them are held out by chance, how many that tell are held out then.
            (vec![tells, still, still, tells, still], vec![1], 1),
            (vec![tells, still, still, tells, still], vec![3], 1),
            (vec![tells, still, still, still], vec![2], 0),
            (vec![tells, tells], vec![], 0),
            (vec![0.0, 0.0, 0.0], vec![1], 0),
        ] {
            for seed in 0..20 {
                let mut hold_out: Vec<bool> = (0..ranges.len()).map(|group| held.contains(&group)).collect();
                let before = hold_out.clone();
                hold_out_what_tells(&ranges, &mut hold_out, &mut Pcg64Mcg::seed_from_u64(seed));
                let told = ranges.iter().zip(&hold_out).filter(|(range, held)| **range == tells && **held);
                assert_eq!(told.count(), expected, "{ranges:?}, {held:?}");
                assert!(before.iter().zip(&hold_out).all(|(before, now)| *now || !before));
            }
        }
    }

    #[test]
    fn no_level_of_a_plan_in_turns_is_left_out() {
        // Four pressures in turn, each run a piece; three of four runs are taken.
        let kind = LogKind::predicting(Channel::Torque);
        let rows = 0..7000;
        let plans: Vec<Plan> = (0..12)
            .map(|run| Plan { run, rows: rows.clone(), lead_row: 0, group: run, past: Before::default() })
            .collect();
        let left_out = |seed: u64| {
            let chosen = choose(&plans, kind, Choice::Fitted(&BTreeSet::new()), seed);
            assert!((8..=9).contains(&chosen.iter().filter(|chosen| **chosen).count()), "seed {seed}");
            let level_is_out = |level: usize| chosen.iter().skip(level).step_by(4).all(|chosen| !chosen);
            (0..4).any(level_is_out)
        };
        // Four of twelve hold a whole level in 36 of 495 ways, three in 4 of 220.
        let count = (0..200).filter(|seed| left_out(*seed)).count();
        assert!(count < 30, "{count} of 200");
    }

    #[test]
    fn enough_is_held_out_and_every_motion_is_fitted() {
        // Groups of each class; how many of them are held out of a log that is fitted whole, and of one that is thinned out.
        let table: [(&[usize], usize, usize); 9] = [
            (&[], 0, 0),
            (&[3], 0, 0),
            (&[4], 1, 1),
            (&[7], 1, 1),
            (&[4, 4, 3], 2, 2),
            (&[3, 3, 3], 0, 2),
            (&[2, 2, 2, 2, 2, 2, 2, 2], 0, 4),
            (&[1, 1, 1, 1, 1, 1, 1, 1], 0, 0),
            (&[8, 1, 1, 1, 1, 2, 2], 2, 2),
        ];
        let both = table
            .into_iter()
            .flat_map(|(alike, whole, thinned)| [(alike, false, whole), (alike, true, thinned)]);
        for (alike, thinned, expected) in both {
            for seed in 0..20 {
                let held = held_out(alike, thinned, &mut Pcg64Mcg::seed_from_u64(seed));
                assert_eq!(held.len(), alike.iter().sum::<usize>());
                assert_eq!(held.iter().filter(|held| **held).count(), expected, "{alike:?}, seed {seed}");
                let mut rest = held.as_slice();
                for count in alike {
                    let (class, others) = rest.split_at(*count);
                    assert!(
                        class.iter().any(|held| !held),
                        "{alike:?}, seed {seed}: a class is held out whole"
                    );
                    rest = others;
                }
            }
        }
    }
}
