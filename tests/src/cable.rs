//! A cable for EtherCAT without hardware or root: a pair of virtual interfaces in a network namespace of the test's own, with the
//! simulated drive at its far end.

use crate::bench_place::machine;
use crate::program;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use test_needs::{skip_on_this_machine, skip_without};

/// Set in a test that runs again inside its namespace.
const INSIDE: &str = "STEPVALVE_TEST_NAMESPACE";

/// The interface of the main device.
pub const NEAR: &str = "bus0";
/// The interface of the simulated drive.
pub const FAR: &str = "bus1";

/// Runs `test`, which is the test function named `name`, in a user and network namespace of its own, where [`NEAR`] and
/// [`FAR`] are connected. Skips loudly where this machine allows none.
///
/// # Panics
/// Where the test fails.
pub fn on_a_cable(name: &str, test: impl FnOnce()) {
    if std::env::var_os(INSIDE).is_some() {
        lay_cable();
        return test();
    }
    if Command::new("ip").arg("-V").output().is_err() {
        return skip_without("ip (iproute2)");
    }
    let allowed =
        Command::new("unshare").args(["-Urn", "ip", "link", "add", "name", NEAR, "type", "veth"]).output();
    match allowed {
        Ok(output) if output.status.success() => {}
        Ok(output) => {
            let reason = String::from_utf8_lossy(&output.stderr).trim().to_owned();
            return skip_on_this_machine(&format!(
                "no network namespace for nobody (unshare -Urn): {reason}"
            ));
        }
        Err(error) => return skip_on_this_machine(&format!("unshare: {error}")),
    }
    // The test inside is a program of its own, which does not see that others of this one wait.
    let _machine = machine();
    let status = Command::new("unshare")
        .arg("-Urn")
        .arg(std::env::current_exe().unwrap())
        .args([name, "--exact", "--nocapture"])
        .env(INSIDE, "1")
        .status()
        .unwrap();
    assert!(status.success(), "{name}, in its namespace: {status}");
}

fn lay_cable() {
    let commands: [&[&str]; 4] = [
        &["link", "add", "name", NEAR, "type", "veth", "peer", "name", FAR],
        &["link", "set", NEAR, "up"],
        &["link", "set", FAR, "up"],
        &["link", "set", "lo", "up"],
    ];
    for arguments in commands {
        let status = Command::new("ip").args(arguments).status().unwrap();
        assert!(status.success(), "ip {arguments:?}: {status}");
    }
}

/// The simulated drive as a process at the far end of the cable.
pub struct DriveProcess {
    process: Child,
    orders: Option<ChildStdin>,
}

impl DriveProcess {
    /// Starts it, moving the valve of `model`, and waits until it answers frames.
    ///
    /// # Panics
    /// Where it does not start.
    pub fn start(model: &Path, arguments: &[&str]) -> Self {
        let mut process = Command::new(program("subdevice"))
            .args(["--interface", FAR, "--model"])
            .arg(model)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        assert_eq!(line, "ready\n");
        let orders = process.stdin.take();
        Self { process, orders }
    }

    /// Something goes wrong: a line that the drive's process knows.
    ///
    /// # Panics
    /// Where the process has ended.
    pub fn hurt(&mut self, line: &str) {
        writeln!(self.orders.as_mut().unwrap(), "{line}").unwrap();
    }

    /// Ends it; its log is written then.
    ///
    /// # Panics
    /// Where it failed.
    pub fn end(mut self) {
        drop(self.orders.take());
        let status = self.process.wait().unwrap();
        assert!(status.success(), "subdevice: {status}");
    }
}

impl Drop for DriveProcess {
    fn drop(&mut self) {
        drop(self.orders.take());
        let _ = self.process.wait();
    }
}
