//! A candidate: an effect under test, its parameters in the coordinates that the fit moves, and the points where a fit
//! may start.

use crate::suspect::Suspect;
use valve_model::{Effect, EffectId, EffectValue, Label, Model, ParamError};

/// Maps a coordinate of the fit, u, to the parameter in the model file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Map {
    /// u
    Plain,
    /// exp(u): a positive parameter known by its order of magnitude.
    Exp,
    /// 1 + exp(u).
    OnePlusExp,
    /// 1/u: a stiffness, fitted as its compliance.
    Inverse,
}

/// Least compliance, rad/(N·m): practically rigid.
const RIGID: f64 = 1e-12;

impl Map {
    pub fn value(self, u: f64) -> f64 {
        match self {
            Self::Plain => u,
            Self::Exp => u.exp(),
            Self::OnePlusExp => 1.0 + u.exp(),
            Self::Inverse => 1.0 / u.max(RIGID),
        }
    }

    /// |dvalue/du|
    pub fn slope(self, u: f64) -> f64 {
        match self {
            Self::Plain => 1.0,
            Self::Exp | Self::OnePlusExp => u.exp(),
            Self::Inverse => 1.0 / (u.max(RIGID) * u.max(RIGID)),
        }
    }
}

/// One parameter of an effect, in the fit's coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Parameter {
    pub key: Label,
    /// Its index in a list parameter; `None` for a number.
    pub slot: Option<usize>,
    pub map: Map,
    /// The value without effect; for a shape parameter, its starting value.
    pub neutral: f64,
    pub lower: f64,
    pub upper: f64,
    /// Finite-difference step.
    pub step: f64,
}

/// A starting point of the fit, and the sensitivities that the screening takes there.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Probe {
    pub shape: Vec<f64>,
    /// Parameter and step of each column.
    pub columns: Vec<(usize, f64)>,
    /// The column is the whole change from neutral to the shape, not a slope.
    pub jump: bool,
}

/// An effect under test.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Candidate {
    pub id: EffectId,
    pub parameters: Vec<Parameter>,
    pub probes: Vec<Probe>,
    /// Parameters that are free from the start.
    pub free: Vec<usize>,
    /// Parameters that are freed only if that cuts the held-out error.
    pub optional: Vec<usize>,
    /// The parameters are cosine and sine of harmonics; each harmonic is added only if it cuts the held-out error.
    pub series: bool,
    /// The law that the user suspects, if the candidate is not one of the list.
    pub own: Option<Suspect>,
}

impl Candidate {
    /// The parameters at which the effect vanishes.
    pub fn neutral(&self) -> Vec<f64> {
        self.parameters.iter().map(|parameter| parameter.neutral).collect()
    }

    /// The effect with these parameters, on top of those that `model` already has for it.
    pub fn effect(&self, model: &Model, numbers: &[f64]) -> Result<Effect, ParamError> {
        let mut parts: Vec<(&str, EffectValue)> = Vec::new();
        let present = model.effects.iter().find(|effect| effect.id() == self.id);
        for (key, value) in present.iter().flat_map(|effect| effect.parts()) {
            parts.push((key, value.clone()));
        }
        if self.id == EffectId::EncoderEccentricity {
            let (along, across) = (at(numbers, 0), at(numbers, 1));
            put(&mut parts, "amplitude_rad", EffectValue::Number(along.hypot(across).min(1.0)));
            put(&mut parts, "phase_rad", EffectValue::Number(across.atan2(along)));
            return Effect::new(self.id, &parts.iter().map(|(k, v)| (*k, v.clone())).collect::<Vec<_>>());
        }
        for (parameter, u) in self.parameters.iter().zip(numbers) {
            let value = parameter.map.value(*u);
            match parameter.slot {
                None => put(&mut parts, parameter.key.as_str(), EffectValue::Number(value)),
                Some(slot) if value != 0.0 => put_slot(&mut parts, parameter.key.as_str(), slot, value),
                Some(_) => {}
            }
        }
        match &self.own {
            Some(own) => {
                let effect = own.effect.with_parts(&parts)?;
                // A fit goes no further: what is written has to be read again.
                effect.check_values()?;
                Ok(effect)
            }
            None => Effect::new(self.id, &parts),
        }
    }

    /// The unit of a parameter.
    pub fn unit_of(&self, key: &str) -> &str {
        self.own.as_ref().map_or_else(|| Self::unit(key, self.id), |own| own.unit(key))
    }

    /// The unit of a parameter in the model file.
    pub fn unit(key: &str, id: EffectId) -> &'static str {
        id.spec().parameter(key).map_or("1", |row| row.unit)
    }
}

pub(crate) fn at(numbers: &[f64], index: usize) -> f64 {
    numbers.get(index).copied().unwrap_or(0.0)
}

fn put<'a>(parts: &mut Vec<(&'a str, EffectValue)>, key: &'a str, value: EffectValue) {
    match parts.iter_mut().find(|(name, _)| *name == key) {
        Some(part) => part.1 = value,
        None => parts.push((key, value)),
    }
}

fn put_slot<'a>(parts: &mut Vec<(&'a str, EffectValue)>, key: &'a str, slot: usize, value: f64) {
    if !parts.iter().any(|(name, _)| *name == key) {
        parts.push((key, EffectValue::List(Vec::new())));
    }
    if let Some((_, EffectValue::List(values))) = parts.iter_mut().find(|(name, _)| *name == key) {
        if values.len() <= slot {
            values.resize(slot + 1, 0.0);
        }
        if let Some(place) = values.get_mut(slot) {
            *place = value;
        }
    }
}
