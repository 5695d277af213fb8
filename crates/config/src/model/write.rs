//! A model as text, with comments: what `parse_model` reads back is the same model, bit for bit.

use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, Value, value};
use valve_model::{
    ClearanceParams, CustomLaw, DahlParams, Effect, EffectValue, FrictionParams, LeuvenParams, LoadParams,
    LuGreParams, Model, MotorParams, OilParams, OrificeParams, Rule, SealParams, StribeckParams, Window,
};

use crate::model::{FORMAT, FORMAT_VERSION, ModelComments};

/// Writes a validated model as the text of a model file.
///
/// For a model whose name is neither blank nor holds control characters, `parse_model` gives the same model back, every
/// number bit for bit.
#[must_use]
pub fn write_model(model: &Model, comments: &ModelComments) -> String {
    let mut document = DocumentMut::new();
    document.insert("format", value(FORMAT));
    document.insert("format_version", value(FORMAT_VERSION as i64));
    document.insert("name", value(&model.name));
    document.decor_mut().set_prefix(comments.header_lines());
    let mut sections = Vec::new();
    sections.extend(model.motor.as_ref().map(|motor| ("motor", motor_section(motor))));
    sections.extend(model.load.as_ref().map(|load| ("load", load_section(load))));
    sections.push(("friction", friction_section(model)));
    sections.extend(model.clearance.as_ref().map(|clearance| ("clearance", clearance_section(clearance))));
    sections.extend(model.seals.as_ref().map(|seals| ("seals", seals_section(seals))));
    sections.extend(model.orifice.as_ref().map(|orifice| ("orifice", orifice_section(orifice))));
    sections.extend(model.oil.as_ref().map(|oil| ("oil", oil_section(oil))));
    for (name, entries) in sections {
        document.insert(name, Item::Table(table(name, entries, comments)));
    }
    if !model.effects.is_empty() {
        document.insert("effect", Item::ArrayOfTables(effects(&model.effects, comments)));
    }
    document.to_string()
}

/// A section's keys and values in the order of the file.
type Entries<'m> = Vec<(&'m str, Value)>;

fn table(path: &str, entries: Entries<'_>, comments: &ModelComments) -> Table {
    let mut table = Table::new();
    table.decor_mut().set_prefix(format!("\n{}", comments.section_lines(path)));
    for (key, mut entry) in entries {
        let (above, behind) = comments.key_parts(path, key);
        entry.decor_mut().set_suffix(behind);
        table.insert(key, Item::Value(entry));
        if let Some(mut key) = table.key_mut(key) {
            key.leaf_decor_mut().set_prefix(above);
        }
    }
    table
}

fn effects(effects: &[Effect], comments: &ModelComments) -> ArrayOfTables {
    let section = |(index, effect): (usize, &Effect)| {
        let path = format!("effect[{index}]");
        let Some(law) = effect.custom() else { return table(&path, effect_section(effect), comments) };
        let mut section = table(&path, custom_section(effect, law), comments);
        if effect.parts().next().is_some() {
            let parameters = table(&format!("{path}.parameters"), parameters(effect), comments);
            section.insert("parameters", Item::Table(parameters));
        }
        section
    };
    effects.iter().enumerate().map(section).collect()
}

/// The shortest text that reads back as the same bits.
fn number(number: f64) -> Value {
    format!("{number:?}").parse().unwrap_or_else(|_| Value::from(number))
}

fn count(count: u32) -> Value {
    Value::from(i64::from(count))
}

fn motor_section(motor: &MotorParams) -> Entries<'static> {
    let mut entries = vec![
        ("phases", count(motor.phases)),
        ("rotor_teeth", count(motor.rotor_teeth)),
        ("full_steps_per_rev", count(motor.full_steps_per_rev)),
        ("microsteps_per_full_step", count(motor.microsteps_per_full_step)),
        ("holding_torque_nm", number(motor.holding_torque_nm)),
        ("rotor_inertia_kg_m2", number(motor.rotor_inertia_kg_m2)),
        ("damping_nm_s_per_rad", number(motor.damping_nm_s_per_rad)),
        ("max_pulse_rate_hz", number(motor.max_pulse_rate_hz)),
    ];
    let optional = [
        ("supply_voltage_v", motor.supply_voltage_v),
        ("phase_resistance_ohm", motor.phase_resistance_ohm),
        ("phase_inductance_h", motor.phase_inductance_h),
        ("rated_current_a", motor.rated_current_a),
        ("torque_constant_nm_per_a", motor.torque_constant_nm_per_a),
    ];
    entries.extend(optional.into_iter().filter_map(|(key, entry)| Some((key, number(entry?)))));
    entries
}

fn load_section(load: &LoadParams) -> Entries<'static> {
    vec![("inertia_kg_m2", number(load.inertia_kg_m2))]
}

fn orifice_section(orifice: &OrificeParams) -> Entries<'static> {
    let mut entries = vec![
        ("discharge_coefficient", number(orifice.discharge_coefficient)),
        ("window_area_m2", number(orifice.window_area_m2)),
        ("closed_angle_rad", number(orifice.closed_angle_rad)),
        ("open_angle_rad", number(orifice.open_angle_rad)),
    ];
    let point = |(way, area): &(f64, f64)| Value::from_iter([number(*way), number(*area)]);
    match &orifice.window {
        Window::Linear => {}
        Window::Round => entries.push(("window", Value::from("round"))),
        Window::Table(table) => entries.push(("window_table", table.points().iter().map(point).collect())),
    }
    entries
}

fn oil_section(oil: &OilParams) -> Entries<'static> {
    vec![
        ("density_kg_per_m3", number(oil.density_kg_per_m3)),
        ("kinematic_viscosity_m2_per_s", number(oil.kinematic_viscosity_m2_per_s)),
        ("reference_temperature_c", number(oil.reference_temperature_c)),
    ]
}

fn clearance_section(clearance: &ClearanceParams) -> Entries<'static> {
    vec![
        ("spool_radius_m", number(clearance.spool_radius_m)),
        ("sleeve_radius_m", number(clearance.sleeve_radius_m)),
        ("length_m", number(clearance.length_m)),
        ("grooves", count(clearance.grooves)),
        ("groove_width_m", number(clearance.groove_width_m)),
        ("opening_area_m2", number(clearance.opening_area_m2)),
    ]
}

fn seals_section(seals: &SealParams) -> Entries<'static> {
    vec![
        ("spool_radius_m", number(seals.spool_radius_m)),
        ("seals", count(seals.seals)),
        ("o_ring_diameter_m", number(seals.o_ring_diameter_m)),
        ("backup_ring_width_m", number(seals.backup_ring_width_m)),
        ("working_pressure_pa", number(seals.working_pressure_pa)),
        ("friction_coefficient", number(seals.friction_coefficient)),
        ("static_ratio", number(seals.static_ratio)),
    ]
}

/// The law and its numbers, but for those that another section gives.
fn friction_section(model: &Model) -> Entries<'static> {
    let mut entries = vec![("law", Value::from(model.friction.law()))];
    entries.extend(match &model.friction {
        FrictionParams::Stribeck(params) => stribeck_entries(params),
        FrictionParams::Dahl(params) => dahl_entries(params),
        FrictionParams::LuGre(params) => lugre_entries(params),
        FrictionParams::Leuven(params) => leuven_entries(params),
    });
    entries.retain(|(key, _)| match *key {
        "coulomb_torque_nm" | "static_torque_nm" => model.seals.is_none(),
        "viscous_nm_s_per_rad" => model.clearance.is_none(),
        _ => true,
    });
    entries
}

fn stribeck_entries(params: &StribeckParams) -> Entries<'static> {
    vec![
        ("coulomb_torque_nm", number(params.coulomb_torque_nm)),
        ("static_torque_nm", number(params.static_torque_nm)),
        ("stribeck_velocity_rad_per_s", number(params.stribeck_velocity_rad_per_s)),
        ("stribeck_exponent", number(params.stribeck_exponent)),
        ("viscous_nm_s_per_rad", number(params.viscous_nm_s_per_rad)),
        ("regularisation_velocity_rad_per_s", number(params.regularisation_velocity_rad_per_s)),
    ]
}

fn dahl_entries(params: &DahlParams) -> Entries<'static> {
    vec![
        ("coulomb_torque_nm", number(params.coulomb_torque_nm)),
        ("bristle_stiffness_nm_per_rad", number(params.bristle_stiffness_nm_per_rad)),
        ("viscous_nm_s_per_rad", number(params.viscous_nm_s_per_rad)),
        ("dahl_exponent", number(params.dahl_exponent)),
    ]
}

fn lugre_entries(params: &LuGreParams) -> Entries<'static> {
    vec![
        ("coulomb_torque_nm", number(params.coulomb_torque_nm)),
        ("static_torque_nm", number(params.static_torque_nm)),
        ("stribeck_velocity_rad_per_s", number(params.stribeck_velocity_rad_per_s)),
        ("stribeck_exponent", number(params.stribeck_exponent)),
        ("bristle_stiffness_nm_per_rad", number(params.bristle_stiffness_nm_per_rad)),
        ("bristle_damping_nm_s_per_rad", number(params.bristle_damping_nm_s_per_rad)),
        ("viscous_nm_s_per_rad", number(params.viscous_nm_s_per_rad)),
    ]
}

fn leuven_entries(params: &LeuvenParams) -> Entries<'static> {
    vec![
        ("coulomb_torque_nm", number(params.coulomb_torque_nm)),
        ("static_torque_nm", number(params.static_torque_nm)),
        ("stribeck_velocity_rad_per_s", number(params.stribeck_velocity_rad_per_s)),
        ("stribeck_exponent", number(params.stribeck_exponent)),
        ("bristle_stiffness_nm_per_rad", number(params.bristle_stiffness_nm_per_rad)),
        ("bristle_damping_nm_s_per_rad", number(params.bristle_damping_nm_s_per_rad)),
        ("viscous_nm_s_per_rad", number(params.viscous_nm_s_per_rad)),
        ("transition_exponent", number(params.transition_exponent)),
        ("maxwell_elements", count(params.maxwell_elements)),
        ("maxwell_saturation_ratio", number(params.maxwell_saturation_ratio)),
        ("maxwell_spacing_exponent", number(params.maxwell_spacing_exponent)),
        ("maxwell_tail_exponent", number(params.maxwell_tail_exponent)),
        ("maxwell_curve_share", number(params.maxwell_curve_share)),
        ("maxwell_damping_share", number(params.maxwell_damping_share)),
    ]
}

fn effect_section(effect: &Effect) -> Entries<'_> {
    let mut entries = vec![("id", Value::from(effect.id().name()))];
    entries.extend(parameters(effect));
    entries
}

/// A formula or a table, the former's parameters left out.
fn custom_section<'m>(effect: &'m Effect, law: &'m CustomLaw) -> Entries<'m> {
    let mut entries = vec![
        ("id", Value::from(law.file_id())),
        ("name", Value::from(effect.id().name())),
        ("acts_on", Value::from(law.acts_on.name())),
    ];
    let list = |numbers: &[f64]| numbers.iter().map(|entry| number(*entry)).collect::<Value>();
    match &law.rule {
        Rule::Formula(text) => entries.push(("expression", Value::from(text))),
        Rule::Table(grid) => {
            let over = grid.axes().map(|(covariate, _)| Value::from(covariate.name()));
            entries.push(("over", over.collect()));
            if let [(_, knots)] = grid.axes().collect::<Vec<_>>()[..] {
                entries.push(("knots", list(knots)));
                entries
                    .push(("values", grid.values().iter().flatten().map(|entry| number(*entry)).collect()));
            } else {
                entries.push(("knots", grid.axes().map(|(_, knots)| list(knots)).collect()));
                entries.push(("values", grid.values().iter().map(|row| list(row)).collect()));
            }
        }
    }
    entries
}

fn parameters(effect: &Effect) -> Entries<'_> {
    let entries = effect.parts().map(|(key, entry)| {
        let entry = match entry {
            EffectValue::Number(entry) => number(*entry),
            EffectValue::List(list) => Value::Array(list.iter().map(|entry| number(*entry)).collect()),
        };
        (key, entry)
    });
    entries.collect()
}
