//! Expressions in named variables, such as `a*speed*abs(speed)`: their text becomes a short program for a stack of numbers.
//!
//! A [`Program`] is plain data. It runs without heap in a bounded number of operations, on numbers, on numbers with their
//! derivatives ([`Dual`]), on intervals ([`Interval`]), by which [`pole`] finds where it would have no finite value, or on dimensions, by
//! which [`dimension`] finds unlike quantities in a sum.
//!
//! ```
//! # fn main() -> Result<(), expression::ExpressionError> {
//! let program = expression::compile("a*speed*abs(speed)", &["speed"], &[("a", 0.006)])?;
//! assert_eq!(program.run(&[-2.0]), -0.024);
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]

mod dimension;
mod error;
mod function;
mod interval;
mod number;
mod parse;
mod poles;
mod program;
mod token;
mod unit;

pub use dimension::{Dimension, dimension};
pub use error::ExpressionError;
pub use interval::Interval;
pub use number::{Dual, Number};
pub use parse::{MOST_BYTES, MOST_INSTRUCTIONS, compile, free_names};
pub use poles::{Pole, pole};
pub use program::Program;
pub use unit::unit;
