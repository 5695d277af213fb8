//! The plant side's guard: it stands between StepCommand and motor, in simulator and bus bridge alike.
//!
//! Once per cycle [`step`] takes the cycle's command, or notes that there is none, and says how the micro-step
//! command moves in that cycle: at a constant pulse rate, within the driver's limits whatever was asked. When the
//! commands stop coming it stops the valve by itself. Positions are absolute micro-steps, rates micro-steps per
//! second (Hz). Pure: no clock, no heap.
//!
//! ```text
//!        follow=1 where the drive stands    `silence_cycles` without a sensible command, beyond the limits of angle
//!  Idle ─────────────▶ Following ───────────────────────────────────▶ Stopped by itself
//!   ▲  ◀─────────────     ▲                                                 │
//!   │      follow=0       │ follow=1, its position our own                  │ follow=0, at standstill
//!   │                     └──────────────── Released ◀──────────────────────┘
//!   └── (start)
//! ```
//! In every mode but Following the rate ramps to zero at the quick-stop deceleration, and stays there. Nothing is followed
//! without current. A drive begins to follow once under each arming (`follow_id`): after a stop it needs a new one. A command that
//! contradicts itself, since one field was altered on the way, or that jumps further than a healthy controller's can, is
//! refused, and counts as missing.
#![forbid(unsafe_code)]

mod approach;
mod limits;
mod params;
mod state;
mod step;
mod units;

pub use limits::{Travel, follow, ramp_down};
pub use params::{AfterStop, DriveError, Params, STANDSTILL_S, stop_cycles_bound};
pub use state::{Mode, State};
pub use step::{Output, Sensors, step};
pub use units::{Microsteps, MicrostepsPerCycle};
