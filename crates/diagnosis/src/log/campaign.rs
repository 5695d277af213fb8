//! A log cut into pieces, with groups that are fitted or held out, and the ranges of its data.

use crate::DiagnosisError;
use crate::log::classes::Class;
use crate::log::course::WholeRun;
use crate::log::cut::{Choice, Place, Plan, choose, deal, longest, plan};
use crate::log::driven::Driven;
use crate::log::facts::Facts;
use crate::log::hum::Hum;
use crate::log::initial_state::InitialState;
use crate::log::kind::LogKind;
use crate::log::loose_ripple::LooseRipple;
use crate::log::lost_steps;
use crate::log::past::{Follower, in_order};
use crate::log::piece::{Piece, check, check_motion};
use crate::log::predictions::Models;
use crate::log::ready::{Params, Ready};
use crate::log::work::Work;
use crate::workers::{Workers, map};
use log_data::{AngleZero, Channel, Log, Run, bridged, median};
use prediction::{Noise, motion_at, predicted_channel};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use valve_model::{Model, ParamError};

/// Least number of samples in a run.
pub(crate) const LEAST_SAMPLES: usize = 50;
/// The integrator's tolerance in a sub-step, as a fraction of the encoder's standard deviation.
const OF_THE_NOISE: f64 = 3e-5;
/// The log, ready to be fitted.
pub(crate) struct Campaign {
    pub kind: LogKind,
    pub pieces: Vec<Piece>,
    pub facts: Facts,
    /// Name and kind of each run.
    pub runs: Vec<(String, String)>,
    /// How each run moves.
    pub classes: Vec<Class>,
    /// Name of each group, as it is reported.
    pub groups: Vec<String>,
    /// The fold of each group; that of a held-out group is not used.
    pub fold_of: Vec<usize>,
    /// Of an angle log: whether the encoder has one zero, or one a run. `None` of a torque log, which has no use for it.
    pub angle_zero: Option<AngleZero>,
    /// True if the misfit is added to every sample's variance. It is correlated, so that tests of whiteness don't apply.
    pub has_misfit: bool,
    /// Tones of the mains that were taken out of the measured channel.
    pub hums: Vec<Hum>,
    /// Ripples with a phase of their own in each run that were taken out of the measured channel.
    pub loose_ripples: Vec<LooseRipple>,
    /// Samples of the log, fitted or not.
    pub samples: usize,
    /// True if there are pieces that were not taken.
    pub thinned: bool,
    /// Counts the samples that all predictions simulate.
    work: Arc<Work>,
    /// The error that the integrator may make in a sub-step, rad.
    angle_error_rad: f64,
    /// Models and what they predicted.
    models: Models<Params>,
}

impl Campaign {
    /// The log as it is fitted.
    pub fn new(log: &Log, model: &Model, seed: u64, workers: &dyn Workers) -> Result<Self, DiagnosisError> {
        Self::of(log, model, Choice::Fitted(&BTreeSet::new()), (seed, workers))
    }

    /// The pieces of a choice.
    pub fn of(
        log: &Log,
        model: &Model,
        choice: Choice<'_>,
        (seed, workers): (u64, &dyn Workers),
    ) -> Result<Self, DiagnosisError> {
        let (log, masks) = bridged(log);
        let log = log.as_ref();
        let kind = LogKind::predicting(channel_of(log, model)?);
        let usable: Vec<bool> = log.runs.iter().map(|run| run.channel(kind.channel).is_some()).collect();
        for (run, _) in log.runs.iter().zip(&usable).filter(|(_, usable)| **usable) {
            check(run, kind, LEAST_SAMPLES)?;
        }
        let used = log.runs.iter().zip(&usable).filter(|(_, usable)| **usable);
        check_motion(used.map(|(run, _)| run), kind)?;
        let classes: Vec<Class> =
            map(workers, log.runs.len(), |index| log.runs.get(index).map(Class::of).unwrap_or_default());
        let (mut plans, groups) = plan(log, (&usable, &classes), kind, longest(log, &usable, kind));
        let noises: Vec<Noise> = map(workers, log.runs.len(), |index| {
            log.runs
                .get(index)
                .map_or(Noise { deviation_rad: 0.0, step_rad: 0.0 }, |run| Noise::of(&run.angle_rad))
        });
        let mut facts = Facts::of_model(model, kind);
        follow(log, model, &noises, &mut plans, &mut facts);
        let chosen = choose(&plans, kind, choice, seed);
        let angle_error_rad = OF_THE_NOISE * usual_deviation_rad(&noises);
        let first_run = log.runs.first().map_or("", |run| run.name.as_str());
        let models = Models::default();
        let ready =
            Ready::new(&models, model, kind, angle_error_rad).map_err(|source| refused(first_run, source))?;
        let pitch_rad = model.motor.filter(|_| !kind.motion_is_measured).map(|motor| motor.tooth_pitch_rad());
        let courses = courses(log, &plans, &chosen, &noises, (kind, facts.reference_temperature_c));
        let work = Arc::new(Work::default());
        work.allow((kind.first_search * kind.most_simulated as f64) as u64);
        let make = |index: usize| {
            let plan = plans.get(index)?;
            if pitch_rad.is_none() && !*chosen.get(index)? {
                return None;
            }
            let run = log.runs.get(plan.run)?;
            let noise = *noises.get(plan.run)?;
            let rows = (plan.lead_row, plan.rows.clone());
            let mut piece =
                Piece::new(run, plan.run, rows, kind, plan.past, noise, facts.reference_temperature_c);
            piece.group = plan.group;
            piece.mask = masks.get(plan.run)?.get(piece.rows.clone()).unwrap_or_default().to_vec();
            piece.course = courses.get(&plan.run).cloned();
            piece.work = Arc::clone(&work);
            // Lost steps are found first and added to every prediction, so that they don't disturb the search for other causes.
            piece.jumps.extend(pitch_rad.and_then(|pitch_rad| lost_steps::find(&piece, &ready, pitch_rad)));
            (*chosen.get(index)? || !piece.jumps.is_empty()).then_some(piece)
        };
        let mut pieces: Vec<Piece> = map(workers, plans.len(), make).into_iter().flatten().collect();
        let thinned = chosen.contains(&false);
        let (hold_out, fold_of) = deal(&classes, &pieces, (groups.len(), thinned), seed);
        for piece in &mut pieces {
            piece.hold_out = hold_out.get(piece.group).copied().unwrap_or(false);
        }
        span(log, &usable, &pieces, &mut facts);
        Ok(Self {
            kind,
            pieces,
            facts,
            runs: log.runs.iter().map(|run| (run.name.clone(), run.kind.clone())).collect(),
            classes,
            groups,
            fold_of,
            angle_zero: (!kind.residual_is_torque()).then_some(log.angle_zero),
            has_misfit: false,
            hums: Vec::new(),
            loose_ripples: Vec::new(),
            samples: log.runs.iter().map(Run::len).sum(),
            thinned,
            work,
            angle_error_rad,
            models,
        })
    }

    /// Where each piece lies in the log.
    pub fn places(&self) -> impl Iterator<Item = Place> {
        self.pieces.iter().map(|piece| (piece.run, piece.rows.start))
    }

    /// True if the allowed number of simulated samples is used up. The search then concludes from the causes found so far.
    pub fn is_worn_out(&self) -> bool {
        self.work.is_spent()
    }

    /// True if something was left out because that number was used up.
    pub fn was_cut_short(&self) -> bool {
        self.work.was_cut()
    }

    /// Samples simulated so far, and the limit for the whole diagnosis.
    pub fn simulated(&self) -> (u64, u64) {
        (self.work.simulated(), self.kind.most_simulated)
    }

    /// Raises the limit to that of the whole diagnosis. The first search is limited to a part of it, so that later ones have some left.
    pub fn allow_all(&self) {
        self.work.allow(self.kind.most_simulated);
    }

    /// Does what a conclusion can't do without, within the reserve if the limit is reached.
    pub fn with_reserve<T>(&self, needed: impl FnOnce() -> T) -> T {
        self.with_part(self.kind.reserve, needed)
    }

    /// Does a search for laws, which a search for causes that used up its samples says nothing against.
    pub fn with_reserve_for_laws<T>(&self, search: impl FnOnce() -> T) -> T {
        self.with_part(self.kind.for_laws, search)
    }

    /// Does something with at least so large a part of the whole limit.
    fn with_part<T>(&self, part: f64, needed: impl FnOnce() -> T) -> T {
        self.work.with_reserve((part * self.kind.most_simulated as f64) as u64, needed)
    }

    /// Ends every search.
    #[cfg(test)]
    pub fn wear_out(&self) {
        self.work.add(1);
        self.work.allow(0);
    }

    /// Subtracts hum from the measured channel: `hums` are the tones, `by_piece` is their sum at each sample of each piece.
    pub fn take_out_hum(&mut self, hums: Vec<Hum>, by_piece: &[Vec<f64>]) {
        self.pieces.iter_mut().zip(by_piece).for_each(|(piece, hum)| piece.take_out_hum(hum));
        for hum in hums {
            // A tone close to one that was taken out before is that one's remainder: it isn't listed twice.
            match self.hums.iter_mut().find(|of| (of.hz - hum.hz).abs() < 0.5) {
                Some(of) => of.amplitude = of.amplitude.max(hum.amplitude),
                None => self.hums.push(hum),
            }
        }
    }

    /// Subtracts ripples with a phase of their own in each run from the measured channel: `by_piece` is their sum at each sample.
    pub fn take_out_ripples(&mut self, ripples: Vec<LooseRipple>, by_piece: &[Vec<f64>]) {
        self.pieces.iter_mut().zip(by_piece).for_each(|(piece, own)| piece.take_out_ripple(own));
        self.loose_ripples.extend(ripples);
    }

    /// Prepares a model for predictions; an error if its parameters are refused.
    pub fn ready(&self, model: &Model) -> Result<Ready, DiagnosisError> {
        Ready::new(&self.models, model, self.kind, self.angle_error_rad)
            .map_err(|source| self.refused(source))
    }

    /// The error for a model that is refused; it names the first run.
    pub fn refused(&self, source: ParamError) -> DiagnosisError {
        refused(self.runs.first().map_or("", |(name, _)| name), source)
    }

    /// Initial states by piece. Pieces that continue another one get the state of their run's first piece.
    pub fn with_followers(&self, mut starts: Vec<InitialState>) -> Vec<InitialState> {
        let mut head = InitialState::default();
        for (piece, start) in self.pieces.iter().zip(&mut starts) {
            if piece.follows() {
                *start = head;
            } else {
                head = *start;
            }
        }
        starts
    }

    /// Whether any run, or block, is held out.
    pub fn holds_out(&self) -> bool {
        self.pieces.iter().any(|piece| piece.hold_out)
    }

    /// Whether a piece is one that errors are judged on: held out, or any where none is.
    pub fn judges(&self) -> impl Fn(&Piece) -> bool + use<> {
        let any_held = self.holds_out();
        move |piece| piece.hold_out || !any_held
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

fn refused(run: &str, source: ParamError) -> DiagnosisError {
    DiagnosisError::Model { run: run.to_owned(), source }
}

/// The channel to predict: the angle if the model has a motor and every run a command, else the torque if any run has it. The
/// angle is preferred because a command is known exactly, between the samples too. A motion is known only as well as its
/// encoder, whose errors stiff bristles turn into torque. In a torque log, runs without torque are left out.
fn channel_of(log: &Log, model: &Model) -> Result<Channel, DiagnosisError> {
    if model.motor.is_some() && log.runs.iter().all(|run| run.angle_command_rad.is_some()) {
        return Ok(Channel::Angle);
    }
    let mut found = Channel::Angle;
    for run in &log.runs {
        if predicted_channel(run)? == Channel::Torque {
            found = Channel::Torque;
        }
    }
    Ok(found)
}

/// The median over the runs of the encoder's standard deviation, rad. A run whose encoder stays on one step shows none.
fn usual_deviation_rad(noises: &[Noise]) -> f64 {
    median(&mut noises.iter().map(|noise| noise.deviation_rad).collect::<Vec<f64>>()).unwrap_or(0.0)
}

/// Sets the state of the contact before each piece, and the log's distance travelled and longest rest.
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

/// The runs of an angle log that are cut but fitted whole: each is predicted as a whole, and its pieces take their rows of that.
fn courses(
    log: &Log,
    plans: &[Plan],
    chosen: &[bool],
    noises: &[Noise],
    (kind, reference_temperature_c): (LogKind, f64),
) -> BTreeMap<usize, Arc<WholeRun>> {
    let mut found = BTreeMap::new();
    if kind.motion_is_measured {
        return found;
    }
    let places: Vec<usize> = (0..plans.len()).collect();
    let run_of = |place: &usize| plans.get(*place).map(|plan| plan.run);
    for own in places.chunk_by(|a, b| run_of(a) == run_of(b)) {
        let all = own.iter().all(|place| chosen.get(*place) == Some(&true));
        let Some(head) = own.first().and_then(|place| plans.get(*place)).filter(|_| all && own.len() > 1)
        else {
            continue;
        };
        let (Some(run), Some(noise)) = (log.runs.get(head.run), noises.get(head.run)) else { continue };
        let course = WholeRun {
            run: head.run,
            driven: Driven::new(run, 0, &(0..run.len()), reference_temperature_c),
            first: motion_at(&run.time_s, &run.angle_rad, *noise, 0),
            past: head.past,
        };
        found.insert(head.run, Arc::new(course));
    }
    found
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
    facts.fastest_rad_per_s = if facts.kind.motion_is_measured {
        motions().fold(0.0, |most: f64, motion| most.max(motion.speed_rad_per_s.abs()))
    } else {
        pieces.iter().map(fastest_command).fold(0.0, f64::max)
    };
    let mut steps: Vec<f64> = pieces
        .iter()
        .flat_map(|piece| piece.driven.time_s().windows(2).take(50))
        .map(|pair| pair.iter().fold(0.0, |a, b| b - a))
        .collect();
    facts.step_s = median(&mut steps).unwrap_or(1e-3);
    facts.encoder_step_rad = pieces.iter().map(|piece| piece.noise.step_rad).fold(0.0, f64::max);
}

fn fastest_command(piece: &Piece) -> f64 {
    let speeds = piece.driven.command_rad().windows(2).zip(piece.driven.time_s().windows(2));
    let speed = |(angles, times): (&[f64], &[f64])| {
        let difference = |pair: &[f64]| pair.iter().fold(0.0, |before, after| after - before);
        (difference(angles) / difference(times)).abs()
    };
    speeds.map(speed).fold(0.0, f64::max)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::fixtures;
    use crate::workers::OneAfterTheOther;
    use valve_model::MotorParams;

    const RUNS: usize = 20;
    const LENGTH: usize = 8000;
    const LOST_AT: usize = 4700;

    fn with_a_motor() -> Model {
        let motor = MotorParams::BENCH_RIG;
        Model { motor: Some(motor), ..fixtures::model(Vec::new()) }
    }

    /// More angles than are fitted, of a rotor at constant speed that jumps in the last run but one.
    fn long(jump_rad: f64) -> Log {
        let run = |number: usize| {
            let time_s: Vec<f64> = (0..LENGTH).map(|k| 20.0 * number as f64 + 2e-3 * k as f64).collect();
            let command: Vec<f64> = (0..LENGTH).map(|k| 1e-3 * k as f64).collect();
            let jump = |k: usize| if number == RUNS - 2 && k >= LOST_AT { jump_rad } else { 0.0 };
            Run {
                name: format!("{number}"),
                kind: "constant-velocity".to_owned(),
                angle_rad: command.iter().enumerate().map(|(k, angle)| angle - 5e-3 + jump(k)).collect(),
                angle_command_rad: Some(command),
                time_s,
                ..Run::default()
            }
        };
        Log { runs: (0..RUNS).map(run).collect(), ..Log::default() }
    }

    #[test]
    fn of_a_long_angle_log_every_run_keeps_some_and_lost_steps_are_seen_wherever_they_are() {
        let model = with_a_motor();
        let pitch_rad = model.motor.unwrap().tooth_pitch_rad();
        let campaign = |jump_rad: f64, seed: u64| {
            Campaign::new(&long(jump_rad), &model, seed, &OneAfterTheOther).unwrap()
        };
        let holds_it = |piece: &Piece| piece.run == RUNS - 2 && piece.rows.contains(&LOST_AT);
        let mut left_out = 0;
        for seed in 0..6 {
            let whole = campaign(0.0, seed);
            let samples: usize = whole.pieces.iter().map(Piece::len).sum();
            let some = LogKind::predicting(Channel::Angle).fitted_of_more;
            assert!((some * 9 / 10..some * 11 / 10).contains(&samples), "{samples}");
            for run in 0..RUNS {
                assert!(whole.pieces.iter().any(|piece| piece.run == run), "seed {seed}: none of run {run}");
            }
            left_out += usize::from(!whole.pieces.iter().any(holds_it));
            let jumped = campaign(-pitch_rad, seed);
            let piece = jumped.pieces.iter().find(|piece| holds_it(piece)).unwrap();
            let (row, jump_rad) = *piece.jumps.first().unwrap();
            assert_eq!(piece.rows.start + row, LOST_AT, "seed {seed}");
            assert!((jump_rad + pitch_rad).abs() < 1e-12, "{jump_rad}");
        }
        assert!(left_out > 0, "no seed leaves it out: nothing is tested");
    }
}
