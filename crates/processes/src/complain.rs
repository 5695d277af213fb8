//! What a process says on stderr. A reader that has gone is no reason to die: a terminal closes while a valve turns.

use std::fmt::Display;
use std::io::{Write, stderr};

/// Writes a line to stderr, where anybody listens.
pub fn complain(line: impl Display) {
    // `eprintln!` panics where the reader has gone.
    let _ = writeln!(stderr(), "{line}");
}
