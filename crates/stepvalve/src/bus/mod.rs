//! `stepvalve bus`: who is on a drive's bus, and what goes over it.

mod capture;
mod pcapng;
mod scan;

use supervisor::{Failure, Outcome};

/// What to do on the bus.
#[derive(clap::Subcommand)]
pub enum Command {
    /// Say who is there, and propose a drive file. Devices are taken to PRE-OP: not while a valve runs
    Scan(scan::Scan),
    /// Write the frames to a pcapng file, for Wireshark. Beside a valve that runs: it sends nothing
    Capture(capture::Capture),
}

/// Runs the command.
///
/// # Errors
/// [`Failure::Input`] for what can't be used; [`Failure::Failed`] where the bus or the disk fails.
pub fn run(command: &Command) -> Result<Outcome, Failure> {
    match command {
        Command::Scan(arguments) => scan::run(arguments),
        Command::Capture(arguments) => capture::run(arguments),
    }
}
