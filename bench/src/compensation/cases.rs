//! What is measured: the shipped scenarios and generated ones, the right belief and wrong ones.

use config::{Scenario, ScheduledSetPoint, SetPoint};
use valve_model::{Effect, EffectId, EffectValue, FrictionParams, LuGreParams, Model, ParamError};

/// What is asked of compensation in a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Demand {
    /// A matched belief alone shall do: the sine, the step sequence, triangles above the stick-slip speed.
    BeliefAlone,
    /// Sliding is unstable here: the encoder is needed.
    BelowStickSlip,
    /// Nothing for a belief alone.
    Encoder,
}

/// A scenario under the name that tables give it, and what is asked of compensation in it.
#[derive(Debug, Clone)]
pub struct Case {
    /// Its name.
    pub name: String,
    /// The motion and everything but models and level.
    pub scenario: Scenario,
    /// The plant.
    pub truth: Model,
    /// What is asked.
    pub demand: Demand,
}

impl Case {
    /// Whether the motor can turn the valve at all at the speeds of the scenario.
    pub fn turns(&self) -> bool {
        let Some(motor) = self.truth.motor else { return false };
        let speed = self.scenario.limits.max_speed_rad_per_s;
        let sliding_nm = self.truth.friction.steady_torque(speed);
        let starting_nm = self.truth.friction.steady_torque(1e-9);
        sliding_nm.max(starting_nm) < motor.holding_torque_nm
    }
}

/// Length of the generated scenarios, s.
const DURATION_S: f64 = 5.0;

/// A case like `like`, to and fro at a constant speed; `stick_slip` is the speed below which sliding is unstable, rad/s.
pub fn triangle(like: &Case, speed_rad_per_s: f64, stick_slip: f64) -> Case {
    let half_rad = (speed_rad_per_s / 2.0).min(0.3);
    let mut case = like.clone();
    let scenario = &mut case.scenario;
    case.name = format!("triangle, {speed_rad_per_s:.3} rad/s");
    case.demand = if speed_rad_per_s > stick_slip { Demand::BeliefAlone } else { Demand::BelowStickSlip };
    scenario.duration_s = DURATION_S;
    scenario.limits.max_speed_rad_per_s = speed_rad_per_s;
    (scenario.limits.min_angle_rad, scenario.limits.max_angle_rad) = (Some(-1.0), Some(1.0));
    scenario.initial_angle_rad = 0.0;
    let side_s = 2.0 * half_rad / speed_rad_per_s;
    let mut time_s = 0.2;
    let mut angle_rad = half_rad;
    scenario.set_points.clear();
    while time_s < DURATION_S - 0.2 {
        scenario.set_points.push(ScheduledSetPoint {
            time_s,
            set_point: SetPoint::Angle { angle_rad },
            line: 0,
        });
        time_s += if scenario.set_points.len() == 1 { side_s / 2.0 } else { side_s };
        angle_rad = -angle_rad;
    }
    case
}

/// A case like `like`, on a sine.
pub fn sine(like: &Case, amplitude_rad: f64, frequency_hz: f64) -> Case {
    let mut case = like.clone();
    case.name = format!("sine, {amplitude_rad} rad at {frequency_hz} Hz");
    case.demand = Demand::Encoder;
    case.scenario.duration_s = DURATION_S;
    case.scenario.initial_angle_rad = 0.0;
    let set_point = SetPoint::Sine { amplitude_rad, frequency_hz };
    case.scenario.set_points = vec![ScheduledSetPoint { time_s: 0.2, set_point, line: 0 }];
    case
}

/// A case like `like` whose friction depends on the direction.
///
/// # Errors
/// An effect that is refused.
pub fn asymmetric(like: &Case) -> Result<Case, ParamError> {
    let mut case = like.clone();
    case.name = format!("{}, friction ±20 % by direction", like.name);
    case.demand = Demand::Encoder;
    let by_direction = [("level", EffectValue::Number(0.2))];
    case.truth.effects.push(Effect::new(EffectId::DirectionAsymmetry, &by_direction)?);
    Ok(case)
}

/// A belief's friction parameters over those of the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factors {
    /// Of T_c.
    pub coulomb: f64,
    /// Of T_s.
    pub static_level: f64,
    /// Of σ2.
    pub viscous: f64,
    /// Of σ0.
    pub stiffness: f64,
    /// Of ω_s.
    pub stribeck_velocity: f64,
}

/// Beliefs wrong by ±30 % in T_c, T_s and σ2, and by ±50 % in σ0 and ω_s: all corners that a law allows.
pub fn thirty_percent(truth: &Model) -> Vec<Model> {
    beliefs(truth, &Factors::corners([0.7, 1.3], [0.5, 1.5]))
}

/// Beliefs wrong by a factor of two in every parameter, up or down: all corners that a law allows.
pub fn factor_of_two(truth: &Model) -> Vec<Model> {
    beliefs(truth, &Factors::corners([0.5, 2.0], [0.5, 2.0]))
}

/// Beliefs wrong in the shaft: the inertia, or the holding torque, too high or too low by 30 %.
pub fn wrong_shaft(truth: &Model) -> Vec<Model> {
    let changed = |inertia: f64, holding: f64| {
        let mut belief = truth.clone();
        if let (Some(motor), Some(load)) = (&mut belief.motor, &mut belief.load) {
            motor.rotor_inertia_kg_m2 *= inertia;
            motor.holding_torque_nm *= holding;
            load.inertia_kg_m2 *= inertia;
        }
        belief
    };
    vec![changed(0.7, 1.0), changed(1.3, 1.0), changed(1.0, 0.7), changed(1.0, 1.3)]
}

fn beliefs(truth: &Model, corners: &[Factors]) -> Vec<Model> {
    corners.iter().filter_map(|factors| factors.of(truth)).collect()
}

impl Factors {
    /// The truth with its friction changed; `None` where T_s would fall below T_c, or the law is not LuGre.
    pub fn of(&self, truth: &Model) -> Option<Model> {
        let FrictionParams::LuGre(law) = truth.friction else { return None };
        let changed = LuGreParams {
            coulomb_torque_nm: law.coulomb_torque_nm * self.coulomb,
            static_torque_nm: law.static_torque_nm * self.static_level,
            viscous_nm_s_per_rad: law.viscous_nm_s_per_rad * self.viscous,
            bristle_stiffness_nm_per_rad: law.bristle_stiffness_nm_per_rad * self.stiffness,
            stribeck_velocity_rad_per_s: law.stribeck_velocity_rad_per_s * self.stribeck_velocity,
            ..law
        };
        changed.validate().ok()?;
        Some(Model { friction: FrictionParams::LuGre(changed), ..truth.clone() })
    }

    /// Every corner of the box whose sides are these pairs.
    fn corners(levels: [f64; 2], bristles: [f64; 2]) -> Vec<Self> {
        let mut corners = Vec::with_capacity(32);
        for bits in 0..32_u32 {
            let pick = |[low, high]: [f64; 2], bit: u32| if bits >> bit & 1 == 0 { low } else { high };
            corners.push(Self {
                coulomb: pick(levels, 0),
                static_level: pick(levels, 1),
                viscous: pick(levels, 2),
                stiffness: pick(bristles, 3),
                stribeck_velocity: pick(bristles, 4),
            });
        }
        corners
    }
}
