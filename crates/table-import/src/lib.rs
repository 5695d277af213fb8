//! Tables from elsewhere: text with separators, and the expressions that make a run's channels of columns.
//!
//! No process and no product's file is known here, so that a fuzzer can throw any bytes at it. Errors are for the person
//! who named the file: they say what was found, where, and what was expected.
#![forbid(unsafe_code)]

mod expression;
mod rows;
mod separated;
mod table;

pub use expression::Map;
pub use rows::Rows;
pub use separated::{Format, Header, Separated, Separator};
pub use table::{Limits, Table, Take, collect};
