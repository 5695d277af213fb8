//! The one table of effects: parameters, units, ranges, what leaves the model unchanged, and what data an effect needs.

mod cells;
mod factors;
mod friction;
mod measurement;
mod torques;

use super::custom::CUSTOM;
use super::id::EffectId;
use super::spec::{EffectSpec, SeenIn};

pub(crate) use cells::MAX_TERMS;

impl EffectId {
    /// The effect's row in the table of effects. Who adds an effect adds its row too, or this doesn't compile.
    pub const fn spec(self) -> &'static EffectSpec {
        match self {
            Self::CoulombLevel => &factors::COULOMB_LEVEL,
            Self::StaticLevel => &factors::STATIC_LEVEL,
            Self::ViscousLevel => &factors::VISCOUS_LEVEL,
            Self::StribeckVelocity => &factors::STRIBECK_VELOCITY,
            Self::BristleStiffness => &factors::BRISTLE_STIFFNESS,
            Self::BristleDamping => &factors::BRISTLE_DAMPING,
            Self::LoadInertia => &factors::LOAD_INERTIA,
            Self::HoldingTorqueLevel => &factors::HOLDING_TORQUE_LEVEL,
            Self::RotorInertia => &factors::ROTOR_INERTIA,
            Self::MotorDamping => &factors::MOTOR_DAMPING,
            Self::PressureDependentFriction => &friction::PRESSURE_DEPENDENT_FRICTION,
            Self::TemperatureDependentViscosity => &friction::TEMPERATURE_DEPENDENT_VISCOSITY,
            Self::TemperatureDependentFriction => &friction::TEMPERATURE_DEPENDENT_FRICTION,
            Self::AngleDependentFriction => &friction::ANGLE_DEPENDENT_FRICTION,
            Self::DirectionAsymmetry => &friction::DIRECTION_ASYMMETRY,
            Self::DwellStiction => &friction::DWELL_STICTION,
            Self::HydraulicLock => &friction::HYDRAULIC_LOCK,
            Self::FrictionLag => &friction::FRICTION_LAG,
            Self::PreslidingHysteresis => &friction::PRESLIDING_HYSTERESIS,
            Self::WearDrift => &friction::WEAR_DRIFT,
            Self::FlowTorque => &torques::FLOW_TORQUE,
            Self::PressureTorque => &torques::PRESSURE_TORQUE,
            Self::PositionTorque => &torques::POSITION_TORQUE,
            Self::CouplingCompliance => &torques::COUPLING_COMPLIANCE,
            Self::DetentTorque => &torques::DETENT_TORQUE,
            Self::MicrostepError => &torques::MICROSTEP_ERROR,
            Self::Backlash => &measurement::BACKLASH,
            Self::MissedSteps => &measurement::MISSED_STEPS,
            Self::TorqueOffset => &measurement::TORQUE_OFFSET,
            Self::TorqueGain => &measurement::TORQUE_GAIN,
            Self::SensorDelay => &measurement::SENSOR_DELAY,
            Self::EncoderEccentricity => &measurement::ENCODER_ECCENTRICITY,
            Self::Custom(_) => &CUSTOM,
        }
    }

    /// Whether a diagnosis takes it as uncertain and never names it as a cause.
    pub fn is_never_a_cause(self) -> bool {
        matches!(self, Self::BristleDamping | Self::RotorInertia | Self::MotorDamping)
    }

    /// Whether it is in what the torque transducer reads, which is no part of the machine.
    pub fn is_of_transducer(self) -> bool {
        self.spec().seen_in == SeenIn::TorqueLogs
    }
}
