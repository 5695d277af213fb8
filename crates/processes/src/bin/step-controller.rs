//! References and feedback to step commands.

use realtime::CountingAllocator;
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    processes::run(signals::Source::Controller)
}
