//! The valve itself: a real drive on EtherCAT.

use realtime::CountingAllocator;
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    processes::run(signals::Source::Plant)
}
