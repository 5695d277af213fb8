//! Effects that users add: formulas and tables.

use expression::{Dimension, ExpressionError, Program, compile, dimension, pole};
use serde::{Deserialize, Serialize};

use super::covariate::{ActsOn, Covariate};
use super::grid::Grid;
use super::id::EffectId;
use super::label::Label;
use super::spec::{EffectSpec, SeenIn};
use crate::ParamError;

/// Formulas and tables of a model, at most: with the lengths of programs it bounds the cost of a step.
pub const MOST_CUSTOM: usize = 8;
/// How such an effect may be called.
const NAME: &str = "a name of at most 31 letters, digits, - and _, a letter first, that no listed effect has";

/// The row of all of them in the table: what users write has none of its own.
pub(super) const CUSTOM: EffectSpec = EffectSpec {
    id: EffectId::Custom(Label::fixed("formula")),
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: None,
    formula: "a formula or a table of the user's",
    keys: "`name`, `acts_on`, and `expression` or `over`, `knots` and `values`",
    parameters: &[],
};

/// What an effect of a user's does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CustomLaw {
    /// On what.
    pub acts_on: ActsOn,
    /// By what.
    pub rule: Rule,
}

/// How a value follows from covariates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Rule {
    /// The text of an expression.
    Formula(String),
    /// A table.
    Table(Grid),
}

/// The value of a rule, ready to run without heap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) enum Prepared {
    Formula(Program),
    Table(Grid),
}

/// The effect that a user calls so.
///
/// # Errors
/// A name that is refused.
pub(super) fn custom_id(name: &str) -> Result<EffectId, ParamError> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let fits = name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(plain);
    let label = Label::new(name).filter(|_| fits && EffectId::from_name(name).is_none());
    label.map(EffectId::Custom).ok_or_else(|| ParamError::new("name", name, NAME))
}

/// Checks an expression with its parameters as formulas have it: that it compiles, that its quantities go together and make what it
/// acts on, and that it has a finite value wherever valves get ([`Covariate::range`]).
///
/// # Errors
/// What is wrong with it and where.
pub fn check_expression(
    text: &str,
    parameters: &[(&str, f64)],
    acts_on: ActsOn,
) -> Result<(), ExpressionError> {
    check_expression_in_units(text, parameters, &vec![None; parameters.len()], acts_on)
}

/// The same where parameters have units: their dimensions, in the parameters' order, of those that may be any `None`.
///
/// # Errors
/// As [`check_expression`].
pub fn check_expression_in_units(
    text: &str,
    parameters: &[(&str, f64)],
    units: &[Option<Dimension>],
    acts_on: ActsOn,
) -> Result<(), ExpressionError> {
    let program = compiled(text, parameters)?;
    check_dimension(text, parameters, units, acts_on)?;
    check_poles(&program)
}

/// Refuses an expression without a finite value somewhere that valves get.
pub(super) fn check_poles(program: &Program) -> Result<(), ExpressionError> {
    let Some(pole) = pole(program, &Covariate::ALL.map(Covariate::range)) else { return Ok(()) };
    let used = Covariate::ALL.into_iter().zip(&pole.near).filter(|(of, _)| program.uses(of.place()));
    let near: Vec<String> =
        used.map(|(of, at)| format!("{} {} {}", of.name(), shown(*at), of.unit())).collect();
    let place = if near.is_empty() { "anywhere".to_owned() } else { format!("near {}", near.join(", ")) };
    let found = format!("an operation that has no finite value {place}");
    Err(ExpressionError::new(pole.at, found, "a finite value wherever valves get"))
}

/// Parameters of known units stand beside the covariates. Written numbers and the other parameters may have any unit, so that only what is
/// wrong whatever they are is refused.
fn check_dimension(
    text: &str,
    parameters: &[(&str, f64)],
    units: &[Option<Dimension>],
    acts_on: ActsOn,
) -> Result<(), ExpressionError> {
    let (known, any): (Vec<_>, Vec<_>) = parameters.iter().zip(units).partition(|(_, unit)| unit.is_some());
    let known_names = known.iter().map(|((name, _), _)| *name);
    let names: Vec<&str> = Covariate::ALL.map(Covariate::name).into_iter().chain(known_names).collect();
    let known_units = known.iter().filter_map(|(_, unit)| **unit);
    let dimensions: Vec<Dimension> =
        Covariate::ALL.map(Covariate::dimension).into_iter().chain(known_units).collect();
    let any: Vec<(&str, f64)> = any.into_iter().map(|(parameter, _)| *parameter).collect();
    let made = dimension(&compile(text, &names, &any)?, &dimensions)?;
    let expected = match acts_on {
        ActsOn::Torque => "a torque in N*m, as with a parameter of that unit before it: a*...",
        ActsOn::Level | ActsOn::Viscous => {
            "a part of friction, a pure number, as with a parameter of that unit before it: a*..."
        }
    };
    let right = if acts_on == ActsOn::Torque { Dimension::TORQUE } else { Dimension::NONE };
    match made {
        Some(made) if !made.is(right) => Err(ExpressionError::new(0, made.to_string(), expected)),
        _ => Ok(()),
    }
}

/// Three digits are enough to find a place.
fn shown(number: f64) -> String {
    if number != 0.0 && !(1e-2..1e5).contains(&number.abs()) {
        format!("{number:.2e}")
    } else {
        format!("{number:.2}")
    }
}

fn compiled(text: &str, parameters: &[(&str, f64)]) -> Result<Program, ExpressionError> {
    compile(text, &Covariate::ALL.map(Covariate::name), parameters)
}

impl CustomLaw {
    /// Ready to run.
    ///
    /// # Errors
    /// An expression that doesn't compile, a table that is none.
    pub(crate) fn prepared(&self, parameters: &[(&str, f64)]) -> Result<Prepared, ParamError> {
        match &self.rule {
            Rule::Formula(text) => compiled(text, parameters).map(Prepared::Formula).map_err(|error| {
                ParamError::new("expression", error, "an expression in covariates and its parameters")
            }),
            Rule::Table(grid) => grid.validate().map(|()| Prepared::Table(grid.clone())),
        }
    }

    /// The `id` in files.
    pub fn file_id(&self) -> &'static str {
        match self.rule {
            Rule::Formula(_) => "formula",
            Rule::Table(_) => "table",
        }
    }
}

/// The names in an expression that are neither covariates nor functions: its parameters, in their order.
///
/// # Errors
/// What is wrong with the expression, whatever its parameters are. A name that is nearly a covariate's is refused, too.
pub fn parameter_names(text: &str) -> Result<Vec<String>, ExpressionError> {
    expression::free_names(text, &Covariate::ALL.map(Covariate::name))
}

impl Prepared {
    /// Its value; it may not be finite.
    pub fn at(&self, covariates: &[f64; Covariate::COUNT]) -> f64 {
        match self {
            Self::Formula(program) => program.run(covariates),
            Self::Table(grid) => grid.at(covariates).0,
        }
    }

    pub fn uses(&self, covariate: Covariate) -> bool {
        match self {
            Self::Formula(program) => program.uses(covariate.place()),
            Self::Table(grid) => grid.is_over(covariate),
        }
    }
}
