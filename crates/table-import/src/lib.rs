//! Tables from elsewhere: text with separators, and the expressions that make a run's channels of columns.
//!
//! No process and no product's file is known here, so that a fuzzer can throw any bytes at it. Errors are for the person
//! who named the file: they say what was found, where, and what was expected. A missing sample is NaN throughout.
#![forbid(unsafe_code)]

mod cells;
mod clock;
mod columns;
mod expression;
mod filter;
mod functions;
mod interleaved;
mod lines;
mod operators;
mod rows;
mod separated;
mod table;
mod units;

pub use columns::{Columns, columns_of};
pub use expression::{Condition, Map};
pub use functions::functions_help;
pub use interleaved::Interleaved;
pub use rows::Rows;
pub use separated::{Format, Header, Separated, Separator, Skip};
pub use table::{CutLine, Selection, Table, Take, collect};
