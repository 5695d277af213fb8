//! What a bridge is set to, and where its frame lies in the cycle.

use fieldbus::{AxisParams, DriveFile, JudgeParams};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The frame goes out at this part of the cycle, per cent.
const PLACE_PERCENT: u64 = 10;
/// Its reply is awaited until this part at most.
const REPLY_PERCENT: u64 = 40;
/// A reply needs this part at least.
const SHORTEST_WAIT_PERCENT: u64 = 5;
/// Deviation from the bus's clock that is borne, per cent of the cycle, and for how many cycles.
const CLOCK_WINDOW_PERCENT: u64 = 20;
const CLOCK_CYCLES: u64 = 10;

/// What a bridge is set to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BridgeParams {
    /// The drive.
    pub file: DriveFile,
    /// The axis.
    pub axis: AxisParams,
    /// The cycle, ns.
    pub period_ns: u32,
    /// Where the frame goes out after the beginning of the cycle, ns.
    pub place_ns: u32,
    /// Until when after the beginning of the cycle its reply is awaited, ns.
    pub reply_until_ns: u32,
}

/// Feedback is wanted before the drive's reply can be there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("{found_ns} ns, expected at least {expected_ns} ns: the drive's frame goes out at {place_ns} ns")]
pub struct WantedTooEarly {
    /// When Feedback is wanted after the beginning of the cycle, ns.
    pub found_ns: u64,
    /// The earliest that it can be wanted, ns.
    pub expected_ns: u64,
    /// When the frame goes out, ns.
    pub place_ns: u64,
}

impl BridgeParams {
    /// A bridge to the drive of `file` behind a guard, in cycles of `period_ns` (at most 10 ms), whose Feedback is wanted
    /// `wanted_ns` after each one's beginning.
    ///
    /// # Errors
    /// [`WantedTooEarly`].
    pub fn new(
        file: DriveFile,
        guard: drive::Params,
        period_ns: u64,
        wanted_ns: u64,
    ) -> Result<Self, WantedTooEarly> {
        let part = |percent: u64| period_ns * percent / 100;
        let (place_ns, reply_until_ns) = (part(PLACE_PERCENT), part(REPLY_PERCENT).min(wanted_ns));
        let expected_ns = part(PLACE_PERCENT + SHORTEST_WAIT_PERCENT);
        if reply_until_ns < expected_ns {
            return Err(WantedTooEarly { found_ns: wanted_ns, expected_ns, place_ns });
        }
        let axis = AxisParams {
            drive: guard,
            profile: file.profile,
            direction: file.direction(),
            position_is_measured: file.position_is_measured,
            homing: file.homing,
            enable_cycles: file.enable_timeout_ns / period_ns.max(1),
            judge: JudgeParams {
                bus_lost_cycles: file.bus_lost_cycles,
                clock_window_ns: part(CLOCK_WINDOW_PERCENT).cast_signed(),
                clock_cycles: CLOCK_CYCLES,
            },
        };
        let short = |ns: u64| u32::try_from(ns).unwrap_or(u32::MAX);
        Ok(Self {
            file,
            axis,
            period_ns: short(period_ns),
            place_ns: short(place_ns),
            reply_until_ns: short(reply_until_ns),
        })
    }
}
