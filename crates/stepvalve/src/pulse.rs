//! Signs of life where no terminal shows a bar: a line on stderr every few seconds, later every minute, for files of jobs and for
//! pipes.

use processes::complain;
use std::io::{IsTerminal, stderr};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// From the first line to the second, and at the most; in between each wait is half as long again as the one before.
const APART: Duration = Duration::from_secs(3);
const MOST_APART: Duration = Duration::from_secs(60);

/// Tells until it is dropped.
pub struct Pulse {
    running: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Pulse {
    /// Tells what `what` says, with the time that has passed, unless stderr is a terminal.
    pub fn new(what: impl Fn() -> String + Send + 'static) -> Self {
        if stderr().is_terminal() {
            return Self { running: None };
        }
        let (sender, dropped) = channel();
        let begun = Instant::now();
        let thread = std::thread::spawn(move || {
            let mut apart = APART;
            while dropped.recv_timeout(apart) == Err(RecvTimeoutError::Timeout) {
                complain(format_args!("{:7.1} s  {}", begun.elapsed().as_secs_f64(), what()));
                apart = (apart * 3 / 2).min(MOST_APART);
            }
        });
        Self { running: Some((sender, thread)) }
    }
}

impl Drop for Pulse {
    fn drop(&mut self) {
        if let Some((sender, thread)) = self.running.take() {
            drop(sender);
            // It says nothing that could fail.
            let _ = thread.join();
        }
    }
}
