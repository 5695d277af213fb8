//! The torque that a measured motion takes.

use crate::conditions::{Conditions, whole};
use crate::delay::delay;
use crate::{Noise, Past, Predicted, PredictionError, Smoother, Start};
use log_data::{Channel, Run};
use valve_model::{
    ContactPast, Model, Motion, MotionInput, MotionParams, MotionState, ParamError, motion_step,
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
/// Where bristles with a memory may have come from, in parts of the break-away deflection; relaxed ones where equal.
const SIDES: [f64; 9] = [0.0, -1.0, 1.0, -0.5, 0.5, -0.75, 0.75, -0.25, 0.25];

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
        Path { time_s: &run.time_s, conditions: &conditions, params: &params, smoother: smoother() };
    let start = path.start(torque_nm, past);
    let first = path.smoother.motion(0);
    let past = begun(start, past);
    let mut state = params.at_start_after(&first, &past);
    let (mut travel_rad, mut left_out) = (0.0, 0);
    let forgotten_rad = FORGOTTEN * params.friction_law().break_away_deflection_rad();
    let mut before = first;
    for index in 0..run.len() {
        let (end, predicted) = path.step(&mut state, &before, index);
        travel_rad += (end.angle_rad - before.angle_rad).abs();
        let unknown = start == Start::LeftOut && travel_rad <= forgotten_rad;
        left_out += usize::from(unknown);
        if let Some(torque) = torque_nm.get_mut(index) {
            *torque = if unknown { f64::NAN } else { predicted };
        }
        before = end;
    }
    delay(&run.time_s, torque_nm, params.sensor_delay_s());
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
fn begun(start: Start, past: &Past) -> ContactPast {
    let (deflection_rad, came_from_rad) = match start {
        Start::Estimated { deflection_rad, came_from_rad } => (deflection_rad, came_from_rad),
        Start::LeftOut => (0.0, 0.0),
    };
    ContactPast { deflection_rad, came_from_rad, rest_s: past.rest_s, distance_rad: past.distance_rad }
}

/// A run's motion through the model.
struct Path<'a> {
    time_s: &'a [f64],
    conditions: &'a Conditions<'a>,
    params: &'a MotionParams,
    smoother: Smoother<'a>,
}

impl Path<'_> {
    /// Moves the contact from the sample before `index`, whose motion is `start`, to it; the motion and the torque there.
    fn step(&mut self, state: &mut MotionState, start: &Motion, index: usize) -> (Motion, f64) {
        let end = if self.params.is_behind_a_spring() {
            self.smoother.sharp_motion(index)
        } else {
            self.smoother.motion(index)
        };
        let at = |index: usize| self.time_s.get(index).copied().unwrap_or(f64::NAN);
        let dt_s = if index == 0 { MOMENT_S } else { at(index) - at(index - 1) };
        let (pressure_drop_pa, oil_temperature_c) = self.conditions.before(index);
        let input = MotionInput { start: *start, end, pressure_drop_pa, oil_temperature_c };
        let output = motion_step(self.params, state, &input, dt_s);
        (end, output.measured_torque_nm)
    }

    /// How the contact begins: the deflection that fits the measured torque best until it is forgotten, and where the bristles
    /// came from if they remember it.
    fn start(&mut self, torque_nm: &[f64], past: &Past) -> Start {
        let law = self.params.friction_law();
        let (most_rad, remembers) = (law.break_away_deflection_rad(), law.has_memory());
        if most_rad == 0.0 {
            return Start::Estimated { deflection_rad: 0.0, came_from_rad: 0.0 };
        }
        let samples = self.samples_until_forgotten(FORGOTTEN * most_rad);
        let measured = torque_nm.get(..samples).unwrap_or_default();
        if !measured.iter().any(|torque| torque.is_finite()) {
            return Start::LeftOut;
        }
        let sides: &[f64] = if remembers { &SIDES } else { &[0.0] };
        let from = |side: &f64| self.start_from(measured, past, (side * most_rad, most_rad));
        let best = sides.iter().map(from).min_by(|one, other| one.1.total_cmp(&other.1));
        best.map_or(Start::LeftOut, |best| best.0)
    }

    /// The best of the starts that came from one deflection, of all within ±`most_rad`, and its misfit.
    fn start_from(
        &mut self,
        measured: &[f64],
        past: &Past,
        (came_from_rad, most_rad): (f64, f64),
    ) -> (Start, f64) {
        let mut best = (0.0, f64::INFINITY);
        let mut try_one = |deflection_rad: f64, best: &mut (f64, f64)| {
            let start = Start::Estimated { deflection_rad, came_from_rad };
            let square = self.misfit(measured, &begun(start, past));
            if square < best.1 {
                *best = (deflection_rad, square);
            }
        };
        for trial in 0..TRIALS {
            try_one(most_rad * (2.0 * f64::from(trial) / f64::from(TRIALS - 1) - 1.0), &mut best);
        }
        let mut reach_rad = most_rad / f64::from(TRIALS - 1);
        for _ in 0..REFINEMENTS {
            for deflection_rad in [best.0 - reach_rad, best.0 + reach_rad] {
                try_one(deflection_rad, &mut best);
            }
            reach_rad *= 0.5;
        }
        (Start::Estimated { deflection_rad: best.0, came_from_rad }, best.1)
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

    /// Sum of squares of predicted less measured torque over the first samples.
    fn misfit(&mut self, measured_nm: &[f64], past: &ContactPast) -> f64 {
        let mut before = self.smoother.motion(0);
        let mut state = self.params.at_start_after(&before, past);
        let mut sum = 0.0;
        for (index, measured) in measured_nm.iter().enumerate() {
            let (end, predicted) = self.step(&mut state, &before, index);
            if measured.is_finite() {
                sum += (predicted - measured) * (predicted - measured);
            }
            before = end;
        }
        sum
    }
}
