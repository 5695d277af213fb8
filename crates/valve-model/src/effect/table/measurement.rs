//! Effects of the measurement.

use super::cells::{ANY, FACTOR, factor, list, number};
use crate::effect::id::EffectId;
use crate::effect::spec::{EffectSpec, SeenIn};

pub(super) const BACKLASH: EffectSpec = EffectSpec {
    id: EffectId::Backlash,
    folded_into: None,
    seen_in: SeenIn::AngleLogs,
    needs: None,
    formula: "the encoder follows the rotor with a play of ± half_width",
    keys: "`half_width_rad`",
    parameters: &[number("half_width_rad", "rad", (0.0, 1.0), 0.0, "a number, 0 to 1", "0: no play")],
};

pub(super) const MISSED_STEPS: EffectSpec = EffectSpec {
    id: EffectId::MissedSteps,
    folded_into: None,
    seen_in: SeenIn::AngleLogs,
    needs: None,
    formula: "the rotor jumps by teeth[i] tooth pitches at time_s[i]",
    keys: "`time_s`, `teeth`",
    parameters: &[
        list("time_s", "s", 8, ANY, "an array of at most 8 finite numbers", "when, from the run's start"),
        list("teeth", "1", 8, 1e6, "an array of at most 8 numbers", "tooth pitches, signed; 0: none"),
    ],
};

pub(super) const TORQUE_OFFSET: EffectSpec = EffectSpec {
    id: EffectId::TorqueOffset,
    folded_into: None,
    seen_in: SeenIn::TorqueLogs,
    needs: None,
    formula: "measured torque + offset",
    keys: "`offset_nm`",
    parameters: &[number("offset_nm", "N*m", (-ANY, ANY), 0.0, "a finite number", "0: none")],
};

pub(super) const TORQUE_GAIN: EffectSpec = EffectSpec {
    id: EffectId::TorqueGain,
    folded_into: None,
    seen_in: SeenIn::TorqueLogs,
    needs: None,
    formula: "measured torque × factor",
    keys: FACTOR,
    parameters: &[factor("1: a true channel")],
};

pub(super) const SENSOR_DELAY: EffectSpec = EffectSpec {
    id: EffectId::SensorDelay,
    folded_into: None,
    seen_in: SeenIn::AnyLog,
    needs: None,
    formula: "torque late against angle (torque logs), angle late against command (angle logs); the low-pass is of order 2, \
                  damped at 1/√2, and late by its share of the delay",
    keys: "`delay_s`, `low_pass_share`",
    parameters: &[
        number("delay_s", "s", (-1.0, 1.0), 0.0, "a number, -1 to 1", "0: no delay"),
        number(
            "low_pass_share",
            "1",
            (0.0, 1.0),
            0.0,
            "a number, 0 to 1",
            "share of the delay that is a low-pass's; of a negative delay none",
        ),
    ],
};

pub(super) const ENCODER_ECCENTRICITY: EffectSpec = EffectSpec {
    id: EffectId::EncoderEccentricity,
    folded_into: None,
    seen_in: SeenIn::AngleLogs,
    needs: None,
    formula: "measured angle + amplitude·sin(θ + phase)",
    keys: "`amplitude_rad`, `phase_rad`",
    parameters: &[
        number("amplitude_rad", "rad", (0.0, 1.0), 0.0, "a number, 0 to 1", "0: centred"),
        number("phase_rad", "rad", (-ANY, ANY), 0.0, "a finite number", "where the error is zero"),
    ],
};
