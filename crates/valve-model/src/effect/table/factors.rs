//! Effects that are a factor on a number of the model.

use super::cells::{FACTOR, factor, factor_on, factor_or_none, number};
use crate::effect::id::EffectId;
use crate::effect::spec::{EffectSpec, SeenIn};

/// What most rows have in common.
const ROW: EffectSpec = EffectSpec {
    id: EffectId::CoulombLevel,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: None,
    formula: "",
    keys: FACTOR,
    parameters: &[factor("1: as the model has it")],
};

pub(super) const COULOMB_LEVEL: EffectSpec = EffectSpec {
    id: EffectId::CoulombLevel,
    folded_into: factor_on("friction", "coulomb_torque_nm and static_torque_nm", "the rig's friction"),
    formula: "T_c and T_s × factor",
    ..ROW
};

pub(super) const STATIC_LEVEL: EffectSpec = EffectSpec {
    id: EffectId::StaticLevel,
    folded_into: factor_on("friction", "static_torque_nm", "the rig's static friction"),
    formula: "T_s × factor at the same T_c; a product below T_c counts as T_c",
    ..ROW
};

pub(super) const VISCOUS_LEVEL: EffectSpec = EffectSpec {
    id: EffectId::ViscousLevel,
    folded_into: factor_on("friction", "viscous_nm_s_per_rad", "the rig's viscous friction"),
    formula: "σ2 × factor",
    parameters: &[number(
        "factor",
        "1",
        (0.0, 1e6),
        1.0,
        "a number, 0 to 1e6",
        "1: as the model has it; 0: no viscous friction",
    )],
    ..ROW
};

pub(super) const STRIBECK_VELOCITY: EffectSpec = EffectSpec {
    id: EffectId::StribeckVelocity,
    folded_into: factor_on(
        "friction",
        "stribeck_velocity_rad_per_s",
        "the speed at which the rig's friction falls",
    ),
    formula: "ω_s × factor",
    ..ROW
};

pub(super) const BRISTLE_STIFFNESS: EffectSpec = EffectSpec {
    id: EffectId::BristleStiffness,
    folded_into: factor_on(
        "friction",
        "bristle_stiffness_nm_per_rad",
        "the rig's stiffness before it slides",
    ),
    formula: "σ0 × factor, σ1 kept",
    ..ROW
};

pub(super) const BRISTLE_DAMPING: EffectSpec = EffectSpec {
    id: EffectId::BristleDamping,
    folded_into: factor_on("friction", "bristle_damping_nm_s_per_rad", "the damping of the rig's bristles"),
    formula: "σ1 × factor; `diagnose` takes it as uncertain, and names it as no cause",
    parameters: &[factor_or_none("1: as the model has it; 0: no damping")],
    ..ROW
};

pub(super) const LOAD_INERTIA: EffectSpec = EffectSpec {
    id: EffectId::LoadInertia,
    folded_into: factor_on("load", "inertia_kg_m2", "the rig's load inertia"),
    formula: "J_load × factor",
    parameters: &[factor_or_none("1: as the model has it; 0: no load")],
    ..ROW
};

pub(super) const HOLDING_TORQUE_LEVEL: EffectSpec = EffectSpec {
    id: EffectId::HoldingTorqueLevel,
    folded_into: factor_on("motor", "holding_torque_nm", "the motor's holding torque"),
    seen_in: SeenIn::AngleLogs,
    formula: "T_hold × factor",
    ..ROW
};

pub(super) const ROTOR_INERTIA: EffectSpec = EffectSpec {
    id: EffectId::RotorInertia,
    folded_into: factor_on("motor", "rotor_inertia_kg_m2", "the rotor's inertia"),
    seen_in: SeenIn::AngleLogs,
    formula: "J_rotor × factor; `diagnose` takes it as uncertain, and names it as no cause",
    ..ROW
};

pub(super) const MOTOR_DAMPING: EffectSpec = EffectSpec {
    id: EffectId::MotorDamping,
    folded_into: factor_on("motor", "damping_nm_s_per_rad", "the motor's damping"),
    seen_in: SeenIn::AngleLogs,
    formula: "D × factor; `diagnose` takes it as uncertain, and names it as no cause",
    parameters: &[factor_or_none("1: as the model has it; 0: no damping")],
    ..ROW
};
