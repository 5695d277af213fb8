//! SIGINT and SIGTERM as flags that the supervisor looks at.

use anyhow::{Context, Result};
use signal_hook::consts::{SIGINT, SIGTERM};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether somebody wants this process to end.
#[derive(Debug, Clone, Default)]
pub struct Interruption {
    any: Arc<AtomicBool>,
    terminated: Arc<AtomicBool>,
}

impl Interruption {
    /// Looks for both signals from now on.
    ///
    /// # Errors
    /// Where the system refuses a handler.
    pub fn watch() -> Result<Self> {
        let this = Self::default();
        for (signal, flag) in [(SIGINT, &this.any), (SIGTERM, &this.any), (SIGTERM, &this.terminated)] {
            signal_hook::flag::register(signal, Arc::clone(flag)).context("signal handler")?;
        }
        Ok(this)
    }

    /// Either signal came.
    pub fn wanted(&self) -> bool {
        self.any.load(Ordering::Relaxed)
    }

    /// SIGTERM came.
    pub fn terminated(&self) -> bool {
        self.terminated.load(Ordering::Relaxed)
    }
}
