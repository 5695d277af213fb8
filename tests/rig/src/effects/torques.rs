//! Torques beside friction, and the coupling.

use super::{Applied, Instance, applied, series};
use crate::spool::Valve;
use serde_json::json;

impl Instance {
    pub(super) fn flow_torque(&self, valve: &mut Valve) -> Applied {
        let n = valve.contact.nominal;
        let wave = self.wave(self.between(0, 0.01, 0.02) * n.coulomb_nm);
        let parameters = series(&wave);
        valve.flow = Some(wave);
        applied(parameters, !self.own_form)
    }

    pub(super) fn position_torque(&self, valve: &mut Valve) -> Applied {
        let n = valve.contact.nominal;
        let wave = self.wave(self.between(0, 0.05, 0.12) * n.coulomb_nm);
        let parameters = series(&wave);
        valve.position = Some(wave);
        applied(parameters, !self.own_form)
    }

    pub(super) fn pressure_torque(&self, valve: &mut Valve) -> Applied {
        let n = valve.contact.nominal;
        valve.pressure_nm_per_mpa = self.sign * self.amount * self.between(0, 0.01, 0.03) * n.coulomb_nm;
        applied(json!({ "gain": valve.pressure_nm_per_mpa }), true)
    }

    pub(super) fn coupling_compliance(&self, valve: &mut Valve) -> Applied {
        let n = valve.contact.nominal;
        let stiffness = n.stiffness_nm_per_rad * self.between(0, 1.5, 3.0) / self.amount.max(1e-9);
        // Enough that the falling friction curve doesn't make the spool squeal.
        let damping = self.between(1, 1.5, 3.0) * n.drive_of_a_squeal();
        valve.coupling = (self.amount > 0.0).then_some((stiffness, damping));
        let parameters = json!({ "stiffness_nm_per_rad": stiffness, "damping_nm_s_per_rad": damping });
        applied(parameters, true)
    }
}
