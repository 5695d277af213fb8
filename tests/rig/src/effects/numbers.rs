//! Numbers of the model that are off.

use super::{Applied, Instance, applied};
use crate::nominal::Nominal;
use serde_json::json;

/// The smallest and the largest change that is drawn for a level, as a part of it.
const LEVEL: (f64, f64) = (0.1, 0.3);

impl Instance {
    /// A number off by a change that is drawn between two parts of it.
    pub(super) fn number(&self, range: (f64, f64), number: &mut f64) -> Applied {
        let factor = self.drawn_factor(range);
        *number *= factor;
        off_by(factor)
    }

    pub(super) fn coulomb_level(&self, n: &mut Nominal) -> Applied {
        let factor = self.drawn_factor(LEVEL);
        n.coulomb_nm *= factor;
        n.static_nm *= factor;
        off_by(factor)
    }

    pub(super) fn static_level(&self, n: &mut Nominal) -> Applied {
        let factor = self.drawn_factor(LEVEL).max(1.05 * n.coulomb_nm / n.static_nm);
        n.static_nm *= factor;
        off_by(factor)
    }

    pub(super) fn holding_torque_level(&self, n: &mut Nominal) -> Applied {
        self.number(LEVEL, &mut n.holding_nm)
    }

    fn drawn_factor(&self, (low, high): (f64, f64)) -> f64 {
        self.factor(self.between(0, low, high))
    }
}

fn off_by(factor: f64) -> Applied {
    applied(json!({ "factor": factor }), true)
}
