//! Trajectory, step-control, drive and plant as the three roles of the loop, and all of them wired in one thread.
//!
//! A role takes the messages of a cycle and gives the messages of that cycle: the processes call the same functions,
//! so that real time, lockstep and in process agree bit for bit.
#![forbid(unsafe_code)]

mod controller;
mod encoder;
mod in_process;
mod marks;
mod measure;
mod metrics;
mod operated;
mod plant;
mod plant_start;
mod pulses;
mod run_table;
mod snapshot;
mod timeline;
mod trajectory;
mod wire;
mod wiring;

pub use crate::trajectory::{DueSetPoint, TrajectoryPart, TrajectoryRole};
pub use controller::{ControllerPart, ControllerRole};
pub use encoder::EncoderParams;
pub use in_process::{Arrived, CycleMessages, CycleOutputs, InProcess};
pub use marks::Marks;
pub use measure::{Level, Outcome, measure, measure_parts, wire_level};
pub use metrics::{Metrics, Spread};
pub use operated::{Operated, Wanted};
pub use plant::{PlantPart, PlantRole, PlantSample};
pub use plant_start::PlantStart;
pub use run_table::{RunSignal, RunTable};
pub use snapshot::{Snapshot, SnapshotReader, SnapshotSender, snapshot_every_cycles};
pub use timeline::{ARM_CYCLE, Timeline};
pub use wire::{Perfect, Presence, Wire};
pub use wiring::{Parts, WiringError, wire, wire_like};
