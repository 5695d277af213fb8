//! The processes of the loop: thin shells around the roles of `closed-loop`, and what they say to the supervisor.
//!
//! A process is started by the supervisor with pipes for stdin and stdout. It reads its [`Part`], joins the bus, says
//! [`FromChild::Ready`], waits for [`ToChild::Go`] with the common epoch, runs its cycles, says [`FromChild::Done`],
//! and stays (so that its last messages can still be read) until [`ToChild::Finish`]. The end of stdin means that the
//! supervisor is gone.
#![forbid(unsafe_code)]
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod aside;
mod bridge;
mod bus_news;
mod child;
mod complain;
mod controller;
mod disarm;
mod faults;
mod frame;
mod inbox;
mod life;
mod outbox;
mod paced;
mod part;
mod plant;
mod recorder;
mod segments;
mod side_thread;
mod trajectory;
mod wishes;

pub use child::ChildError;
pub use complain::complain;
pub use disarm::{ORDER_ID_STEP, straight_disarm};
pub use frame::{FrameError, read_frame, write_frame};
pub use life::run;
pub use part::{
    BridgePart, ChildSummary, FromChild, Keep, Membership, Pace, Part, RecorderPart, Task, TaskTiming,
    ToChild,
};
pub use segments::{SegmentName, segments_in};
