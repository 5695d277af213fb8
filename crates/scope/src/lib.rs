//! A running instance seen live: a server on this machine alone, which reads the bus as an observer, keeps the last seconds of
//! every message, waits for triggers, saves captures, and shows all of it on one page.
//!
//! ```text
//!  bus ─▶ observer ─▶ hub: history ─▶ trigger ─▶ capture ─▶ MCAP (and HDF5, by `stepvalve convert`)
//!                       │
//!                       └─▶ one queue a client ─▶ its thread ─▶ page or Foxglove viewer
//! ```
//! One thread reads the bus, whatever clients do: a client that stops reading fills its own queue, and is told what it missed.
//! docs/scope.md is the guide.
#![forbid(unsafe_code)]

mod aside;
mod block;
mod capture;
mod client;
mod foxglove;
mod frame;
mod history;
mod http;
mod hub;
mod mailbox;
mod observer;
mod page;
mod request;
mod server;
mod signal;
mod store;
mod token;
mod trigger;

pub use capture::CAPTURE_NOTE;
pub use server::{Opened, Options, ScopeError, serve};
pub use trigger::{Condition, Machine, Mode, Settings, Slope, State, Unusable, Window};
