//! The one table of effects: ids, parameters, units, ranges, and what leaves the model unchanged.

use super::spec::{EffectSpec, ParameterSpec, ValueKind};

const fn number(
    key: &'static str,
    unit: &'static str,
    (min, max): (f64, f64),
    default: f64,
    range: &'static str,
    meaning: &'static str,
) -> ParameterSpec {
    ParameterSpec { key, unit, kind: ValueKind::Number, min, max, default, range, meaning }
}

const fn list(
    key: &'static str,
    unit: &'static str,
    most: usize,
    bound: f64,
    range: &'static str,
    meaning: &'static str,
) -> ParameterSpec {
    ParameterSpec {
        key,
        unit,
        kind: ValueKind::List(most),
        min: -bound,
        max: bound,
        default: 0.0,
        range,
        meaning,
    }
}

const fn factor(meaning: &'static str) -> ParameterSpec {
    number("factor", "1", (1e-3, 1e3), 1.0, "a number, 0.001 to 1000", meaning)
}

/// Most harmonics of a series over the angle.
pub(crate) const MAX_HARMONICS: usize = 16;

pub(super) fn spec(id: &str) -> Option<&'static EffectSpec> {
    EFFECTS.iter().find(|spec| spec.id == id)
}

const ANY: f64 = f64::MAX;
const FACTOR: &str = "`factor`";
const SERIES: &str = "`cos`, `sin`";
const HARMONICS: &str = "an array of at most 16 numbers";
const POSITIVE: &str = "a number above zero";
const NOT_NEGATIVE: &str = "a number, zero or above";
const TINY: f64 = f64::MIN_POSITIVE;

/// Every effect.
pub const EFFECTS: &[EffectSpec] = &[
    EffectSpec {
        id: "coulomb-level",
        formula: "T_c and T_s × factor",
        keys: FACTOR,
        parameters: &[factor("1: as the model has it")],
    },
    EffectSpec {
        id: "static-level",
        formula: "T_s × factor at the same T_c; a product below T_c counts as T_c",
        keys: FACTOR,
        parameters: &[factor("1: as the model has it")],
    },
    EffectSpec {
        id: "viscous-level",
        formula: "σ2 × factor",
        keys: FACTOR,
        parameters: &[number(
            "factor",
            "1",
            (0.0, 1e6),
            1.0,
            "a number, 0 to 1e6",
            "1: as the model has it; 0: no viscous friction",
        )],
    },
    EffectSpec {
        id: "stribeck-velocity",
        formula: "ω_s × factor",
        keys: FACTOR,
        parameters: &[factor("1: as the model has it")],
    },
    EffectSpec {
        id: "bristle-stiffness",
        formula: "σ0 × factor, σ1 kept",
        keys: FACTOR,
        parameters: &[factor("1: as the model has it")],
    },
    EffectSpec {
        id: "load-inertia",
        formula: "J_load × factor",
        keys: FACTOR,
        parameters: &[number(
            "factor",
            "1",
            (0.0, 1e3),
            1.0,
            "a number, 0 to 1000",
            "1: as the model has it; 0: no load",
        )],
    },
    EffectSpec {
        id: "holding-torque-level",
        formula: "T_hold × factor",
        keys: FACTOR,
        parameters: &[factor("1: as the model has it")],
    },
    EffectSpec {
        id: "pressure-dependent-friction",
        formula: "T_c and T_s × (1 + gain·(|p|/1 MPa)^exponent)",
        keys: "`gain`, `exponent`",
        parameters: &[
            number("gain", "1/MPa^exponent", (0.0, ANY), 0.0, NOT_NEGATIVE, "0: pressure doesn't matter"),
            number("exponent", "1", (0.1, 4.0), 1.0, "a number, 0.1 to 4", "1: linear in pressure"),
        ],
    },
    EffectSpec {
        id: "temperature-dependent-viscosity",
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
    },
    EffectSpec {
        id: "temperature-dependent-friction",
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
    },
    EffectSpec {
        id: "angle-dependent-friction",
        formula: "T_c and T_s × (1 + Σ_k cos[k]·cos kθ + sin[k]·sin kθ), the factor at least 0.001",
        keys: SERIES,
        parameters: &[
            list("cos", "1", MAX_HARMONICS, ANY, HARMONICS, "a_k from k = 1 on; 0: no such harmonic"),
            list("sin", "1", MAX_HARMONICS, ANY, HARMONICS, "b_k from k = 1 on; 0: no such harmonic"),
        ],
    },
    EffectSpec {
        id: "direction-asymmetry",
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
    },
    EffectSpec {
        id: "dwell-stiction",
        formula: "T_s × (1 + gain·(1 − exp(−(t/time_constant)^exponent))), t the time at rest",
        keys: "`gain`, `time_constant_s`, `exponent`",
        parameters: &[
            number("gain", "1", (0.0, ANY), 0.0, NOT_NEGATIVE, "the growth after a long rest; 0: none"),
            number("time_constant_s", "s", (1e-3, 1e9), 10.0, "a number, 0.001 to 1e9", "how fast it grows"),
            number("exponent", "1", (0.1, 4.0), 1.0, "a number, 0.1 to 4", "1: exponential growth"),
        ],
    },
    EffectSpec {
        id: "hydraulic-lock",
        formula: "T_c and T_s × (1 + gain·(|p|/1 MPa)·(1 − exp(−(t/time_constant)^exponent))), t the time at rest",
        keys: "`gain`, `time_constant_s`, `exponent`",
        parameters: &[
            number("gain", "1/MPa", (0.0, ANY), 0.0, NOT_NEGATIVE, "the growth after a long rest; 0: none"),
            number("time_constant_s", "s", (1e-3, 1e9), 10.0, "a number, 0.001 to 1e9", "how fast it grows"),
            number("exponent", "1", (0.1, 4.0), 1.0, "a number, 0.1 to 4", "1: exponential growth"),
        ],
    },
    EffectSpec {
        id: "friction-lag",
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
    },
    EffectSpec {
        id: "presliding-hysteresis",
        formula: "σ0·z of LuGre or Dahl (whose exponent n replaces) is replaced by F_h(z) of Maxwell elements, σ1 by σ1 times the part of them that stick, \
                  same initial stiffness, same steady curve; refused for a static law, which has no bristles, and for Leuven, which has the elements already",
        keys: "`transition_exponent`, `saturation_ratio`, `spacing_exponent`, `tail_exponent`, `curve_share`",
        parameters: &[
            number(
                "transition_exponent",
                "1",
                (1.0, 100.0),
                10.0,
                "a number, 1 to 100",
                "n of the Leuven law",
            ),
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
    },
    EffectSpec {
        id: "wear-drift",
        formula: "T_c and T_s × (1 + gain·(1 − exp(−s/distance))), s the distance travelled; ×(1 + gain·s/distance) early on",
        keys: "`gain`, `distance_rad`",
        parameters: &[
            number("gain", "1", (-0.999, ANY), 0.0, "a number, -0.999 or above", "the final change; 0: none"),
            number("distance_rad", "rad", (TINY, 1e12), 1e3, POSITIVE, "the distance that takes 63 % of it"),
        ],
    },
    EffectSpec {
        id: "flow-torque",
        formula: "adds (p/1 MPa)·(Σ_k cos[k]·cos kθ + sin[k]·sin kθ) against the motor",
        keys: SERIES,
        parameters: &[
            list("cos", "N*m/MPa", MAX_HARMONICS, ANY, HARMONICS, "from k = 1 on; 0: no such harmonic"),
            list("sin", "N*m/MPa", MAX_HARMONICS, ANY, HARMONICS, "from k = 1 on; 0: no such harmonic"),
        ],
    },
    EffectSpec {
        id: "pressure-torque",
        formula: "adds gain·(p/1 MPa) against the motor",
        keys: "`gain`",
        parameters: &[number("gain", "N*m/MPa", (-ANY, ANY), 0.0, "a finite number", "0: none")],
    },
    EffectSpec {
        id: "position-torque",
        formula: "adds Σ_k cos[k]·cos kθ + sin[k]·sin kθ against the motor",
        keys: SERIES,
        parameters: &[
            list("cos", "N*m", MAX_HARMONICS, ANY, HARMONICS, "from k = 1 on; 0: no such harmonic"),
            list("sin", "N*m", MAX_HARMONICS, ANY, HARMONICS, "from k = 1 on; 0: no such harmonic"),
        ],
    },
    EffectSpec {
        id: "coupling-compliance",
        formula: "a spring between encoder (on the motor's side) and spool, and a damper beside it",
        keys: "`stiffness_nm_per_rad`, `damping_nm_s_per_rad`",
        parameters: &[
            number(
                "stiffness_nm_per_rad",
                "N*m/rad",
                (1.0, 1e12),
                1e12,
                "a number, 1 to 1e12",
                "large: rigid",
            ),
            number(
                "damping_nm_s_per_rad",
                "N*m*s/rad",
                (0.0, 1e6),
                0.0,
                "a number, 0 to 1e6",
                "of the spring; 0: a spool whose friction falls with speed may squeal",
            ),
        ],
    },
    EffectSpec {
        id: "detent-torque",
        formula: "the motor adds Σ_k cos[k]·cos(kNθ) + sin[k]·sin(kNθ), N full steps in a turn",
        keys: SERIES,
        parameters: &[
            list("cos", "N*m", 4, ANY, "an array of at most 4 numbers", "from k = 1 on; 0: no such harmonic"),
            list("sin", "N*m", 4, ANY, "an array of at most 4 numbers", "from k = 1 on; 0: no such harmonic"),
        ],
    },
    EffectSpec {
        id: "microstep-error",
        formula: "θ_cmd + Σ_k cos[k]·cos(kN_r·θ_cmd) + sin[k]·sin(kN_r·θ_cmd), N_r rotor teeth",
        keys: SERIES,
        parameters: &[
            list(
                "cos",
                "rad",
                10,
                0.1,
                "an array of at most 10 numbers, -0.1 to 0.1",
                "from k = 1 on; 0: none",
            ),
            list(
                "sin",
                "rad",
                10,
                0.1,
                "an array of at most 10 numbers, -0.1 to 0.1",
                "from k = 1 on; 0: none",
            ),
        ],
    },
    EffectSpec {
        id: "backlash",
        formula: "the encoder follows the rotor with a play of ± half_width",
        keys: "`half_width_rad`",
        parameters: &[number("half_width_rad", "rad", (0.0, 1.0), 0.0, "a number, 0 to 1", "0: no play")],
    },
    EffectSpec {
        id: "missed-steps",
        formula: "the rotor jumps by teeth[i] tooth pitches at time_s[i]",
        keys: "`time_s`, `teeth`",
        parameters: &[
            list("time_s", "s", 8, ANY, "an array of at most 8 finite numbers", "when, from the run's start"),
            list("teeth", "1", 8, 1e6, "an array of at most 8 numbers", "tooth pitches, signed; 0: none"),
        ],
    },
    EffectSpec {
        id: "torque-offset",
        formula: "measured torque + offset",
        keys: "`offset_nm`",
        parameters: &[number("offset_nm", "N*m", (-ANY, ANY), 0.0, "a finite number", "0: none")],
    },
    EffectSpec {
        id: "torque-gain",
        formula: "measured torque × factor",
        keys: FACTOR,
        parameters: &[factor("1: a true channel")],
    },
    EffectSpec {
        id: "sensor-delay",
        formula: "torque late against angle (torque logs), angle late against command (angle logs)",
        keys: "`delay_s`",
        parameters: &[number("delay_s", "s", (-1.0, 1.0), 0.0, "a number, -1 to 1", "0: no delay")],
    },
    EffectSpec {
        id: "encoder-eccentricity",
        formula: "measured angle + amplitude·sin(θ + phase)",
        keys: "`amplitude_rad`, `phase_rad`",
        parameters: &[
            number("amplitude_rad", "rad", (0.0, 1.0), 0.0, "a number, 0 to 1", "0: centred"),
            number("phase_rad", "rad", (-ANY, ANY), 0.0, "a finite number", "where the error is zero"),
        ],
    },
];
