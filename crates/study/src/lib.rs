//! A log and a model to a whole answer: how the log is read, what the diagnosis finds, in words and files, and what to run next.
//!
//! What the command line and the Python package share. Numbers and texts come in, numbers and texts go out: no file is opened, and
//! nothing is printed. [`Threads`] has the processors and the clock that the diagnosis itself knows nothing of.
#![forbid(unsafe_code)]

mod answer;
mod best;
mod closed_loop;
pub mod experiment;
pub mod extended;
mod fix;
pub mod headline;
mod makers;
mod predicted;
pub mod quality;
mod readings;
mod residuals;
mod sines;
mod suspects;
mod threads;
pub mod unnamed;
pub mod words;

pub use answer::{Answer, Case, Question};
pub use fix::{Fixed, fixed};
pub use makers::cause_of;
pub use predicted::{Done, Task, predict_all, predicted, take_tasks};
pub use readings::{Reading, prepare, readings};
pub use residuals::{Residuals, Sampled};
pub use sines::largest_amplitude;
pub use suspects::{LawFile, suspects};
pub use threads::Threads;
