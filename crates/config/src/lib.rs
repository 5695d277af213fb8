//! Scenario and model files: text to validated data, and models back to text.
//!
//! No file is opened here: the caller reads the text and names it. Everything is checked once, and all errors of a file
//! are found in one go, each with line, column, what was found and what was expected. Angles, times, flows and the like
//! may carry units ("17deg", "40L/min"); bare numbers are SI.
#![forbid(unsafe_code)]

mod against_models;
mod asked;
mod bounds;
mod drive_file;
mod edit;
mod effects_file;
mod error;
mod model;
mod plan;
mod reachable;
mod reader;
mod scenario;
mod schema;
mod source;
mod suggest;
mod units;

pub use against_models::{belief_warnings, check_against_models};
pub use drive_file::parse_drive;
pub use edit::{Editable, Setting};
pub use effects_file::{OwnEffect, OwnParameter, parse_effects};
pub use error::{ConfigError, ConfigErrors};
pub use model::{ModelComments, parse_model, write_model};
pub use plan::{
    Design, DesignKind, FailureLimit, How, Named, Plan, Target, Task, Vary, parse_plan, says_the_same,
};
pub use scenario::{
    AfterStop, Compensation, Control, Damping, Drive, Driver, Encoder, FlowPressure, Homing, HomingMarks,
    HomingMethod, HomingSearch, LARGEST_ENCODER_DELAY_CYCLES, LostSteps, MotionLimits, OBSERVER_BANDWIDTH_HZ,
    Profile, Safety, Scenario, ScheduledSetPoint, SetPoint, TaskTiming, Timing, parse_scenario,
    usual_damping,
};
pub use schema::{FileKind, schema};
pub use units::{Dimension, QuantityError, parse_quantity};
