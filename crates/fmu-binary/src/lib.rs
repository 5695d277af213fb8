//! The shared library within a functional mock-up unit: FMI 2.0 and 3.0 for co-simulation, in one file.
//!
//! Beside `realtime` the only crate that may hold `unsafe`. All that it computes is in crate `fmu`; here are pointers, and the
//! promise that nothing unwinds into the importer: every entry goes through `instance::with` or `guarded`.

#[macro_use]
mod macros;

mod calls;
mod instance;
mod memory;
mod resources;
mod three;
mod two;
