//! What instruments do to the measurement.

use super::{Applied, Instance, applied};
use crate::spool::Valve;
use serde_json::json;
use std::f64::consts::TAU;

impl Instance {
    pub(super) fn torque_offset(&self, valve: &mut Valve) -> Applied {
        let n = valve.contact.nominal;
        valve.offset_nm = self.sign * self.amount * self.between(0, 0.04, 0.12) * n.coulomb_nm;
        applied(json!({ "offset_nm": valve.offset_nm }), true)
    }

    pub(super) fn torque_gain(&self, valve: &mut Valve) -> Applied {
        valve.gain = self.factor(self.between(0, 0.06, 0.15));
        applied(json!({ "factor": valve.gain }), true)
    }

    pub(super) fn sensor_delay(&self, valve: &mut Valve) -> Applied {
        valve.delay_s = self.amount * self.between(0, 1.5e-3, 4e-3);
        applied(json!({ "delay_s": valve.delay_s }), true)
    }

    pub(super) fn encoder_eccentricity(&self, valve: &mut Valve) -> Applied {
        valve.eccentricity = (self.amount * self.between(0, 3e-4, 2e-3), TAU * self.draws[1]);
        let (amplitude, phase) = valve.eccentricity;
        applied(json!({ "amplitude_rad": amplitude, "phase_rad": phase }), true)
    }
}
