//! Effects: what a valve does beyond the nominal model, by the names that diagnosis gives to causes.

mod id;
mod series;
mod spec;
mod table;

use serde::{Deserialize, Serialize};

pub use id::EffectId;
pub use spec::{Condition, EffectSpec, ModelNumber, ParameterSpec, SeenIn, ValueKind};

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

/// One `[[effect]]` of a model file, validated against its row of the table ([`EffectId::spec`]).
///
/// In the file: `id`, and beside it one key per parameter, a number or an array of numbers. Parameters left out take
/// the neutral or default value of the table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    id: EffectId,
    parameters: Vec<(String, EffectValue)>,
}

impl Effect {
    /// An effect with some of its parameters, by key.
    ///
    /// # Errors
    /// A key that it doesn't have (the error's `key` is then `id`), a key given twice, a value out of its range or of the
    /// wrong kind (`key` is then the parameter's).
    pub fn new(id: EffectId, parameters: &[(&str, EffectValue)]) -> Result<Self, ParamError> {
        let parameters = parameters.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
        let effect = Self { id, parameters };
        effect.validate()?;
        Ok(effect)
    }

    /// An effect from what a model file holds: its name and its keys, `id` itself left out.
    ///
    /// # Errors
    /// A name that is no effect's (`key` is then `id`); else as [`Effect::new`].
    pub fn from_parts(name: &str, parameters: &[(&str, EffectValue)]) -> Result<Self, ParamError> {
        let id = EffectId::from_name(name)
            .ok_or_else(|| ParamError::new("id", name, "the name of a known effect"))?;
        Self::new(id, parameters)
    }

    /// Which effect it is.
    pub fn id(&self) -> EffectId {
        self.id
    }

    /// The parameters given, in the order they were given, for writing back.
    pub fn parts(&self) -> impl Iterator<Item = (&str, &EffectValue)> {
        self.parameters.iter().map(|(key, value)| (key.as_str(), value))
    }

    /// The effect's row in the table.
    pub fn spec(&self) -> &'static EffectSpec {
        self.id.spec()
    }

    /// A parameter that is a number: as given, else the table's default; 0 where the effect has no such parameter.
    pub fn number(&self, key: &str) -> f64 {
        match self.given(key) {
            Some(EffectValue::Number(value)) => *value,
            _ => self.spec().parameter(key).map_or(0.0, |row| row.default),
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
    /// As [`Effect::new`].
    pub fn validate(&self) -> Result<(), ParamError> {
        let spec = self.spec();
        for (index, (key, value)) in self.parameters.iter().enumerate() {
            let row = spec
                .parameter(key)
                .ok_or_else(|| ParamError::new("id", format!("{} with key `{key}`", self.id), spec.keys))?;
            if self.parameters.iter().skip(index + 1).any(|(other, _)| other == key) {
                return Err(ParamError::new(row.key, "given twice", "each key once"));
            }
            row.check(value)?;
        }
        self.check_orders()
    }

    /// A series keeps only so many orders.
    fn check_orders(&self) -> Result<(), ParamError> {
        let (cos, sin) = (self.list("cos"), self.list("sin"));
        let there =
            |index: &usize| [cos, sin].iter().any(|of| of.get(*index).is_some_and(|value| *value != 0.0));
        let count = (0..cos.len().max(sin.len())).filter(there).count();
        let Some(row) = self.spec().parameter("cos").filter(|_| count > table::MAX_TERMS) else {
            return Ok(());
        };
        Err(ParamError::new(row.key, format!("{count} orders other than 0 in `cos` and `sin`"), row.range))
    }
}
