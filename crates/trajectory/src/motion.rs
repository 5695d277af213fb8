//! What the reference is doing: resting, on a planned motion, or on a sine; and the time that runs along it.

use crate::profile::Profile;
use crate::sine::Sine;
use signals::Kinematics;

/// A motion since its start, at time scale 1.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "a box would take the heap in the loop")]
pub(crate) enum Motion {
    /// At rest.
    Rest {
        /// Where.
        angle_rad: f64,
    },
    /// On a planned motion.
    Planned(Planned),
    /// On a sine.
    Sine(Sine),
}

/// A planned motion, where it starts, and what comes after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Planned {
    pub profile: Profile,
    /// The angle that the profile's own count from.
    pub start_rad: f64,
    /// What the motion leads to.
    pub then: Then,
}

/// What a planned motion leads to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Then {
    /// Rest, at exactly this angle.
    Rest {
        /// Where.
        angle_rad: f64,
    },
    /// Rotation at exactly this speed, without an end.
    Rotate {
        /// How fast.
        speed_rad_per_s: f64,
    },
    /// A sine, which begins at once.
    Sine(Sine),
}

impl Motion {
    /// The state at `time_s` after the motion's start.
    pub fn at(&self, time_s: f64) -> Kinematics {
        match self {
            Self::Rest { angle_rad } => Kinematics::at_rest(*angle_rad),
            Self::Planned(planned) => planned.at(time_s),
            Self::Sine(sine) => sine.at(time_s),
        }
    }

    /// Whether it stands still.
    pub fn rests(&self) -> bool {
        matches!(self, Self::Rest { .. })
    }

    /// Where it comes to rest; `None` if it doesn't.
    pub fn rest_angle_rad(&self) -> Option<f64> {
        match self {
            Self::Rest { angle_rad } | Self::Planned(Planned { then: Then::Rest { angle_rad }, .. }) => {
                Some(*angle_rad)
            }
            _ => None,
        }
    }

    /// What follows if the motion has ended by `time_s`, and how far into that one is then.
    fn successor(&self, time_s: f64) -> Option<(Self, f64)> {
        let Self::Planned(planned) = self else { return None };
        let since_s = time_s - planned.profile.duration_s();
        if since_s < 0.0 {
            return None;
        }
        match planned.then {
            Then::Rest { angle_rad } => Some((Self::Rest { angle_rad }, 0.0)),
            Then::Sine(sine) => Some((Self::Sine(sine), since_s)),
            Then::Rotate { .. } => None,
        }
    }
}

impl Planned {
    fn at(&self, time_s: f64) -> Kinematics {
        let since_s = time_s - self.profile.duration_s();
        if since_s < 0.0 {
            let state = self.profile.at(time_s);
            return Kinematics { angle_rad: self.start_rad + state.angle_rad, ..state };
        }
        let end_rad = self.start_rad + self.profile.end().angle_rad;
        match self.then {
            Then::Rest { angle_rad } => Kinematics::at_rest(angle_rad),
            Then::Sine(sine) => sine.at(since_s),
            Then::Rotate { speed_rad_per_s } => Kinematics {
                angle_rad: end_rad + speed_rad_per_s * since_s,
                speed_rad_per_s,
                ..Kinematics::default()
            },
        }
    }
}

/// A motion and the time since its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ActiveMotion {
    pub motion: Motion,
    pub time: MotionTime,
}

impl ActiveMotion {
    /// At the motion's start.
    pub fn starting(motion: Motion) -> Self {
        Self { motion, time: MotionTime::default() }
    }

    /// The state now.
    pub fn now(&self, period_s: f64) -> Kinematics {
        self.motion.at(self.time.seconds(period_s))
    }

    /// The same `periods` later, when time ran at `mean_scale` meanwhile: on the next motion if this one is over.
    pub fn later(&self, periods: u64, period_s: f64, mean_scale: f64) -> Self {
        let time = self.time.later(periods, period_s, mean_scale);
        match self.motion.successor(time.seconds(period_s)) {
            Some((motion, since_s)) => Self { motion, time: MotionTime { offset_s: since_s, periods: 0 } },
            None => Self { time, ..*self },
        }
    }
}

/// The time since a motion's start: whole periods are counted, so that a rotation of days does not drift.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct MotionTime {
    offset_s: f64,
    periods: u64,
}

impl MotionTime {
    /// The time, s.
    fn seconds(&self, period_s: f64) -> f64 {
        self.offset_s + self.periods as f64 * period_s
    }

    /// The time `periods` later, when time ran at `mean_scale` meanwhile.
    fn later(&self, periods: u64, period_s: f64, mean_scale: f64) -> Self {
        if mean_scale == 1.0 {
            Self { periods: self.periods.saturating_add(periods), ..*self }
        } else {
            Self { offset_s: self.seconds(period_s) + periods as f64 * period_s * mean_scale, periods: 0 }
        }
    }
}
