//! Campaigns: a plan becomes a design of runs, each run a row, and rows a table with what they show.
//!
//! Pure calculation: texts come in, rows go out. Every run follows from the plan and its own number alone, so it is the same on
//! whatever thread, shard or machine it is made, and in whatever order. [`log`] turns rows into bytes that survive a cut at any
//! place; who writes them and who lends the threads is the caller's business.
#![forbid(unsafe_code)]

mod base;
mod columns;
mod design;
mod diagnose;
mod effects;
mod error;
pub mod log;
mod plan;
mod recorded;
mod row;
mod run;

pub use base::{BaseTexts, Source};
pub use columns::{Column, Metric, Values, columns};
pub use effects::{Group, Level, Share, Shares, course, shares};
pub use error::CampaignError;
pub use plan::{Campaign, RunTexts};
pub use recorded::record;
pub use row::{Diagnosed, Failure, MotionMetrics, Row, Stage};
