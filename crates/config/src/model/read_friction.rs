//! `[friction]`: a law's name and the numbers that this law needs, but for those that a design calculation gives.

use valve_model::{DahlParams, FrictionParams, LeuvenParams, LuGreParams, StribeckParams};

use crate::model::read_design::Design;
use crate::reader::Section;

#[derive(Clone, Copy)]
enum Law {
    Stribeck,
    Dahl,
    LuGre,
    Leuven,
}

const OTHER_LAWS: &[(&str, Law)] =
    &[("stribeck", Law::Stribeck), ("dahl", Law::Dahl), ("leuven", Law::Leuven)];
const LAWS: &str = "\"lugre\" or \"stribeck\" or \"dahl\" or \"leuven\"";

/// The friction section; `None` without a known law, since the law decides which keys there are.
pub(super) fn read_friction(section: Section<'_>, design: &Design) -> Option<FrictionParams> {
    let field = section.require("law", LAWS)?;
    let law = field.choice(("lugre", Law::LuGre), OTHER_LAWS)?;
    let friction = match law {
        Law::Stribeck => FrictionParams::Stribeck(read_stribeck(&section, design)),
        Law::Dahl => FrictionParams::Dahl(read_dahl(&section, design)),
        Law::LuGre => FrictionParams::LuGre(read_lugre(&section, design)),
        Law::Leuven => FrictionParams::Leuven(read_leuven(&section, design)),
    };
    section.conclude(friction.validate());
    Some(friction)
}

fn read_stribeck(section: &Section<'_>, design: &Design) -> StribeckParams {
    StribeckParams {
        coulomb_torque_nm: design.coulomb_torque_nm(section),
        static_torque_nm: design.static_torque_nm(section),
        stribeck_velocity_rad_per_s: section.number("stribeck_velocity_rad_per_s"),
        stribeck_exponent: section.number("stribeck_exponent"),
        viscous_nm_s_per_rad: design.viscous_nm_s_per_rad(section),
        regularisation_velocity_rad_per_s: section.number("regularisation_velocity_rad_per_s"),
    }
}

fn read_dahl(section: &Section<'_>, design: &Design) -> DahlParams {
    DahlParams {
        coulomb_torque_nm: design.coulomb_torque_nm(section),
        bristle_stiffness_nm_per_rad: section.number("bristle_stiffness_nm_per_rad"),
        viscous_nm_s_per_rad: design.viscous_nm_s_per_rad(section),
        dahl_exponent: section.number("dahl_exponent"),
    }
}

fn read_lugre(section: &Section<'_>, design: &Design) -> LuGreParams {
    LuGreParams {
        coulomb_torque_nm: design.coulomb_torque_nm(section),
        static_torque_nm: design.static_torque_nm(section),
        stribeck_velocity_rad_per_s: section.number("stribeck_velocity_rad_per_s"),
        stribeck_exponent: section.number("stribeck_exponent"),
        bristle_stiffness_nm_per_rad: section.number("bristle_stiffness_nm_per_rad"),
        bristle_damping_nm_s_per_rad: section.number("bristle_damping_nm_s_per_rad"),
        viscous_nm_s_per_rad: design.viscous_nm_s_per_rad(section),
    }
}

fn read_leuven(section: &Section<'_>, design: &Design) -> LeuvenParams {
    LeuvenParams {
        coulomb_torque_nm: design.coulomb_torque_nm(section),
        static_torque_nm: design.static_torque_nm(section),
        stribeck_velocity_rad_per_s: section.number("stribeck_velocity_rad_per_s"),
        stribeck_exponent: section.number("stribeck_exponent"),
        bristle_stiffness_nm_per_rad: section.number("bristle_stiffness_nm_per_rad"),
        bristle_damping_nm_s_per_rad: section.number("bristle_damping_nm_s_per_rad"),
        viscous_nm_s_per_rad: design.viscous_nm_s_per_rad(section),
        transition_exponent: section.number("transition_exponent"),
        maxwell_elements: section.count("maxwell_elements"),
        maxwell_saturation_ratio: section.number("maxwell_saturation_ratio"),
        maxwell_spacing_exponent: section.number("maxwell_spacing_exponent"),
        maxwell_tail_exponent: section.optional_number("maxwell_tail_exponent").unwrap_or(0.0),
        maxwell_curve_share: section.optional_number("maxwell_curve_share").unwrap_or(0.0),
        maxwell_damping_share: section.optional_number("maxwell_damping_share").unwrap_or(0.0),
    }
}
