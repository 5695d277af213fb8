//! The simulated drive as a process of its own, at the far end of a cable of two virtual interfaces: how tests and benchmarks
//! start it, hurt it, and read its log.

use crate::device::SyncRow;
use std::ffi::OsStr;
use std::io::{self, BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};

/// The interface of the main device.
pub const NEAR: &str = "bus0";
/// The interface of the simulated drive.
pub const FAR: &str = "bus1";

/// What the program's log begins with.
pub const LOG_HEADER: &str = "host_ns,start,end,fresh,age_ns,status,control,al";

/// Connects [`NEAR`] and [`FAR`] in the present network namespace.
///
/// # Errors
/// Where `ip` is missing or refuses.
pub fn lay_cable() -> io::Result<()> {
    ip(&["link", "add", "name", NEAR, "type", "veth", "peer", "name", FAR])?;
    for interface in [NEAR, FAR, "lo"] {
        ip(&["link", "set", interface, "up"])?;
    }
    Ok(())
}

fn ip(arguments: &[&str]) -> io::Result<()> {
    let output = Command::new("ip").args(arguments).output()?;
    if output.status.success() {
        return Ok(());
    }
    let reason = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    Err(io::Error::other(format!("ip {}: {reason}", arguments.join(" "))))
}

/// The simulated drive as a process.
#[derive(Debug)]
pub struct DriveProcess {
    process: Child,
    orders: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
}

impl DriveProcess {
    /// Starts `program` on [`FAR`], moving the valve of `model`, and waits until it answers frames.
    ///
    /// # Errors
    /// Where it does not start.
    pub fn start(program: &Path, model: &Path, arguments: &[impl AsRef<OsStr>]) -> io::Result<Self> {
        let mut process = Command::new(program)
            .args(["--interface", FAR, "--model"])
            .arg(model)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let orders = process.stdin.take();
        let answers = process.stdout.take().ok_or_else(|| io::Error::other("no stdout"))?;
        let mut this = Self { process, orders, answers: BufReader::new(answers) };
        match this.answer()?.as_str() {
            "ready\n" => Ok(this),
            found => {
                Err(io::Error::other(format!("{}: said {found:?}, expected \"ready\"", program.display())))
            }
        }
    }

    fn answer(&mut self) -> io::Result<String> {
        let mut line = String::new();
        self.answers.read_line(&mut line)?;
        Ok(line)
    }

    /// Something goes wrong: a line that the program knows. When it did, on CLOCK_MONOTONIC, ns.
    ///
    /// # Errors
    /// Where the process has ended, or does not know the line.
    pub fn hurt(&mut self, line: &str) -> io::Result<u64> {
        let orders = self.orders.as_mut().ok_or_else(|| io::Error::other("the drive has ended"))?;
        writeln!(orders, "{line}")?;
        let answer = self.answer()?;
        answer.trim().parse().map_err(|_| io::Error::other(format!("{line}: the drive says {answer:?}")))
    }

    /// Ends it; its log is written then.
    ///
    /// # Errors
    /// What the system says.
    pub fn end(mut self) -> io::Result<ExitStatus> {
        drop(self.orders.take());
        self.process.wait()
    }
}

impl Drop for DriveProcess {
    fn drop(&mut self) {
        drop(self.orders.take());
        let _ = self.process.wait();
    }
}

/// Writes a log.
///
/// # Errors
/// What the system says.
pub fn write_log(path: &Path, rows: &[SyncRow]) -> io::Result<()> {
    let mut file = io::BufWriter::new(std::fs::File::create(path)?);
    writeln!(file, "{LOG_HEADER}")?;
    for row in rows {
        let SyncRow { host_ns, start, end, fresh, age_ns, status, control, al } = row;
        writeln!(file, "{host_ns},{start},{end},{},{age_ns},{status},{control},{al}", u8::from(*fresh))?;
    }
    file.flush()
}

/// Reads a log.
///
/// # Errors
/// A line that is none of a log.
pub fn read_log(path: &Path) -> io::Result<Vec<SyncRow>> {
    let text = std::fs::read_to_string(path)?;
    text.lines().skip(1).map(|line| row(line).ok_or_else(|| io::Error::other(format!("{line:?}")))).collect()
}

fn row(line: &str) -> Option<SyncRow> {
    let numbers: Option<Vec<i64>> = line.split(',').map(|number| number.parse().ok()).collect();
    let [host_ns, start, end, fresh, age_ns, status, control, al] = *numbers? else { return None };
    Some(SyncRow {
        host_ns: host_ns.try_into().ok()?,
        start,
        end,
        fresh: fresh == 1,
        age_ns: age_ns.try_into().ok()?,
        status: status.try_into().ok()?,
        control: control.try_into().ok()?,
        al: al.try_into().ok()?,
    })
}
