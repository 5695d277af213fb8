//! The rig hides effects by the names that the product gives them, from a table of its own.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use hidden_effect_rig::{LogKind, effects_of};
use std::collections::BTreeSet;
use valve_model::{EffectId, SeenIn};

/// Every cause of the product is one that the rig can hide, in the logs that can show it, and the other way round.
#[test]
fn the_rig_hides_what_the_product_names() {
    for (log, unseen) in [(LogKind::Torque, SeenIn::AngleLogs), (LogKind::Angle, SeenIn::TorqueLogs)] {
        let hidden: BTreeSet<&str> = effects_of(log).into_iter().collect();
        let causes = EffectId::ALL.iter().filter(|id| !id.is_never_a_cause());
        let seen = causes.filter(|id| id.spec().seen_in != unseen);
        assert_eq!(hidden, seen.map(|id| id.name()).collect(), "{log:?} logs");
    }
}

#[test]
fn a_name_leads_to_its_effect() {
    for id in EffectId::ALL {
        assert_eq!(EffectId::from_name(id.name()), Some(*id));
        assert_eq!(serde_json::to_value(id).unwrap(), id.name());
        assert_eq!(id.spec().id, *id);
    }
    assert_eq!(EffectId::from_name("outside-gear"), None);
}
