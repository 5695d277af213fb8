//! A row of the table of effects: an effect and its parameters.

use super::EffectValue;
use super::id::EffectId;
use crate::ParamError;

/// What a parameter's value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ValueKind {
    /// One number.
    Number,
    /// An array of at most so many numbers.
    List(usize),
}

/// One parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterSpec {
    /// The key in the model file.
    pub key: &'static str,
    /// The unit, "1" where there is none.
    pub unit: &'static str,
    /// A number or an array.
    pub kind: ValueKind,
    /// The least value accepted; an array's entries alike.
    pub min: f64,
    /// The greatest value accepted; an array's entries alike.
    pub max: f64,
    /// The value where the key is left out; arrays are then empty.
    pub default: f64,
    /// The range in words, for messages.
    pub range: &'static str,
    /// What the parameter does, and what zero or one means.
    pub meaning: &'static str,
}

/// Numbers of a model file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelNumber {
    /// The section they are in.
    pub section: &'static str,
    /// Their keys, in words.
    pub keys: &'static str,
    /// What they are, for people; follows "a factor on".
    pub label: &'static str,
}

impl ModelNumber {
    /// Each of their keys, as files have it.
    pub fn each_key(&self) -> impl Iterator<Item = &'static str> + use<> {
        self.keys.split([' ', ',', '`']).filter(|word| word.contains('_'))
    }
}

/// Which logs an effect shows in: torque logs hold torque and angle, angle logs command and angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeenIn {
    /// Both.
    AnyLog,
    /// It is in what the transducer reads.
    TorqueLogs,
    /// It lies between command and angle.
    AngleLogs,
}

/// What acts on a valve beside its motor, and is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    /// Pressure drop over the orifice.
    PressureDrop,
    /// Temperature of the oil.
    OilTemperature,
}

/// One effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectSpec {
    /// Which one.
    pub id: EffectId,
    /// The number of the model that it is a factor on, if that is all it is; it can be folded in there.
    pub folded_into: Option<ModelNumber>,
    /// The logs that can show it.
    pub seen_in: SeenIn,
    /// The condition that it depends on, which a log has to bring along.
    pub needs: Option<Condition>,
    /// What is changed in, or added to, the nominal model.
    pub formula: &'static str,
    /// The keys in words, for messages.
    pub keys: &'static str,
    /// The parameters.
    pub parameters: &'static [ParameterSpec],
}

impl EffectSpec {
    /// The row of one key.
    pub fn parameter(&self, key: &str) -> Option<&'static ParameterSpec> {
        self.parameters.iter().find(|row| row.key == key)
    }
}

impl ParameterSpec {
    pub(crate) fn check(&self, value: &EffectValue) -> Result<(), ParamError> {
        match (self.kind, value) {
            (ValueKind::Number, EffectValue::Number(number)) => self.check_number(*number),
            (ValueKind::List(most), EffectValue::List(numbers)) if numbers.len() <= most => {
                numbers.iter().try_for_each(|number| self.check_number(*number))
            }
            (_, EffectValue::Number(number)) => Err(ParamError::new(self.key, number, self.range)),
            (_, EffectValue::List(numbers)) => {
                let found = format!("an array of {}", numbers.len());
                Err(ParamError::new(self.key, found, self.range))
            }
        }
    }

    fn check_number(&self, number: f64) -> Result<(), ParamError> {
        if number.is_finite() && number >= self.min && number <= self.max {
            Ok(())
        } else {
            Err(ParamError::new(self.key, number, self.range))
        }
    }
}
