//! Facts of a campaign: the model's magnitudes, which set finite-difference steps, and the ranges of the data, which decide
//! what can be tested.

use crate::log::kind::LogKind;
use valve_model::{Covariate, FrictionParams, Model};

/// Magnitudes of the model and ranges of the data.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Facts {
    pub kind: LogKind,
    pub coulomb_nm: f64,
    pub static_nm: Option<f64>,
    pub stiffness: Option<f64>,
    /// Whether the law has a bristle damping σ1.
    pub bristles_damp: bool,
    /// Whether the motor has a damping of its own.
    pub motor_damps: bool,
    pub stribeck: bool,
    pub lugre: bool,
    pub viscous: f64,
    pub load_inertia: Option<f64>,
    /// Damping below which a spool behind a spring squeals at the worst speed, N·m·s/rad.
    pub squeal: f64,
    /// Holding torque, N·m, and rotor teeth.
    pub motor: Option<(f64, f64)>,
    pub fastest_rad_per_s: f64,
    pub travel_rad: f64,
    /// Least and greatest |p| over the log, MPa; `None` without the channel in every run.
    pub pressure_mpa: Option<(f64, f64)>,
    /// Least and greatest temperature, °C.
    pub temperature_c: Option<(f64, f64)>,
    pub reference_temperature_c: f64,
    /// Least and greatest angle, rad.
    pub angle_rad: (f64, f64),
    /// The usual time between samples.
    pub step_s: f64,
    /// The encoder's step, rad; 0 where the angles show none.
    pub encoder_step_rad: f64,
    /// The longest rest, s.
    pub longest_rest_s: f64,
    pub rotor_inertia: f64,
    pub excitation: Excitation,
}

/// What the motion excites.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Excitation {
    /// Swings between reversals that stay in the presliding range.
    pub small_swings: usize,
    /// True if it moves both ways, the rarer way for at least a twentieth of the moving samples.
    pub both_ways: bool,
    /// Reversals in all, those of larger swings included.
    pub turns: usize,
    /// The signal-to-noise ratio of the torque that a spring as stiff as the bristles would add to the inertia's.
    pub ringing: f64,
    /// Frequencies at which inertia shows, in torque logs.
    pub frequencies: usize,
    /// Samples whose command moves near the motor's resonance with an amplitude above noise, in angle logs.
    pub near_resonance: usize,
    /// Correlation of the distance travelled with pressure and with temperature from run to run.
    pub drift_with_pressure: f64,
    pub drift_with_temperature: f64,
}

impl Facts {
    /// The facts that follow from the model; those of the data are still empty.
    pub fn of_model(model: &Model, kind: LogKind) -> Self {
        let (coulomb_nm, static_nm, stiffness, viscous) = match &model.friction {
            FrictionParams::Stribeck(p) => {
                (p.coulomb_torque_nm, Some(p.static_torque_nm), None, p.viscous_nm_s_per_rad)
            }
            FrictionParams::Dahl(p) => {
                (p.coulomb_torque_nm, None, Some(p.bristle_stiffness_nm_per_rad), p.viscous_nm_s_per_rad)
            }
            FrictionParams::LuGre(p) => (
                p.coulomb_torque_nm,
                Some(p.static_torque_nm),
                Some(p.bristle_stiffness_nm_per_rad),
                p.viscous_nm_s_per_rad,
            ),
            FrictionParams::Leuven(p) => (
                p.coulomb_torque_nm,
                Some(p.static_torque_nm),
                Some(p.bristle_stiffness_nm_per_rad),
                p.viscous_nm_s_per_rad,
            ),
        };
        Self {
            kind,
            coulomb_nm,
            static_nm,
            stiffness,
            bristles_damp: bristles_damp(&model.friction),
            motor_damps: model.motor.is_some_and(|motor| motor.damping_nm_s_per_rad > 0.0),
            stribeck: static_nm.is_some(),
            lugre: matches!(model.friction, FrictionParams::LuGre(_)),
            viscous,
            squeal: drive_of_a_squeal(&model.friction),
            load_inertia: model.load.map(|load| load.inertia_kg_m2),
            motor: model.motor.map(|motor| (motor.holding_torque_nm, f64::from(motor.rotor_teeth))),
            fastest_rad_per_s: 0.0,
            travel_rad: 0.0,
            pressure_mpa: None,
            temperature_c: None,
            reference_temperature_c: model.reference_temperature_c(),
            angle_rad: (f64::INFINITY, f64::NEG_INFINITY),
            step_s: 1e-3,
            encoder_step_rad: 0.0,
            longest_rest_s: 0.0,
            rotor_inertia: model.motor.map_or(0.0, |motor| motor.rotor_inertia_kg_m2),
            excitation: Excitation::default(),
        }
    }

    /// Whether the pressure varies enough for its effects to be told apart from others.
    pub fn pressure_varies(&self) -> bool {
        self.pressure_mpa.is_some_and(|(least, most)| most - least > 0.1 * most && most - least > 0.02)
    }

    pub fn temperature_varies(&self) -> bool {
        self.temperature_c.is_some_and(|(least, most)| most - least > 3.0)
    }

    /// Whether a quantity varies enough for that; anything but the conditions does.
    pub fn varies(&self, of: Covariate) -> bool {
        match of {
            Covariate::PressureDrop => self.pressure_varies(),
            Covariate::OilTemperature => self.temperature_varies(),
            Covariate::Angle
            | Covariate::Speed
            | Covariate::Acceleration
            | Covariate::Time
            | Covariate::TimeAtRest
            | Covariate::Distance => true,
        }
    }

    /// Holding torque and teeth of the motor in an angle log, in which the rotor's position on its teeth is predicted.
    pub fn rotor(&self) -> Option<(f64, f64)> {
        self.motor.filter(|_| !self.kind.motion_is_measured)
    }

    pub fn greatest_pressure_mpa(&self) -> f64 {
        self.pressure_mpa.map_or(0.0, |(_, most)| most)
    }
}

fn bristles_damp(friction: &FrictionParams) -> bool {
    match friction {
        FrictionParams::LuGre(p) => p.bristle_damping_nm_s_per_rad > 0.0,
        FrictionParams::Leuven(p) => p.bristle_damping_nm_s_per_rad > 0.0,
        FrictionParams::Dahl(_) | FrictionParams::Stribeck(_) => false,
    }
}

/// The largest negative damping of LuGre's law on the falling Stribeck curve, N·m·s/rad: −σ1·ω·g'(ω)/g(ω) near the Stribeck
/// velocity. 0 for the other laws.
fn drive_of_a_squeal(friction: &FrictionParams) -> f64 {
    let FrictionParams::LuGre(p) = friction else { return 0.0 };
    let fall_nm = (p.static_torque_nm - p.coulomb_torque_nm) * (-1.0f64).exp();
    p.bristle_damping_nm_s_per_rad * p.stribeck_exponent * fall_nm / (p.coulomb_torque_nm + fall_nm)
}
