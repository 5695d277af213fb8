//! The driver's limits, applied to a command: the one piece of code that both the drive and the controller use, so that
//! a healthy controller's commands pass the drive untouched.

use crate::approach::largest_approach;
use crate::{Microsteps, MicrostepsPerCycle, Params};

/// Relative slack of the limits: a command that was cut to the same limits elsewhere must pass untouched.
const LIMIT_SLACK: f64 = 1e-9;

/// What a cycle came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Travel {
    /// Way of the cycle.
    pub way: MicrostepsPerCycle,
    /// Position at its end.
    pub position: Microsteps,
    /// Whether the greatest pulse rate held it back.
    pub rate_limited: bool,
    /// Whether the greatest change of the pulse rate held it back.
    pub change_limited: bool,
}

impl Travel {
    /// Whether any limit held it back.
    pub fn limited(&self) -> bool {
        self.rate_limited || self.change_limited
    }
}

/// Goes from `position`, after a cycle's way of `travel`, towards `target`, or as far as the limits let it.
///
/// `own_way` is how far the target itself goes in this cycle. What was missed is caught up relative to that, at no
/// more than can still be braked in time: it ends on the target without passing it.
pub fn follow(
    params: &Params,
    position: Microsteps,
    travel: MicrostepsPerCycle,
    target: Microsteps,
    own_way: MicrostepsPerCycle,
) -> Travel {
    let (max_travel, max_change) = (params.max_travel(), params.max_change());
    let gap = (target - (position + own_way)).0;
    // Positions are only known to their last bit.
    let rounding = 4.0 * f64::EPSILON * (target.0.abs() + position.0.abs());
    let direct_way = (target - position).0;
    let wanted = if gap.abs() <= max_change * (1.0 + LIMIT_SLACK) + rounding {
        direct_way
    } else {
        own_way.0 + largest_approach(gap.abs(), max_change).copysign(gap)
    };
    let changed = clamp(wanted, travel.0, max_change, max_change * LIMIT_SLACK + rounding);
    let way = clamp(changed, 0.0, max_travel, max_travel * LIMIT_SLACK + rounding);
    let direct = way == direct_way;
    let way_taken = MicrostepsPerCycle(way);
    Travel {
        way: way_taken,
        position: if direct { target } else { position + way_taken },
        rate_limited: way != changed,
        change_limited: !direct && way == changed,
    }
}

/// The way of the next cycle of a quick stop, after a cycle's way of `travel`: 0 once it stands.
pub fn ramp_down(params: &Params, travel: MicrostepsPerCycle) -> MicrostepsPerCycle {
    let rest = travel.0.abs() - params.quick_stop_change();
    if rest > 0.0 { MicrostepsPerCycle(rest.copysign(travel.0)) } else { MicrostepsPerCycle::ZERO }
}

/// `value`, unless it is further than `limit` from `centre`, a slack aside; then what is just `limit` from it.
fn clamp(value: f64, centre: f64, limit: f64, slack: f64) -> f64 {
    if (value - centre).abs() <= limit + slack { value } else { centre + limit.copysign(value - centre) }
}
