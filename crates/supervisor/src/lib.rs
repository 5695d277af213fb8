//! The supervisor: starts a generation of processes, watches it, ends it in the right order; restarts it where it is to
//! stay, and answers operators meanwhile.
//!
//! ```text
//!  services made ─▶ processes started, each told its part ─▶ all ready ─▶ go, with the common epoch
//!  ─▶ loop processes done ─▶ recorder finishes ─▶ everybody ends ─▶ nothing left
//! ```
//! A loop process that dies ends the generation: the plant's own guard stops the valve, and the plant ends last. A
//! recorder that dies is replaced by another that writes the next segment; the loop doesn't notice.
//!
//! The command line reads files and checks them, hands a [`Mission`] over and becomes `stepvalve-supervisor`; that program
//! links nothing that reads or writes HDF5 or makes pages, and becomes the command line again when the valve stands.
#![forbid(unsafe_code)]
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod angle_doubt;
mod child;
mod clients;
mod control;
mod disarm;
mod drive_fault;
mod exit;
mod generation;
mod handover;
mod inject;
mod instance;
mod instances;
mod interruption;
mod journal;
mod lock;
mod mission;
mod news;
mod notify;
mod operate;
mod parameters;
mod progress;
mod recorder_keeper;
mod request;
mod runtime_folder;
mod set_points;
mod status;
mod stay;
mod watch;

pub use control::{ask, ask_status, socket_path};
pub use disarm::disarm;
pub use exit::{Failure, Outcome};
pub use handover::{CONCLUDE, begin, conclude, received};
pub use instance::{Whereabouts, prefix, whereabouts};
pub use instances::{FoundInstance, base_folders, instances, without_a_folder};
pub use interruption::Interruption;
pub use journal::{Entry, EventKind, advice, advice_on_alarm, journal_path, older_journal_path};
pub use mission::{Conclusion, Ending, Mission, ProcessEnding, Timings};
pub use progress::Progress;
pub use request::{Answer, Request};
pub use runtime_folder::{InstanceName, base_folder, base_path, instance_folder};
pub use status::{ProcessStatus, Status};
pub use stay::supervise;
