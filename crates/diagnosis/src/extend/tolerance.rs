//! Corrections of the model's own parameters within their tolerance.

use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::Correction;
use crate::log::facts::Facts;
use valve_model::EffectId;

/// The parameters, each as the effect whose factor is the correction; the transducer's zero is an offset.
const FACTORS: [EffectId; 8] = [
    EffectId::CoulombLevel,
    EffectId::StaticLevel,
    EffectId::ViscousLevel,
    EffectId::StribeckVelocity,
    EffectId::BristleStiffness,
    EffectId::LoadInertia,
    EffectId::HoldingTorqueLevel,
    EffectId::TorqueGain,
];

/// Corrections, all neutral, of the parameters that these data could show. `tolerance` is the standard deviation relative to
/// the parameter, of the torque's zero relative to T_c.
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
        free: true,
    };
    let factors = FACTORS.map(|id| correction(id, "factor", 1.0, tolerance));
    let zero = correction(EffectId::TorqueOffset, "offset_nm", 0.0, tolerance * facts.coulomb_nm);
    let shown = |of: &Correction| able.iter().any(|candidate| candidate.id == of.id);
    factors.into_iter().chain([zero]).filter(shown).collect()
}
