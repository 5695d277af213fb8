//! Effects: what a valve does beyond the nominal model, by the names that diagnosis gives to causes.

mod series;
mod spec;
mod table;

use serde::{Deserialize, Serialize};

pub use spec::{EffectSpec, ParameterSpec, ValueKind};
pub use table::EFFECTS;

pub(crate) use series::Series;

use crate::ParamError;

/// One parameter's value: a number, or a list of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum EffectValue {
    /// A number.
    Number(f64),
    /// A list, such as the harmonics of a Fourier series from the first on.
    List(Vec<f64>),
}

/// One `[[effect]]` of a model file, validated against [`EFFECTS`].
///
/// In the file: `id`, and beside it one key per parameter, a number or an array of numbers. Parameters left out take
/// the neutral or default value of the table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    id: String,
    parameters: Vec<(String, EffectValue)>,
}

impl Effect {
    /// An effect from what a model file holds: its id and its keys, `id` itself left out.
    ///
    /// # Errors
    /// An id or a key that is not in [`EFFECTS`] (`key` is then `id`), a key given twice, a value out of its range or
    /// of the wrong kind (`key` is then the parameter's).
    pub fn from_parts(id: &str, parameters: &[(&str, EffectValue)]) -> Result<Self, ParamError> {
        let parameters = parameters.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
        let effect = Self { id: id.to_owned(), parameters };
        effect.validate()?;
        Ok(effect)
    }

    /// The effect's name.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// The parameters given, in the order they were given, for writing back.
    pub fn parts(&self) -> impl Iterator<Item = (&str, &EffectValue)> {
        self.parameters.iter().map(|(key, value)| (key.as_str(), value))
    }

    /// The effect's row in the table.
    ///
    /// # Errors
    /// An id that the table doesn't know.
    pub fn spec(&self) -> Result<&'static EffectSpec, ParamError> {
        table::spec(&self.id).ok_or_else(|| ParamError::new("id", &self.id, "the name of a known effect"))
    }

    /// A parameter that is a number: as given, else the table's default; 0 where the effect has no such parameter.
    pub fn number(&self, key: &str) -> f64 {
        match self.given(key) {
            Some(EffectValue::Number(value)) => *value,
            _ => self.spec().ok().and_then(|spec| spec.parameter(key)).map_or(0.0, |row| row.default),
        }
    }

    /// A parameter that is a list: as given, else empty.
    pub fn list(&self, key: &str) -> &[f64] {
        match self.given(key) {
            Some(EffectValue::List(values)) => values,
            _ => &[],
        }
    }

    fn given(&self, key: &str) -> Option<&EffectValue> {
        self.parameters.iter().find(|(name, _)| name == key).map(|(_, value)| value)
    }

    /// Checks the effect against the table.
    ///
    /// # Errors
    /// As [`Effect::from_parts`].
    pub fn validate(&self) -> Result<(), ParamError> {
        let spec = self.spec()?;
        for (index, (key, value)) in self.parameters.iter().enumerate() {
            let row = spec
                .parameter(key)
                .ok_or_else(|| ParamError::new("id", format!("{} with key `{key}`", self.id), spec.keys))?;
            if self.parameters.iter().skip(index + 1).any(|(other, _)| other == key) {
                return Err(ParamError::new(row.key, "given twice", "each key once"));
            }
            row.check(value)?;
        }
        Ok(())
    }
}
