//! Pressure and oil temperature along a run, and the checks of what a prediction needs.

use crate::PredictionError;
use log_data::{Channel, Run};
use valve_model::{Condition, Effect, Model};

/// Pressure drop (Pa) and oil temperature (°C) by sample; the model's own numbers where nothing depends on them.
pub(crate) struct Conditions<'a> {
    pressure_drop_pa: Option<&'a [f64]>,
    oil_temperature_c: Option<&'a [f64]>,
    reference_temperature_c: f64,
}

impl<'a> Conditions<'a> {
    /// What `model` needs of `run`.
    pub fn of(run: &'a Run, model: &Model) -> Result<Self, PredictionError> {
        Ok(Self {
            pressure_drop_pa: needed(run, model, Channel::PressureDrop)?,
            oil_temperature_c: needed(run, model, Channel::OilTemperature)?,
            reference_temperature_c: model.reference_temperature_c(),
        })
    }

    /// Pressure drop and oil temperature in the middle between sample `index` and the one before.
    pub fn before(&self, index: usize) -> (f64, f64) {
        let middle = |values: Option<&[f64]>, default: f64| match values {
            Some(values) => mean(values.get(index.saturating_sub(1)), values.get(index)),
            None => default,
        };
        (middle(self.pressure_drop_pa, 0.0), middle(self.oil_temperature_c, self.reference_temperature_c))
    }
}

fn mean(before: Option<&f64>, after: Option<&f64>) -> f64 {
    0.5 * (before.copied().unwrap_or(0.0) + after.copied().unwrap_or(0.0))
}

/// The channel that a condition is measured in.
fn channel_of(condition: Condition) -> Channel {
    match condition {
        Condition::PressureDrop => Channel::PressureDrop,
        Condition::OilTemperature => Channel::OilTemperature,
    }
}

/// A channel that some effects of the model depend on; `None` where the model has none of them.
fn needed<'a>(run: &'a Run, model: &Model, channel: Channel) -> Result<Option<&'a [f64]>, PredictionError> {
    let conditions = [Condition::PressureDrop, Condition::OilTemperature];
    let needs = |effect: &&Effect| {
        conditions.into_iter().any(|condition| channel_of(condition) == channel && effect.needs(condition))
    };
    let Some(effect) = model.effects.iter().find(needs) else {
        return Ok(None);
    };
    let missing = || PredictionError::MissingChannel { run: run.name.clone(), channel, effect: effect.id() };
    whole(run, channel, run.channel(channel).ok_or_else(missing)?).map(Some)
}

/// A channel's samples, none of them missing.
pub(crate) fn whole<'a>(
    run: &Run,
    channel: Channel,
    values: &'a [f64],
) -> Result<&'a [f64], PredictionError> {
    match values.iter().position(|value| value.is_nan()) {
        None => Ok(values),
        Some(index) => Err(PredictionError::MissingSample {
            run: run.name.clone(),
            row: index + 1,
            time_s: run.time_s.get(index).copied().unwrap_or(f64::NAN),
            channel,
        }),
    }
}
