//! The observer at run time: its estimate, the commands of the dead time, and the torque that it adds to the feed-forward.

use crate::observer::Observer;
use crate::params::Params;
use crate::tuning::Tuning;
use crate::watch::load_share::Expected;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use signals::Kinematics;

/// The largest age of an encoder's reading, in cycles.
pub const LARGEST_ENCODER_DELAY_CYCLES: u64 = 16;

/// Length of the command history, in cycles: the largest encoder delay, the longest dead time (2), and two ends.
const TRAIL: usize = LARGEST_ENCODER_DELAY_CYCLES as usize + 4;

/// Time for which the reference has to rest before the command is held, s.
const SETTLING_S: f64 = 0.02;

/// Hysteresis of the hold at rest: the command is held once the deviation is within this many encoder counts or one
/// micro-step, and released beyond the multiple below, so that quantisation, noise and the size of a pulse cause no hunting.
const HOLD_COUNTS: f64 = 2.0;
const RELEASES: f64 = 2.0;

/// After the reference has rested for this time, s, each reversal of the command but the first doubles the hold window, and widens it to the
/// largest deviation since the reversal before: a persistent limit cycle is backlash or stiction, and no correction ends it.
const HUNTS_AFTER_S: f64 = 0.1;
const MOST_TURNS: i32 = 8;

/// Time constant with which the observer's torque fades when it is given up, s.
const FADING_S: f64 = 0.02;

/// Coefficient of the first-order filter on the deviation that the hold looks at, per cycle.
const SMOOTHING: f64 = 0.1;

/// A command at one instant: the end of a cycle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Instant {
    /// The spool's target, rad: the reference, shaped, or the re-entry ramp.
    pub reference_rad: f64,
    /// w of the observer's model: the command's torque on a spool on its reference, minus the feed-forward, N·m.
    pub beyond_nm: f64,
    /// The angle that the command stands for, rad.
    pub command_rad: f64,
    /// The torques that the belief expects then.
    pub expected: Expected,
}

/// The observer's state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Correction {
    /// Estimate of x, ẋ and d at the time of the newest reading.
    estimate: Vector3<f64>,
    /// The history of commands, newest first: index 0 is the end of the cycle commanded last.
    trail: [Instant; TRAIL],
    resting_cycles: u64,
    /// How often the command has reversed in this rest, and the direction of its last motion.
    turns: i32,
    direction: f64,
    /// The largest deviation since the last reversal, and the window as widened by reversals, rad.
    swing_rad: f64,
    widened_rad: f64,
    smoothed_rad: f64,
    holds: bool,
    /// Torque beyond the feed-forward in the last cycle, N·m.
    beyond_nm: f64,
    /// Whether the estimate of the disturbance is at its limit.
    saturated: bool,
}

impl Default for Correction {
    fn default() -> Self {
        Self {
            estimate: Vector3::zeros(),
            trail: [Instant::default(); TRAIL],
            resting_cycles: 0,
            turns: 0,
            direction: 0.0,
            swing_rad: 0.0,
            widened_rad: 0.0,
            smoothed_rad: 0.0,
            holds: false,
            beyond_nm: 0.0,
            saturated: false,
        }
    }
}

/// What has been found out about the belief.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Belief {
    /// Whether the shaft was found to differ from it.
    pub shaft_is_off: bool,
    /// Whether its friction state is still valid.
    pub contact_is_known: bool,
}

/// What the observer wants of the next command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Wish {
    /// A torque beyond the feed-forward.
    More {
        /// The torque, N·m.
        beyond_nm: f64,
    },
    /// To hold it where it is.
    Hold,
}

impl Correction {
    /// Starts at rest: friction balances whatever torque the command gives, so that is the disturbance.
    pub(crate) fn at_rest(instant: Instant) -> Self {
        Self {
            trail: [instant; TRAIL],
            estimate: Vector3::new(0.0, 0.0, instant.beyond_nm),
            ..Self::default()
        }
    }

    /// Restarts after lost steps, on a rotor that moves by `way_rad` per cycle and will be at `rotor_rad` when the newest
    /// command ends. The torque is periodic in the tooth pitch, so `torque_nm` needs only the lead.
    pub(crate) fn restart(&mut self, rotor_rad: f64, way_rad: f64, torque_nm: impl Fn(f64) -> f64) {
        for (age, instant) in self.trail.iter_mut().enumerate() {
            instant.reference_rad = rotor_rad - way_rad * age as f64;
            instant.beyond_nm = torque_nm(instant.command_rad - instant.reference_rad);
        }
        *self = Self { trail: self.trail, ..Self::default() };
    }

    /// The command that belongs to a reading of this age, in cycles before the end of the cycle commanded last.
    pub(crate) fn commanded(&self, age_cycles: u64) -> Instant {
        self.instant(age_cycles as usize)
    }

    /// The angle aimed at then, rad; `None` if that is longer ago than the history.
    pub(crate) fn aim_rad(&self, age_cycles: u64) -> Option<f64> {
        let age = usize::try_from(age_cycles).ok()?;
        self.trail.get(age).map(|instant| instant.reference_rad)
    }

    /// Speed aimed at in the cycle that ends then, rad/s.
    pub(crate) fn aim_speed_rad_per_s(&self, age_cycles: u64, period_s: f64) -> f64 {
        let (end, begin) = (self.commanded(age_cycles), self.commanded(age_cycles + 1));
        (end.reference_rad - begin.reference_rad) / period_s
    }

    /// Corrects the history: at that instant the drive was at `command_rad`, which changes the torque by `change_nm`.
    pub(crate) fn accepted(&mut self, age_cycles: u64, command_rad: f64, change_nm: f64) {
        if let Some(instant) = self.trail.get_mut(age_cycles as usize) {
            instant.command_rad = command_rad;
            instant.beyond_nm += change_nm;
        }
    }

    /// Appends the command for the end of the next cycle.
    pub(crate) fn push(&mut self, instant: Instant) {
        self.trail.rotate_right(1);
        if let Some(newest) = self.trail.first_mut() {
            *newest = instant;
        }
    }

    fn instant(&self, age: usize) -> Instant {
        self.trail.get(age).copied().unwrap_or_default()
    }

    /// A cycle without reading and command: the estimate is advanced by the model alone.
    pub(crate) fn coast(&mut self, params: &Params, instant: Instant) {
        if let Some(observer) = &params.observer {
            self.estimate = self.predicted(params, observer);
        }
        self.push(instant);
    }

    /// The estimate at the time of this cycle's reading, before the reading is used.
    fn predicted(&self, params: &Params, observer: &Observer) -> Vector3<f64> {
        let age = age(params, observer);
        observer.predicted(&self.estimate, self.instant(age + 1).beyond_nm, self.instant(age).beyond_nm)
    }

    /// Corrects the estimate by this cycle's reading, predicts over the dead time, and asks for the next torque.
    pub(crate) fn step(
        &mut self,
        params: &Params,
        observer: &Observer,
        tuning: &Tuning,
        angle_rad: Option<f64>,
        next: &Kinematics,
        belief: Belief,
    ) -> Wish {
        let age = age(params, observer);
        let predicted = self.predicted(params, observer);
        let reading_rad =
            angle_rad.map_or(predicted.x, |angle_rad| angle_rad - self.instant(age).reference_rad);
        let filter = if belief.shaft_is_off { observer.cautious } else { tuning.filter(observer) };
        let limit_nm = tuning.observer_limit_nm(observer);
        self.estimate = observer.corrected(&filter, &predicted, reading_rad, limit_nm);
        self.saturated = limit_nm > 0.0 && self.estimate.z.abs() >= limit_nm;
        self.rest(params, observer, next, reading_rad);
        if !observer.settings.damps && (self.holds || !belief.contact_is_known) {
            // A torque from stiction or ringing is no disturbance of the next motion.
            self.estimate.z = predicted.z;
        }
        if self.holds {
            return Wish::Hold;
        }
        let mut ahead = self.estimate;
        for age in (1..=age).rev() {
            ahead = observer.predicted(&ahead, self.instant(age).beyond_nm, self.instant(age - 1).beyond_nm);
        }
        let beyond_nm = observer.torque_nm(&ahead, self.instant(0).beyond_nm);
        self.beyond_nm = beyond_nm;
        Wish::More { beyond_nm }
    }

    /// Without the observer: the torque that it added fades, so that the command does not jump.
    pub(crate) fn fall_back(&mut self, period_s: f64) -> Wish {
        self.beyond_nm *= (-period_s / FADING_S).exp();
        self.saturated = false;
        Wish::More { beyond_nm: self.beyond_nm }
    }

    /// Whether the estimate of the disturbance is at its limit.
    pub(crate) fn saturated(&self) -> bool {
        self.saturated
    }

    /// The feed-forward has changed: the disturbance estimate and the history are shifted, so that the total torque is continuous. `change` is
    /// the part of the believed friction by which less is fed.
    pub(crate) fn feed_less(&mut self, reading_age_cycles: u64, change: f64) {
        let friction_nm = self.commanded(reading_age_cycles).expected.friction_nm;
        self.estimate.z += change * friction_nm;
        for instant in &mut self.trail {
            instant.beyond_nm += change * instant.expected.friction_nm;
        }
    }

    /// Decides whether the command is held: the reference has rested long enough, and the deviation is within the hysteresis.
    fn rest(&mut self, params: &Params, observer: &Observer, next: &Kinematics, reading_rad: f64) {
        let rests = next.rests() && next.angle_rad == self.instant(0).reference_rad;
        self.resting_cycles = if rests { self.resting_cycles.saturating_add(1) } else { 0 };
        self.smoothed_rad += SMOOTHING * (reading_rad - self.smoothed_rad);
        let rested_s = self.resting_cycles as f64 * params.period_s;
        let settled = rested_s >= SETTLING_S;
        let window_rad = window_rad(params, observer);
        self.count_turns(params, rested_s, window_rad);
        let window_rad = if self.holds { RELEASES } else { 1.0 } * window_rad.max(self.widened_rad);
        self.holds = settled && self.smoothed_rad.abs() < window_rad;
    }
}

impl Correction {
    /// Counts the reversals of a command whose reference rests.
    fn count_turns(&mut self, params: &Params, rested_s: f64, window_rad: f64) {
        if rested_s < HUNTS_AFTER_S {
            (self.turns, self.direction, self.swing_rad, self.widened_rad) = (0, 0.0, 0.0, 0.0);
            return;
        }
        self.swing_rad = self.swing_rad.max(self.smoothed_rad.abs());
        let way_rad = self.instant(0).command_rad - self.instant(1).command_rad;
        if way_rad.abs() < params.drive.microstep_angle_rad / 2.0 {
            return;
        }
        if way_rad * self.direction < 0.0 && self.turns < MOST_TURNS {
            self.turns += 1;
            if self.turns > 1 {
                self.widened_rad = self.swing_rad.max(2.0 * self.widened_rad.max(window_rad));
            }
            self.swing_rad = 0.0;
        }
        self.direction = way_rad.signum();
    }
}

/// Whether the encoder is too coarse for the observer: within its hold window a resting valve is not corrected, and that window
/// is wider than the error that friction would cause without an observer.
pub(crate) fn is_too_coarse(params: &Params, observer: &Observer) -> bool {
    HOLD_COUNTS * observer.settings.count_rad * params.stiffness_nm_per_rad() > params.coulomb_torque_nm
}

/// The hold window: a resting valve nearer to its reference than this is not corrected, rad.
///
/// An observer without damping is far slower than a slip. While it integrates at rest, friction sticks until the command has
/// gone too far, and the rotor slips by up to (T_s − T_c)/K: a limit cycle. The window is therefore at least that slip.
fn window_rad(params: &Params, observer: &Observer) -> f64 {
    let fine_rad = (HOLD_COUNTS * observer.settings.count_rad).max(params.drive.microstep_angle_rad);
    if observer.settings.damps {
        return fine_rad;
    }
    let excess_nm = params.friction.steady_torque(f64::MIN_POSITIVE) - params.coulomb_torque_nm;
    fine_rad.max(excess_nm / params.stiffness_nm_per_rad())
}

/// Age of this cycle's reading, in cycles before the end of the cycle commanded last.
fn age(params: &Params, observer: &Observer) -> usize {
    params.age_cycles(&observer.settings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::ObserverSettings;
    use crate::params::tests::params;

    const COUNT_RAD: f64 = 5e-5;

    fn observed(count_rad: f64) -> Params {
        let settings = ObserverSettings {
            bandwidth_hz: 320.0,
            torque_limit_nm: 3.0,
            count_rad,
            noise_rad: 1e-5,
            delay_cycles: 0,
            damps: true,
        };
        params().with_observer(settings)
    }

    /// A rest in which the command goes to and fro every 20 cycles and the reading deviates by as much.
    fn hunting(amplitude_rad: f64, cycles: u32) -> Correction {
        let params = observed(COUNT_RAD);
        let mut correction = Correction::default();
        let rests = Kinematics::default();
        for cycle in 0..cycles {
            let direction = if cycle / 20 % 2 == 0 { 1.0 } else { -1.0 };
            let command_rad = correction.commanded(0).command_rad + direction * 1e-4;
            correction.push(Instant { command_rad, ..Instant::default() });
            let observer = params.observer.as_ref().unwrap();
            correction.rest(&params, observer, &rests, direction * amplitude_rad);
        }
        correction
    }

    #[test]
    fn hunting_widens_the_window_to_the_swing_seen() {
        let window_rad = 2.0 * COUNT_RAD;
        assert_eq!(hunting(2e-3, 115).widened_rad, 0.0, "one turn may be a correction");
        // Within 20 cycles the filter covers seven eighths of the way between the two ends.
        let seen = hunting(2e-3, 121);
        assert!(seen.turns == 2 && (1e-3..2e-3).contains(&seen.widened_rad), "{seen:?}");
        assert!(seen.holds);
        assert_eq!(hunting(1e-5, 121).widened_rad, 2.0 * window_rad, "at least twofold");
        assert_eq!(hunting(1e-5, 141).widened_rad, 4.0 * window_rad);
    }

    #[test]
    fn a_reference_that_moves_ends_what_the_rest_before_widened() {
        let params = observed(COUNT_RAD);
        let mut correction = hunting(2e-3, 200);
        let moves = Kinematics { speed_rad_per_s: 1.0, ..Kinematics::default() };
        correction.rest(&params, params.observer.as_ref().unwrap(), &moves, 0.0);
        assert_eq!((correction.turns, correction.widened_rad, correction.holds), (0, 0.0, false));
    }

    #[test]
    fn an_encoder_is_too_coarse_where_its_window_is_wider_than_frictions_lag() {
        // 1.5 N·m on 300 N·m/rad: 5 mrad, which is 2 counts of 2.5 mrad.
        for (count_rad, coarse) in [(1e-5, false), (2.4e-3, false), (2.6e-3, true)] {
            let params = observed(count_rad);
            assert_eq!(is_too_coarse(&params, params.observer.as_ref().unwrap()), coarse, "{count_rad} rad");
        }
    }
}
