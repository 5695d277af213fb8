//! A file of effects that a user suspects (`stepvalve-effects`): formulas whose parameters have a start, bounds and a unit.

use valve_model::{ActsOn, CustomLaw, Dimension, Effect, Label, Rule, check_expression_in_units, unit};

use crate::asked::Shape;
use crate::error::ConfigErrors;
use crate::reader::{Field, Section, parse};

const FORMAT: &str = "stepvalve-effects";
const FORMAT_VERSION: u64 = 1;
const EXPRESSION: &str = "an expression such as a*speed*abs(speed)";
const ACTS_ON: &str = "\"torque\" or \"level\" or \"viscous\"";

/// An effect that a user suspects.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnEffect {
    /// The formula.
    pub effect: Effect,
    /// Its parameters, in the file's order.
    pub parameters: Vec<OwnParameter>,
    /// The line at which it begins, from 1.
    pub line: usize,
}

/// A parameter of it.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnParameter {
    /// Its name.
    pub key: Label,
    /// Where a fit begins, if the file says.
    pub start: Option<f64>,
    /// The least value.
    pub min: f64,
    /// The greatest value.
    pub max: f64,
    /// Its unit, "1" if the file says none.
    pub unit: String,
    /// The unit's dimension; `None` if the file says none, which may then be any.
    pub dimension: Option<Dimension>,
}

/// Reads a file of effects from its text. `file` names it in errors.
///
/// # Errors
/// All that is wrong in the text.
pub fn parse_effects(text: &str, file: &str) -> Result<Vec<OwnEffect>, ConfigErrors> {
    parse(text, file, FORMAT, FORMAT_VERSION, |root| {
        let fields = root.list("effect");
        if fields.is_empty() {
            root.refuse_key("effect", "nothing", "a table [[effect]]");
        }
        let effects: Vec<OwnEffect> = fields.iter().filter_map(read_effect).collect();
        for (index, (field, effect)) in fields.iter().zip(&effects).enumerate() {
            let id = effect.effect.id();
            if effects.iter().take(index).any(|other| other.effect.id() == id) {
                field.refuse_as(format!("{id}, given twice"), "each name once");
            }
        }
        root.finish();
        Some(effects)
    })
}

fn read_effect(field: &Field<'_>) -> Option<OwnEffect> {
    let section = field.section("a table [[effect]]")?;
    let name = section.text("name", "a name");
    let acts_on = section.require("acts_on", ACTS_ON).and_then(|field| {
        let choices = ActsOn::ALL.map(|of| (of.name(), of));
        let (first, others) = choices.split_first()?;
        field.choice(*first, others)
    });
    let parameters = section.section("parameters").map_or_else(Vec::new, read_parameters);
    let expression = section.require("expression", EXPRESSION);
    let effect = acts_on.zip(expression).and_then(|(acts_on, expression)| {
        let text = expression.text(EXPRESSION);
        // Where nothing is said of a start, 1 is as good as any number to check the text with.
        let numbers: Vec<(&str, f64)> =
            parameters.iter().map(|(of, _)| (of.key.as_str(), of.start.unwrap_or(1.0))).collect();
        if text.is_empty() || !section.is_clean() {
            return None;
        }
        let units: Vec<Option<Dimension>> = parameters.iter().map(|(of, _)| of.dimension).collect();
        if let Err(error) = check_expression_in_units(&text, &numbers, &units, acts_on) {
            match error.parameter.and_then(|place| parameters.get(place)) {
                Some((_, place)) => place.refuse_as(error.found, error.expected),
                None => expression.refuse_within(error.at, error.found, error.expected),
            }
            return None;
        }
        let effect = Effect::custom_named(&name, CustomLaw { acts_on, rule: Rule::Formula(text) }, &numbers);
        let refuse = |error: valve_model::ParamError| {
            let at = section.find(error.key);
            at.map(|field| field.refuse_as(error.found, error.expected))
        };
        effect.map_err(refuse).ok()
    });
    section.finish();
    let parameters = parameters.into_iter().map(|(of, _)| of).collect();
    effect.map(|effect| OwnEffect { effect, parameters, line: field.line() })
}

/// The parameters with the places of their names, in the file's order.
fn read_parameters(section: Section<'_>) -> Vec<(OwnParameter, Field<'_>)> {
    let mut fields = section.all();
    fields.sort_by_key(|(_, place, _)| place.start());
    fields
        .into_iter()
        .filter_map(|(name, place, value)| Some((read_parameter(&name, &place, &value)?, place)))
        .collect()
}

fn read_parameter(name: &str, place: &Field<'_>, value: &Field<'_>) -> Option<OwnParameter> {
    const START: &str = "a number, where the fit begins, or a table of `start`, `min`, `max` and `unit`";
    let Some(key) = Label::new(name) else {
        place.refuse("a name of at most 31 bytes");
        return None;
    };
    let mut of =
        OwnParameter { key, start: None, min: -1e9, max: 1e9, unit: "1".to_owned(), dimension: None };
    if !value.is_table() {
        of.start = Some(value.number(START));
        return Some(of);
    }
    let section = value.section("a table")?;
    of.start = section.optional_number("start");
    of.min = section.optional_number("min").unwrap_or(of.min);
    of.max = section.optional_number("max").unwrap_or(of.max);
    section.expects("unit", Shape::Text);
    if let Some(field) = section.find("unit") {
        of.unit = field.text("a unit such as N*m");
        match unit(&of.unit) {
            Ok(dimension) => of.dimension = Some(dimension),
            Err(error) if !of.unit.is_empty() => field.refuse_as(error.found, error.expected),
            Err(_) => {}
        }
    }
    section.finish();
    Some(of)
}
