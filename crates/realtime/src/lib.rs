//! What a process needs to keep a cycle: scheduling, locked memory, the cyclic timer, and the timing it really kept.
//!
//! Beside `fmu-binary`, which no process of the loop links, the only crate that may hold `unsafe`.

mod alloc_count;
mod clock;
mod cyclic_timer;
mod dma_latency;
mod embassy_time;
mod loop_stats;
mod machine;
mod memory;
mod packet_socket;
mod packet_tap;
mod scheduling;

pub use alloc_count::{CountingAllocator, allocations_of_this_thread};
pub use clock::now_ns;
pub use cyclic_timer::{CyclicTimer, Wake};
pub use dma_latency::CpuDmaLatency;
pub use embassy_time::{tell_time, told_time};
pub use loop_stats::{LoopStats, LoopSummary, Percentiles};
pub use machine::machine_facts;
pub use memory::{PageFaults, lock_memory, page_faults_of_this_thread, prefault_stack};
pub use packet_socket::{PacketError, PacketSocket};
pub use packet_tap::{PacketTap, TappedFrame};
pub use scheduling::{Obtained, Wanted, cores, current_fifo_priority, obtain};
