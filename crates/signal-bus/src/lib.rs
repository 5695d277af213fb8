//! All services of the loop in one place, with their quality of service; the only crate that opens iceoryx2 services.
//!
//! A generation of processes meets in a [`Place`] of its own: a root directory and a prefix for names in shared
//! memory. The supervisor creates the services there, its children open them. Each service has one publisher.
//! Writing never waits: a reader that falls behind loses the oldest messages and counts them.
#![forbid(unsafe_code)]

mod bus;
mod error;
mod place;
mod reader;
mod services;
mod writer;

pub use bus::Bus;
pub use error::BusError;
pub use place::Place;
pub use reader::{CycleReader, Found, StreamReader};
pub use services::{RECORDER_DEPTH, Service};
pub use writer::Writer;
