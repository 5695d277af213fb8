//! A child process: started, told its part, listened to.

use crate::control::Asked;
use anyhow::{Context, Result};
use processes::{FromChild, Part, ToChild, read_frame, write_frame};
use signals::Source;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child as Process, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

/// Something that a child said, or its end.
pub struct Event {
    /// Who.
    pub source: Source,
    /// Counts the processes started, so that a dead recorder's last words aren't taken for its successor's.
    pub number: u32,
    /// What; `None` when its stdout ended: it is dead or dying.
    pub said: Option<FromChild>,
}

/// What the supervisor waits for: a child's words, or an operator's wish.
pub enum News {
    /// From a child.
    Child(Event),
    /// From the control socket.
    Asked(Asked),
}

/// A child process.
pub struct Child {
    source: Source,
    number: u32,
    process: Process,
    orders: Option<ChildStdin>,
}

impl Child {
    /// Starts the program of `part`'s process, from the folder of this program, and tells it its part.
    ///
    /// # Errors
    /// Where the program is missing or can't be told.
    pub fn start(part: Part, number: u32, events: &Sender<News>) -> Result<Self> {
        let source = part.task.source();
        let path = program(source)?;
        let mut process = Command::new(&path)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            // Ctrl-C on the terminal is for the supervisor, which stops the valve first.
            .process_group(0)
            .spawn()
            .with_context(|| path.display().to_string())?;
        listen(&mut process, source, number, events);
        let mut child = Self { source, number, orders: process.stdin.take(), process };
        child.tell(&ToChild::Part(Box::new(part)))?;
        Ok(child)
    }

    /// Sends an order.
    ///
    /// # Errors
    /// Where the child is gone.
    pub fn tell(&mut self, order: &ToChild) -> Result<()> {
        let pipe = self.orders.as_mut().with_context(|| format!("{} takes no more orders", self.source))?;
        write_frame(pipe, order).with_context(|| self.source.name())
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

/// Hands on what the child says, from a thread of its own.
fn listen(process: &mut Process, source: Source, number: u32, events: &Sender<News>) {
    let Some(mut pipe) = process.stdout.take() else { return };
    let events = events.clone();
    std::thread::spawn(move || {
        loop {
            // A frame that can't be read is the end of sensible speech.
            let said = read_frame(&mut pipe).ok().flatten();
            let over = said.is_none();
            if events.send(News::Child(Event { source, number, said })).is_err() || over {
                return;
            }
        }
    });
}

/// The program beside this one.
fn program(source: Source) -> Result<PathBuf> {
    let own = std::env::current_exe().context("path of this program")?;
    let path = own.with_file_name(source.name());
    path.exists().then_some(()).with_context(|| format!("{} is missing beside stepvalve", path.display()))?;
    Ok(path)
}
