//! The observer at work: what it remembers, and the torque it adds to the one fed forward.

use crate::observer::Observer;
use crate::params::Params;
use crate::tuning::Tuning;
use nalgebra::Vector3;
use signals::Kinematics;

/// Samples remembered: the oldest reading that a scenario may have, the longest dead time, and one to start from.
const TRAIL: usize = 20;

/// So long the reference has to rest before the command is held, s.
const SETTLING_S: f64 = 0.02;

/// Deviation up to which the command is held once the reference rests, in counts of the encoder, and the one that ends
/// the hold. Between them noise and the rounding of counts and micro-steps toggle nothing.
const HOLD_COUNTS: f64 = 2.0;
const RELEASE_COUNTS: f64 = 4.0;

/// Smoothing of the reading that decides over holding, per cycle.
const SMOOTHING: f64 = 0.1;

/// One instant of the command that has been given.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Instant {
    /// Where the spool was wanted, rad.
    pub reference_rad: f64,
    /// The torque that the command gives there beyond the one fed forward, N·m.
    pub beyond_nm: f64,
    /// Where the command stands, rad.
    pub command_rad: f64,
}

/// The observer's state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Correction {
    /// x, ẋ and d at the time of the newest reading.
    estimate: Vector3<f64>,
    /// The newest first: it belongs to the end of the cycle commanded last.
    trail: [Instant; TRAIL],
    resting_cycles: u64,
    smoothed_rad: f64,
    holds: bool,
}

impl Default for Correction {
    fn default() -> Self {
        Self {
            estimate: Vector3::zeros(),
            trail: [Instant::default(); TRAIL],
            resting_cycles: 0,
            smoothed_rad: 0.0,
            holds: false,
        }
    }
}

/// What the observer wants of the next command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Wish {
    /// Something beyond what is fed forward.
    More {
        /// The torque, N·m.
        beyond_nm: f64,
        /// How far the spool is beyond the reference, rad; `None` where nobody sees it.
        deviation_rad: Option<f64>,
    },
    /// The command shall not move.
    Hold,
}

impl Correction {
    /// Where nothing moves the torque that the command gives is what friction takes.
    pub(crate) fn at_rest(instant: Instant) -> Self {
        Self {
            trail: [instant; TRAIL],
            estimate: Vector3::new(0.0, 0.0, instant.beyond_nm),
            ..Self::default()
        }
    }

    /// Begins anew on a rotor that moves at `way_rad` a cycle and is at `rotor_rad` when the newest command ends; teeth
    /// and half-teeth of the motor do not matter to its torque.
    pub(crate) fn restart(&mut self, rotor_rad: f64, way_rad: f64, torque_nm: impl Fn(f64) -> f64) {
        for (age, instant) in self.trail.iter_mut().enumerate() {
            instant.reference_rad = rotor_rad - way_rad * age as f64;
            instant.beyond_nm = torque_nm(instant.command_rad - instant.reference_rad);
        }
        *self = Self { trail: self.trail, ..Self::default() };
    }

    /// What was commanded for the time of a reading of this age in cycles, beside the dead time.
    pub(crate) fn commanded(&self, age_cycles: u64) -> Instant {
        self.instant(age_cycles as usize)
    }

    /// Notes what has been commanded for the end of the next cycle.
    pub(crate) fn push(&mut self, instant: Instant) {
        self.trail.rotate_right(1);
        if let Some(newest) = self.trail.first_mut() {
            *newest = instant;
        }
    }

    fn instant(&self, age: usize) -> Instant {
        self.trail.get(age).copied().unwrap_or_default()
    }

    /// A cycle in which nothing was read or commanded: the estimate is predicted with the last command.
    pub(crate) fn coast(&mut self, params: &Params, instant: Instant) {
        if let Some(observer) = &params.observer {
            self.estimate = self.predicted(params, observer);
        }
        self.push(instant);
    }

    /// The estimate at the time of this cycle's reading, before it.
    fn predicted(&self, params: &Params, observer: &Observer) -> Vector3<f64> {
        let age = age(params, observer);
        observer.predicted(&self.estimate, self.instant(age + 1).beyond_nm, self.instant(age).beyond_nm)
    }

    /// Takes a cycle's reading in and looks ahead over the dead time.
    pub(crate) fn step(
        &mut self,
        params: &Params,
        observer: &Observer,
        tuning: &Tuning,
        angle_rad: Option<f64>,
        next: &Kinematics,
    ) -> Wish {
        let age = age(params, observer);
        let predicted = self.predicted(params, observer);
        let reading_rad =
            angle_rad.map_or(predicted.x, |angle_rad| angle_rad - self.instant(age).reference_rad);
        let (filter, limit_nm) = (tuning.filter(observer), tuning.observer_limit_nm(observer));
        self.estimate = observer.corrected(&filter, &predicted, reading_rad, limit_nm);
        self.rest(observer, next, reading_rad, params.period_s);
        if self.holds {
            return Wish::Hold;
        }
        let mut ahead = self.estimate;
        for age in (1..=age).rev() {
            ahead = observer.predicted(&ahead, self.instant(age).beyond_nm, self.instant(age - 1).beyond_nm);
        }
        let beyond_nm = observer.torque_nm(&ahead, self.instant(0).beyond_nm);
        // The reading itself: the estimate trusts a model that does not hold for a rotor out of step.
        Wish::More { beyond_nm, deviation_rad: Some(reading_rad) }
    }

    /// Whether the command is held: the reference has rested for a while and the spool is where it is wanted.
    fn rest(&mut self, observer: &Observer, next: &Kinematics, reading_rad: f64, period_s: f64) {
        let rests = next.speed_rad_per_s == 0.0 && next.acceleration_rad_per_s2 == 0.0;
        self.resting_cycles = if rests { self.resting_cycles.saturating_add(1) } else { 0 };
        self.smoothed_rad += SMOOTHING * (reading_rad - self.smoothed_rad);
        let settled = self.resting_cycles as f64 * period_s >= SETTLING_S;
        let counts = if self.holds { RELEASE_COUNTS } else { HOLD_COUNTS };
        self.holds = settled && self.smoothed_rad.abs() < counts * observer.settings.count_rad;
    }
}

/// How old a reading is when it is taken in, in cycles commanded since.
fn age(params: &Params, observer: &Observer) -> usize {
    (params.loop_delay_cycles + observer.settings.delay_cycles) as usize
}
