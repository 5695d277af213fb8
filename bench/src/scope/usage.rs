//! What a process uses, as the kernel tells.

use anyhow::{Context, Result};

/// The kernel counts processor time in these, everywhere: USER_HZ.
const TICKS_PER_SECOND: f64 = 100.0;

/// Memory and processor time of a process.
#[derive(Debug, Clone, Copy)]
pub(super) struct Usage {
    pub(super) resident_kb: u64,
    pub(super) cpu_s: f64,
}

impl Usage {
    /// Now.
    ///
    /// # Errors
    /// Where the process is gone.
    pub(super) fn of(pid: u32) -> Result<Self> {
        let status = std::fs::read_to_string(format!("/proc/{pid}/status"))?;
        let resident = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let resident = resident.and_then(|text| text.trim().split(' ').next()).context("no VmRSS")?;
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat"))?;
        // Behind the name, which may hold anything: field 3 is the first.
        let fields = stat.rsplit_once(')').context("no name in stat")?.1;
        let ticks: Vec<f64> = fields.split_whitespace().skip(11).take(2).flat_map(str::parse).collect();
        Ok(Self { resident_kb: resident.parse()?, cpu_s: ticks.iter().sum::<f64>() / TICKS_PER_SECOND })
    }
}
