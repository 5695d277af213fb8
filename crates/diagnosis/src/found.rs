//! What a diagnosis returns to its caller: its progress, and its result.

use crate::contest::Contest;
use crate::outcome::Diagnosis;
use log_data::Channel;
use valve_model::{Effect, EffectId, Model};

/// Progress of a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event<'a> {
    /// The residual of the given model and the noise, RMS in the channel's unit.
    Noise {
        /// Measured less predicted, on the runs that causes are fitted on.
        rms: f64,
        /// Noise of the measurement.
        noise: f64,
    },
    /// Effects by their linearised cut of the held-out RMS, relative to the noise.
    Ranking(&'a [(EffectId, f64)]),
    /// Progress towards the bound of the search: samples simulated, and their limit.
    Bound {
        /// Samples simulated so far.
        simulated: u64,
        /// Samples after which it concludes from the causes found so far.
        at_most: u64,
    },
    /// A step of the work.
    Step(&'static str),
    /// A step that searches anew, and why.
    Again(&'static str),
}

/// A piece of a run, for plots: measured against predicted.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    /// The run's place in the log, its name and kind.
    pub run: usize,
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: String,
    /// Whether it was held out.
    pub held_out: bool,
    /// Times, s.
    pub time_s: Vec<f64>,
    /// Measured angle, rad; that of the command in logs without torque.
    pub angle_rad: Vec<f64>,
    /// Speed, rad/s.
    pub speed_rad_per_s: Vec<f64>,
    /// Pressure drop, Pa; empty without.
    pub pressure_pa: Vec<f64>,
    /// Oil temperature, °C; empty without.
    pub temperature_c: Vec<f64>,
    /// What was measured: torque, N·m, or angle, rad.
    pub measured: Vec<f64>,
    /// Prediction of the given model.
    pub before: Vec<f64>,
    /// Prediction of the extended model.
    pub after: Vec<f64>,
    /// One over each sample's standard deviation by the error model, 1/N·m or 1/rad: small where the prediction itself is not
    /// well known, as where it begins; 0 for a sample that does not count.
    pub weights: Vec<f64>,
}

/// The diagnosis, and what goes with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// For diagnosis.json.
    pub diagnosis: Diagnosis,
    /// The given model with the accepted causes and the corrections within the tolerance: it predicts this log with the reported error.
    pub extended: Model,
    /// The effect that fitted best of each ambiguous group, in their order; none if there is an objection to the selection.
    /// Then the effects that are offered.
    pub proposed: Vec<Effect>,
    /// Every effect of each ambiguous group, in their order, fitted in place of the others.
    pub rivals: Vec<Effect>,
    /// Each ambiguous group of which two effects or more were fitted, and the last law without a name with those that do as well, for the
    /// next experiment.
    pub contests: Vec<Contest>,
    /// The channel that the model predicts.
    pub channel: Channel,
    /// Whether each run's zero of the torque, or a hum, was subtracted before the error was computed: predictions contain neither.
    pub taken_off: bool,
    /// The first screening: cut of the held-out RMS, relative to the noise.
    pub ranking: Vec<(EffectId, f64)>,
    /// The pieces, for plots.
    pub shown: Vec<Shown>,
    /// Samples of the log, and of those the ones that were fitted or held out.
    pub samples: (usize, usize),
}
