//! What no list of causes has.

use super::{Applied, Instance, applied};
use crate::contact::Contact;
use crate::law::{ActsOn, Law};
use crate::nominal::Nominal;
use crate::spool::Valve;
use serde_json::json;
use std::f64::consts::TAU;

impl Instance {
    pub(super) fn outside_square_drag(&self, contact: &mut Contact) -> Applied {
        let n = contact.nominal;
        contact.square_drag = 2.0 * self.size(&n) / n.fastest_rad_per_s.powi(2);
        unlisted()
    }

    /// Of the torque, or of the angle where there is none.
    pub(super) fn outside_hum(&self, valve: &mut Valve) -> Applied {
        valve.hum = Some((self.size(&valve.contact.nominal), self.between(1, 11.0, 53.0)));
        unlisted()
    }

    pub(super) fn outside_gear(&self, valve: &mut Valve) -> Applied {
        valve.gear =
            Some((self.size(&valve.contact.nominal), self.between(1, 2.3, 2.7), TAU * self.draws[2]));
        unlisted()
    }

    pub(super) fn outside_wander(&self, contact: &mut Contact) -> Applied {
        let part = 0.7 * self.size(&contact.nominal) / contact.nominal.coulomb_nm;
        contact.wander = vec![
            (part, self.between(1, 0.35, 0.5), TAU * self.draws[2]),
            (part, self.between(3, 0.8, 1.1), TAU * self.draws[4]),
        ];
        unlisted()
    }

    pub(super) fn outside_play(&self, valve: &mut Valve) -> Applied {
        valve.transducer_play_nm = self.size(&valve.contact.nominal);
        unlisted()
    }

    /// A law of one of the groups of forms.
    pub(super) fn outside_law(&self, group: usize, contact: &mut Contact) -> Applied {
        let n = contact.nominal;
        let form = Law::choose(group, self.draws[5]);
        let unit = if form.0 == ActsOn::Torque { self.size(&n) } else { self.size(&n) / n.coulomb_nm };
        let law = Law::new(form, self.sign * unit, (n.fastest_rad_per_s, n.reference_c), &self.draws);
        let told = law.told();
        contact.law = Some(law);
        applied(told, false)
    }

    fn size(&self, n: &Nominal) -> f64 {
        self.amount * self.between(0, 0.05, 0.12) * n.coulomb_nm
    }
}

fn unlisted() -> Applied {
    applied(json!({}), false)
}
