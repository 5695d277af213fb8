//! The messages of the loop: one file each, their header, and the one check that every reader makes.
//!
//! A message is a [`Header`] followed by a body. Every field of both is eight bytes wide (`u64`, `i64` or
//! `f64`), so there is no padding, the layout is the same on every 64-bit machine, and the bytes are at the
//! same time a valid CDR payload for a `ros2msg` schema. Angles are radians, torques N·m, times seconds unless
//! the name ends in another unit.
#![forbid(unsafe_code)]

#[macro_use]
mod message;

mod body;
mod bus_status;
mod check;
mod codes;
mod control_status;
mod controller_snapshot;
mod feedback;
mod field;
mod header;
mod kinematics;
mod loop_timing;
mod operator_command;
mod plant_truth;
mod recorder_progress;
mod reference;
mod run_columns;
mod sequence;
mod set_point;
mod step_command;

pub use body::Body;
pub use bus_status::BusStatus;
pub use check::{Defect, Expectation, check};
pub use codes::{
    BusPhase, ControlParameter, ControllerState, FaultCode, HeldFlow, HomingPhase, OperatorKind,
    OperatorResult, Scheduling, SetPointKind, SetPointRefusal, Source,
};
pub use control_status::{ControlStatus, alarm, limiting};
pub use controller_snapshot::ControllerSnapshot;
pub use feedback::{Feedback, validity};
pub use field::{Field, Kind, MAX_ANGLE_RAD, MAX_MICROSTEPS, Rule};
pub use header::Header;
pub use kinematics::Kinematics;
pub use loop_timing::LoopTiming;
pub use message::Message;
pub use operator_command::OperatorCommand;
pub use plant_truth::PlantTruth;
pub use recorder_progress::RecorderProgress;
pub use reference::Reference;
pub use run_columns::{RUN_COLUMNS, RunColumn};
pub use sequence::{Arrival, SequenceTracker};
pub use set_point::SetPoint;
pub use step_command::StepCommand;
