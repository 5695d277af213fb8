//! The torque that a measured motion takes.

use crate::conditions::{Conditions, whole};
use crate::delay::delay;
use crate::sides::{SIDES, clearer};
use crate::{Noise, Past, Predicted, PredictionError, Smoother, Start};
use log_data::{Channel, Run};
use valve_model::{
    ContactPast, Model, MotionInput, MotionParams, MotionSample, MotionState, ParamError,
    measured_motion_step,
};

/// Samples, at most, from which the bristle's deflection at a run's start is estimated.
const START_SAMPLES: usize = 1000;
/// A contact has forgotten how it began after so many break-away deflections of travel.
const FORGOTTEN: f64 = 5.0;
/// After how long the torque of the first sample is taken, s: as good as none.
const MOMENT_S: f64 = 1e-9;
/// Deflections tried at first, and refinements around the best.
const TRIALS: i32 = 9;
const REFINEMENTS: usize = 14;

/// Replaces the run's measured torque by what the model has for its motion.
pub(crate) fn predict(
    run: &Run,
    model: &Model,
    past: &Past,
    torque_nm: &mut [f64],
) -> Result<Predicted, PredictionError> {
    let refused = |source: ParamError| PredictionError::Model { run: run.name.clone(), source };
    let params = MotionParams::new(model).map_err(refused)?;
    whole(run, Channel::Angle, &run.angle_rad)?;
    let conditions = Conditions::of(run, model)?;
    let noise = Noise::of(&run.angle_rad);
    let smoother = || Smoother::new(&run.time_s, &run.angle_rad, noise);
    let mut path =
        Path { time_s: &run.time_s, conditions: &conditions, params: &params, smoother: smoother(), noise };
    let start = path.start(torque_nm, past);
    let first = path.smoother.motion(0);
    let past = begun(start, past, path.clock_s());
    let mut state = params.at_start_after(&first, &past);
    let (mut travel_rad, mut left_out) = (0.0, 0);
    let forgotten_rad = FORGOTTEN * params.friction_law().break_away_deflection_rad();
    let mut before = first;
    for index in 0..run.len() {
        let end = path.motion(index);
        let predicted = path.step(&mut state, (&before, &end), index);
        travel_rad += (end.angle_rad - before.angle_rad).abs();
        let unknown = start == Start::LeftOut && travel_rad <= forgotten_rad;
        left_out += usize::from(unknown);
        if let Some(torque) = torque_nm.get_mut(index) {
            *torque = if unknown { f64::NAN } else { predicted };
        }
        before = end;
    }
    delay(&run.time_s, torque_nm, params.sensor_delay());
    let end = state.friction.past();
    Ok(Predicted {
        channel: Channel::Torque,
        start,
        left_out,
        noise,
        end: Past { rest_s: end.rest_s, distance_rad: end.distance_rad },
    })
}

/// The contact at the start of a run.
fn begun(start: Start, past: &Past, clock_s: f64) -> ContactPast {
    let (deflection_rad, came_from_rad) = match start {
        Start::Estimated { deflection_rad, came_from_rad } => (deflection_rad, came_from_rad),
        Start::LeftOut => (0.0, 0.0),
    };
    let Past { rest_s, distance_rad } = *past;
    ContactPast { deflection_rad, came_from_rad, rest_s, distance_rad, clock_s }
}

/// A run's motion through the model.
struct Path<'a> {
    time_s: &'a [f64],
    conditions: &'a Conditions<'a>,
    params: &'a MotionParams,
    smoother: Smoother<'a>,
    noise: Noise,
}

impl Path<'_> {
    /// The log's clock at the run's first sample, s.
    fn clock_s(&self) -> f64 {
        self.time_s.first().copied().unwrap_or(0.0)
    }

    fn motion(&mut self, index: usize) -> MotionSample {
        if self.params.is_behind_a_spring() {
            self.smoother.sharp_motion(index)
        } else {
            self.smoother.motion(index)
        }
    }

    /// Moves the contact from the sample before `index`, whose motion is `start`, to it, whose motion is `end`; the torque there.
    fn step(
        &self,
        state: &mut MotionState,
        (start, end): (&MotionSample, &MotionSample),
        index: usize,
    ) -> f64 {
        let at = |index: usize| self.time_s.get(index).copied().unwrap_or(f64::NAN);
        let dt_s = if index == 0 { MOMENT_S } else { at(index) - at(index - 1) };
        let (pressure_drop_pa, oil_temperature_c) = self.conditions.before(index);
        let input = MotionInput { start: *start, end: *end, pressure_drop_pa, oil_temperature_c };
        measured_motion_step(self.params, state, (&input, self.noise.deviation_rad), dt_s).measured_torque_nm
    }

    /// How the contact begins: the deflection that fits the measured torque best until it is forgotten, and where bristles that
    /// remember it came from, as far as the torque tells.
    fn start(&mut self, torque_nm: &[f64], past: &Past) -> Start {
        let law = self.params.friction_law();
        let (most_rad, remembers) = (law.break_away_deflection_rad(), law.has_memory());
        if most_rad == 0.0 {
            return Start::Estimated { deflection_rad: 0.0, came_from_rad: 0.0 };
        }
        let samples = self.samples_until_forgotten(FORGOTTEN * most_rad);
        let measured_nm = torque_nm.get(..samples).unwrap_or_default();
        if !measured_nm.iter().any(|torque| torque.is_finite()) {
            return Start::LeftOut;
        }
        let first = self.smoother.motion(0);
        let motions = (0..measured_nm.len()).map(|index| self.motion(index)).collect();
        let search = StartSearch { path: self, first, motions, measured_nm, past, most_rad };
        let relaxed = search.best_from(0.0);
        let sides: &[f64] = if remembers { &SIDES } else { &[] };
        let others = sides.iter().map(|side| search.best_from(side * most_rad));
        clearer(relaxed, others, |tried| tried.square).start
    }

    fn samples_until_forgotten(&mut self, forgotten_rad: f64) -> usize {
        let mut travel_rad = 0.0;
        let mut before = self.smoother.motion(0);
        for index in 1..START_SAMPLES.min(self.time_s.len()) {
            let end = self.smoother.motion(index);
            travel_rad += (end.angle_rad - before.angle_rad).abs();
            if travel_rad > forgotten_rad {
                return index;
            }
            before = end;
        }
        START_SAMPLES.min(self.time_s.len())
    }
}

/// A search for the start of a run, over its first samples.
struct StartSearch<'a> {
    path: &'a Path<'a>,
    first: MotionSample,
    motions: Vec<MotionSample>,
    measured_nm: &'a [f64],
    past: &'a Past,
    /// Break-away deflection, rad.
    most_rad: f64,
}

/// A start that was tried, with the sum of squares that it leaves, (N·m)².
#[derive(Debug, Clone, Copy)]
struct Tried {
    start: Start,
    square: f64,
}

impl StartSearch<'_> {
    fn tried(&self, deflection_rad: f64, came_from_rad: f64) -> Tried {
        let start = Start::Estimated { deflection_rad, came_from_rad };
        Tried { start, square: self.misfit(&begun(start, self.past, self.path.clock_s())) }
    }

    /// The best of the deflections within ±`most_rad` that came from one: a few tried, and the best of them refined.
    fn best_from(&self, came_from_rad: f64) -> Tried {
        let part = |trial: i32| 2.0 * f64::from(trial) / f64::from(TRIALS - 1) - 1.0;
        let mut best = self.tried(-self.most_rad, came_from_rad);
        for trial in 1..TRIALS {
            best = better(best, self.tried(self.most_rad * part(trial), came_from_rad));
        }
        let mut reach_rad = self.most_rad / f64::from(TRIALS - 1);
        for _ in 0..REFINEMENTS {
            if let Start::Estimated { deflection_rad, .. } = best.start {
                for beside_rad in [deflection_rad - reach_rad, deflection_rad + reach_rad] {
                    best = better(best, self.tried(beside_rad, came_from_rad));
                }
            }
            reach_rad *= 0.5;
        }
        best
    }

    /// Sum of squares of predicted less measured torque over the first samples.
    fn misfit(&self, past: &ContactPast) -> f64 {
        let mut before = &self.first;
        let mut state = self.path.params.at_start_after(before, past);
        let mut sum = 0.0;
        for (index, (measured, end)) in self.measured_nm.iter().zip(&self.motions).enumerate() {
            let predicted = self.path.step(&mut state, (before, end), index);
            if measured.is_finite() {
                sum += (predicted - measured) * (predicted - measured);
            }
            before = end;
        }
        sum
    }
}

/// The one that leaves less; the former of equals.
fn better(one: Tried, other: Tried) -> Tried {
    if other.square < one.square { other } else { one }
}
