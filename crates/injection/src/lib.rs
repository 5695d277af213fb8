//! Faults put into the loop on purpose, at the message boundary: between a process's role and what the others receive.
//!
//! A [`Fault`] says what goes wrong, an [`Injection`] from which cycle on; both have a text form, one line each
//! (`flip-bits feedback bits=3 seed=7 at=1200`). A [`Line`] is what a publisher's messages pass through on their way out.
//! [`FaultyWire`] is the same for the loop in one thread. Nothing of the loop itself knows of it. Pure: no clock, no
//! files; random details come from a seed.
#![forbid(unsafe_code)]

mod by_name;
mod draw;
mod fault;
mod line;
mod text;
mod wire;

pub use draw::{SplitSeed, draw};
pub use fault::{Damage, Fault, Injection, MAX_AGE, Stream};
pub use line::{Carried, Line};
pub use text::FaultTextError;
pub use wire::FaultyWire;
