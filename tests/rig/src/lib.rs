//! A rig that knows what it hides: from a seed it draws a valve, an experiment and a hidden effect, and "measures".
//!
//! It shares no friction code with the product: its equations of motion, its friction and its integrator (Radau IIA of
//! order 5, error-controlled) are its own, and where an effect's form is open, half of the seeds take another than the
//! one that the product's effects have. Only the names of the effects and what they mean are common.
#![forbid(unsafe_code)]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "test support: small arrays of known sizes; a failure here is the test's message"
)]

mod angle_plan;
mod campaign;
mod contact;
mod draw;
mod effect;
mod effects;
mod exact;
mod forms;
mod hidden;
mod jet;
mod judge;
mod law;
mod log_kind;
mod measure;
mod motion;
mod nominal;
mod ordered;
mod plan;
mod radau;
mod real;
mod spool;
mod surroundings;
mod torque_plan;
mod truth;

pub use campaign::Campaign;
pub use draw::choose;
pub use hidden::{Family, Gap, Hidden, LAWS, OUTSIDE, STRONG, WEAK, effects_of, gap_from_name, twins};
pub use judge::{Finding, Interval, Outcome, intervals};
pub use log_kind::LogKind;
pub use ordered::{OrderedRun, ordered};
pub use real::{Columns, Left, Normal};
pub use truth::{HiddenEffect, Imperfect, Truth};
