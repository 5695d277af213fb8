//! Keeps the CPU from deep sleep: the kernel honours the wish while the file is open.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};

/// /dev/cpu_dma_latency, held at 0 µs until dropped.
#[derive(Debug)]
pub struct CpuDmaLatency {
    _file: File,
}

impl CpuDmaLatency {
    /// Asks for a wake-up latency of 0 µs.
    ///
    /// # Errors
    /// Where the file is missing or this user may not write it.
    pub fn hold() -> io::Result<Self> {
        let mut file = OpenOptions::new().write(true).open("/dev/cpu_dma_latency")?;
        file.write_all(&0_i32.to_ne_bytes())?;
        Ok(Self { _file: file })
    }
}
