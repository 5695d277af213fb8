//! What a scenario says, in SI: the data that the supervisor hands out to the processes.

mod checks;
mod homing;
mod profile;
mod read;
mod read_control;
mod read_homing;
mod read_set_points;
mod read_timing;
mod set_point;

pub(crate) use checks::{angle_outside, angle_within, refuse_sine_outside};
pub use homing::{Homing, HomingMarks, HomingMethod, HomingSearch};
pub use profile::Profile;
pub(crate) use read::asked;
pub use read::{LARGEST_ENCODER_DELAY_CYCLES, parse_scenario};
pub use read_control::{OBSERVER_BANDWIDTH_HZ, usual_damping};
pub use set_point::{FlowPressure, ScheduledSetPoint, SetPoint};
use std::f64::consts::TAU;

/// Shorter periods work where the machine does, but nothing is promised.
const SHORTEST_SUPPORTED_PERIOD_NS: u64 = 250_000;

/// A silence that is long for an operator, s: within as much `disarm` says what it could not do.
const LONG_SILENCE_S: f64 = 1.0;
/// A pressure drop below a hundredth of a bar is next to none.
const LEAST_PRESSURE_PA: f64 = 1e3;

/// A validated scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// The scenario's name, for titles and recordings.
    pub name: String,
    /// Cycle time, in nanoseconds; a whole number of microseconds from 100 µs to 10 ms.
    pub period_ns: u64,
    /// How long the scenario lasts, in seconds, counted from arming.
    pub duration_s: f64,
    /// Seed of all random numbers (the encoder's noise).
    pub seed: u64,
    /// Model file of the simulated plant, as written: relative to the scenario's file.
    pub truth: String,
    /// Model file of the controller, as written: relative to the scenario's file.
    pub belief: String,
    /// Angle of motor and spool at the beginning, in radians.
    pub initial_angle_rad: f64,
    /// What the trajectory may do.
    pub limits: MotionLimits,
    /// What the micro-step driver may be asked for.
    pub driver: Driver,
    /// The encoder at the spool.
    pub encoder: Encoder,
    /// When the controller gives up.
    pub safety: Safety,
    /// Where the angle's zero comes from.
    pub homing: Homing,
    /// How much friction the controller compensates.
    pub compensation: Compensation,
    /// What it does with the encoder, and against the resonance.
    pub control: Control,
    /// Cycles from Feedback to the beginning of the command's cycle: 1, or 2 for a bus that returns inputs k while it carries command k+1.
    pub loop_delay_cycles: u64,
    /// The real drive in the simulated plant's place; `None` without one.
    pub drive: Option<Drive>,
    /// Phase, core and priority of each process.
    pub timing: Timing,
    /// Pressure drop over the orifice against time, in pascals.
    pub pressure_drop: Profile,
    /// Oil temperature against time, in degrees Celsius.
    pub oil_temperature: Profile,
    /// Set-points in the order of their times.
    pub set_points: Vec<ScheduledSetPoint>,
}

/// A real drive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Drive {
    /// The drive's file, as written: relative to the scenario's file.
    pub file: String,
    /// The network interface that it is on.
    pub interface: String,
}

impl Scenario {
    /// Cycle time in seconds.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.period_ns as f64 / 1e9
    }

    /// What is allowed but may surprise: one sentence each.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.period_ns < SHORTEST_SUPPORTED_PERIOD_NS {
            let period_us = self.period_ns / 1000;
            warnings.push(format!(
                "a period of {period_us} us is experimental: below 250 us nothing is promised"
            ));
        }
        warnings.extend(self.hardly_meant());
        // With a real drive the set-points are the operator's.
        if self.set_points.is_empty() && self.drive.is_none() {
            warnings.push("no set-point: the valve holds its initial angle".to_owned());
        }
        warnings.extend(self.too_coarse());
        warnings.extend(self.hardly_watched());
        if !self.encoder.fitted {
            warnings.push(
                "no encoder: lost steps and following errors are not seen by the controller".to_owned(),
            );
            if !self.driver.holds_when_disarmed {
                warnings.push(
                    "no encoder and no current while disarmed: disarming loses the zero of the angle"
                        .to_owned(),
                );
            }
        }
        warnings
    }

    /// Numbers that were probably meant in degrees or in bar, and are in radians or pascals, as a number without a unit is.
    fn hardly_meant(&self) -> impl Iterator<Item = String> {
        let ends = [("min_angle", self.limits.min_angle_rad), ("max_angle", self.limits.max_angle_rad)];
        let turns = ends.into_iter().filter_map(|(key, limit)| {
            let limit = limit.filter(|limit| limit.abs() > TAU)?;
            Some(format!(
                "limits.{key} is {limit} rad, {:.1} turns: a number without a unit is one of radians",
                limit / TAU
            ))
        });
        let least_pa = self.pressure_drop.least_but_none().filter(|least_pa| *least_pa < LEAST_PRESSURE_PA);
        turns.chain(least_pa.map(|least_pa| {
            format!("pressure_drop is {least_pa} Pa, next to none: a number without a unit is one of pascals")
        }))
    }

    /// An encoder whose one count is more than the following error that is allowed.
    fn too_coarse(&self) -> Option<String> {
        let count_rad = TAU / self.encoder.counts_per_turn as f64;
        let most_rad = self.safety.max_following_error_rad;
        (self.encoder.fitted && count_rad > most_rad).then(|| {
            format!(
                "one count of the encoder is {:.3}°, more than max_following_error ({:.3}°): the first motion would be a fault",
                count_rad.to_degrees(),
                most_rad.to_degrees()
            )
        })
    }

    /// Limits of what is watched that are so wide that nothing is.
    fn hardly_watched(&self) -> impl Iterator<Item = String> {
        let Safety { silence_cycles, max_following_error_rad: most_rad, .. } = self.safety;
        let silence_s = silence_cycles as f64 * self.period_s();
        let silence = (silence_s > LONG_SILENCE_S).then(|| {
            format!(
                "silence_cycles is {silence_cycles}: for {silence_s:.1} s a valve goes on that nobody commands any more"
            )
        });
        let ends = self.limits.min_angle_rad.zip(self.limits.max_angle_rad);
        let range_rad = ends.map_or(TAU, |(min_rad, max_rad)| max_rad - min_rad);
        let error = (self.encoder.fitted && most_rad >= range_rad).then(|| {
            let range = if ends.is_some() { "all of the valve's range" } else { "a turn or more" };
            format!(
                "max_following_error is {:.1}°, {range}: a valve that does not follow is never a fault",
                most_rad.to_degrees()
            )
        });
        silence.into_iter().chain(error)
    }
}

/// Limits of the reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLimits {
    /// Smallest angle, in radians; `None`: unlimited, rotation is allowed.
    pub min_angle_rad: Option<f64>,
    /// Largest angle, in radians; `None`: unlimited, rotation is allowed.
    pub max_angle_rad: Option<f64>,
    /// Largest speed in either direction, in rad/s.
    pub max_speed_rad_per_s: f64,
    /// Largest acceleration in either direction, in rad/s².
    pub max_acceleration_rad_per_s2: f64,
    /// Largest jerk in either direction, in rad/s³.
    pub max_jerk_rad_per_s3: f64,
    /// Largest speed while the valve is not homed, in rad/s: its limits of angle mean nothing then.
    pub unhomed_speed_rad_per_s: f64,
}

impl MotionLimits {
    /// Whether an end of the angle is limited, so that endless rotation is not possible.
    #[must_use]
    pub fn position_limited(&self) -> bool {
        self.min_angle_rad.is_some() || self.max_angle_rad.is_some()
    }

    /// Whether an angle in radians lies within the limits; an end that is not limited allows all.
    #[must_use]
    pub fn contain_angle(&self, angle_rad: f64) -> bool {
        !(self.min_angle_rad.is_some_and(|min| angle_rad < min)
            || self.max_angle_rad.is_some_and(|max| angle_rad > max))
    }
}

/// What the micro-step driver may be asked for, whatever the controller wants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Driver {
    /// Largest pulse rate in either direction, in hertz.
    pub max_pulse_rate_hz: f64,
    /// Largest change of the pulse rate, in hertz per second.
    pub max_pulse_acceleration_hz_per_s: f64,
    /// Ramp of a quick stop, in hertz per second.
    pub quick_stop_deceleration_hz_per_s: f64,
    /// What follows when a quick stop has come to rest.
    pub after_stop: AfterStop,
    /// Whether the motor carries current while the controller is disarmed.
    pub holds_when_disarmed: bool,
    /// How long the simulated driver takes to energise the motor, in seconds.
    pub energise_time_s: f64,
}

/// What follows when the valve has stopped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AfterStop {
    /// The motor stays energised and holds its angle.
    Hold,
    /// The motor is switched off; friction and flow decide where the spool goes.
    DeEnergise,
    /// The driver goes on to a neutral angle by itself where nobody commands it any more, and holds there.
    Neutral {
        /// The angle, in radians.
        angle_rad: f64,
        /// The speed on the way there, in rad/s.
        speed_rad_per_s: f64,
    },
}

/// The encoder at the spool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encoder {
    /// Whether there is one.
    pub fitted: bool,
    /// Counts per turn.
    pub counts_per_turn: u64,
    /// Noise added before quantisation, RMS, in radians.
    pub noise_rad: f64,
    /// Age of its reading in Feedback, in cycles.
    pub delay_cycles: u64,
    /// Whether it knows its angle from the start.
    pub absolute: bool,
}

/// When the controller gives up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Safety {
    /// A partner silent for this many cycles is noticed; the stop begins one later.
    pub silence_cycles: u64,
    /// Following error at rest that is a fault, in radians, against what the command aimed at: the reference, shaped, or
    /// coming back to it.
    pub max_following_error_rad: f64,
    /// By how much that grows with the reference's speed, in seconds.
    pub following_error_per_speed_s: f64,
    /// What follows lost steps, where an encoder sees them.
    pub lost_steps: LostSteps,
}

/// How much friction the controller compensates with its belief.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compensation {
    /// Nothing.
    None,
    /// Coulomb and viscous friction on the reference's speed.
    CoulombViscous,
    /// The belief's whole friction law on the reference.
    Full,
    /// The same with the belief's effects.
    FullWithEffects,
}

impl Compensation {
    /// The levels by their names in scenarios, each at the place that is its number for a running controller.
    pub const NAMED: [(&'static str, Self); 4] = [
        ("none", Self::None),
        ("coulomb-viscous", Self::CoulombViscous),
        ("full", Self::Full),
        ("full-with-effects", Self::FullWithEffects),
    ];
}

/// What the controller does with the encoder, and against the resonance of motor and load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// Whether a disturbance observer makes up for what the belief leaves over; needs an encoder.
    pub observer: bool,
    /// How fast it follows, in hertz; without a number as fast as suits encoder and belief.
    pub observer_bandwidth_hz: Option<f64>,
    /// The largest torque that it makes up for, as a part of the belief's holding torque.
    pub observer_limit: f64,
    /// What is done against the resonance.
    pub damping: Damping,
}

/// What the controller does against the resonance of motor and load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Damping {
    /// Nothing.
    None,
    /// The observer predicts over the delay and damps; needs it and a period of at most 1 ms.
    Active,
    /// The reference goes through a shaper that the resonance does not answer to, late by a quarter of its period.
    Shaping,
}

/// What the controller does when the rotor has fallen into another tooth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LostSteps {
    /// It is a fault.
    Fault,
    /// The command goes to where the rotor is, and back to the reference from there.
    Resynchronise,
}

/// Timing of the four processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// The processes with deadlines wake so long before them, ready themselves and spin until then, in nanoseconds; 0: they sleep to the
    /// deadline.
    pub early_ns: u64,
    /// plant-simulator or valve-bridge.
    pub plant: TaskTiming,
    /// trajectory-generator.
    pub trajectory: TaskTiming,
    /// step-controller.
    pub controller: TaskTiming,
    /// run-recorder; its phase does not matter.
    pub recorder: TaskTiming,
}

/// When and where one process runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TaskTiming {
    /// Its deadline after the beginning of each cycle, in nanoseconds.
    pub phase_ns: u64,
    /// The core it is bound to; `None`: any.
    pub core: Option<usize>,
    /// SCHED_FIFO priority from 1 to 99; `None`: the normal scheduler.
    pub priority: Option<u8>,
}
