//! `[[effect]]` with `id = "formula"` or `id = "table"`: what users add by an expression or by numbers.

use valve_model::{ActsOn, Covariate, CustomLaw, Effect, Grid, ParamError, Rule, check_expression};

use crate::asked::Shape;
use crate::reader::{Field, Section};
use crate::suggest::nearest;

const FORMULA: &str = "formula";
const TABLE: &str = "table";
/// The ids of what is read here.
pub(super) const IDS: [&str; 2] = [FORMULA, TABLE];

const ACTS_ON: &str = "\"torque\" or \"level\" or \"viscous\"";
const COVARIATES: &str =
    "one or two of angle, speed, acceleration, time, pressure_drop, oil_temperature, time_at_rest, distance";
const KNOTS: &str = "2 to 64 rising numbers, or with two covariates a list of 2 to 16 for each";
const VALUES: &str = "a number for each knot, or with two covariates a list for each knot of the first";

/// A formula or a table; `None` if something was refused.
pub(super) fn read_custom(section: Section<'_>, id: &str) -> Option<Effect> {
    let name = section.find("name");
    section.expects("name", Shape::Text);
    if name.is_none() && id == FORMULA {
        section.require("name", "a name, which tells formulas apart");
    }
    let called = name.as_ref().map_or_else(|| id.to_owned(), |name| name.text("a name"));
    let acts_on = section.require("acts_on", ACTS_ON).and_then(|field| {
        let choices = ActsOn::ALL.map(|of| (of.name(), of));
        let (first, others) = choices.split_first()?;
        field.choice(*first, others)
    });
    let rule = if id == FORMULA {
        read_formula(&section, acts_on.unwrap_or(ActsOn::Torque))
    } else {
        read_table(&section)
    };
    let effect = acts_on.zip(rule).and_then(|(acts_on, (rule, parameters))| {
        let numbers: Vec<(&str, f64)> =
            parameters.iter().map(|(key, value)| (key.as_str(), *value)).collect();
        let effect = Effect::custom_named(&called, CustomLaw { acts_on, rule }, &numbers);
        effect.map_err(|error| refuse(&section, error)).ok()
    });
    section.finish();
    effect
}

fn refuse(section: &Section<'_>, error: ParamError) {
    if section.is_clean() {
        match section.find(error.key) {
            Some(field) => field.refuse_as(error.found, error.expected),
            None => section.refuse(error.found, error.expected),
        }
    }
}

type Read = (Rule, Vec<(String, f64)>);

fn read_formula(section: &Section<'_>, acts_on: ActsOn) -> Option<Read> {
    const EXPRESSION: &str = "an expression such as a*speed*abs(speed)";
    section.expects("expression", Shape::Text);
    section.expects("parameters", Shape::NamedNumbers);
    let parameters = section.find("parameters").map_or_else(Vec::new, |field| field.named_numbers());
    let field = section.require("expression", EXPRESSION)?;
    let text = field.text(EXPRESSION);
    if text.is_empty() || parameters.iter().any(|of| of.number.is_nan()) {
        return None;
    }
    let numbers: Vec<(&str, f64)> = parameters.iter().map(|of| (of.name.as_str(), of.number)).collect();
    if let Err(error) = check_expression(&text, &numbers, acts_on) {
        match error.parameter.and_then(|place| parameters.get(place)) {
            Some(own) => own.place.refuse_as(error.found, error.expected),
            None => field.refuse_within(error.at, error.found, error.expected),
        }
        return None;
    }
    Some((Rule::Formula(text), parameters.into_iter().map(|of| (of.name, of.number)).collect()))
}

fn read_table(section: &Section<'_>) -> Option<Read> {
    section.expects("over", Shape::List);
    section.expects("over[]", Shape::Choice(Covariate::ALL.map(|of| of.name().to_owned()).to_vec()));
    for key in ["knots", "values"] {
        section.expects(key, Shape::List);
        section.expects(&format!("{key}[]"), Shape::Number);
        section.expects(&format!("{key}[]"), Shape::List);
        section.expects(&format!("{key}[][]"), Shape::Number);
    }
    let over = section.require("over", COVARIATES);
    let (knots, values) = (section.require("knots", KNOTS), section.require("values", VALUES));
    let (over, knots, values) = (read_over(&over?)?, knots?, values?);
    let two = over.len() == 2;
    let axes = if two { rows(&knots, KNOTS)? } else { vec![(knots.clone(), plain(&knots, KNOTS)?)] };
    axes.iter().try_for_each(|(field, knots)| check_rising(field, knots))?;
    let axes = axes.into_iter().map(|(_, knots)| knots).collect();
    let rows = if two {
        rows(&values, VALUES)?.into_iter().map(|(_, row)| row).collect()
    } else {
        plain(&values, VALUES)?.into_iter().map(|value| vec![value]).collect()
    };
    match Grid::new(over, axes, rows) {
        Ok(grid) => Some((Rule::Table(grid), Vec::new())),
        Err(error) => {
            let field = if error.key == "knots" { knots } else { values };
            field.refuse_as(error.found, error.expected);
            None
        }
    }
}

fn read_over(field: &Field<'_>) -> Option<Vec<Covariate>> {
    if !field.is_array() {
        field.refuse(COVARIATES);
        return None;
    }
    let mut over = Vec::new();
    for element in field.elements() {
        let name = element.text(COVARIATES);
        let Some(covariate) = Covariate::from_name(&name) else {
            if !name.is_empty() {
                let known = Covariate::ALL.map(|of| of.name().to_owned());
                let near = nearest(&name, &known);
                let hint = near.map_or_else(String::new, |near| format!("{near} (did you mean it?) or "));
                element.refuse(format!("{hint}{COVARIATES}"));
            }
            return None;
        };
        if over.contains(&covariate) {
            element.refuse("another covariate than the first");
            return None;
        }
        over.push(covariate);
    }
    if !(1..=2).contains(&over.len()) {
        field.refuse_as(format!("{} covariates", over.len()), COVARIATES);
        return None;
    }
    Some(over)
}

/// The numbers of a list; `None` if one is none.
fn plain(field: &Field<'_>, expected: &str) -> Option<Vec<f64>> {
    let numbers = field.numbers(expected);
    (field.is_array() && numbers.iter().all(|number| number.is_finite())).then_some(numbers)
}

/// The lists of a list, each with its place.
fn rows<'a>(field: &Field<'a>, expected: &str) -> Option<Vec<(Field<'a>, Vec<f64>)>> {
    if !field.is_array() {
        field.refuse(expected);
        return None;
    }
    field.elements().into_iter().map(|row| plain(&row, expected).map(|numbers| (row, numbers))).collect()
}

/// Refuses the first knot that is not above the one before.
fn check_rising(field: &Field<'_>, knots: &[f64]) -> Option<()> {
    let falls = knots.iter().zip(knots.iter().skip(1)).position(|(knot, next)| next <= knot);
    let Some(before) = falls else { return Some(()) };
    if let (Some(knot), Some(element)) = (knots.get(before), field.elements().get(before + 1)) {
        element.refuse(format!("a knot above the one before, {knot}"));
    }
    None
}
