//! Angle, speed, acceleration and jerk at one instant.

/// The state of a motion. Which zero the angle has, the owner says.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Kinematics {
    pub angle_rad: f64,
    pub speed_rad_per_s: f64,
    pub acceleration_rad_per_s2: f64,
    pub jerk_rad_per_s3: f64,
}

impl Kinematics {
    /// At rest at an angle.
    pub fn at_rest(angle_rad: f64) -> Self {
        Self { angle_rad, ..Self::default() }
    }

    /// The state after `time_s` at constant jerk.
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
