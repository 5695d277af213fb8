//! What a command prints on stdout. A reader that has seen enough (`| head`) is no failure.

use std::fmt::Display;
use std::io::{Write, stdout};

/// Prints a line.
pub fn say(line: impl Display) {
    // A closed pipe means that nobody listens any more.
    let _ = writeln!(stdout(), "{line}");
}
