//! A model as a functional mock-up unit (FMI 2.0 and 3.0, co-simulation): its variables, its steps, its state as bytes, and the
//! description that an importer reads.
//!
//! Pure: neither file nor clock nor C. The C interface is crate `fmu-binary`; the command line packs both into a file.
#![forbid(unsafe_code)]

mod description;
mod error;
mod snapshot;
mod unit;
mod units;
mod variables;

pub use description::{Version, description, documentation, token};
pub use error::UnitError;
pub use snapshot::Snapshot;
pub use unit::Unit;
pub use variables::{Causality, Kind, Variable, Variables};

/// The name of the shared library, and of the model within the description.
pub const LIBRARY: &str = "stepvalve_fmu";
/// The model's file among the unit's resources.
pub const MODEL_FILE: &str = "model.toml";
