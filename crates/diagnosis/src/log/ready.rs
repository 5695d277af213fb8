//! A model prepared to predict torque or angle: everything in which the two predictions differ.

use crate::log::course::angle_rad;
use crate::log::driven::Driven;
use crate::log::initial_state::InitialState;
use crate::log::inputs::Inputs;
use crate::log::kind::LogKind;
use crate::log::predictions::{Key, Models, Prepared, Stretch, key, locked};
use crate::log::torque::{begins_with_nm, torque_nm};
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};
use valve_model::{Model, MotionParams, ParamError, ValveParams};

/// The initial friction torque may be up to this multiple of the static torque: the model's own levels may be too low.
const BEYOND_STATIC: f64 = 1.2;
/// The simulation cost of a torque sample with bristles, and of a sub-step behind a spring, relative to a static friction law.
const BRISTLES: usize = 4;
const SPRING: usize = 20;
/// Most that the first angle may be off, rad.
const FIRST_ANGLE_RAD: f64 = 0.01;

/// What the prediction of one of the channels needs of a model.
#[derive(Debug)]
pub(crate) enum Params {
    Torque(Box<MotionParams>),
    Angle(Box<ValveParams>),
}

/// A prepared model in the hands of who asks it.
pub(crate) struct Ready {
    prepared: Arc<Prepared<Params>>,
    /// The runs that were counted as work here: one is predicted once for all its pieces.
    counted: Mutex<BTreeSet<Key>>,
}

/// The simulation cost of a sample, relative to a static friction law.
fn cost(params: &MotionParams, time_s: &[f64]) -> usize {
    let bristles = params.friction_law().break_away_deflection_rad() > 0.0;
    let length_s = time_s.first().zip(time_s.last()).map_or(0.0, |(first, last)| last - first);
    match params.pieces_behind_spring(length_s / time_s.len().max(1) as f64) {
        Some(pieces) => SPRING * pieces as usize,
        None if bristles => BRISTLES,
        None => 1,
    }
}

impl Ready {
    /// The integrator of angles may err by `angle_error_rad` in a sub-step. All models that `models` holds predict the same kind of log.
    pub fn new(
        models: &Models<Params>,
        model: &Model,
        kind: LogKind,
        angle_error_rad: f64,
    ) -> Result<Self, ParamError> {
        let prepare = || {
            Ok(if kind.motion_is_measured {
                Params::Torque(Box::new(MotionParams::new(model)?))
            } else {
                Params::Angle(Box::new(ValveParams::new(model)?.accepting(angle_error_rad)))
            })
        };
        Ok(Self { prepared: models.prepared(model, prepare)?, counted: Mutex::default() })
    }

    fn params(&self) -> &Params {
        &self.prepared.params
    }

    /// True where a piece starts with a torque that friction carries, false where it starts with an angle.
    pub fn starts_with_a_torque(&self) -> bool {
        matches!(self.params(), Params::Torque(_))
    }

    /// The most that friction carries at rest where a piece starts, N·m; `None` where a piece starts with an angle.
    pub fn static_torque_nm(&self, driven: &Driven) -> Option<f64> {
        match self.params() {
            Params::Torque(params) => Some(begins_with_nm(params, driven)),
            Params::Angle(..) => None,
        }
    }

    /// Bound of the initial state's shift, N·m or rad; 0 if the law has no bristles that could hold a torque.
    pub fn start_bound(&self, driven: &Driven) -> f64 {
        match self.params() {
            Params::Torque(params) if params.friction_law().break_away_deflection_rad() == 0.0 => 0.0,
            Params::Torque(params) => BEYOND_STATIC * begins_with_nm(params, driven),
            Params::Angle(..) => FIRST_ANGLE_RAD,
        }
    }

    /// A torque as the transducer measures it: scaled and delayed. Unchanged in an angle log.
    pub fn as_measured(&self, driven: &Driven, mut values: Vec<f64>) -> Vec<f64> {
        if let Params::Torque(params) = self.params() {
            values.iter_mut().for_each(|value| *value *= params.torque_gain());
            prediction::delay(driven.time_s(), &mut values, params.sensor_delay());
        }
        values
    }

    /// True if the prediction depends on the side from which the piece began: the encoder's shaft has play, or the bristles a memory.
    pub fn has_sides(&self) -> bool {
        match self.params() {
            Params::Torque(params) => params.friction_law().has_memory(),
            Params::Angle(params) => {
                params.backlash_half_width_rad() > 0.0 || params.friction_law().has_memory()
            }
        }
    }

    /// The torque, N·m, or the angle, rad, of each sample.
    pub fn predict(&self, inputs: &Inputs<'_>, start: InitialState) -> Vec<f64> {
        self.count(inputs, start);
        let Some(stretch) = inputs.stretch else { return self.simulate(inputs, start) };
        let rows = inputs.whole_run.map(|(_, rows)| rows);
        self.prepared.predictions.get(key(stretch, start), rows, || self.simulate(inputs, start))
    }

    /// Simulates a piece, or the whole of its run.
    fn simulate(&self, inputs: &Inputs<'_>, start: InitialState) -> Vec<f64> {
        match (self.params(), &inputs.whole_run) {
            (Params::Torque(params), _) => torque_nm(params, inputs, start),
            (Params::Angle(params), Some((run, _))) => {
                angle_rad(&run.driven, run.first, run.past, params, start)
            }
            (Params::Angle(params), None) => {
                let Some(first) = inputs.motions.first() else { return Vec::new() };
                let mut angle = angle_rad(inputs.driven, *first, inputs.past, params, start);
                angle.split_off(inputs.driven.lead().min(angle.len()))
            }
        }
    }

    /// Counts a prediction as work, whether it was kept or not: where a search ends must not depend on what is forgotten when.
    fn count(&self, inputs: &Inputs<'_>, start: InitialState) {
        let samples = match (self.params(), &inputs.whole_run) {
            (Params::Torque(params), _) => inputs.motions.len() * cost(params, inputs.driven.time_s()),
            (Params::Angle(_), None) => inputs.driven.all_times_s().len(),
            (Params::Angle(_), Some((run, _))) => {
                let is_new = locked(&self.counted).insert(key(Stretch::Run(run.run), start));
                if is_new { run.driven.all_times_s().len() } else { 0 }
            }
        };
        inputs.work.add(samples);
    }
}
