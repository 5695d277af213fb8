//! What a process has once it is on the bus, and how it talks with the supervisor.

use crate::disarm::DisarmDesk;
use crate::frame::{FrameError, write_frame};
use crate::part::{ChildSummary, FromChild, Pace, ToChild};
use crate::wishes::Wishes;
use ethercat_link::{BringUpError, LinkError};
use injection::Injection;
use realtime::{Wanted, obtain};
use signal_bus::{Bus, BusError};
use signals::Source;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{self, stdout};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use thiserror::Error;

/// Why a process can't do its work.
#[derive(Debug, Error)]
pub enum ChildError {
    /// What came over stdin.
    #[error("stdin: {0}")]
    Frame(#[from] FrameError),
    /// The supervisor said something out of order.
    #[error("the supervisor sent {found}, expected {expected}")]
    OutOfOrder {
        /// What it sent.
        found: &'static str,
        /// What was to come.
        expected: &'static str,
    },
    /// The part is another process's.
    #[error("this part is for {found}, expected one for {expected}")]
    WrongPart {
        /// The process it is for.
        found: Source,
        /// This process.
        expected: Source,
    },
    /// The generation's lock file.
    #[error("lock file: {0}")]
    Lock(io::Error),
    /// The socket for disarming.
    #[error("socket for disarming: {0}")]
    DisarmSocket(io::Error),
    /// A thread beside the cycle.
    #[error("a thread: {0}")]
    Thread(io::Error),
    /// The bus.
    #[error("bus: {0}")]
    Bus(#[from] BusError),
    /// The record.
    #[error("record: {0}")]
    Recording(#[from] recording::RecordingError),
    /// The interface of the drive.
    #[error("{interface}: {error}")]
    Link {
        /// Its name.
        interface: String,
        /// What is wrong with it.
        error: LinkError,
    },
    /// The drive.
    #[error("{interface}: {error}")]
    Drive {
        /// The interface that it is on.
        interface: String,
        /// What was found, and what was expected.
        error: BringUpError,
    },
    /// The histograms of loop timing.
    #[error("histogram: {0}")]
    Histogram(String),
}

/// What a process has once it is on the bus.
pub(crate) struct Child {
    pub(crate) source: Source,
    pub(crate) bus: Bus,
    pub(crate) pace: Pace,
    pub(crate) recorded: bool,
    pub(crate) timeline: closed_loop::Timeline,
    pub(crate) phase_ns: u64,
    pub(crate) early_ns: u64,
    pub(crate) wishes: Arc<Wishes>,
    pub(crate) wanted: Wanted,
    /// Faults planned before the start; `None` where none are allowed.
    pub(crate) injections: Option<Vec<Injection>>,
    /// Where operators disarm the valve straight away.
    pub(crate) disarm_desk: Option<Arc<DisarmDesk>>,
    pub(crate) orders: Receiver<ToChild>,
    /// Orders that came before the start.
    pub(crate) early: RefCell<VecDeque<ToChild>>,
}

/// The core of a process in lockstep, where there are two: trajectory and controller take turns, so they share one and hand
/// it to each other; the plant works beside them on the other. The recorder, which compresses, has a third where there is one; else it
/// has the plant's while that waits.
pub(crate) fn lockstep_core(source: Source) -> Option<usize> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    match source {
        _ if cores < 2 => None,
        Source::Trajectory | Source::Controller => Some(0),
        Source::Plant => Some(1),
        Source::Recorder => Some(if cores > 2 { 2 } else { 1 }),
        Source::Supervisor => None,
    }
}

impl Child {
    /// This process's core in lockstep.
    pub(crate) fn lockstep_core(&self) -> Option<usize> {
        lockstep_core(self.source)
    }

    /// Asks for the scheduling, says ready, waits for the start. `None`: the supervisor wants no start any more.
    pub(crate) fn ready(&self) -> Result<Option<u64>, ChildError> {
        let wanted = match self.pace {
            Pace::Realtime => self.wanted,
            // Waiting for each other under FIFO would starve the machine.
            Pace::Lockstep => Wanted { priority: None, core: self.lockstep_core(), lock_memory: false },
        };
        let (obtained, dma_latency) = obtain(&wanted);
        // Held until the process ends.
        std::mem::forget(dma_latency);
        write_frame(stdout(), &FromChild::Ready(obtained))?;
        loop {
            match self.orders.recv() {
                Ok(ToChild::Go { epoch_ns }) => return Ok(Some(epoch_ns)),
                // Somebody may want something of a recorder that takes over before it is told to go.
                Ok(order @ (ToChild::Mark(_) | ToChild::SaveTiming | ToChild::Inject(_))) => {
                    self.early.borrow_mut().push_back(order);
                }
                _ => return Ok(None),
            }
        }
    }

    /// The next order that came since, if any.
    pub(crate) fn order(&self) -> Option<ToChild> {
        self.early.borrow_mut().pop_front().or_else(|| self.orders.try_recv().ok())
    }

    /// Says something to the supervisor; one that is gone is noticed elsewhere.
    pub(crate) fn say(&self, words: &FromChild) {
        let _ = write_frame(stdout(), words);
    }

    /// Says that its cycles are done, and stays until nobody reads its messages any more.
    pub(crate) fn finish(&self, summary: ChildSummary) -> Result<(), ChildError> {
        write_frame(stdout(), &FromChild::Done(Box::new(summary)))?;
        // The last messages stay readable until the supervisor, or its absence, says that nobody wants them.
        while !self.wishes.finish() && !self.wishes.orphaned() {
            if self.orders.recv().is_err() {
                break;
            }
        }
        Ok(())
    }
}
