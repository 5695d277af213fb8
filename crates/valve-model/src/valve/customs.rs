//! A model's formulas and tables, ready to run: torques on the spool, and factors of friction's levels and of σ2.
//!
//! Each is asked at a [`Moment`]: angle, speed, acceleration and time as they change within a cycle, the rest as it is held
//! there. A value that is not finite counts as zero, and one beyond [`MOST`] is held there, so that the equations of motion stay sound
//! whatever a user writes.

use expression::Dual;
use serde::{Deserialize, Serialize};

use crate::effect::Prepared;
use crate::friction::{Contact, Levels};
use crate::{ActsOn, Covariate, Effect, Model, ParamError};

/// The levels are never scaled below this: a law needs some friction.
const LEAST_LEVEL: f64 = 1e-3;

/// No torque (N·m) and no factor is taken for more, either way: what is made of it has to stay a number.
const MOST: f64 = 1e9;

/// All covariates at one instant, by their places.
pub(crate) type Moment = [f64; Covariate::COUNT];
/// A value and its derivatives by angle, speed, acceleration and time.
pub(crate) type Sloped = Dual<{ Covariate::MOVING }>;

/// What is held while a motion goes on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Held {
    pub pressure_drop_pa: f64,
    pub oil_temperature_c: f64,
    pub rest_s: f64,
    pub distance_rad: f64,
    /// The clock at the beginning.
    pub clock_s: f64,
}

impl Held {
    pub fn new(pressure_drop_pa: f64, oil_temperature_c: f64, contact: &Contact) -> Self {
        let Contact { rest_s, distance_rad, clock_s, .. } = *contact;
        Self { pressure_drop_pa, oil_temperature_c, rest_s, distance_rad, clock_s }
    }

    /// With what moves, `time_s` after the beginning.
    #[inline]
    pub fn at(&self, angle: f64, speed: f64, acceleration: f64, time_s: f64) -> Moment {
        let clock_s = self.clock_s + time_s;
        let held = [self.pressure_drop_pa, self.oil_temperature_c, self.rest_s, self.distance_rad];
        let [pressure_pa, temperature_c, rest_s, distance] = held;
        [angle, speed, acceleration, clock_s, pressure_pa, temperature_c, rest_s, distance]
    }
}

/// One formula or table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Custom {
    acts_on: ActsOn,
    rule: Prepared,
}

/// All of a model's; immutable, and without heap while they run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Customs {
    all: Vec<Custom>,
    loads: bool,
    scales: bool,
    accelerated: bool,
    remembers: bool,
}

impl Customs {
    /// Takes one of a validated model.
    pub fn take(&mut self, effect: &Effect) {
        let (Some(law), Some(Ok(rule))) = (effect.custom(), effect.prepared()) else { return };
        let acts_on = law.acts_on;
        self.loads |= acts_on == ActsOn::Torque;
        self.scales |= acts_on != ActsOn::Torque;
        self.accelerated |= acts_on == ActsOn::Torque && rule.uses(Covariate::Acceleration);
        self.remembers |= rule.uses(Covariate::TimeAtRest) || rule.uses(Covariate::Distance);
        self.all.push(Custom { acts_on, rule });
    }

    /// Whether there are any.
    pub fn is_there(&self) -> bool {
        !self.all.is_empty()
    }

    /// Whether one loads the spool.
    pub fn loads(&self) -> bool {
        self.loads
    }

    /// Whether one scales friction.
    pub fn scales(&self) -> bool {
        self.scales
    }

    /// Whether a torque depends on the acceleration that it takes part in.
    pub fn is_accelerated(&self) -> bool {
        self.accelerated
    }

    /// Whether one depends on the contact's past.
    pub fn remembers(&self) -> bool {
        self.remembers
    }

    /// Their torque against the motor, N·m.
    pub fn torque_nm(&self, at: &Moment) -> f64 {
        self.of(ActsOn::Torque).map(|custom| custom.value(at)).sum()
    }

    /// The torque with its derivatives.
    pub fn torque_sloped(&self, at: &Moment) -> Sloped {
        let mut sum = Sloped { value: 0.0, slopes: [0.0; Covariate::MOVING] };
        for custom in self.of(ActsOn::Torque) {
            let more = custom.sloped(at);
            sum.value += more.value;
            sum.slopes.iter_mut().zip(more.slopes).for_each(|(slope, more)| *slope += more);
        }
        sum
    }

    /// Levels with their factors.
    #[inline]
    pub fn scaled(&self, levels: Levels, at: &Moment) -> Levels {
        if !self.scales {
            return levels;
        }
        let factor = |acts_on: ActsOn, least: f64| -> f64 {
            self.of(acts_on).map(|custom| (1.0 + custom.value(at)).max(least)).product()
        };
        let level = factor(ActsOn::Level, LEAST_LEVEL);
        Levels {
            level: levels.level * level,
            level_per_rad: levels.level_per_rad * level,
            viscous: levels.viscous * factor(ActsOn::Viscous, 0.0),
            ..levels
        }
    }

    /// The derivatives of the logarithm of a factor of friction.
    pub fn steepness(&self, acts_on: ActsOn, at: &Moment) -> [f64; Covariate::MOVING] {
        let mut sum = [0.0; Covariate::MOVING];
        for custom in self.of(acts_on) {
            let Sloped { value, slopes } = custom.sloped(at);
            if 1.0 + value > LEAST_LEVEL {
                sum.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += slope / (1.0 + value));
            }
        }
        sum
    }

    fn of(&self, acts_on: ActsOn) -> impl Iterator<Item = &Custom> {
        self.all.iter().filter(move |custom| custom.acts_on == acts_on)
    }
}

impl Custom {
    fn value(&self, at: &Moment) -> f64 {
        bounded(self.rule.at(at))
    }

    fn sloped(&self, at: &Moment) -> Sloped {
        let found = match &self.rule {
            Prepared::Formula(program) => {
                let mut variables = [Sloped::variable(0.0, usize::MAX); Covariate::COUNT];
                for (place, (variable, value)) in variables.iter_mut().zip(at).enumerate() {
                    *variable = Sloped::variable(*value, place);
                }
                program.run(&variables)
            }
            Prepared::Table(grid) => {
                let (value, by) = grid.at(at);
                let mut slopes = [0.0; Covariate::MOVING];
                for (covariate, slope) in by.into_iter().flatten() {
                    slopes.iter_mut().skip(covariate.place()).take(1).for_each(|own| *own = slope);
                }
                Sloped { value, slopes }
            }
        };
        let value = bounded(found.value);
        let mut slopes = found.slopes;
        for slope in &mut slopes {
            // Where it is held it has no slope.
            *slope = if value == found.value { bounded(*slope) } else { 0.0 };
        }
        Sloped { value, slopes }
    }
}

fn bounded(value: f64) -> f64 {
    if value.is_finite() { value.clamp(-MOST, MOST) } else { 0.0 }
}

/// Refuses what a simulated valve can't know: friction that depends on the acceleration that it takes part in.
pub(super) fn check_for_a_valve(model: &Model) -> Result<(), ParamError> {
    let acts_on_friction =
        |effect: &&Effect| effect.custom().is_some_and(|law| law.acts_on != ActsOn::Torque);
    let mut refused = model.effects.iter().filter(acts_on_friction);
    match refused.find(|effect| effect.depends_on(Covariate::Acceleration)) {
        None => Ok(()),
        Some(effect) => {
            let expected =
                "a torque where a simulated valve's acceleration matters: friction takes part in it";
            Err(ParamError::new("acts_on", format!("friction of {}", effect.id()), expected))
        }
    }
}
