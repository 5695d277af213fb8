//! Numbers of the model that are off.

use super::{Applied, Instance, applied};
use crate::nominal::Nominal;
use serde_json::json;

impl Instance {
    pub(super) fn coulomb_level(&self, n: &mut Nominal) -> Applied {
        let factor = self.factor(self.between(0, 0.1, 0.3));
        n.coulomb_nm *= factor;
        n.static_nm *= factor;
        off_by(factor)
    }

    pub(super) fn static_level(&self, n: &mut Nominal) -> Applied {
        let factor = self.factor(self.between(0, 0.1, 0.3)).max(1.05 * n.coulomb_nm / n.static_nm);
        n.static_nm *= factor;
        off_by(factor)
    }

    pub(super) fn viscous_level(&self, n: &mut Nominal) -> Applied {
        let factor = self.factor(self.between(0, 0.3, 0.8));
        n.viscous_nm_s_per_rad *= factor;
        off_by(factor)
    }

    pub(super) fn stribeck_velocity(&self, n: &mut Nominal) -> Applied {
        let factor = self.factor(self.between(0, 0.5, 1.2));
        n.stribeck_rad_per_s *= factor;
        off_by(factor)
    }

    pub(super) fn bristle_stiffness(&self, n: &mut Nominal) -> Applied {
        let factor = self.factor(self.between(0, 0.3, 0.6));
        n.stiffness_nm_per_rad *= factor;
        off_by(factor)
    }

    pub(super) fn load_inertia(&self, n: &mut Nominal) -> Applied {
        let factor = self.factor(self.between(0, 0.3, 0.6));
        n.load_kg_m2 *= factor;
        off_by(factor)
    }

    pub(super) fn holding_torque_level(&self, n: &mut Nominal) -> Applied {
        let factor = self.factor(self.between(0, 0.1, 0.3));
        n.holding_nm *= factor;
        off_by(factor)
    }
}

fn off_by(factor: f64) -> Applied {
    applied(json!({ "factor": factor }), true)
}
