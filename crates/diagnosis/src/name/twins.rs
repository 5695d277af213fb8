//! Twins: effects that act alike in the prediction, and the data that tell them apart.

use crate::log::facts::Facts;
use crate::log::kind::LogKind;
use valve_model::EffectId;

/// Least number of presliding swings.
const SWINGS: usize = 12;
/// Least number of reversals.
const TURNS: usize = 4;
/// Least signal of a spring behind the inertia, in standard deviations.
const RINGING: f64 = 4.0;
/// Least number of frequencies at which inertia shows.
const FREQUENCIES: usize = 3;
/// Samples near the motor's resonance.
const NEAR_RESONANCE: usize = 200;
/// A channel whose correlation with the distance travelled reaches this can't be told from wear.
const TREND: f64 = 0.85;

/// Data that tell twins apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Apart {
    Presliding,
    Ringing,
    TwoPressures,
    TwoTemperatures,
    ThreeFrequencies,
    Turns,
    BothWays,
    NearResonance,
    PressureOutOfOrder,
    TemperatureOutOfOrder,
}

impl Apart {
    fn is_in(self, facts: &Facts) -> bool {
        let excited = &facts.excitation;
        match self {
            Self::Presliding => excited.small_swings >= SWINGS,
            Self::Ringing => excited.ringing >= RINGING,
            Self::TwoPressures => facts.pressure_varies(),
            Self::TwoTemperatures => facts.temperature_varies(),
            Self::ThreeFrequencies => excited.frequencies >= FREQUENCIES,
            Self::Turns => excited.turns >= TURNS,
            Self::BothWays => excited.both_ways,
            Self::NearResonance => excited.near_resonance >= NEAR_RESONANCE,
            Self::PressureOutOfOrder => excited.drift_with_pressure.abs() < TREND,
            Self::TemperatureOutOfOrder => excited.drift_with_temperature.abs() < TREND,
        }
    }

    /// What is missing, as a reason.
    fn missing(self) -> &'static str {
        match self {
            Self::Presliding => "nothing swings within the bristles' reach (presliding)",
            Self::Ringing => "nothing moves fast enough for the load's inertia to show beside the spring",
            Self::TwoPressures => "there is one pressure drop",
            Self::TwoTemperatures => "there is one oil temperature",
            Self::ThreeFrequencies => "inertia shows at fewer than three frequencies",
            Self::Turns => "the motion never turns back",
            Self::BothWays => "the motion goes one way only",
            Self::NearResonance => "nothing is accelerated near the motor's resonance",
            Self::PressureOutOfOrder => "the pressure rises or falls with the distance travelled",
            Self::TemperatureOutOfOrder => "the oil temperature rises or falls with the distance travelled",
        }
    }
}

/// Effects that act alike, and data any of which tells them apart.
type Twins = (&'static [EffectId], &'static [Apart]);

const TORQUE: [Twins; 12] = [
    (&[EffectId::CoulombLevel, EffectId::DirectionAsymmetry, EffectId::TorqueOffset], &[Apart::BothWays]),
    (&[EffectId::DirectionAsymmetry, EffectId::TorqueOffset], &[Apart::Presliding]),
    (&[EffectId::CouplingCompliance, EffectId::BristleStiffness], &[Apart::Ringing]),
    (&[EffectId::FlowTorque, EffectId::PositionTorque], &[Apart::TwoPressures]),
    (&[EffectId::PressureTorque, EffectId::TorqueOffset], &[Apart::TwoPressures]),
    (&[EffectId::PressureTorque, EffectId::DirectionAsymmetry], &[Apart::TwoPressures, Apart::Presliding]),
    (&[EffectId::PressureDependentFriction, EffectId::CoulombLevel], &[Apart::TwoPressures]),
    (&[EffectId::DwellStiction, EffectId::HydraulicLock], &[Apart::TwoPressures]),
    (&[EffectId::WearDrift, EffectId::TemperatureDependentFriction], &[Apart::TemperatureOutOfOrder]),
    (&[EffectId::WearDrift, EffectId::PressureDependentFriction], &[Apart::PressureOutOfOrder]),
    (&[EffectId::LoadInertia, EffectId::SensorDelay, EffectId::FrictionLag], &[Apart::ThreeFrequencies]),
    (&[EffectId::TemperatureDependentViscosity, EffectId::ViscousLevel], &[Apart::TwoTemperatures]),
];
const ANGLE: [Twins; 10] = [
    (&[EffectId::EncoderEccentricity, EffectId::PositionTorque, EffectId::FlowTorque], &[Apart::Turns]),
    (&[EffectId::ViscousLevel, EffectId::SensorDelay], &[Apart::NearResonance]),
    (&[EffectId::CoulombLevel, EffectId::Backlash], &[Apart::Presliding]),
    (&[EffectId::CoulombLevel, EffectId::HoldingTorqueLevel], &[Apart::NearResonance]),
    (&[EffectId::Backlash, EffectId::HoldingTorqueLevel], &[Apart::Presliding]),
    (&[EffectId::PressureDependentFriction, EffectId::CoulombLevel], &[Apart::TwoPressures]),
    (&[EffectId::FlowTorque, EffectId::PositionTorque], &[Apart::TwoPressures]),
    (&[EffectId::DwellStiction, EffectId::HydraulicLock], &[Apart::TwoPressures]),
    (&[EffectId::WearDrift, EffectId::TemperatureDependentFriction], &[Apart::TemperatureOutOfOrder]),
    (&[EffectId::WearDrift, EffectId::PressureDependentFriction], &[Apart::PressureOutOfOrder]),
];

/// True if two effects are twins in logs of this kind.
pub(crate) fn are_twins(a: EffectId, b: EffectId, kind: LogKind) -> bool {
    lists(kind).iter().any(|(ids, _)| a != b && ids.contains(&a) && ids.contains(&b))
}

/// What these data lack to tell two twins apart; `None` if they are no twins, or the data suffice.
pub(crate) fn missing(a: EffectId, b: EffectId, facts: &Facts) -> Option<&'static str> {
    let pairs = lists(facts.kind).iter();
    let mut own = pairs.filter(|(ids, _)| a != b && ids.contains(&a) && ids.contains(&b));
    let lacking = own.find(|(_, apart)| !apart.iter().any(|apart| apart.is_in(facts)))?;
    lacking.1.first().map(|apart| apart.missing())
}

fn lists(kind: LogKind) -> &'static [Twins] {
    if kind.motion_is_measured { &TORQUE } else { &ANGLE }
}
