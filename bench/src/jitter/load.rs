//! What else the machine has to do: nothing, or one of stress-ng's loads.

use crate::programs::{Workplace, installed};
use anyhow::{Context, Result};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Load {
    /// Its name in tables.
    pub name: &'static str,
    /// stress-ng's options; none for an idle machine.
    pub options: &'static [&'static str],
}

/// All loads.
pub const LOADS: [Load; 4] = [
    Load { name: "idle", options: &[] },
    Load { name: "cpu", options: &["--cpu", "2"] },
    Load { name: "memory", options: &["--stream", "2"] },
    Load { name: "I/O", options: &["--hdd", "2", "--hdd-bytes", "64M", "--hdd-opts", "fsync"] },
];

/// A load under way; ends with this.
pub struct Running {
    stress: Option<Child>,
}

impl Load {
    /// Whether it can be made here.
    pub fn available(&self) -> bool {
        self.options.is_empty() || installed("stress-ng")
    }

    /// What it is, for tables.
    pub fn describe(&self) -> String {
        if self.options.is_empty() {
            return self.name.to_owned();
        }
        format!("{}: stress-ng {}", self.name, self.options.join(" "))
    }

    /// Starts it and gives it a second.
    ///
    /// # Errors
    /// Where stress-ng can't be started.
    pub fn start(&self, place: &Workplace) -> Result<Running> {
        if self.options.is_empty() {
            return Ok(Running { stress: None });
        }
        let folder = place.path("stress");
        std::fs::create_dir_all(&folder)?;
        let stress = Command::new("stress-ng")
            .args(self.options)
            .arg("--quiet")
            .arg("--temp-path")
            .arg(folder)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .context("stress-ng")?;
        std::thread::sleep(Duration::from_secs(1));
        Ok(Running { stress: Some(stress) })
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let Some(stress) = &mut self.stress else { return };
        // Asked to end, it ends its own workers and removes their files.
        if let Ok(pid) = i32::try_from(stress.id()) {
            let _ = kill(Pid::from_raw(pid), Signal::SIGTERM);
        }
        let _ = stress.wait();
    }
}
