//! Effects: what a valve does beyond the nominal model, by the names that diagnosis gives to causes.

mod covariate;
mod custom;
mod grid;
mod id;
mod label;
mod series;
mod spec;
mod table;

use serde::{Deserialize, Serialize};

pub use covariate::{ActsOn, Covariate};
pub use custom::{
    CustomLaw, MOST_CUSTOM, Rule, check_expression, check_expression_in_units, parameter_names,
};
pub use grid::Grid;
pub use id::EffectId;
pub use label::Label;
pub use spec::{Condition, EffectSpec, ModelNumber, ParameterSpec, SeenIn, ValueKind};

pub(crate) use custom::Prepared;
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
/// the neutral or default value of the table. A formula or a table has no row; what it does is [`Effect::custom`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    id: EffectId,
    parameters: Vec<(String, EffectValue)>,
    custom: Option<CustomLaw>,
}

impl Effect {
    /// An effect with some of its parameters, by key.
    ///
    /// # Errors
    /// A key that it doesn't have (the error's `key` is then `id`), a key given twice, a value out of its range or of the
    /// wrong kind (`key` is then the parameter's).
    pub fn new(id: EffectId, parameters: &[(&str, EffectValue)]) -> Result<Self, ParamError> {
        let parameters = parameters.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
        let effect = Self { id, parameters, custom: None };
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

    /// A formula or a table by a name of the user's; a formula's parameters are the names in its expression.
    ///
    /// # Errors
    /// A name, an expression or a table that is refused (`key` is `name`, `expression`, `over`, `knots` or `values`).
    pub fn custom_named(name: &str, law: CustomLaw, parameters: &[(&str, f64)]) -> Result<Self, ParamError> {
        let own = |(key, value): &(&str, f64)| ((*key).to_owned(), EffectValue::Number(*value));
        let parameters = parameters.iter().map(own).collect();
        let effect = Self { id: custom::custom_id(name)?, parameters, custom: Some(law) };
        effect.validate()?;
        Ok(effect)
    }

    /// The same formula, table or effect of the list with other parameters.
    ///
    /// # Errors
    /// As [`Effect::new`].
    pub fn with_parts(&self, parameters: &[(&str, EffectValue)]) -> Result<Self, ParamError> {
        let parameters = parameters.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
        let effect = Self { id: self.id, parameters, custom: self.custom.clone() };
        effect.validate()?;
        Ok(effect)
    }

    /// The value of a formula or a table at covariates in the order of [`Covariate::ALL`]; `None` for the effects of the list.
    pub fn custom_value(&self, covariates: &[f64; 8]) -> Option<f64> {
        self.prepared()?.ok().map(|prepared| prepared.at(covariates))
    }

    /// The same at many places.
    pub fn custom_values(&self, covariates: impl Iterator<Item = [f64; 8]>) -> Option<Vec<f64>> {
        let prepared = self.prepared()?.ok()?;
        Some(covariates.map(|at| prepared.at(&at)).collect())
    }

    /// What a formula or a table does; `None` for the effects of the list.
    pub fn custom(&self) -> Option<&CustomLaw> {
        self.custom.as_ref()
    }

    /// Whether it depends on a condition, which a log has to bring along.
    pub fn needs(&self, condition: Condition) -> bool {
        let covariate = match condition {
            Condition::PressureDrop => Covariate::PressureDrop,
            Condition::OilTemperature => Covariate::OilTemperature,
        };
        self.spec().needs == Some(condition) || self.depends_on(covariate)
    }

    /// Whether a formula or a table depends on a covariate.
    pub fn depends_on(&self, covariate: Covariate) -> bool {
        self.prepared().is_some_and(|prepared| prepared.is_ok_and(|prepared| prepared.uses(covariate)))
    }

    /// Refuses a formula whose parameters leave it without a finite value somewhere that valves get ([`Covariate::range`]), as
    /// readers of model files do.
    ///
    /// # Errors
    /// `expression`, and where it has none.
    pub fn check_values(&self) -> Result<(), ParamError> {
        let Some(Prepared::Formula(program)) = self.prepared().transpose()? else { return Ok(()) };
        custom::check_poles(&program)
            .map_err(|error| ParamError::new("expression", error, "a finite value wherever valves get"))
    }

    /// A formula or a table ready to run.
    pub(crate) fn prepared(&self) -> Option<Result<Prepared, ParamError>> {
        let number = |value: &EffectValue| match value {
            EffectValue::Number(number) => *number,
            EffectValue::List(_) => f64::NAN,
        };
        let numbers: Vec<(&str, f64)> = self.parts().map(|(key, value)| (key, number(value))).collect();
        self.custom.as_ref().map(|law| law.prepared(&numbers))
    }

    fn validate_custom(&self) -> Result<(), ParamError> {
        let name = self.id.name();
        custom::custom_id(name)?;
        for (key, value) in &self.parameters {
            if !matches!(value, EffectValue::Number(number) if number.is_finite()) {
                return Err(ParamError::new("parameters", key, "finite numbers"));
            }
        }
        let law = || ParamError::new("id", name, "an effect of the list, a formula or a table");
        self.prepared().ok_or_else(law)?.map(|_| ())
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
        if self.id.is_custom() || self.custom.is_some() {
            return self.validate_custom();
        }
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
