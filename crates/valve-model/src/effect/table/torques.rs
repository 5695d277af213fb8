//! Effects that are other torques, the coupling, and the motor's own.

use super::cells::{ANY, HARMONICS, MAX_HARMONICS, SERIES, list, number};
use crate::effect::id::EffectId;
use crate::effect::spec::{Condition, EffectSpec, SeenIn};

pub(super) const FLOW_TORQUE: EffectSpec = EffectSpec {
    id: EffectId::FlowTorque,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: Some(Condition::PressureDrop),
    formula: "adds (p/1 MPa)·(Σ_k cos[k]·cos kθ + sin[k]·sin kθ) against the motor",
    keys: SERIES,
    parameters: &[
        list("cos", "N*m/MPa", MAX_HARMONICS, ANY, HARMONICS, "from k = 1 on; 0: no such harmonic"),
        list("sin", "N*m/MPa", MAX_HARMONICS, ANY, HARMONICS, "from k = 1 on; 0: no such harmonic"),
    ],
};

pub(super) const PRESSURE_TORQUE: EffectSpec = EffectSpec {
    id: EffectId::PressureTorque,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: Some(Condition::PressureDrop),
    formula: "adds gain·(p/1 MPa) against the motor",
    keys: "`gain`",
    parameters: &[number("gain", "N*m/MPa", (-ANY, ANY), 0.0, "a finite number", "0: none")],
};

pub(super) const POSITION_TORQUE: EffectSpec = EffectSpec {
    id: EffectId::PositionTorque,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: None,
    formula: "adds Σ_k cos[k]·cos kθ + sin[k]·sin kθ against the motor",
    keys: SERIES,
    parameters: &[
        list("cos", "N*m", MAX_HARMONICS, ANY, HARMONICS, "from k = 1 on; 0: no such harmonic"),
        list("sin", "N*m", MAX_HARMONICS, ANY, HARMONICS, "from k = 1 on; 0: no such harmonic"),
    ],
};

pub(super) const COUPLING_COMPLIANCE: EffectSpec = EffectSpec {
    id: EffectId::CouplingCompliance,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: None,
    formula: "a spring between encoder (on the motor's side) and spool, and a damper beside it",
    keys: "`stiffness_nm_per_rad`, `damping_nm_s_per_rad`",
    parameters: &[
        number("stiffness_nm_per_rad", "N*m/rad", (1.0, 1e12), 1e12, "a number, 1 to 1e12", "large: rigid"),
        number(
            "damping_nm_s_per_rad",
            "N*m*s/rad",
            (0.0, 1e6),
            0.0,
            "a number, 0 to 1e6",
            "of the spring; 0: a spool whose friction falls with speed may squeal",
        ),
    ],
};

pub(super) const DETENT_TORQUE: EffectSpec = EffectSpec {
    id: EffectId::DetentTorque,
    folded_into: None,
    seen_in: SeenIn::AngleLogs,
    needs: None,
    formula: "the motor adds Σ_k cos[k]·cos(kNθ) + sin[k]·sin(kNθ), N full steps in a turn",
    keys: SERIES,
    parameters: &[
        list("cos", "N*m", 4, ANY, "an array of at most 4 numbers", "from k = 1 on; 0: no such harmonic"),
        list("sin", "N*m", 4, ANY, "an array of at most 4 numbers", "from k = 1 on; 0: no such harmonic"),
    ],
};

pub(super) const MICROSTEP_ERROR: EffectSpec = EffectSpec {
    id: EffectId::MicrostepError,
    folded_into: None,
    seen_in: SeenIn::AngleLogs,
    needs: None,
    formula: "θ_cmd + Σ_k cos[k]·cos(kN_r·θ_cmd) + sin[k]·sin(kN_r·θ_cmd), N_r rotor teeth",
    keys: SERIES,
    parameters: &[
        list("cos", "rad", 10, 0.1, "an array of at most 10 numbers, -0.1 to 0.1", "from k = 1 on; 0: none"),
        list("sin", "rad", 10, 0.1, "an array of at most 10 numbers, -0.1 to 0.1", "from k = 1 on; 0: none"),
    ],
};
