//! How fast the time scale of the motion may change.
//!
//! With the scale s the reference's speed is v·s and its acceleration a·s² + v·ṡ. The time scale changes by at most
//! [`MAX_RATE_PER_S`], and no faster than that acceleration allows: while the motion already accelerates or brakes
//! at its limit the time scale waits. The jerk is not limited while the time scale changes.

use crate::Params;
use crate::motion::ActiveMotion;

/// The time scale goes from 1 to 0 in 50 ms at the fastest.
const MAX_RATE_PER_S: f64 = 20.0;

/// How often the change is halved until the acceleration is within its limit; after that the time scale stays.
const HALVINGS: u32 = 12;

/// Time scale and its rate of change over the last cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TimeScale {
    pub scale: f64,
    pub rate_per_s: f64,
}

impl TimeScale {
    /// Normal time scale.
    pub const NORMAL: Self = Self { scale: 1.0, rate_per_s: 0.0 };

    /// The time scale `periods` later, on its way to `wanted`.
    pub fn towards(&self, wanted: f64, params: &Params, active: &ActiveMotion, periods: u64) -> Self {
        if wanted == self.scale {
            return Self { rate_per_s: 0.0, ..*self };
        }
        let dt_s = periods as f64 * params.period_s;
        let most = MAX_RATE_PER_S * dt_s;
        let mut change = (wanted - self.scale).clamp(-most, most);
        for _ in 0..HALVINGS {
            let next = Self { scale: self.scale + change, rate_per_s: change / dt_s };
            let later = active.later(periods, params.period_s, (self.scale + next.scale) / 2.0);
            let keeps = |time_scale: f64, active: &ActiveMotion| {
                let state = active.now(params.period_s);
                let acceleration = state.acceleration_rad_per_s2 * time_scale * time_scale
                    + state.speed_rad_per_s * next.rate_per_s;
                acceleration.abs() <= params.limits.max_acceleration_rad_per_s2
            };
            if keeps(self.scale, active) && keeps(next.scale, &later) {
                // The last step lands on the wanted value itself, not beside it.
                let arrived = change == wanted - self.scale;
                return if arrived { Self { scale: wanted, ..next } } else { next };
            }
            change /= 2.0;
        }
        Self { rate_per_s: 0.0, ..*self }
    }
}
