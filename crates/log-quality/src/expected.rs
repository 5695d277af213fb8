//! What the model expects where the friction has settled, and how far a record is from it, as it is or turned and scaled.
//!
//! The torque of a motion in sliding, T = T_steady(ω) + J·α, or the lag of a motor behind its command, asin(T/T_hold)/N_r. Only
//! samples count before which the contact has moved some break-away deflections one way: what bristles do is left out, so
//! that nothing has to be fitted.

use crate::windows::Window;
use valve_model::{FrictionLaw, Model, MotionParams, MotionSample, MotorParams};

/// Break-away deflections of travel after which friction has settled.
const SETTLED: f64 = 5.0;
/// A run's zero is taken out where it slides both ways for this part of the samples that count, each.
const BOTH_WAYS: f64 = 0.2;
/// Samples that count, at least.
const LEAST: f64 = 100.0;

/// How a record might have to be turned or scaled to be what it says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale {
    pub(crate) angle: f64,
    pub(crate) time: f64,
    pub(crate) measured: f64,
}

/// As it is.
pub(crate) const AS_IT_IS: Scale = Scale { angle: 1.0, time: 1.0, measured: 1.0 };

/// The model's steady side.
pub(crate) enum Expected<'a> {
    /// Of a torque log.
    Torque { law: FrictionLaw, inertia: f64 },
    /// Of an angle log.
    Lag { law: FrictionLaw, inertia: f64, motor: &'a MotorParams },
    /// Nothing but the direction of friction: for want of a model.
    Direction,
}

/// Sums over the samples that count of one run.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sums {
    count: f64,
    forward: f64,
    measured: f64,
    expected: f64,
    measured_2: f64,
    expected_2: f64,
    product: f64,
}

impl<'a> Expected<'a> {
    /// What a model has for logs with torque, or without.
    pub(crate) fn new(model: Option<&'a Model>, torque: bool) -> Option<Self> {
        let Some(model) = model else { return torque.then_some(Self::Direction) };
        let law = *MotionParams::new(model).ok()?.friction_law();
        let load = model.load.map_or(0.0, |load| load.inertia_kg_m2);
        match (&model.motor, torque) {
            (_, true) => Some(Self::Torque { law, inertia: load }),
            (Some(motor), false) => Some(Self::Lag { law, inertia: load + motor.rotor_inertia_kg_m2, motor }),
            (None, false) => None,
        }
    }

    fn deflection_rad(&self) -> f64 {
        match self {
            Self::Torque { law, .. } | Self::Lag { law, .. } => law.break_away_deflection_rad(),
            Self::Direction => 0.0,
        }
    }

    fn at(&self, speed: f64, acceleration: f64) -> f64 {
        match self {
            Self::Torque { law, inertia } => {
                let friction = law.steady_torque(speed);
                friction + no_more(inertia * acceleration, friction)
            }
            Self::Lag { law, inertia, motor } => {
                let friction = law.steady_torque(speed);
                let torque =
                    friction + no_more(inertia * acceleration, friction) + motor.damping_nm_s_per_rad * speed;
                let part = (torque / motor.holding_torque_nm).clamp(-1.0, 1.0);
                part.asin() / f64::from(motor.rotor_teeth)
            }
            Self::Direction => speed.signum(),
        }
    }

    /// The sums of each run, at its place in the log.
    pub(crate) fn sums(&self, windows: &[Window], runs: usize) -> Vec<Sums> {
        self.mended(windows, runs, AS_IT_IS).into_iter().map(|sums| sums.given).collect()
    }

    /// The sums of each run as it is, and once mended: over the samples that count either way.
    pub(crate) fn mended(&self, windows: &[Window], runs: usize, scale: Scale) -> Vec<Mended> {
        let mut all = vec![Mended::default(); runs];
        for window in windows {
            if let Some(sums) = all.get_mut(window.run) {
                self.add(&window.motions, &window.measured, scale, sums);
            }
        }
        all
    }

    /// The sums of a stretch.
    pub(crate) fn sums_of(&self, motions: &[MotionSample], measured: &[f64]) -> Sums {
        let mut sums = Mended::default();
        self.add(motions, measured, AS_IT_IS, &mut sums);
        sums.given
    }

    fn add(&self, motions: &[MotionSample], measured: &[f64], scale: Scale, sums: &mut Mended) {
        let settled_rad = SETTLED * self.deflection_rad();
        let (mut given, mut mended) = (Travel::default(), Travel::default());
        for (motion, measured) in motions.iter().zip(measured) {
            let (moved, would_move) = (scaled(motion, AS_IT_IS), scaled(motion, scale));
            let settled = given.exceeds(&moved, settled_rad) & mended.exceeds(&would_move, settled_rad);
            if !settled || !measured.is_finite() {
                continue;
            }
            sums.given.take(*measured, self.of(&moved), given.direction);
            sums.mended.take(scale.measured * measured, self.of(&would_move), mended.direction);
        }
    }

    fn of(&self, motion: &MotionSample) -> f64 {
        self.at(motion.speed_rad_per_s, motion.acceleration_rad_per_s2)
    }
}

/// A run's sums as it is, and once mended.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Mended {
    pub(crate) given: Sums,
    pub(crate) mended: Sums,
}

fn scaled(motion: &MotionSample, scale: Scale) -> MotionSample {
    MotionSample {
        angle_rad: scale.angle * motion.angle_rad,
        speed_rad_per_s: scale.angle / scale.time * motion.speed_rad_per_s,
        acceleration_rad_per_s2: scale.angle / (scale.time * scale.time) * motion.acceleration_rad_per_s2,
    }
}

/// How far a contact has moved one way.
#[derive(Default)]
struct Travel {
    rad: f64,
    /// 1 or -1, and 0 at rest.
    direction: f64,
    before_rad: Option<f64>,
}

impl Travel {
    /// Goes on to `motion`; true if the contact has moved further than `settled_rad` since it turned.
    fn exceeds(&mut self, motion: &MotionSample, settled_rad: f64) -> bool {
        let (speed, angle_rad) = (motion.speed_rad_per_s, motion.angle_rad);
        if speed.signum() != self.direction || speed == 0.0 {
            (self.rad, self.direction) = (0.0, if speed == 0.0 { 0.0 } else { speed.signum() });
        }
        self.rad += (angle_rad - self.before_rad.replace(angle_rad).unwrap_or(angle_rad)).abs();
        self.direction != 0.0 && self.rad > settled_rad
    }
}

impl Sums {
    fn take(&mut self, measured: f64, expected: f64, direction: f64) {
        self.count += 1.0;
        self.forward += f64::from(u8::from(direction > 0.0));
        self.measured += measured;
        self.expected += expected;
        self.measured_2 += measured * measured;
        self.expected_2 += expected * expected;
        self.product += measured * expected;
    }

    /// Whether there is enough to judge by.
    pub(crate) fn tell(&self) -> bool {
        self.count >= LEAST
    }

    /// The run's own zero: the mean of measured less expected; `None` where it doesn't slide both ways, or too little.
    pub(crate) fn zero(&self) -> Option<f64> {
        let both_ways = (BOTH_WAYS..=1.0 - BOTH_WAYS).contains(&(self.forward / self.count));
        (both_ways && self.tell()).then(|| (self.measured - self.expected) / self.count)
    }

    /// RMS of what is expected.
    pub(crate) fn expected_rms(&self) -> f64 {
        (self.expected_2 / self.count).sqrt()
    }

    /// The run's own zero taken out, where there is one.
    pub(crate) fn about_zero(self) -> Self {
        let Some(zero) = self.zero() else { return self };
        Self {
            measured: self.expected,
            measured_2: self.measured_2 - 2.0 * zero * self.measured + self.count * zero * zero,
            product: self.product - zero * self.expected,
            ..self
        }
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            forward: self.forward + other.forward,
            measured: self.measured + other.measured,
            expected: self.expected + other.expected,
            measured_2: self.measured_2 + other.measured_2,
            expected_2: self.expected_2 + other.expected_2,
            product: self.product + other.product,
        }
    }

    /// RMS of measured less expected.
    pub(crate) fn error(&self) -> f64 {
        ((self.measured_2 - 2.0 * self.product + self.expected_2).max(0.0) / self.count).sqrt()
    }

    /// The error in parts of the geometric mean of both RMS: 0 where they agree, 2 where one is the other turned, √2 where
    /// they have nothing to do with each other, large where one is much larger; 0.7 where one is twice the other.
    pub(crate) fn distance(&self) -> f64 {
        let scale = (self.measured_2 * self.expected_2).sqrt() / self.count;
        if scale > 0.0 { self.error() / scale.sqrt() } else { f64::INFINITY }
    }

    /// The factor of what is expected that is in what was measured, whatever else is: 1 where the model is right, 0 where they have nothing to do
    /// with each other.
    pub(crate) fn factor(&self) -> f64 {
        if self.expected_2 > 0.0 { self.product / self.expected_2 } else { 0.0 }
    }

    /// Correlation about zero of measured and expected.
    pub(crate) fn correlation(&self) -> f64 {
        let scale = (self.measured_2 * self.expected_2).sqrt();
        if scale > 0.0 { self.product / scale } else { 0.0 }
    }
}

/// An inertia's torque, but no more than friction's: accelerations are known badly, and a few wild ones would rule the sums.
fn no_more(torque: f64, friction: f64) -> f64 {
    torque.clamp(-friction.abs(), friction.abs())
}

/// All runs that tell together, each about its own zero.
pub(crate) fn pooled(sums: &[Sums]) -> Sums {
    sums.iter().filter(|sums| sums.tell()).fold(Sums::default(), |all, sums| all.plus(sums.about_zero()))
}
