//! What a unit refuses, in words for its importer's log.

use thiserror::Error;

/// Why a unit refuses.
#[derive(Debug, Error)]
pub enum UnitError {
    /// The model's text is no model.
    #[error("{0}")]
    Model(String),
    /// The model is none of a whole valve, or a number of it is forbidden.
    #[error("{0}")]
    Refused(#[from] valve_model::ParamError),
    /// No variable has this reference.
    #[error("found no variable with value reference {0} of this type")]
    Unknown(u32),
    /// The variable isn't the importer's to set.
    #[error("{0} is computed; expected an input or a parameter")]
    Computed(String),
    /// A value that is no number.
    #[error("{name}: found {value}, expected a finite number")]
    NoNumber {
        /// The variable.
        name: String,
        /// What it was to become.
        value: f64,
    },
    /// A parameter that is fixed once the simulation runs.
    #[error("{0} can be set before the initialisation ends only")]
    Fixed(String),
    /// A communication step that can't be made.
    #[error("found a communication step of {0} s, expected more than 0 s and at most 10 s")]
    Step(f64),
    /// The state is no number any more.
    #[error("the valve's state is no finite number at {0} s: are the inputs?")]
    NotFinite(f64),
    /// Bytes that are no state of this unit.
    #[error("these bytes are no state of this unit")]
    State,
}
