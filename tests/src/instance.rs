//! An instance under `stepvalve run`, as the black-box tests start, ask and end it.

use crate::{Finished, TestPlace};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

impl TestPlace {
    /// `stepvalve run` of a scenario as instance `name`, recorded to `out`; not waited for. A hang-up ends it, whatever the
    /// tests themselves were started under.
    pub fn spawn_instance(&self, name: &str, options: &[&str], scenario: &Path, out: &Path) -> Child {
        let mut command = self.within(Command::new("env"));
        command.arg("--default-signal=HUP").arg(crate::program("stepvalve"));
        command.args(["run", "--instance", name]).args(options).arg("--out").arg(out).arg(scenario);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    }

    /// The same, waited for until its controller has run a cycle.
    pub fn start_instance(&self, name: &str, options: &[&str], scenario: &Path, out: &Path) -> Child {
        let run = self.spawn_instance(name, options, scenario, out);
        self.wait_for("the instance", || {
            self.status()?["processes"]["step-controller"]["cycle"].as_u64().filter(|cycle| *cycle > 0)
        });
        run
    }

    /// Arms as soon as it isn't refused any more: a controller that has only just begun, or a drive that isn't in operation yet, says so.
    ///
    /// # Panics
    /// When it is refused for a minute, with the last refusal and the status.
    pub fn arm_when_ready(&self) {
        let begun = Instant::now();
        loop {
            let asked = self.stepvalve(&["arm"]);
            if asked.code == Some(0) {
                return;
            }
            assert!(
                begun.elapsed() < Duration::from_secs(60),
                "not armed in a minute: {}{}",
                asked.stderr,
                self.stepvalve(&["status"]).stdout
            );
            // Each refusal is a line on the instance's stderr, which nobody reads here before its end.
            sleep(Duration::from_millis(100));
        }
    }

    /// What `stepvalve status --json` says of the one instance here; `None` where there is none.
    pub fn status(&self) -> Option<Value> {
        serde_json::from_str(&self.stepvalve(&["status", "--json"]).stdout).ok()
    }
}

/// Sends a signal to an instance and waits for its end.
pub fn end_instance(run: Child, signal: Signal) -> Finished {
    kill(Pid::from_raw(run.id().cast_signed()), signal).unwrap();
    run.wait_with_output().unwrap().into()
}
