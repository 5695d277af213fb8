//! The driver's limits of pulse rate and pulse acceleration, applied to a command. Controller and drive use the same
//! function, so a healthy controller's commands pass the drive unchanged.

use crate::approach::largest_approach;
use crate::{Microsteps, MicrostepsPerCycle, Params};

/// Relative tolerance of the limits, so that a command that the controller limited passes the drive unchanged.
const LIMIT_SLACK: f64 = 1e-9;

/// The motion of one cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Travel {
    /// Travel of the cycle.
    pub way: MicrostepsPerCycle,
    /// Position at its end.
    pub position: Microsteps,
    /// Whether the limit of the pulse rate was reached.
    pub rate_limited: bool,
    /// Whether the limit of the pulse acceleration was reached.
    pub change_limited: bool,
}

impl Travel {
    /// Whether any limit was reached.
    pub fn limited(&self) -> bool {
        self.rate_limited || self.change_limited
    }
}

/// One cycle from `position` towards `target`, within the limits; `travel` is the travel of the cycle before.
///
/// `own_way` is the travel of the target itself in this cycle. A gap to the target is closed relative to that, at a rate
/// from which the drive can still brake, so it reaches a moving target without overshoot.
pub fn follow(
    params: &Params,
    position: Microsteps,
    travel: MicrostepsPerCycle,
    target: Microsteps,
    own_way: MicrostepsPerCycle,
) -> Travel {
    let (max_travel, max_change) = (params.max_travel(), params.max_change());
    let gap = (target - (position + own_way)).0;
    // Rounding of the positions themselves.
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

/// Travel of the next cycle of a quick stop, after a cycle with `travel`; 0 at standstill.
pub fn ramp_down(params: &Params, travel: MicrostepsPerCycle) -> MicrostepsPerCycle {
    let rest = travel.0.abs() - params.quick_stop_change();
    if rest > 0.0 { MicrostepsPerCycle(rest.copysign(travel.0)) } else { MicrostepsPerCycle::ZERO }
}

/// `value` limited to `centre` ± `limit`; values within `slack` beyond are left as they are.
fn clamp(value: f64, centre: f64, limit: f64, slack: f64) -> f64 {
    if (value - centre).abs() <= limit + slack { value } else { centre + limit.copysign(value - centre) }
}
