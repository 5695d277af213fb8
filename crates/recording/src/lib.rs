//! MCAP streams of the loop's messages: a writer that survives being killed, and a reader that takes what is left.
//!
//! One record is one or more segments (`REC-0001.mcap`, `REC-0002.mcap`, ...), each an MCAP file of its own.
//! Every message of the loop keeps its bits: the payload is a CDR header and the message as [`signals`] lays it
//! out, which a `ros2msg` schema describes, so that Foxglove, PlotJuggler and the Python reader open it.
//! What a recorder lost is declared on a channel of its own; the reader compares sequence numbers and says
//! what is missing without a declaration, too.
#![forbid(unsafe_code)]

mod any_message;
mod cdr;
mod codes;
mod error;
mod gap;
mod info;
mod ledger;
mod reader;
mod schema;
mod segment;
mod topic;
mod writer;

pub use any_message::AnyMessage;
pub use cdr::HEADER as CDR_HEADER;
pub use codes::{Codes, codes};
pub use error::RecordingError;
pub use gap::{Gap, GapOrigin, KnownGap};
pub use info::{RecordInfo, Texts};
pub use ledger::Tally;
pub use reader::{Note, Report, Segment, read_info, read_record};
pub use schema::{Schema, of_topic as schema_of};
pub use segment::Damage;
pub use topic::{Topic, bytes_per_cycle};
pub use writer::{INTERRUPTED, Writer};
