//! A drive on EtherCAT, without the wire: what is sent and what replies mean, as pure functions.
//!
//! ```text
//!  StepCommand k ─▶ guard (drive) ─▶ Axis ─▶ process data ─▶ CyclicFrame ─▶ wire
//!  Feedback k   ◀──────────────────── Axis ◀─ Judge ◀──────── CyclicFrame ◀─ wire
//! ```
//! - [`objects`]: object numbers beside their names (CiA 402-2, ETG.1000.6).
//! - [`DriveFile`] and [`Plan`]: what the drive must be, and every SDO written and read back before it may move.
//! - [`CyclicFrame`]: the one frame of a cycle: the clock (FRMW), the process data (LRW), the AL state (FPRD).
//! - [`BroadcastRead`]: a question to all devices, who is there.
//! - [`Profile`] with [`Outputs`] and [`Inputs`]: process data to bytes and back.
//! - [`Cia402`]: the control word that leads the drive from one state to the next.
//! - [`Counter`]: the bus's 32 bits as a position that never wraps.
//! - [`Judge`]: which replies count, and when the bus is lost.
//! - [`Clock`]: our cycle onto the bus's SYNC0.
//! - [`Axis`]: all of it with the guard: StepCommand in, Feedback out.
//!
//! No clock, heap or I/O in a cycle; positions in micro-steps, times in ns.
#![forbid(unsafe_code)]

mod axis;
mod broadcast;
mod cia402;
mod clock;
mod counter;
mod cyclic_frame;
mod drive_file;
mod judge;
pub mod objects;
mod plan;
mod process_data;

pub use axis::{Axis, AxisParams, Exchange, Sent};
pub use broadcast::BroadcastRead;
pub use cia402::{Cia402, DriveState, Order, control};
pub use clock::{Clock, ClockParams, fit_rate};
pub use counter::Counter;
pub use cyclic_frame::{CyclicFrame, FrameError, MAX_FRAME, Reply};
pub use drive_file::{DriveFile, DriveFileError, Homing, Profile, Sdo, SdoValue};
pub use judge::{BusFault, Judge, JudgeParams, Outcome, Verdict, al_state_name};
pub use plan::{Mismatch, OwnLimits, Plan, Request, may_be_absent, watchdog_registers};
pub use process_data::{Inputs, Layout, Outputs};
