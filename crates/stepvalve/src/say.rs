//! What a command prints on stdout. A reader that has seen enough (`| head`) is no failure.

use std::fmt::Display;
use std::io::{Write, stdout};

/// Prints a line.
pub fn say(line: impl Display) {
    let _ = is_heard(line);
}

/// Prints a line; whether anybody listens: a closed pipe means that nobody does any more.
pub fn is_heard(line: impl Display) -> bool {
    writeln!(stdout(), "{line}").is_ok()
}
