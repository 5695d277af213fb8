//! A cause under test: an effect of the model, its parameters as the fit moves them, and where the fit may begin.

use valve_model::{Effect, EffectId, EffectValue, Model, ParamError};

/// From the number that the fit moves to the one in the model file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Map {
    /// The same.
    Plain,
    /// exp(u): for what is above zero and known by its order of magnitude.
    Exp,
    /// 1 + exp(u).
    OnePlusExp,
    /// 1/u: a stiffness by its compliance.
    Inverse,
}

/// The least compliance, rad/(N·m): as good as rigid.
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

/// One number of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Parameter {
    pub key: &'static str,
    /// The place in a list, from 0; `None` for a plain number.
    pub slot: Option<usize>,
    pub map: Map,
    /// Where it changes nothing, or, for a shape, where it begins.
    pub neutral: f64,
    pub lower: f64,
    pub upper: f64,
    /// A change that shows and is still small.
    pub step: f64,
}

/// A beginning for the fit: the shape, and the numbers whose sensitivity is looked at there.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Probe {
    pub shape: Vec<f64>,
    /// Parameter and step of each column.
    pub columns: Vec<(usize, f64)>,
    /// The column is the whole way to the shape, not a slope.
    pub jump: bool,
}

/// An effect under test.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Candidate {
    pub id: EffectId,
    pub parameters: Vec<Parameter>,
    pub probes: Vec<Probe>,
    /// Numbers that are fitted from the beginning.
    pub free: Vec<usize>,
    /// Numbers that are fitted only where the data ask for it.
    pub optional: Vec<usize>,
    /// Harmonics in pairs of cosine and sine: each is taken where it pays.
    pub series: bool,
}

impl Candidate {
    /// Where it changes nothing.
    pub fn neutral(&self) -> Vec<f64> {
        self.parameters.iter().map(|parameter| parameter.neutral).collect()
    }

    /// The effect with these numbers, on top of what `model` says of it already.
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
                None => put(&mut parts, parameter.key, EffectValue::Number(value)),
                Some(slot) if value != 0.0 => put_slot(&mut parts, parameter.key, slot, value),
                Some(_) => {}
            }
        }
        Effect::new(self.id, &parts)
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
