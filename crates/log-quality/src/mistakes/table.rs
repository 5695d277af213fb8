//! The ways in which people mistake a record's units and signs, and how each is mended.

use super::AGREES;
use crate::expected::{AS_IT_IS, Scale};
use crate::finding::Kind;
use log_data::Channel;
use std::f64::consts::{PI, TAU};

/// Degrees in a radian.
pub(super) const DEGREES: f64 = 180.0 / PI;

/// One way to mistake a record, and how to mend it.
pub(super) struct Mistake {
    pub(super) kind: Kind,
    pub(super) channels: &'static [Channel],
    pub(super) scale: Scale,
    pub(super) says: &'static str,
    pub(super) mend: &'static str,
    /// How many mistakes it is at once.
    pub(super) count: i32,
    /// How near to the model the record must be once mended.
    pub(super) agrees: f64,
}

const fn mistake(
    kind: Kind,
    channels: &'static [Channel],
    scale: Scale,
    says: &'static str,
    mend: &'static str,
) -> Mistake {
    Mistake { kind, channels, scale, says, mend, count: 1, agrees: AGREES }
}

/// Torque and angle as an instrument shows them, in units of its own both.
const fn with_degrees(torque: f64, says: &'static str, mend: &'static str) -> Mistake {
    Mistake {
        kind: Kind::TorqueUnit,
        channels: &[Channel::Torque, Channel::Angle],
        scale: Scale { measured: torque, angle: 1.0 / DEGREES, time: 1.0 },
        says,
        mend,
        count: 2,
        agrees: AGREES,
    }
}

/// A factor of ten is no unit, and a first guess of a model's friction may be off by half as much: once mended, the record must be nearer than
/// others, within a quarter.
const SLIPPED: f64 = 0.25;

const fn slipped(torque: f64, says: &'static str, mend: &'static str) -> Mistake {
    let scale = Scale { measured: torque, ..AS_IT_IS };
    Mistake { agrees: SLIPPED, ..mistake(Kind::TorqueUnit, &[Channel::Torque], scale, says, mend) }
}

/// Those of a torque log.
pub(super) const OF_TORQUE: &[Mistake] = &[
    mistake(
        Kind::TorqueSign,
        &[Channel::Torque, Channel::Angle],
        Scale { measured: -1.0, ..AS_IT_IS },
        "with the torque's sign turned",
        "is the torque, or the angle, wired the other way? Then --map torque='-(...)', or the same for angle",
    ),
    mistake(
        Kind::TorqueUnit,
        &[Channel::Torque],
        Scale { measured: 1e-2, ..AS_IT_IS },
        "with the torque divided by 100",
        "is it in N*cm? Then --map torque='.../100'",
    ),
    mistake(
        Kind::TorqueUnit,
        &[Channel::Torque],
        Scale { measured: 1e-3, ..AS_IT_IS },
        "with the torque divided by 1000",
        "is it in mN*m? Then --map torque='.../1000'",
    ),
    mistake(
        Kind::TorqueUnit,
        &[Channel::Torque],
        Scale { measured: 1e2, ..AS_IT_IS },
        "with the torque times 100",
        "was it divided by 100 once too often?",
    ),
    mistake(
        Kind::TorqueUnit,
        &[Channel::Torque],
        Scale { measured: 1e3, ..AS_IT_IS },
        "with the torque times 1000",
        "is it in kN*m, or was it divided by 1000 once too often?",
    ),
    slipped(
        0.1,
        "with the torque divided by 10",
        "did a decimal point slip, or the amplifier's range? Then --map torque='.../10'",
    ),
    slipped(
        10.0,
        "with the torque times 10",
        "did a decimal point slip, or the amplifier's range? Then --map torque='...*10'",
    ),
    DEGREE,
    TURN,
    MILLISECOND,
    with_degrees(
        1e-2,
        "with the torque divided by 100 and the angle by 57.3",
        "are they in N*cm and degrees? Then --map torque='.../100' --map angle='...*pi/180'",
    ),
    with_degrees(
        1e-3,
        "with the torque divided by 1000 and the angle by 57.3",
        "are they in mN*m and degrees? Then --map torque='.../1000' --map angle='...*pi/180'",
    ),
];

/// Those of an angle log.
pub(super) const OF_ANGLE: &[Mistake] = &[
    mistake(
        Kind::SwappedChannels,
        &[Channel::Angle, Channel::AngleCommand],
        Scale { measured: -1.0, ..AS_IT_IS },
        "with angle and angle_command exchanged",
        "exchange the two columns",
    ),
    Mistake { scale: Scale { angle: 1.0 / DEGREES, measured: 1.0 / DEGREES, time: 1.0 }, ..DEGREE },
    Mistake { scale: Scale { angle: TAU, measured: TAU, time: 1.0 }, ..TURN },
    MILLISECOND,
];

const DEGREE: Mistake = mistake(
    Kind::AngleUnit,
    &[Channel::Angle],
    Scale { angle: 1.0 / DEGREES, ..AS_IT_IS },
    "with the angle divided by 57.3",
    "is it in degrees? Then --map angle='...*pi/180'",
);

const TURN: Mistake = mistake(
    Kind::AngleUnit,
    &[Channel::Angle],
    Scale { angle: TAU, ..AS_IT_IS },
    "with the angle times 6.28",
    "is it in turns? Then --map angle='...*2*pi'",
);

const MILLISECOND: Mistake = mistake(
    Kind::TimeUnit,
    &[Channel::Time],
    Scale { time: 1e-3, ..AS_IT_IS },
    "with the time divided by 1000",
    "is it in ms? Then --map time='.../1000'",
);
