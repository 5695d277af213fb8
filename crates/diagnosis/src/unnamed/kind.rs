//! The cause of the list that a law is like: it acts on the same by the same quantities, in another form.

use crate::unnamed::term::Term;
use valve_model::{ActsOn, Covariate, EffectId};

/// What such a law is in a valve, where the list has a cause that goes by these quantities. A listed form was tried and left more; that it is
/// another form is all that the law says beyond the cause.
pub(crate) fn kind(term: &Term) -> Option<EffectId> {
    let mut on: Vec<Covariate> = term.covariates().collect();
    on.sort_by_key(|of| of.name());
    on.dedup();
    match (term.acts_on, on.as_slice()) {
        (ActsOn::Torque, [Covariate::Angle]) => Some(EffectId::PositionTorque),
        (ActsOn::Torque, [Covariate::PressureDrop]) => Some(EffectId::PressureTorque),
        (ActsOn::Torque, [Covariate::Angle, Covariate::PressureDrop]) => Some(EffectId::FlowTorque),
        (ActsOn::Level, [Covariate::Angle]) => Some(EffectId::AngleDependentFriction),
        (ActsOn::Level, [Covariate::PressureDrop]) => Some(EffectId::PressureDependentFriction),
        (ActsOn::Level, [Covariate::OilTemperature]) => Some(EffectId::TemperatureDependentFriction),
        (ActsOn::Level, [Covariate::TimeAtRest]) => Some(EffectId::DwellStiction),
        (ActsOn::Level, [Covariate::Distance]) => Some(EffectId::WearDrift),
        (ActsOn::Viscous, [Covariate::OilTemperature]) => Some(EffectId::TemperatureDependentViscosity),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unnamed::factor::Factor;

    #[test]
    fn a_law_is_of_the_kind_of_a_cause_that_acts_alike() {
        use Covariate::{Angle, Distance, OilTemperature, PressureDrop, Speed, Time, TimeAtRest};
        let cases: [(ActsOn, &[Covariate], Option<EffectId>); 12] = [
            (ActsOn::Torque, &[Angle], Some(EffectId::PositionTorque)),
            (ActsOn::Torque, &[PressureDrop], Some(EffectId::PressureTorque)),
            (ActsOn::Torque, &[PressureDrop, Angle], Some(EffectId::FlowTorque)),
            (ActsOn::Level, &[Angle], Some(EffectId::AngleDependentFriction)),
            (ActsOn::Level, &[PressureDrop], Some(EffectId::PressureDependentFriction)),
            (ActsOn::Level, &[OilTemperature], Some(EffectId::TemperatureDependentFriction)),
            (ActsOn::Level, &[TimeAtRest], Some(EffectId::DwellStiction)),
            (ActsOn::Level, &[Distance], Some(EffectId::WearDrift)),
            (ActsOn::Viscous, &[OilTemperature], Some(EffectId::TemperatureDependentViscosity)),
            (ActsOn::Level, &[Speed], None),
            (ActsOn::Level, &[PressureDrop, Speed], None),
            (ActsOn::Torque, &[Time], None),
        ];
        for (acts_on, on, expected) in cases {
            let factor = |of: &Covariate| Factor {
                of: *of,
                texts: Vec::new(),
                unit: "",
                shape: None,
                listed: false,
                knots: Vec::new(),
            };
            let factors = on.iter().map(factor).collect();
            assert_eq!(kind(&Term { acts_on, factors }), expected, "{acts_on:?} {on:?}");
        }
    }
}
