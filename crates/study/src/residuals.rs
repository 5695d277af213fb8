//! Every sample of the log, predicted by the given and by the extended model.
//!
//! The diagnosis looks at blocks of long logs. Here whole runs are predicted, as `stepvalve predict` does it.

use crate::predicted::predictions;
use diagnosis::{Covariance, Found};
use log_data::{AngleZero, Attribute, Channel, Extra, Log, median};
use nalgebra::DMatrix;
use prediction::PredictionError;
use valve_model::{EffectValue, Model};

/// So many samples may be predicted to learn how far the parameters' uncertainty moves a prediction: a few seconds' work.
const TORQUES: usize = 10_000_000;
const ANGLES: usize = 1_000_000;

/// A log's samples beside their predictions.
#[derive(Debug)]
pub struct Residuals {
    /// What is predicted.
    pub channel: Channel,
    /// Of each run, in the log's order.
    pub runs: Vec<Sampled>,
    /// Whether the standard deviations know of the parameters' uncertainty, beside the measurement's noise.
    with_parameters: bool,
}

/// A run's samples, in the channel's unit; NaN where nothing was measured or predicted.
#[derive(Debug, Default)]
pub struct Sampled {
    /// As measured.
    pub measured: Vec<f64>,
    /// Predicted by the given model.
    pub before: Vec<f64>,
    /// Predicted by the extended model.
    pub after: Vec<f64>,
    /// The standard deviation of measured less predicted by the extended model, were it right.
    pub deviation: Vec<f64>,
}

impl Residuals {
    /// Predicts all runs.
    ///
    /// # Errors
    /// A run that can't be predicted; the diagnosis has looked at all of them before.
    pub fn of(log: &Log, given: &Model, found: &Found) -> Result<Self, PredictionError> {
        let channel = found.channel;
        let (whole, _) = log_data::bridged(log);
        let mut before = predictions(&whole, channel, given)?;
        let mut after = predictions(&whole, channel, &found.extended)?;
        let noise = found.diagnosis.residual.first().map_or(f64::NAN, |residual| residual.noise);
        let spread = spread(&whole, found, &after)?;
        let with_parameters = spread.is_some();
        let measured: Vec<Vec<f64>> =
            log.runs.iter().map(|run| run.channel(channel).unwrap_or_default().to_vec()).collect();
        if channel == Channel::Angle {
            take_out_zeros(log.angle_zero, &measured, &mut before);
            take_out_zeros(log.angle_zero, &measured, &mut after);
        }
        let runs = measured.into_iter().zip(before).zip(after).enumerate().map(
            |(index, ((measured, before), after))| {
                let of_run = spread.as_ref().and_then(|spread| spread.get(index));
                let at = |row: usize| of_run.and_then(|run| run.get(row)).copied().unwrap_or(0.0);
                let deviation = (0..measured.len()).map(|row| (noise * noise + at(row)).sqrt()).collect();
                Sampled { measured, before, after, deviation }
            },
        );
        Ok(Self { channel, runs: runs.collect(), with_parameters })
    }

    /// A log as residuals.h5 holds it: the log's channels, and what was predicted beside them.
    pub fn beside(&self, log: &Log) -> Log {
        let unit = self.channel.unit();
        let mut all = Log { title: format!("Residuals: {}", log.title), ..log.clone() };
        let mut say = |key: &str, text: &str| {
            all.attributes.insert(key.to_owned(), Attribute::Text(text.to_owned()));
        };
        say("predicted", self.channel.name());
        say(
            "standard_deviation",
            if self.with_parameters { "of noise and parameters" } else { "of noise alone" },
        );
        for (run, sampled) in all.runs.iter_mut().zip(&self.runs) {
            let extra = |name: &str, values: &[f64]| Extra {
                name: name.to_owned(),
                unit: unit.to_owned(),
                values: values.to_vec(),
            };
            run.extra = vec![
                extra("measured", &sampled.measured),
                extra("predicted_before", &sampled.before),
                extra("predicted_after", &sampled.after),
                extra("standard_deviation", &sampled.deviation),
            ];
        }
        all
    }
}

impl Sampled {
    /// RMS of measured less predicted, where both are known.
    pub fn rms(&self, after: bool) -> f64 {
        let predicted = if after { &self.after } else { &self.before };
        let squares = self.measured.iter().zip(predicted).map(|(measured, model)| (measured - model).powi(2));
        let (sum, count) = squares
            .filter(|square| square.is_finite())
            .fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 1.0));
        if count > 0.0 { (sum / count).sqrt() } else { f64::NAN }
    }
}

/// Moves predicted angles to the measured zero, which no model knows: one for the log, or one for each run.
fn take_out_zeros(zero: AngleZero, measured: &[Vec<f64>], predicted: &mut [Vec<f64>]) {
    let differences = |measured: &[f64], predicted: &[f64]| -> Vec<f64> {
        measured
            .iter()
            .zip(predicted)
            .map(|(m, p)| m - p)
            .filter(|difference| difference.is_finite())
            .collect()
    };
    let mut by_run: Vec<Vec<f64>> =
        measured.iter().zip(predicted.iter()).map(|(m, p)| differences(m, p)).collect();
    let shifts: Vec<f64> = match zero {
        AngleZero::PerRun => by_run.iter_mut().map(|of| median(of).unwrap_or(0.0)).collect(),
        AngleZero::Common => vec![median(&mut by_run.concat()).unwrap_or(0.0); measured.len()],
    };
    for (values, shift) in predicted.iter_mut().zip(shifts) {
        values.iter_mut().for_each(|value| *value += shift);
    }
}

/// The variance of each prediction by what the causes' numbers are uncertain, to first order; `None` where there is no such
/// number, or too many samples.
fn spread(log: &Log, found: &Found, after: &[Vec<f64>]) -> Result<Option<Vec<Vec<f64>>>, PredictionError> {
    let shifted = moved(&found.extended, &found.diagnosis.covariance);
    let samples: usize = after.iter().map(Vec::len).sum();
    let most = if found.channel == Channel::Torque { TORQUES } else { ANGLES };
    if shifted.is_empty() || samples.saturating_mul(shifted.len()) > most {
        return Ok(None);
    }
    let mut variance: Vec<Vec<f64>> = after.iter().map(|run| vec![0.0; run.len()]).collect();
    for model in &shifted {
        let moved = predictions(log, found.channel, model)?;
        for ((sums, run), moved) in variance.iter_mut().zip(after).zip(&moved) {
            for ((sum, value), moved) in sums.iter_mut().zip(run).zip(moved) {
                *sum += (moved - value).powi(2);
            }
        }
    }
    Ok(Some(variance))
}

/// The model moved by one standard deviation along each direction in which its causes' numbers scatter independently.
fn moved(extended: &Model, covariance: &Covariance) -> Vec<Model> {
    let known: Vec<usize> = (0..covariance.of.len())
        .filter(|index| covariance.of.get(*index).is_some_and(|name| with(extended, name, 0.0).is_some()))
        .collect();
    if known.is_empty() {
        return Vec::new();
    }
    let entry = |row: usize, column: usize| {
        let (row, column) = (known.get(row).copied(), known.get(column).copied());
        row.zip(column)
            .and_then(|(row, column)| covariance.matrix.get(row)?.get(column).copied())
            .unwrap_or(0.0)
    };
    let scatter = DMatrix::from_fn(known.len(), known.len(), entry).symmetric_eigen();
    let along = |direction: usize| {
        let size = scatter.eigenvalues.get(direction).copied().filter(|of| *of > 0.0)?.sqrt();
        // Where one side is no model any more, the other is.
        [size, -size].into_iter().find_map(|size| {
            known.iter().enumerate().try_fold(extended.clone(), |model, (place, index)| {
                let by = size * scatter.eigenvectors.get((place, direction))?;
                with(&model, covariance.of.get(*index)?, by)
            })
        })
    };
    (0..known.len()).filter_map(along).collect()
}

/// The model with a number of an effect, `id.key` or `id.key[n]`, greater by so much; `None` where it has no such number, or
/// may not have it.
fn with(model: &Model, name: &str, by: f64) -> Option<Model> {
    let (id, key) = name.split_once('.')?;
    let (key, slot) = match key.strip_suffix(']').and_then(|key| key.split_once('[')) {
        Some((key, slot)) => (key, Some(slot.parse::<usize>().ok()?.checked_sub(1)?)),
        None => (key, None),
    };
    let mut model = model.clone();
    let effect = model.effects.iter_mut().find(|effect| effect.id().name() == id)?;
    let mut parts: Vec<(String, EffectValue)> =
        effect.parts().map(|(key, value)| (key.to_owned(), value.clone())).collect();
    let (_, value) = parts.iter_mut().find(|(of, _)| of == key)?;
    match (value, slot) {
        (EffectValue::Number(number), None) => *number += by,
        (EffectValue::List(list), Some(slot)) => *list.get_mut(slot)? += by,
        _ => return None,
    }
    let parts: Vec<(&str, EffectValue)> =
        parts.iter().map(|(key, value)| (key.as_str(), value.clone())).collect();
    *effect = effect.with_parts(&parts).ok()?;
    Some(model)
}
