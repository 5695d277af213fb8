//! A program watched until its end: how long it took, of the processor and of memory.

use anyhow::{Context, Result, bail};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// How often it is looked at: what it took of late may be missed.
const LOOK: Duration = Duration::from_millis(5);

/// What a program took.
#[derive(Debug, Clone, Copy)]
pub struct Taken {
    /// From its start to its end, s.
    pub wall_s: f64,
    /// Processor time, s.
    pub cpu_s: f64,
    /// Largest resident memory, MB.
    pub memory_mb: f64,
}

/// Runs a program whose output nobody wants.
///
/// # Errors
/// Where it can't be run, or fails.
pub fn run(command: &mut Command) -> Result<Taken> {
    let begun = Instant::now();
    let mut process = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
    watch(&mut process, begun).with_context(|| format!("{command:?}"))
}

/// Waits for the end of one that was begun then.
///
/// # Errors
/// Where it fails.
pub fn watch(process: &mut Child, begun: Instant) -> Result<Taken> {
    let (mut ticks, mut memory_kb) = (0, 0);
    let status = loop {
        ticks = ticks.max(processor_ticks(process.id()).unwrap_or(0));
        memory_kb = memory_kb.max(resident_kb(process.id()).unwrap_or(0));
        if let Some(status) = process.try_wait()? {
            break status;
        }
        std::thread::sleep(LOOK);
    };
    if !status.success() {
        bail!("{status}");
    }
    Ok(Taken {
        wall_s: begun.elapsed().as_secs_f64(),
        // Linux counts in hundredths of a second towards programs, whatever its own tick.
        cpu_s: ticks as f64 / 100.0,
        memory_mb: memory_kb as f64 / 1024.0,
    })
}

/// User and system time.
fn processor_ticks(pid: u32) -> Option<u64> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut next = || fields.next()?.parse::<u64>().ok();
    Some(next()? + next()?)
}

fn resident_kb(pid: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?.split_whitespace().next()?.parse().ok()
}
