//! Effects on friction's structure.

use super::cells::{ANY, HARMONICS, MAX_HARMONICS, NOT_NEGATIVE, POSITIVE, SERIES, TINY, list, number};
use crate::effect::id::EffectId;
use crate::effect::spec::{Condition, EffectSpec, SeenIn};

pub(super) const PRESSURE_DEPENDENT_FRICTION: EffectSpec = EffectSpec {
    id: EffectId::PressureDependentFriction,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: Some(Condition::PressureDrop),
    formula: "T_c and T_s × (1 + gain·(|p|/1 MPa)^exponent)",
    keys: "`gain`, `exponent`",
    parameters: &[
        number("gain", "1/MPa^exponent", (0.0, ANY), 0.0, NOT_NEGATIVE, "0: pressure doesn't matter"),
        number("exponent", "1", (0.1, 4.0), 1.0, "a number, 0.1 to 4", "1: linear in pressure"),
    ],
};

pub(super) const TEMPERATURE_DEPENDENT_VISCOSITY: EffectSpec = EffectSpec {
    id: EffectId::TemperatureDependentViscosity,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: Some(Condition::OilTemperature),
    formula: "σ2 × exp(−beta·(ϑ − ϑ_ref))",
    keys: "`beta_per_k`",
    parameters: &[number(
        "beta_per_k",
        "1/K",
        (-1.0, 1.0),
        0.0,
        "a number, -1 to 1",
        "0: temperature doesn't matter; mineral oil: about 0.03",
    )],
};

pub(super) const TEMPERATURE_DEPENDENT_FRICTION: EffectSpec = EffectSpec {
    id: EffectId::TemperatureDependentFriction,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: Some(Condition::OilTemperature),
    formula: "T_c and T_s × (1 + beta·(ϑ − ϑ_ref)), the factor at least 0.001",
    keys: "`beta_per_k`",
    parameters: &[number(
        "beta_per_k",
        "1/K",
        (-1.0, 1.0),
        0.0,
        "a number, -1 to 1",
        "0: temperature doesn't matter",
    )],
};

pub(super) const ANGLE_DEPENDENT_FRICTION: EffectSpec = EffectSpec {
    id: EffectId::AngleDependentFriction,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: None,
    formula: "T_c and T_s × (1 + Σ_k cos[k]·cos kθ + sin[k]·sin kθ), the factor at least 0.001",
    keys: SERIES,
    parameters: &[
        list("cos", "1", MAX_HARMONICS, ANY, HARMONICS, "a_k from k = 1 on; 0: no such harmonic"),
        list("sin", "1", MAX_HARMONICS, ANY, HARMONICS, "b_k from k = 1 on; 0: no such harmonic"),
    ],
};

pub(super) const DIRECTION_ASYMMETRY: EffectSpec = EffectSpec {
    id: EffectId::DirectionAsymmetry,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: None,
    formula: "T_c and T_s × (1 + level·sgn ω), σ2 × (1 + viscous·sgn ω)",
    keys: "`level`, `viscous`",
    parameters: &[
        number(
            "level",
            "1",
            (-0.999, 0.999),
            0.0,
            "a number, -0.999 to 0.999",
            "(T₊ − T₋)/(T₊ + T₋); 0: the same both ways",
        ),
        number(
            "viscous",
            "1",
            (-0.999, 0.999),
            0.0,
            "a number, -0.999 to 0.999",
            "the same of σ2; 0: the same both ways",
        ),
    ],
};

pub(super) const DWELL_STICTION: EffectSpec = EffectSpec {
    id: EffectId::DwellStiction,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: None,
    formula: "T_s × (1 + gain·(1 − exp(−(t/time_constant)^exponent))), t the time at rest",
    keys: "`gain`, `time_constant_s`, `exponent`",
    parameters: &[
        number("gain", "1", (0.0, ANY), 0.0, NOT_NEGATIVE, "the growth after a long rest; 0: none"),
        number("time_constant_s", "s", (1e-3, 1e9), 10.0, "a number, 0.001 to 1e9", "how fast it grows"),
        number("exponent", "1", (0.1, 4.0), 1.0, "a number, 0.1 to 4", "1: exponential growth"),
    ],
};

pub(super) const HYDRAULIC_LOCK: EffectSpec = EffectSpec {
    id: EffectId::HydraulicLock,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: Some(Condition::PressureDrop),
    formula: "T_c and T_s × (1 + gain·(|p|/1 MPa)·(1 − exp(−(t/time_constant)^exponent))), t the time at rest",
    keys: "`gain`, `time_constant_s`, `exponent`",
    parameters: &[
        number("gain", "1/MPa", (0.0, ANY), 0.0, NOT_NEGATIVE, "the growth after a long rest; 0: none"),
        number("time_constant_s", "s", (1e-3, 1e9), 10.0, "a number, 0.001 to 1e9", "how fast it grows"),
        number("exponent", "1", (0.1, 4.0), 1.0, "a number, 0.1 to 4", "1: exponential growth"),
    ],
};

pub(super) const FRICTION_LAG: EffectSpec = EffectSpec {
    id: EffectId::FrictionLag,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: None,
    formula: "g and σ2·ω are taken at ω_lag; with s = second_stage_share: (1 − s)·time_constant·dω_1/dt = ω − ω_1, \
                  s·time_constant·dω_lag/dt = ω_1 − ω_lag",
    keys: "`time_constant_s`, `second_stage_share`",
    parameters: &[
        number("time_constant_s", "s", (0.0, 1e3), 0.0, "a number, 0 to 1000", "τ; 0: no lag"),
        number(
            "second_stage_share",
            "1",
            (0.0, 0.5),
            0.0,
            "a number, 0 to 0.5",
            "s; 0: one stage, 0.5: two alike",
        ),
    ],
};

pub(super) const PRESLIDING_HYSTERESIS: EffectSpec = EffectSpec {
    id: EffectId::PreslidingHysteresis,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: None,
    formula: "σ0·z of LuGre or Dahl (whose exponent n replaces) is replaced by F_h(z) of Maxwell elements, σ1 by σ1 times the part of them that stick, \
                  same initial stiffness, same steady curve; refused for a static law, which has no bristles, and for Leuven, which has the elements already",
    keys: "`transition_exponent`, `saturation_ratio`, `spacing_exponent`, `tail_exponent`, `curve_share`",
    parameters: &[
        number("transition_exponent", "1", (1.0, 100.0), 10.0, "a number, 1 to 100", "n of the Leuven law"),
        number(
            "saturation_ratio",
            "1",
            (1.001, 100.0),
            1.2,
            "a number, 1.001 to 100",
            "ΣW_i/T_s of the Leuven law; large: a straight spring",
        ),
        number(
            "spacing_exponent",
            "1",
            (0.1, 10.0),
            1.0,
            "a number, 0.1 to 10",
            "how the slip levels are spaced; 1: evenly",
        ),
        number(
            "tail_exponent",
            "1",
            (0.0, 10.0),
            0.0,
            "a number, 0 to 10",
            "how far the last elements to slip stand out; 0: not",
        ),
        number(
            "curve_share",
            "1",
            (0.0, 1.0),
            0.0,
            "a number, 0 to 1",
            "how far the elements' slip torques follow the steady curve as it falls with speed; 0: not at all (Leuven), 1: \
                 wholly (generalised Maxwell slip)",
        ),
    ],
};

pub(super) const WEAR_DRIFT: EffectSpec = EffectSpec {
    id: EffectId::WearDrift,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: None,
    formula: "T_c and T_s × (1 + gain·(1 − exp(−s/distance))), s the distance travelled; ×(1 + gain·s/distance) early on",
    keys: "`gain`, `distance_rad`",
    parameters: &[
        number("gain", "1", (-0.999, ANY), 0.0, "a number, -0.999 or above", "the final change; 0: none"),
        number("distance_rad", "rad", (TINY, 1e12), 1e3, POSITIVE, "the distance that takes 63 % of it"),
    ],
};
