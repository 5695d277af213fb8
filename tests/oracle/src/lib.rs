//! Judges a finished run by the pulses that reached the motor, with arithmetic of its own: it shares none with `drive` or
//! `step-control`.
//!
//! What it wants of every cycle k, with N pulses in it (signed), a period T, the driver's limits r (rate), a
//! (acceleration) and q (quick stop), and rounding to whole pulses:
//! - |N| ≤ r·T + 1, and neighbouring pulses no closer than that allows;
//! - |N − N before| ≤ a·T² + 2, or q·T² + 2 where the rate falls towards zero;
//! - the drive is told to begin to follow only under an operator's order to arm or home that still holds, once for each order;
//! - N = 0 after an operator's order to stop, once silence and ramp are over, until the next order to arm or home;
//! - N = 0 before the first command that the drive is to follow;
//! - N = 0 once the *deadline* is over: `silence_cycles` and the ramp after the last command to follow, or the ramp after
//!   a command not to follow.
#![forbid(unsafe_code)]

mod judge;
mod limits;
mod orders;

pub use judge::{Judge, Unsafe, Verdict};
pub use limits::Limits;
pub use orders::{Order, Wish};
