//! SIGINT, SIGTERM and SIGHUP as flags that the supervisor looks at: each of them is a clean stop.

use anyhow::{Context, Result};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::os::raw::c_int;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether somebody wants this process to end.
#[derive(Debug, Clone, Default)]
pub struct Interruption {
    any: Arc<AtomicBool>,
    terminated: Arc<AtomicBool>,
}

impl Interruption {
    /// Looks for the signals from now on. A hang-up that this process was told to ignore (nohup) stays ignored.
    ///
    /// # Errors
    /// Where the system refuses a handler.
    pub fn watch() -> Result<Self> {
        let this = Self::default();
        let mut wanted = vec![(SIGINT, &this.any), (SIGTERM, &this.any), (SIGTERM, &this.terminated)];
        if !is_ignored(SIGHUP) {
            wanted.push((SIGHUP, &this.any));
        }
        for (signal, flag) in wanted {
            signal_hook::flag::register(signal, Arc::clone(flag)).context("signal handler")?;
        }
        Ok(this)
    }

    /// One of the signals came.
    pub fn wanted(&self) -> bool {
        self.any.load(Ordering::Relaxed)
    }

    /// SIGTERM came.
    pub fn terminated(&self) -> bool {
        self.terminated.load(Ordering::Relaxed)
    }
}

/// Whether this process ignores a signal, as the kernel tells.
fn is_ignored(signal: c_int) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask & (1 << (signal - 1)) != 0
}
