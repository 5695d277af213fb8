//! Why effects are untestable: what the log, its motion or the model lacks.

use crate::log::facts::Facts;
use valve_model::{Condition, EffectId};

/// Stiffness that stands in for the bristles' where friction has none, N·m/rad. The softest coupling that is tried has
/// `SOFTEST` times the bristles' compliance. If the load on it swings more than `MOST_SWINGS` times between two samples, the
/// log holds no information about the coupling, and its motion would take thousands of steps.
const USUAL_STIFFNESS: f64 = 1e3;
pub(crate) const SOFTEST: f64 = 0.3;
const MOST_SWINGS: f64 = 16.0;
/// A pressure drop below this counts as none, MPa.
pub(crate) const SOME_PRESSURE: f64 = 0.02;

/// An effect that these data can't show.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Untestable {
    pub id: EffectId,
    pub reason: String,
}

/// True if an effect is fitted only as a rival of its twins, because its channel is constant.
pub(crate) fn is_confounded(id: EffectId, facts: &Facts) -> bool {
    needs_pressure(id) && !facts.pressure_varies()
}

pub(crate) fn needs_pressure(id: EffectId) -> bool {
    id.spec().needs == Some(Condition::PressureDrop)
}

/// What these data, or the model, lack for an effect; `None` where it can be tested.
pub(crate) fn why_not(id: EffectId, facts: &Facts) -> Option<String> {
    if id.spec().seen_in == facts.kind.unseen {
        let reason = if facts.kind.residual_is_torque() {
            "shows in a log of command and angle only; here the torque is predicted from the angle"
        } else {
            "no torque channel"
        };
        return Some(reason.to_owned());
    }
    if needs_pressure(id) {
        match facts.pressure_mpa {
            None => return Some("no pressure_drop channel".to_owned()),
            Some((_, most)) if most <= SOME_PRESSURE => {
                return Some("pressure_drop is zero throughout".to_owned());
            }
            Some((_, most)) if !facts.pressure_varies() => {
                return Some(format!("pressure_drop is {most:.3} MPa throughout; two pressures are needed"));
            }
            _ => {}
        }
    }
    if id.spec().needs == Some(Condition::OilTemperature) {
        match facts.temperature_c {
            None => return Some("no oil_temperature channel".to_owned()),
            Some((least, most)) if !facts.temperature_varies() => {
                return Some(format!(
                    "oil_temperature stays between {least:.1} and {most:.1} °C; a span of more than 3 K is needed"
                ));
            }
            _ => {}
        }
    }
    why_not_by_model(id, facts)
}

fn why_not_by_model(id: EffectId, facts: &Facts) -> Option<String> {
    let lacks = |missing: bool, what: &str| missing.then(|| format!("the model has no {what}"));
    let stribeck = || lacks(!facts.stribeck, "Stribeck curve");
    let bristles = || lacks(facts.stiffness.is_none(), "bristles, so it has no presliding");
    let no_inertia = facts.load_inertia.is_none_or(|inertia| inertia == 0.0);
    match id {
        EffectId::StaticLevel | EffectId::DwellStiction => stribeck().or_else(bristles),
        EffectId::StribeckVelocity => stribeck(),
        EffectId::HydraulicLock | EffectId::BristleStiffness | EffectId::BristleDamping => bristles(),
        EffectId::PreslidingHysteresis => lacks(!facts.lugre, "LuGre law to put it into"),
        EffectId::ViscousLevel | EffectId::TemperatureDependentViscosity => {
            lacks(facts.viscous == 0.0, "viscous friction to scale")
        }
        EffectId::LoadInertia => lacks(no_inertia, "load inertia to scale"),
        EffectId::CouplingCompliance => {
            lacks(no_inertia, "load inertia behind a coupling").or_else(|| swings_unseen(facts))
        }
        EffectId::AngleDependentFriction | EffectId::PositionTorque | EffectId::FlowTorque => {
            let narrow = facts.angle_rad.1 - facts.angle_rad.0 < 0.1;
            narrow.then(|| "the angle spans less than 0.1 rad".to_owned())
        }
        EffectId::CoulombLevel
        | EffectId::RotorInertia
        | EffectId::MotorDamping
        | EffectId::HoldingTorqueLevel
        | EffectId::TorqueGain
        | EffectId::TorqueOffset
        | EffectId::PressureDependentFriction
        | EffectId::PressureTorque
        | EffectId::TemperatureDependentFriction
        | EffectId::DirectionAsymmetry
        | EffectId::FrictionLag
        | EffectId::WearDrift
        | EffectId::DetentTorque
        | EffectId::MicrostepError
        | EffectId::Backlash
        | EffectId::MissedSteps
        | EffectId::SensorDelay
        | EffectId::EncoderEccentricity
        | EffectId::Custom(_) => None,
    }
}

/// Why a coupling can't be seen at this sampling interval; `None` if it can.
fn swings_unseen(facts: &Facts) -> Option<String> {
    let swings = swings_between_samples(facts);
    (swings > MOST_SWINGS).then(|| {
        format!(
            "the log is sampled every {:.1} ms, in which the load on a coupling as soft as shows would swing {swings:.0} times",
            1e3 * facts.step_s
        )
    })
}

/// How often the load on the softest coupling that is tried would swing within a sampling interval; 0 if the angle is
/// predicted, from a command that is known between the samples.
fn swings_between_samples(facts: &Facts) -> f64 {
    let Some(inertia) = facts.load_inertia.filter(|_| facts.kind.motion_is_measured) else { return 0.0 };
    let softest = 1.0 / (SOFTEST * rigid_enough(facts));
    (softest / inertia).sqrt() * facts.step_s / std::f64::consts::TAU
}

/// The compliance of friction's own bristles, rad/(N·m); a usual one where there are none.
pub(crate) fn rigid_enough(facts: &Facts) -> f64 {
    1.0 / facts.stiffness.unwrap_or(USUAL_STIFFNESS)
}
