//! The covariates that a cause's torque is a function of. Residual structure over these means that its functional form is wrong; over
//! others, that there is a further cause.

use valve_model::EffectId;

/// The covariates of an effect, by the names that the tests of a residual use.
pub(crate) fn covariates(id: EffectId) -> &'static [&'static str] {
    match id {
        EffectId::CoulombLevel
        | EffectId::StaticLevel
        | EffectId::StribeckVelocity
        | EffectId::ViscousLevel
        | EffectId::DirectionAsymmetry => &["speed"],
        EffectId::BristleStiffness
        | EffectId::BristleDamping
        | EffectId::RotorInertia
        | EffectId::MotorDamping
        | EffectId::PreslidingHysteresis
        | EffectId::FrictionLag
        | EffectId::SensorDelay
        | EffectId::HoldingTorqueLevel
        | EffectId::Backlash
        | EffectId::TorqueGain => &["speed", "acceleration"],
        EffectId::LoadInertia | EffectId::CouplingCompliance => &["acceleration"],
        EffectId::TorqueOffset => &[],
        EffectId::PressureDependentFriction => &["pressure", "speed"],
        EffectId::PressureTorque => &["pressure"],
        EffectId::TemperatureDependentFriction | EffectId::TemperatureDependentViscosity => {
            &["temperature", "speed"]
        }
        EffectId::DwellStiction => &["time since rest"],
        EffectId::HydraulicLock => &["time since rest", "pressure"],
        EffectId::WearDrift => &["distance travelled"],
        EffectId::AngleDependentFriction
        | EffectId::PositionTorque
        | EffectId::DetentTorque
        | EffectId::MicrostepError
        | EffectId::EncoderEccentricity => &["angle"],
        EffectId::FlowTorque => &["angle", "pressure"],
        EffectId::MissedSteps => &["run"],
        // A user's law may depend on any of them.
        EffectId::Custom(_) => &[
            "speed",
            "acceleration",
            "angle",
            "pressure",
            "temperature",
            "time since rest",
            "distance travelled",
        ],
    }
}

/// Whether an effect is a function of this covariate; an order of the angle counts as the angle.
pub(crate) fn goes_by(id: EffectId, on: &str) -> bool {
    covariates(id).iter().any(|own| on == *own || *own == "angle" && on.starts_with("angle"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_of_the_angle_is_the_angle() {
        assert!(goes_by(EffectId::PositionTorque, "angle, order 3"));
        assert!(goes_by(EffectId::DirectionAsymmetry, "speed"));
        assert!(!goes_by(EffectId::DirectionAsymmetry, "acceleration"));
        assert!(!goes_by(EffectId::TorqueOffset, "speed"));
    }
}
