//! A thread beside the cycle, for pipes and sockets.

use std::io;
use std::thread::Builder;

/// Its stack: locked memory from end to end in a process of the loop, where the usual 2 MB of each would be a tenth of all it has.
const STACK_BYTES: usize = 256 << 10;

/// Starts one.
///
/// # Errors
/// Where the system has no more threads.
pub(crate) fn start(name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
    Builder::new().name(name.to_owned()).stack_size(STACK_BYTES).spawn(work).map(drop)
}
