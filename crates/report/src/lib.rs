//! Self-contained HTML pages with plots: one file, no network, readable at ten million samples.
//!
//! A [`Page`] is made of sections of text, tables and plots; [`run_page`] makes the page of a run. Time signals
//! are reduced as they are handed over ([`TimeAxis::trace`]), so that neither the page nor the memory needed to
//! make it grows with the length of a run beyond one signal at a time; smallest and largest values survive.
//! Plots are drawn by uPlot (in `vendor/`) and the scripts in `src/page/`, both part of the page.
#![forbid(unsafe_code)]

mod document;
mod encode;
mod error;
mod histogram;
mod html;
mod hue;
mod linked;
mod opening_table;
mod page;
mod run_page;
mod strip;
mod table;
mod thinning;
mod time_axis;
mod time_plots;
mod view;
mod write;
mod xy_plot;

pub use document::Document;
pub use error::ReportError;
pub use histogram::{Distribution, Histogram};
pub use hue::Hue;
pub use linked::{Covariate, Linked, LinkedSeries};
pub use opening_table::{OpeningRow, OpeningTable};
pub use page::{Block, Page, Section};
pub use run_page::{RunData, run_page};
pub use strip::{Interval, Level, Marker, Strip};
pub use table::Table;
pub use time_axis::{TimeAxis, Trace};
pub use time_plots::{Line, Panel, Series, TimePlots};
pub use xy_plot::{Axis, Band, Style, XyPlot, XySeries};
