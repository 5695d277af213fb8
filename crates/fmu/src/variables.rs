//! The variables of a unit: inputs, outputs, and every number of its model as a parameter.

use crate::units::of_key;
use config::{Editable, Setting};
use valve_model::{Model, ValveOutput, ValveState};

/// Who gives a variable its value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Causality {
    /// The importer, at every step.
    Input,
    /// The unit.
    Output,
    /// The importer, before the initialisation ends.
    Fixed,
    /// The importer, at any time.
    Tunable,
}

/// A variable's type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A number.
    Real,
    /// A whole number.
    Integer,
}

/// One variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// The value reference.
    pub reference: u32,
    /// The name that users see.
    pub name: String,
    /// What it is.
    pub about: String,
    /// Its unit, where it has one.
    pub unit: Option<String>,
    /// Who gives it its value.
    pub causality: Causality,
    /// Its type.
    pub kind: Kind,
    /// Its value at the start; of an output none.
    pub start: Option<f64>,
    /// The path within the model's text, of a number of the model.
    pub(crate) path: Option<String>,
}

/// All variables of a unit, in the order of their references.
#[derive(Debug, Clone, PartialEq)]
pub struct Variables {
    all: Vec<Variable>,
}

pub(crate) const COMMAND: u32 = 0;
pub(crate) const PRESSURE: u32 = 1;
pub(crate) const TEMPERATURE: u32 = 2;
pub(crate) const CURRENT: u32 = 3;
pub(crate) const INPUTS: usize = 4;
pub(crate) const START_ANGLE: u32 = 50;
pub(crate) const LOST_STEPS: u32 = 30;
/// FMI 3.0's time.
pub(crate) const TIME: u32 = 40;
/// The first of the model's numbers.
pub(crate) const NUMBERS: u32 = 100;

/// An output's value, of the valve and of its last step, if there was one.
type Value = fn(&ValveState, Option<&ValveOutput>) -> f64;

/// Outputs: reference, name, unit, what it is, and its value.
const OUTPUTS: &[(u32, &str, &str, &str, Value)] = &[
    (10, "angle", "rad", "angle of the spool", |valve, _| valve.angle_rad),
    (11, "speed", "rad/s", "speed of the spool", |valve, _| valve.speed_rad_per_s),
    (12, "rotor_angle", "rad", "angle of the motor's rotor", |valve, _| valve.rotor_angle_rad),
    (
        13,
        "encoder_angle",
        "rad",
        "angle at the encoder: with play and eccentricity, before its steps and noise",
        |valve, last| last.map_or(valve.encoder_shaft_rad, |of| of.encoder_angle_rad),
    ),
    (14, "motor_torque", "N.m", "torque of the motor on its rotor, damping included", |_, last| {
        last.map_or(0.0, |of| of.motor_torque_nm)
    }),
    (15, "friction_torque", "N.m", "friction, positive against positive speed", |_, last| {
        last.map_or(0.0, |of| of.friction_torque_nm)
    }),
    (16, "load_torque", "N.m", "torque between motor and load", |_, last| {
        last.map_or(0.0, |of| of.load_torque_nm)
    }),
    (17, "other_torque", "N.m", "other torques on the spool: of flow, pressure, angle", |_, last| {
        last.map_or(0.0, |of| of.other_torque_nm)
    }),
    (18, "flow", "m3/s", "flow through the orifice; 0 where the model has none", |_, last| {
        last.map_or(0.0, |of| of.flow_m3_per_s)
    }),
    (19, "bristle_deflection", "rad", "mean deflection of the bristles", |_, last| {
        last.map_or(0.0, |of| of.bristle_deflection_rad)
    }),
];

/// The value of an output; `None` where the reference is none of an output's.
pub(crate) fn output(reference: u32, valve: &ValveState, last: Option<&ValveOutput>) -> Option<f64> {
    let (.., value) = OUTPUTS.iter().find(|(of, ..)| *of == reference)?;
    Some(value(valve, last))
}

/// Counts of a model's text, which make another machine of it: they are no parameters.
const COUNTS: &[&str] = &[
    "format_version",
    "phases",
    "rotor_teeth",
    "full_steps_per_rev",
    "microsteps_per_full_step",
    "grooves",
    "seals",
    "maxwell_elements",
];

impl Variables {
    /// Those of a model, whose numbers stand in `text` in SI units.
    pub(crate) fn new(model: &Model, text: &Editable) -> Self {
        let mut all = inputs(model);
        all.extend(OUTPUTS.iter().map(|(reference, name, unit, about, _)| Variable {
            reference: *reference,
            name: (*name).to_owned(),
            about: (*about).to_owned(),
            unit: Some((*unit).to_owned()),
            causality: Causality::Output,
            kind: Kind::Real,
            start: None,
            path: None,
        }));
        all.push(Variable {
            reference: LOST_STEPS,
            name: "lost_steps".to_owned(),
            about: "how many tooth pitches the rotor is off its command, since the start".to_owned(),
            unit: None,
            causality: Causality::Output,
            kind: Kind::Integer,
            start: None,
            path: None,
        });
        all.push(Variable {
            reference: START_ANGLE,
            name: "start_angle".to_owned(),
            about: "where the spool rests at the start".to_owned(),
            unit: Some("rad".to_owned()),
            causality: Causality::Fixed,
            kind: Kind::Real,
            start: Some(0.0),
            path: None,
        });
        let numbers = text.paths().into_iter().filter_map(|path| number(model, text, path));
        all.extend(numbers.zip(NUMBERS..).map(|(variable, reference)| Variable { reference, ..variable }));
        Self { all }
    }

    /// All, in the order of their references.
    pub fn iter(&self) -> impl Iterator<Item = &Variable> {
        self.all.iter()
    }

    /// The variable with a reference.
    pub fn get(&self, reference: u32) -> Option<&Variable> {
        self.all
            .binary_search_by_key(&reference, |variable| variable.reference)
            .ok()
            .and_then(|at| self.all.get(at))
    }
}

fn inputs(model: &Model) -> Vec<Variable> {
    let table = [
        (
            COMMAND,
            "command",
            Some("rad"),
            "commanded angle at the end of the step, reached at constant speed",
            0.0,
        ),
        (PRESSURE, "pressure_drop", Some("Pa"), "pressure drop over the orifice", 0.0),
        (
            TEMPERATURE,
            "oil_temperature",
            Some("degC"),
            "temperature of the oil",
            model.reference_temperature_c(),
        ),
        (
            CURRENT,
            "current_ratio",
            None,
            "part of the rated current in the windings: 1, or less where it is lowered, 0 switched off",
            1.0,
        ),
    ];
    let input = |(reference, name, unit, about, start): (u32, &str, Option<&str>, &str, f64)| Variable {
        reference,
        name: name.to_owned(),
        about: about.to_owned(),
        unit: unit.map(str::to_owned),
        causality: Causality::Input,
        kind: Kind::Real,
        start: Some(start),
        path: None,
    };
    table.map(input).into()
}

/// A number of the model's text as a variable, its reference not yet known.
fn number(model: &Model, text: &Editable, path: String) -> Option<Variable> {
    let Some(Setting::Number { number, .. }) = text.get(&path) else { return None };
    let key = path.rsplit('.').next().unwrap_or(&path);
    if COUNTS.contains(&key) {
        return None;
    }
    let (name, unit, meaning) = match effect_of(model, &path) {
        Some((name, unit, meaning)) => (name, unit, meaning),
        None => (path.clone(), of_key(key).map(str::to_owned), "a number of the model file".to_owned()),
    };
    Some(Variable {
        reference: 0,
        name,
        about: meaning,
        unit,
        causality: Causality::Tunable,
        kind: Kind::Real,
        start: Some(number),
        path: Some(path),
    })
}

/// Name, unit and meaning of an effect's number: by the effect's name, not by its place in the file.
fn effect_of(model: &Model, path: &str) -> Option<(String, Option<String>, String)> {
    let (index, rest) = path.strip_prefix("effect[")?.split_once("].")?;
    let effect = model.effects.get(index.parse::<usize>().ok()?)?;
    let id = effect.id();
    let key = rest.split('[').next().unwrap_or(rest);
    // Formulas and tables have units of their user's.
    let row = if id.is_custom() { None } else { id.spec().parameter(key) };
    let unit = row.filter(|row| row.unit != "1").map(|row| row.unit.to_owned());
    let meaning = row.map_or_else(|| "a number of the effect".to_owned(), |row| row.meaning.to_owned());
    Some((format!("{}.{rest}", id.name()), unit, meaning))
}
