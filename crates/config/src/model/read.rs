//! The model's file, section by section. Which values a section may hold, `valve_model` says.

use valve_model::{EffectId, LoadParams, Model, MotorParams, OilParams, OrificeParams, Window, WindowTable};

use crate::asked::Visit;
use crate::error::ConfigErrors;
use crate::model::read_custom::IDS;
use crate::model::read_design::read_design;
use crate::model::read_effects::read_effects;
use crate::model::read_friction::read_friction;
use crate::model::{FORMAT, FORMAT_VERSION};
use crate::reader::{Field, Section, asked as asked_of, parse};

/// Reads a model from its text. `file` names it in errors.
///
/// # Errors
/// All that is wrong in the text: what does not parse, unknown keys, missing ones, and for each section the first value
/// that no valve can have.
pub fn parse_model(text: &str, file: &str) -> Result<Model, ConfigErrors> {
    parse(text, file, FORMAT, FORMAT_VERSION, read)
}

/// What the reader asks of models that together have every law of friction, every effect and every section.
pub(crate) fn asked() -> Vec<Visit> {
    let sections = "[motor]\n[load]\n[oil]\n[clearance]\n[seals]\n[orifice]\nwindow = \"round\"\n\
                    [friction]\nlaw = \"lugre\"\n";
    let table = "[orifice]\nwindow_table = [[0.0, 0.0], [1.0, 1.0]]\n".to_owned();
    let laws = ["lugre", "stribeck", "dahl", "leuven"].map(|law| format!("[friction]\nlaw = \"{law}\"\n"));
    let ids = EffectId::ALL.iter().map(|id| id.name()).chain(IDS);
    let effects = ids.map(|id| format!("[[effect]]\nid = \"{id}\"\n"));
    let texts = [sections.to_owned(), table].into_iter().chain(laws).chain(effects);
    texts.flat_map(|text| asked_of(&text, FORMAT, FORMAT_VERSION, read)).collect()
}

/// The model; `None` if something without which there is none was refused.
fn read(root: Section<'_>) -> Option<Model> {
    let name = root.text("name", "a name");
    let motor = root.optional_section("motor").map(read_motor);
    let load = root.optional_section("load").map(read_load);
    let oil = root.optional_section("oil").map(read_oil);
    let design = read_design(&root, oil.as_ref());
    let friction = root.section("friction").and_then(|section| read_friction(section, &design));
    let orifice = root.optional_section("orifice").map(read_orifice);
    let effects = read_effects(&root);
    root.finish();
    Some(Model {
        name,
        motor,
        load,
        friction: friction?,
        orifice,
        oil,
        clearance: design.clearance,
        seals: design.seals,
        effects,
    })
}

fn read_motor(section: Section<'_>) -> MotorParams {
    let motor = MotorParams {
        phases: section.count("phases"),
        rotor_teeth: section.count("rotor_teeth"),
        full_steps_per_rev: section.count("full_steps_per_rev"),
        microsteps_per_full_step: section.count("microsteps_per_full_step"),
        holding_torque_nm: section.number("holding_torque_nm"),
        rotor_inertia_kg_m2: section.number("rotor_inertia_kg_m2"),
        damping_nm_s_per_rad: section.number("damping_nm_s_per_rad"),
        max_pulse_rate_hz: section.number("max_pulse_rate_hz"),
        supply_voltage_v: section.optional_number("supply_voltage_v"),
        phase_resistance_ohm: section.optional_number("phase_resistance_ohm"),
        phase_inductance_h: section.optional_number("phase_inductance_h"),
        rated_current_a: section.optional_number("rated_current_a"),
        torque_constant_nm_per_a: section.optional_number("torque_constant_nm_per_a"),
    };
    section.conclude(motor.validate());
    motor
}

fn read_load(section: Section<'_>) -> LoadParams {
    let load = LoadParams { inertia_kg_m2: section.number("inertia_kg_m2") };
    section.conclude(load.validate());
    load
}

fn read_orifice(section: Section<'_>) -> OrificeParams {
    let orifice = OrificeParams {
        discharge_coefficient: section.number("discharge_coefficient"),
        window_area_m2: section.number("window_area_m2"),
        closed_angle_rad: section.number("closed_angle_rad"),
        open_angle_rad: section.number("open_angle_rad"),
        window: read_window(&section),
    };
    section.conclude(orifice.validate());
    orifice
}

/// The window's shape by its name, or by a table; linear where neither is given.
fn read_window(section: &Section<'_>) -> Window {
    let shape = section.find("window");
    if let Some(table) = section.find("window_table") {
        if let Some(shape) = shape {
            shape.refuse_as("a shape beside `window_table`", "one of the two");
        }
        return read_window_table(&table);
    }
    let shapes = &[("round", Window::Round)];
    shape.and_then(|field| field.choice(("linear", Window::Linear), shapes)).unwrap_or_default()
}

fn read_window_table(field: &Field<'_>) -> Window {
    let expected = "a list of points [way, area]";
    if !field.is_array() {
        field.refuse(expected);
        return Window::Linear;
    }
    let points: Vec<_> = field.elements().iter().map(|point| point.numbers(expected)).collect();
    let mut pairs = Vec::new();
    for (point, field) in points.iter().zip(field.elements()) {
        match point[..] {
            [way, area] => pairs.push((way, area)),
            _ if !field.is_array() => return Window::Linear, // refused above
            _ => {
                field.refuse(expected);
                return Window::Linear;
            }
        }
    }
    match WindowTable::new(&pairs) {
        Ok(table) => Window::Table(table),
        Err(error) => {
            field.refuse_as(error.found, error.expected);
            Window::Linear
        }
    }
}

fn read_oil(section: Section<'_>) -> OilParams {
    let oil = OilParams {
        density_kg_per_m3: section.number("density_kg_per_m3"),
        kinematic_viscosity_m2_per_s: section.number("kinematic_viscosity_m2_per_s"),
        reference_temperature_c: section.number("reference_temperature_c"),
    };
    section.conclude(oil.validate());
    oil
}
