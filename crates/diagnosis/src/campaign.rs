//! A log cut into pieces, grouped into what is fitted and what is held out, with the facts that it spans.

use crate::DiagnosisError;
use crate::driven::lead_of;
use crate::facts::Facts;
use crate::past::{Before, Follower, in_order};
use crate::piece::{Piece, Ready, check};
use crate::workers::{Workers, map};
use log_data::{AngleZero, Channel, Log, Run};
use prediction::{Noise, predicted_channel};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeMap;
use std::ops::Range;
use valve_model::Model;

/// The fewest samples of a run that are of use.
pub(crate) const LEAST_SAMPLES: usize = 50;
/// The longest piece, and the most samples of a log that are fitted; of longer logs pieces are chosen evenly.
const LONGEST: usize = 20_000;
const MOST_SAMPLES: usize = 300_000;
/// Runs of one kind from which whole runs are held out; below, runs are cut into so many blocks.
const RUNS_OF_A_KIND: usize = 4;
const BLOCKS: usize = 4;
/// A log of few runs is cut into so many blocks in all.
const BLOCKS_IN_ALL: usize = 20;
/// A block has at least so many samples.
const LEAST_BLOCK: usize = 400;
/// One group in so many is held out.
const HOLD_OUT: usize = 4;
const FOLDS: usize = 5;

/// The log, ready to be fitted.
pub(crate) struct Campaign {
    pub channel: Channel,
    pub pieces: Vec<Piece>,
    pub facts: Facts,
    /// Name and kind of each run.
    pub runs: Vec<(String, String)>,
    /// Name of each group, as it is reported.
    pub groups: Vec<String>,
    /// The fold of each group; those held out have none that is used.
    pub fold_of: Vec<usize>,
    pub angle_zero_per_run: bool,
    /// Samples of the log, chosen or not.
    pub samples: usize,
}

/// A piece before it is made.
struct Plan {
    run: usize,
    rows: Range<usize>,
    /// Where its prediction begins.
    lead_row: usize,
    group: usize,
    /// Before its lead.
    past: Before,
}

impl Campaign {
    pub fn new(log: &Log, model: &Model, seed: u64, workers: &dyn Workers) -> Result<Self, DiagnosisError> {
        let channel = channel_of(log)?;
        let usable: Vec<bool> = log.runs.iter().map(|run| run.channel(channel).is_some()).collect();
        for (run, _) in log.runs.iter().zip(&usable).filter(|(_, usable)| **usable) {
            check(run, channel, LEAST_SAMPLES)?;
        }
        let (mut plans, groups) = plan(log, &usable, channel);
        let noises: Vec<Noise> = map(workers, log.runs.len(), |index| {
            log.runs
                .get(index)
                .map_or(Noise { deviation_rad: 0.0, step_rad: 0.0 }, |run| Noise::of(&run.angle_rad))
        });
        let mut facts = Facts::of_model(model, channel);
        follow(log, model, &noises, &mut plans, &mut facts);
        choose(&mut plans, seed);
        let make = |index: usize| {
            let plan = plans.get(index)?;
            let run = log.runs.get(plan.run)?;
            let noise = *noises.get(plan.run)?;
            let rows = (plan.lead_row, plan.rows.clone());
            let mut piece =
                Piece::new(run, plan.run, rows, channel, plan.past, noise, facts.reference_temperature_c);
            piece.group = plan.group;
            Some(piece)
        };
        let mut pieces: Vec<Piece> = map(workers, plans.len(), make).into_iter().flatten().collect();
        let (hold_out, fold_of) = deal(log, &pieces, groups.len(), seed);
        for piece in &mut pieces {
            piece.hold_out = hold_out.get(piece.group).copied().unwrap_or(false);
        }
        span(log, &usable, &pieces, &mut facts);
        Ok(Self {
            channel,
            pieces,
            facts,
            runs: log.runs.iter().map(|run| (run.name.clone(), run.kind.clone())).collect(),
            groups,
            fold_of,
            angle_zero_per_run: log.angle_zero == AngleZero::PerRun,
            samples: log.runs.iter().map(Run::len).sum(),
        })
    }

    /// Refuses a model that can't predict.
    pub fn ready(&self, model: &Model) -> Result<Ready, DiagnosisError> {
        let run = || {
            self.pieces
                .first()
                .and_then(|piece| self.runs.get(piece.run))
                .map_or(String::new(), |run| run.0.clone())
        };
        Ready::new(model, self.channel).map_err(|source| DiagnosisError::Model { run: run(), source })
    }

    /// Names of the runs, or blocks, that are held out.
    pub fn held_out(&self) -> Vec<String> {
        let mut held: Vec<usize> =
            self.pieces.iter().filter(|piece| piece.hold_out).map(|piece| piece.group).collect();
        held.sort_unstable();
        held.dedup();
        held.iter().filter_map(|group| self.groups.get(*group).cloned()).collect()
    }
}

/// Torque where any run has it; the others are then left out.
fn channel_of(log: &Log) -> Result<Channel, DiagnosisError> {
    let mut found = Channel::Angle;
    for run in &log.runs {
        if predicted_channel(run)? == Channel::Torque {
            found = Channel::Torque;
        }
    }
    Ok(found)
}

/// Cuts the runs: whole ones where there are enough of their kind, blocks otherwise.
fn plan(log: &Log, usable: &[bool], channel: Channel) -> (Vec<Plan>, Vec<String>) {
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    let runs = || log.runs.iter().zip(usable).enumerate().filter(|(_, (_, usable))| **usable);
    runs().for_each(|(_, (run, _))| *kinds.entry(&run.kind).or_default() += 1);
    let total = runs().count();
    let blocks_of_few = if total < RUNS_OF_A_KIND { BLOCKS_IN_ALL.div_ceil(total.max(1)) } else { BLOCKS };
    let (mut plans, mut groups) = (Vec::new(), Vec::new());
    for (index, (run, _)) in runs() {
        let whole = kinds.get(run.kind.as_str()).is_some_and(|count| *count >= RUNS_OF_A_KIND);
        let wanted = if whole { 1 } else { blocks_of_few.min(run.len() / LEAST_BLOCK).max(1) };
        let blocks = wanted.max(run.len().div_ceil(LONGEST));
        let group = groups.len();
        for block in 0..blocks {
            let rows = run.len() * block / blocks..run.len() * (block + 1) / blocks;
            let own = if whole { group } else { group + block };
            if !whole || block == 0 {
                let name = if whole || blocks == 1 { run.name.clone() } else { block_name(run, &rows) };
                groups.push(name);
            }
            let past = Before::default();
            // A torque's motion is measured throughout; an angle's state is guessed where its prediction begins.
            let lead_row = if channel == Channel::Angle { lead_of(run, rows.start) } else { rows.start };
            plans.push(Plan { run: index, rows, lead_row, group: own, past });
        }
    }
    (plans, groups)
}

fn block_name(run: &Run, rows: &Range<usize>) -> String {
    let at = |row: usize| run.time_s.get(row).copied().unwrap_or(f64::NAN);
    format!("{}@{:.3}..{:.3}", run.name, at(rows.start), at(rows.end - 1))
}

fn follow(log: &Log, model: &Model, noises: &[Noise], plans: &mut [Plan], facts: &mut Facts) {
    let mut follower = Follower::new(model);
    for (index, rest_s) in in_order(log) {
        let (Some(run), Some(noise)) = (log.runs.get(index), noises.get(index)) else { continue };
        follower.rest(rest_s);
        let starts: Vec<usize> =
            plans.iter().filter(|plan| plan.run == index).map(|plan| plan.lead_row).collect();
        let pasts = follower.run(run, *noise, &starts);
        let own = plans.iter_mut().filter(|plan| plan.run == index);
        own.zip(pasts).for_each(|(plan, past)| plan.past = past);
    }
    facts.travel_rad = follower.distance_rad();
    facts.longest_rest_s = follower.longest_rest_s;
}

/// Of more samples than are fitted, pieces evenly over the log.
fn choose(plans: &mut Vec<Plan>, seed: u64) {
    let total: usize = plans.iter().map(|plan| plan.rows.len()).sum();
    if total <= MOST_SAMPLES {
        return;
    }
    let part = MOST_SAMPLES as f64 / total as f64;
    let mut due = Pcg64Mcg::seed_from_u64(seed).random_range(0.0..1.0);
    plans.retain(|_| {
        due += part;
        let taken = due >= 1.0;
        if taken {
            due -= 1.0;
        }
        taken
    });
}

/// Deals groups to folds and to those held out: neighbours in kind, direction and pressure go different ways.
fn deal(log: &Log, pieces: &[Piece], groups: usize, seed: u64) -> (Vec<bool>, Vec<usize>) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut keys: Vec<(String, i8, i64, u32, usize)> = Vec::new();
    for group in 0..groups {
        let Some(piece) = pieces.iter().find(|piece| piece.group == group) else { continue };
        let kind = log.runs.get(piece.run).map_or(String::new(), |run| run.kind.clone());
        let turn = piece.kinematics(piece.len().saturating_sub(1)).0 - piece.kinematics(0).0;
        let direction = if turn.abs() < 1e-3 { 0 } else { turn.signum() as i8 };
        let pressure = piece.driven.pressure_pa().first().map_or(0.0, |pressure| pressure / 1e5) as i64;
        keys.push((kind, direction, pressure, random.random(), group));
    }
    keys.sort();
    let (mut hold_out, mut fold_of) = (vec![false; groups], vec![0; groups]);
    for same in keys.chunk_by(|a, b| a.0 == b.0) {
        let mut offset: Vec<usize> = (0..HOLD_OUT).collect();
        offset.shuffle(&mut random);
        let offset = offset.first().copied().unwrap_or(0);
        for (place, key) in same.iter().enumerate() {
            // The last, incomplete round of a kind gives none away.
            let complete = place / HOLD_OUT * HOLD_OUT + HOLD_OUT <= same.len();
            if let Some(held) = hold_out.get_mut(key.4) {
                *held = complete && place % HOLD_OUT == offset;
            }
        }
    }
    let fitted = keys.iter().filter(|key| hold_out.get(key.4) == Some(&false));
    for (place, key) in fitted.enumerate() {
        if let Some(fold) = fold_of.get_mut(key.4) {
            *fold = place % FOLDS;
        }
    }
    (hold_out, fold_of)
}

fn span(log: &Log, usable: &[bool], pieces: &[Piece], facts: &mut Facts) {
    let runs = || log.runs.iter().zip(usable).filter(|(_, usable)| **usable).map(|(run, _)| run);
    let range = |channel: Channel, absolute: bool| {
        let mut bounds = (f64::INFINITY, f64::NEG_INFINITY);
        for run in runs() {
            for value in run.channel(channel)? {
                let value = if absolute { value.abs() } else { *value };
                bounds = (bounds.0.min(value), bounds.1.max(value));
            }
        }
        Some(bounds)
    };
    facts.pressure_mpa = range(Channel::PressureDrop, true).map(|(least, most)| (least / 1e6, most / 1e6));
    facts.temperature_c = range(Channel::OilTemperature, false);
    facts.angle_rad = range(Channel::Angle, false).unwrap_or((0.0, 0.0));
    let motions = || pieces.iter().flat_map(|piece| &piece.motions);
    facts.fastest_rad_per_s = motions().fold(0.0, |most: f64, motion| most.max(motion.speed_rad_per_s.abs()));
    if facts.channel == Channel::Angle {
        facts.fastest_rad_per_s = pieces.iter().map(fastest_command).fold(0.0, f64::max);
    }
    let mut steps: Vec<f64> = pieces
        .iter()
        .flat_map(|piece| piece.driven.time_s().windows(2).take(50))
        .map(|pair| pair.iter().fold(0.0, |a, b| b - a))
        .collect();
    steps.sort_by(f64::total_cmp);
    facts.step_s = steps.get(steps.len() / 2).copied().unwrap_or(1e-3);
}

fn fastest_command(piece: &Piece) -> f64 {
    let speeds = piece.driven.command_rad().windows(2).zip(piece.driven.time_s().windows(2));
    let speed = |(angles, times): (&[f64], &[f64])| {
        let difference = |pair: &[f64]| pair.iter().fold(0.0, |before, after| after - before);
        (difference(angles) / difference(times)).abs()
    };
    speeds.map(speed).fold(0.0, f64::max)
}
