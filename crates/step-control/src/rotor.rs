//! Where the rotor will be when a command takes effect: its last reading, advanced by as much of the wanted motion as the
//! readings confirm.
//!
//! A reading is a dead time older than the command that it limits. A healthy rotor covers the wanted motion meanwhile; a
//! jammed one stays where it was read. The share of the wanted motion that the rotor covered between the last two readings
//! tells them apart, one cycle after the rotor has stopped. Where the dead time is longer than half a period of the
//! resonance it does not: a free rotor may have turned back in between, so all of the wanted motion is assumed then.

use crate::correction::Correction;
use crate::params::Params;
use serde::{Deserialize, Serialize};
use signals::Kinematics;

/// The last reading, and how much of the wanted motion the rotor made.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Seen {
    /// The reading, rad.
    reading_rad: f64,
    /// Cycles since the one in which it arrived, whether the controller ran in them or not.
    cycles_ago: u64,
    /// Measured motion between the last two readings, as a fraction of the wanted one, from 0 to 1.
    confirmed: f64,
}

impl Seen {
    /// A first reading: the rotor is assumed to follow.
    pub(crate) fn first(reading_rad: f64) -> Self {
        Self { reading_rad, cycles_ago: 0, confirmed: 1.0 }
    }

    /// A cycle later that the controller overran.
    pub(crate) fn passed_over(self) -> Self {
        Self { cycles_ago: self.cycles_ago.saturating_add(1), ..self }
    }

    /// A cycle later, with its reading where one arrived.
    pub(crate) fn next(self, params: &Params, commanded: &Correction, reading_rad: Option<f64>) -> Self {
        let Some(reading_rad) = reading_rad else { return self.passed_over() };
        let cycles_ago = self.cycles_ago.saturating_add(1);
        let age = age_cycles(params);
        let wanted_rad = match (commanded.aim_rad(age), commanded.aim_rad(age.saturating_add(cycles_ago))) {
            (Some(now_rad), Some(before_rad)) => now_rad - before_rad,
            _ => return Self::first(reading_rad),
        };
        let confirmed = if wanted_rad == 0.0 {
            self.confirmed
        } else {
            ((reading_rad - self.reading_rad) / wanted_rad).clamp(0.0, 1.0)
        };
        Self { reading_rad, cycles_ago: 0, confirmed }
    }

    /// The rotor when the command towards `target` has been carried out; `None` if the reading is older than the history of
    /// commands.
    pub(crate) fn at(&self, params: &Params, commanded: &Correction, target: &Kinematics) -> Option<Rotor> {
        let age = age_cycles(params).saturating_add(self.cycles_ago);
        let confirmed = if says_where_the_rotor_is(params, age) { self.confirmed } else { 1.0 };
        let advance_rad = confirmed * (target.angle_rad - commanded.aim_rad(age)?);
        Some(Rotor {
            deviation_rad: self.reading_rad + advance_rad - target.angle_rad,
            way_rad: confirmed * (target.angle_rad - commanded.aim_rad(0)?),
        })
    }
}

/// The rotor at the end of a cycle that is being commanded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rotor {
    /// Its angle minus the target's, rad.
    pub deviation_rad: f64,
    /// Its motion in that cycle, rad.
    pub way_rad: f64,
}

/// Whether a reading of this age still says where the rotor is when the next command ends. A free rotor oscillates about its
/// command: after half a period of the resonance it is on the other side.
fn says_where_the_rotor_is(params: &Params, age_cycles: u64) -> bool {
    (age_cycles + 1) as f64 * params.period_s <= params.half_period_s()
}

/// Age of a reading when it arrives, in cycles before the end of the cycle commanded last.
fn age_cycles(params: &Params) -> u64 {
    params.loop_delay_cycles + params.encoder_delay_cycles
}
