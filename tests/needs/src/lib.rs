//! What tests need beside this repository, and the one rule for skipping where it is missing.
//!
//! A test that can't run says so past the test harness, which keeps the output of passing tests to itself. Under
//! `STEPVALVE_CI=1`, which `.ci/run` sets, a test skipped for something that could be installed fails. A test that the
//! machine itself can't run is skipped there too, and says why.
#![forbid(unsafe_code)]

mod filter;
mod python;
mod skip;

pub use filter::there_and_back;
pub use python::{python, python_with_browser};
pub use skip::{skip_on_this_machine, skip_without};
