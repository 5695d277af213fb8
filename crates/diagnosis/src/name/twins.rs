//! Twins: effects that act alike in the prediction, and the data that tell them apart.

use crate::log::facts::Facts;
use crate::log::kind::LogKind;
use std::f64::consts::TAU;
use valve_model::{EffectId, SeenIn};

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
/// Angles that span less than this part of a turn show no more of a torque over the angle than a constant: one of order 1 changes by at most a
/// fifth of its amplitude about their middle.
const WIDE_RAD: f64 = TAU / 16.0;
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
    WideAngle,
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
            Self::WideAngle => facts.angle_rad.1 - facts.angle_rad.0 >= WIDE_RAD,
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
            Self::WideAngle => "the motion stays within a sixteenth of a turn",
            Self::TemperatureOutOfOrder => "the oil temperature rises or falls with the distance travelled",
        }
    }
}

/// Groups of effects that act alike, in the order in which missing data are reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Twins {
    /// Over the angle, in what the encoder reads: its own error, or torques.
    OverTheAngle,
    /// What makes the spool late.
    Lateness,
    /// What keeps the spool from following small motions.
    SmallMotion,
    /// What sets how far the rotor is off the command.
    Deflection,
    /// What leaves the spool behind on both sides.
    Play,
    /// A torque that is there in one direction.
    OneWay,
    /// A torque that pressure gives: in one direction, or as friction.
    PressureOneWay,
    /// A torque over the angle: in one direction, or as friction.
    AngleOneWay,
    /// A torque that doesn't depend on speed.
    Constant,
    /// A spring behind the load.
    Spring,
    /// A torque over the angle: with pressure or without.
    TorqueOverAngle,
    /// A constant torque: with pressure or without.
    PressureOrZero,
    /// A difference between directions: with pressure or without.
    PressureOrDirection,
    /// A level of friction: with pressure or without.
    PressureOrLevel,
    /// Stiction that grows in rest: with pressure or without.
    GrowsInRest,
    /// Friction that changes through the log: by wear or warmth.
    WearOrWarmth,
    /// Friction that changes through the log: by wear or pressure.
    WearOrPressure,
    /// A torque that follows the acceleration.
    WithAcceleration,
    /// A viscous level: with temperature or without.
    WarmthOrViscosity,
    /// A torque that pressure gives: over the angle or not.
    PressureOverAngle,
    /// A torque: over the angle or constant.
    ConstantOverAngle,
    /// A level of friction: over the angle or not.
    LevelOverAngle,
}

impl Twins {
    /// In order.
    const ALL: [Self; 22] = [
        Self::OverTheAngle,
        Self::Lateness,
        Self::SmallMotion,
        Self::Deflection,
        Self::Play,
        Self::OneWay,
        Self::PressureOneWay,
        Self::AngleOneWay,
        Self::Constant,
        Self::Spring,
        Self::TorqueOverAngle,
        Self::PressureOrZero,
        Self::PressureOrDirection,
        Self::PressureOrLevel,
        Self::GrowsInRest,
        Self::WearOrWarmth,
        Self::WearOrPressure,
        Self::WithAcceleration,
        Self::WarmthOrViscosity,
        Self::PressureOverAngle,
        Self::ConstantOverAngle,
        Self::LevelOverAngle,
    ];

    /// Data any of which tells them apart; the first is what a report asks for.
    fn told_apart_by(self) -> &'static [Apart] {
        match self {
            Self::OverTheAngle => &[Apart::Turns],
            Self::Lateness | Self::Deflection => &[Apart::NearResonance],
            Self::SmallMotion | Self::Play | Self::Constant => &[Apart::Presliding],
            Self::OneWay | Self::PressureOneWay | Self::AngleOneWay => &[Apart::BothWays],
            Self::Spring => &[Apart::Ringing],
            Self::TorqueOverAngle | Self::PressureOrZero | Self::PressureOrLevel | Self::GrowsInRest => {
                &[Apart::TwoPressures]
            }
            Self::PressureOrDirection => &[Apart::TwoPressures, Apart::Presliding],
            Self::WearOrWarmth => &[Apart::TemperatureOutOfOrder],
            Self::WearOrPressure => &[Apart::PressureOutOfOrder],
            Self::WithAcceleration => &[Apart::ThreeFrequencies],
            Self::WarmthOrViscosity => &[Apart::TwoTemperatures],
            Self::PressureOverAngle | Self::ConstantOverAngle | Self::LevelOverAngle => &[Apart::WideAngle],
        }
    }

    /// The logs in which they act alike.
    fn in_logs(self) -> SeenIn {
        match self {
            Self::OverTheAngle | Self::Lateness | Self::SmallMotion | Self::Deflection | Self::Play => {
                SeenIn::AngleLogs
            }
            Self::OneWay
            | Self::PressureOneWay
            | Self::AngleOneWay
            | Self::Constant
            | Self::Spring
            | Self::PressureOrZero
            | Self::PressureOrDirection
            | Self::WithAcceleration
            | Self::WarmthOrViscosity
            | Self::PressureOverAngle
            | Self::ConstantOverAngle
            | Self::LevelOverAngle => SeenIn::TorqueLogs,
            Self::TorqueOverAngle
            | Self::PressureOrLevel
            | Self::GrowsInRest
            | Self::WearOrWarmth
            | Self::WearOrPressure => SeenIn::AnyLog,
        }
    }
}

/// The groups that an effect belongs to.
fn of(id: EffectId) -> &'static [Twins] {
    use Twins::*;
    match id {
        EffectId::CoulombLevel => &[OneWay, PressureOrLevel, SmallMotion, Deflection, LevelOverAngle],
        EffectId::DirectionAsymmetry => &[OneWay, Constant, PressureOrDirection],
        EffectId::TorqueOffset => &[OneWay, Constant, PressureOrZero, ConstantOverAngle],
        EffectId::CouplingCompliance | EffectId::BristleStiffness => &[Spring],
        EffectId::FlowTorque => &[TorqueOverAngle, OverTheAngle, PressureOverAngle],
        EffectId::PositionTorque => &[TorqueOverAngle, OverTheAngle, AngleOneWay, ConstantOverAngle],
        EffectId::AngleDependentFriction => &[AngleOneWay, LevelOverAngle],
        EffectId::EncoderEccentricity => &[OverTheAngle],
        EffectId::PressureTorque => &[PressureOrZero, PressureOrDirection, PressureOneWay, PressureOverAngle],
        EffectId::PressureDependentFriction => &[PressureOrLevel, WearOrPressure, PressureOneWay],
        EffectId::DwellStiction | EffectId::HydraulicLock => &[GrowsInRest],
        EffectId::WearDrift => &[WearOrWarmth, WearOrPressure],
        EffectId::TemperatureDependentFriction => &[WearOrWarmth],
        EffectId::LoadInertia | EffectId::FrictionLag => &[WithAcceleration],
        EffectId::SensorDelay => &[WithAcceleration, Lateness],
        EffectId::TemperatureDependentViscosity => &[WarmthOrViscosity],
        EffectId::ViscousLevel => &[WarmthOrViscosity, Lateness],
        EffectId::Backlash => &[SmallMotion, Play],
        EffectId::HoldingTorqueLevel => &[Deflection, Play],
        EffectId::StaticLevel
        | EffectId::StribeckVelocity
        | EffectId::BristleDamping
        | EffectId::RotorInertia
        | EffectId::MotorDamping
        | EffectId::PreslidingHysteresis
        | EffectId::DetentTorque
        | EffectId::MicrostepError
        | EffectId::MissedSteps
        | EffectId::TorqueGain
        | EffectId::Custom(_) => &[],
    }
}

/// The groups in which two effects are twins in logs of this kind.
fn shared(a: EffectId, b: EffectId, kind: LogKind) -> impl Iterator<Item = Twins> {
    let both = move |twins: &Twins| a != b && of(a).contains(twins) && of(b).contains(twins);
    Twins::ALL.into_iter().filter(move |twins| twins.in_logs() != kind.unseen && both(twins))
}

/// True if two effects are twins in logs of this kind.
pub(crate) fn are_twins(a: EffectId, b: EffectId, kind: LogKind) -> bool {
    shared(a, b, kind).next().is_some()
}

/// What these data lack to tell two twins apart; `None` if they are no twins, or the data suffice.
pub(crate) fn missing(a: EffectId, b: EffectId, facts: &Facts) -> Option<&'static str> {
    let is_in = |apart: &Apart| apart.is_in(facts);
    let lacking =
        shared(a, b, facts.kind).map(Twins::told_apart_by).find(|apart| !apart.iter().any(is_in))?;
    lacking.first().map(|apart| apart.missing())
}
