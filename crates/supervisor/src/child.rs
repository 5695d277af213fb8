//! A child process: started, told its part, listened to.

use crate::handover::beside;
use crate::news::{Event, News};
use anyhow::{Context, Result};
use processes::{FromChild, ToChild, read_frame, write_frame};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, PidfdFlags, Signal, kill_process, pidfd_open};
use signals::Source;
use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt;
use std::process::{Child as Process, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

/// A child process.
pub struct Child {
    source: Source,
    number: u32,
    process: Process,
    orders: Option<ChildStdin>,
}

impl Child {
    /// Starts a process's program, from the folder of this program.
    ///
    /// # Errors
    /// Where the program is missing.
    pub fn start(source: Source, program: &str, number: u32, events: &Sender<News>) -> Result<Self> {
        let path = beside(program)?;
        let mut process = Command::new(&path)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            // Ctrl-C on the terminal is for the supervisor, which stops the valve first.
            .process_group(0)
            // The supervisor alone speaks to systemd.
            .env_remove("NOTIFY_SOCKET")
            .env_remove("WATCHDOG_PID")
            .env_remove("WATCHDOG_USEC")
            .spawn()
            .with_context(|| path.display().to_string())?;
        listen(&mut process, source, number, events)?;
        Ok(Self { source, number, orders: process.stdin.take(), process })
    }

    /// Sends an order.
    ///
    /// # Errors
    /// Where the child is gone.
    pub fn tell(&mut self, order: &ToChild) -> Result<()> {
        let pipe = self.orders.as_mut().with_context(|| format!("{} takes no more orders", self.source))?;
        write_frame(pipe, order).with_context(|| self.source.name())
    }

    /// Sends a signal to it.
    ///
    /// # Errors
    /// What the system says.
    pub fn signal(&self, signal: Signal) -> Result<()> {
        kill_process(self.pid(), signal).with_context(|| self.source.name())
    }

    /// Its process id; as long as nobody waits for it, no other process has it.
    pub fn pid(&self) -> Pid {
        Pid::from_child(&self.process)
    }

    /// Whether an event is this process's.
    pub fn is_origin(&self, event: &Event) -> bool {
        event.source == self.source && event.number == self.number
    }

    /// Waits for its end, with orders closed; kills it if it takes longer than `patience`.
    ///
    /// # Errors
    /// Where the system can't say.
    pub fn end(mut self, patience: Duration) -> Result<ExitStatus> {
        self.orders = None;
        let begun = Instant::now();
        loop {
            if let Some(status) = self.process.try_wait()? {
                return Ok(status);
            }
            if begun.elapsed() > patience {
                self.process.kill()?;
                return Ok(self.process.wait()?);
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

/// Hands on what the child says, and its death, from a thread of its own.
fn listen(process: &mut Process, source: Source, number: u32, events: &Sender<News>) -> Result<()> {
    let pidfd = pidfd_open(Pid::from_child(process), PidfdFlags::empty())
        .with_context(|| format!("{source}: pidfd_open"))?;
    let Some(mut pipe) = process.stdout.take() else { return Ok(()) };
    let events = events.clone();
    std::thread::spawn(move || {
        loop {
            let said = next_words(&mut pipe, &pidfd);
            let over = said.is_none();
            if events.send(News::Child(Event { source, number, said })).is_err() || over {
                return;
            }
        }
    });
    Ok(())
}

/// Waits for the child's next words, or its death: whatever else may still hold its stdout open.
fn next_words(pipe: &mut ChildStdout, pidfd: &OwnedFd) -> Option<FromChild> {
    let speaks = |timeout: Option<&Timespec>| {
        let mut watched = [PollFd::new(pipe, PollFlags::IN), PollFd::new(pidfd, PollFlags::IN)];
        loop {
            match poll(&mut watched, timeout) {
                Err(rustix::io::Errno::INTR) => {}
                _ => return watched.first().is_some_and(|pipe| !pipe.revents().is_empty()),
            }
        }
    };
    // Dead: what it had said before can still be read.
    if !speaks(None) && !speaks(Some(&Timespec { tv_sec: 0, tv_nsec: 0 })) {
        return None;
    }
    // After a damaged frame nothing more is read from this child.
    read_frame(pipe).ok().flatten()
}
