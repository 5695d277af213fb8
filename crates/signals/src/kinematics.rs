//! Angle, speed, acceleration and jerk at one instant: what a Reference says of the motion.

use crate::Reference;
use serde::{Deserialize, Serialize};

/// The state of a motion. Which zero the angle has, the owner says.
///
/// ```
/// use signals::Kinematics;
///
/// let start = Kinematics { jerk_rad_per_s3: 6.0, ..Kinematics::at_rest(0.5) };
/// let end = start.after(2.0);
/// assert_eq!((end.angle_rad, end.speed_rad_per_s, end.acceleration_rad_per_s2), (8.5, 12.0, 12.0));
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Kinematics {
    /// Angle, rad.
    pub angle_rad: f64,
    /// Speed, rad/s.
    pub speed_rad_per_s: f64,
    /// Acceleration, rad/s².
    pub acceleration_rad_per_s2: f64,
    /// Jerk, rad/s³; constant until the next instant.
    pub jerk_rad_per_s3: f64,
}

impl Kinematics {
    /// At rest at an angle.
    pub fn at_rest(angle_rad: f64) -> Self {
        Self { angle_rad, ..Self::default() }
    }

    /// Whether it neither moves nor is about to. A motion may begin and end between two such instants.
    pub fn rests(&self) -> bool {
        self.speed_rad_per_s == 0.0 && self.acceleration_rad_per_s2 == 0.0
    }

    /// The same angle and speed, without acceleration and jerk.
    #[must_use]
    pub fn at_constant_speed(self) -> Self {
        Self { acceleration_rad_per_s2: 0.0, jerk_rad_per_s3: 0.0, ..self }
    }

    /// The state after `time_s` at constant jerk.
    #[must_use]
    pub fn after(&self, time_s: f64) -> Self {
        let Self { angle_rad: angle, speed_rad_per_s: speed, acceleration_rad_per_s2: acceleration, .. } =
            *self;
        let jerk = self.jerk_rad_per_s3;
        Self {
            angle_rad: angle + time_s * (speed + time_s * (acceleration / 2.0 + time_s * jerk / 6.0)),
            speed_rad_per_s: speed + time_s * (acceleration + time_s * jerk / 2.0),
            acceleration_rad_per_s2: acceleration + time_s * jerk,
            jerk_rad_per_s3: jerk,
        }
    }
}

impl Reference {
    /// The motion that it wants.
    pub fn kinematics(&self) -> Kinematics {
        Kinematics {
            angle_rad: self.angle_rad,
            speed_rad_per_s: self.speed_rad_per_s,
            acceleration_rad_per_s2: self.acceleration_rad_per_s2,
            jerk_rad_per_s3: self.jerk_rad_per_s3,
        }
    }
}
