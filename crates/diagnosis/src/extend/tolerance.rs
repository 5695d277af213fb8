//! Corrections of the model's own parameters within their tolerance.

use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::Correction;
use crate::log::facts::Facts;
use valve_model::EffectId;

/// The parameters, each as the effect whose factor or offset is the correction.
const NUMBERS: [EffectId; 9] = [
    EffectId::CoulombLevel,
    EffectId::StaticLevel,
    EffectId::ViscousLevel,
    EffectId::StribeckVelocity,
    EffectId::BristleStiffness,
    EffectId::LoadInertia,
    EffectId::HoldingTorqueLevel,
    EffectId::TorqueGain,
    EffectId::TorqueOffset,
];

/// Corrections of all numbers that these data could show, none made yet; `tolerance` is the standard deviation of a number in
/// parts of it, of the torque's zero in parts of T_c.
pub(crate) fn corrections(facts: &Facts, able: &[Candidate], tolerance: f64) -> Vec<Correction> {
    let shown = NUMBERS.iter().filter(|id| able.iter().any(|candidate| candidate.id == **id));
    let correction = |id: &EffectId| {
        let (key, neutral, unit) = match id {
            EffectId::TorqueOffset => ("offset_nm", 0.0, facts.coulomb_nm),
            _ => ("factor", 1.0, 1.0),
        };
        Correction { id: *id, key, neutral, value: neutral, deviation: tolerance * unit, free: true }
    };
    if tolerance > 0.0 { shown.map(correction).collect() } else { Vec::new() }
}
