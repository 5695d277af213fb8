//! `[clearance]` and `[seals]`: sections that stand in the place of numbers of `[friction]`.

use valve_model::{ClearanceParams, OilParams, SealParams};

use crate::reader::Section;

/// What is given by design calculation. The numbers are placeholders where a section was refused.
#[derive(Default)]
pub(super) struct Design {
    /// `[clearance]`
    pub clearance: Option<ClearanceParams>,
    /// `[seals]`
    pub seals: Option<SealParams>,
    viscous_nm_s_per_rad: Option<f64>,
    levels_nm: Option<(f64, f64)>,
}

/// Both sections; `[clearance]` needs `[oil]`.
pub(super) fn read_design(root: &Section<'_>, oil: Option<&OilParams>) -> Design {
    let clearance = root.optional_section("clearance").map(read_clearance);
    let seals = root.optional_section("seals").map(read_seals);
    if clearance.is_some() && oil.is_none() && root.find("oil").is_none() {
        root.refuse_key("oil", "nothing", "a section [oil] beside [clearance]");
    }
    let viscous = |clearance: &ClearanceParams| {
        let oil = oil.filter(|oil| oil.validate().is_ok() && clearance.validate().is_ok());
        oil.map_or(0.0, |oil| clearance.viscous_nm_s_per_rad(oil))
    };
    let levels = |seals: &SealParams| {
        let sound = seals.validate().is_ok();
        if sound { (seals.coulomb_torque_nm(), seals.static_torque_nm()) } else { (1.0, 1.0) }
    };
    Design {
        viscous_nm_s_per_rad: clearance.as_ref().map(viscous),
        levels_nm: seals.as_ref().map(levels),
        clearance,
        seals,
    }
}

impl Design {
    /// T_c from `[seals]`, else from `[friction]`.
    pub fn coulomb_torque_nm(&self, friction: &Section<'_>) -> f64 {
        either(friction, "coulomb_torque_nm", self.levels_nm.map(|levels| levels.0), "[seals]")
    }

    /// T_s from `[seals]`, else from `[friction]`.
    pub fn static_torque_nm(&self, friction: &Section<'_>) -> f64 {
        either(friction, "static_torque_nm", self.levels_nm.map(|levels| levels.1), "[seals]")
    }

    /// σ2 from `[clearance]`, else from `[friction]`.
    pub fn viscous_nm_s_per_rad(&self, friction: &Section<'_>) -> f64 {
        either(friction, "viscous_nm_s_per_rad", self.viscous_nm_s_per_rad, "[clearance]")
    }
}

/// A number that either the design's section or `[friction]` gives, not both.
fn either(friction: &Section<'_>, key: &str, designed: Option<f64>, design: &str) -> f64 {
    let Some(value) = designed else { return friction.number(key) };
    if let Some(field) = friction.find(key) {
        let found = format!("{} beside {design}, which gives the same", field.found());
        field.refuse_as(found, format!("`friction.{key}` or {design}, not both"));
    }
    value
}

fn read_clearance(section: Section<'_>) -> ClearanceParams {
    let clearance = ClearanceParams {
        spool_radius_m: section.number("spool_radius_m"),
        sleeve_radius_m: section.number("sleeve_radius_m"),
        length_m: section.number("length_m"),
        grooves: section.count("grooves"),
        groove_width_m: section.number("groove_width_m"),
        opening_area_m2: section.number("opening_area_m2"),
    };
    section.conclude(clearance.validate());
    clearance
}

fn read_seals(section: Section<'_>) -> SealParams {
    let seals = SealParams {
        spool_radius_m: section.number("spool_radius_m"),
        seals: section.count("seals"),
        o_ring_diameter_m: section.number("o_ring_diameter_m"),
        backup_ring_width_m: section.number("backup_ring_width_m"),
        working_pressure_pa: section.number("working_pressure_pa"),
        friction_coefficient: section.number("friction_coefficient"),
        static_ratio: section.number("static_ratio"),
    };
    section.conclude(seals.validate());
    seals
}
