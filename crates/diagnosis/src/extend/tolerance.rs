//! Corrections of the model's own parameters within their tolerance.

use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::Correction;
use crate::log::facts::Facts;
use std::f64::consts::SQRT_2;
use valve_model::EffectId;

/// The parameters, each as the effect whose factor is the correction; the transducer's zero is an offset.
const FACTORS: [EffectId; 11] = [
    EffectId::CoulombLevel,
    EffectId::StaticLevel,
    EffectId::ViscousLevel,
    EffectId::StribeckVelocity,
    EffectId::BristleStiffness,
    EffectId::BristleDamping,
    EffectId::LoadInertia,
    EffectId::HoldingTorqueLevel,
    EffectId::RotorInertia,
    EffectId::MotorDamping,
    EffectId::TorqueGain,
];

/// Whether no fit moves it.
pub(crate) fn is_held(id: EffectId) -> bool {
    id == EffectId::TorqueGain || id.is_never_a_cause()
}

/// The standard deviation of a factor. That of the static friction stands beside the one on both levels, T_s over T_c: where either is off by
/// its own tolerance, this is off by both.
fn tolerance_of(id: EffectId, tolerance: f64) -> f64 {
    if id == EffectId::StaticLevel { SQRT_2 * tolerance } else { tolerance }
}

/// Corrections, all neutral, of the parameters that these data could show. `tolerance` is the standard deviation relative to
/// the parameter, of the torque's zero relative to T_c.
///
/// The torque's scale and the bristles' damping are held. All levels together with the damping predict what the scale does, so
/// that the data can't tell it from them. Free, either would follow whatever the model lacks at reversals. They are uncertain
/// all the same, and count so in intervals. So are the rotor's inertia and the motor's damping in an angle log: were they exact,
/// they would be all that tells the holding torque from all levels together.
pub(crate) fn corrections(facts: &Facts, able: &[Candidate], tolerance: f64) -> Vec<Correction> {
    if tolerance <= 0.0 {
        return Vec::new();
    }
    let correction = |id: EffectId, key, neutral: f64, deviation| Correction {
        id,
        key,
        neutral,
        value: neutral,
        deviation,
        free: !is_held(id),
        // A step is as long for all of them.
        finer: tolerance / tolerance_of(id, tolerance),
    };
    let factors = FACTORS.map(|id| correction(id, "factor", 1.0, tolerance_of(id, tolerance)));
    let zero = correction(EffectId::TorqueOffset, "offset_nm", 0.0, tolerance * facts.coulomb_nm);
    let shown = |of: &Correction| match of.id {
        EffectId::BristleDamping => facts.bristles_damp,
        EffectId::RotorInertia => facts.rotor().is_some(),
        EffectId::MotorDamping => facts.rotor().is_some() && facts.motor_damps,
        id => able.iter().any(|candidate| candidate.id == id),
    };
    factors.into_iter().chain([zero]).filter(shown).collect()
}
