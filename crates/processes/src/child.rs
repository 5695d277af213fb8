//! The life of a process, the same for all four: part, bus, ready, go, cycles, done, finish.

use crate::complain::complain;
use crate::disarm::DisarmDesk;
use crate::frame::{FrameError, read_frame, write_frame};
use crate::part::{ChildSummary, FromChild, Pace, Part, Task, ToChild};
use crate::{bridge, controller, plant, recorder, trajectory};
use ethercat_link::{BringUpError, LinkError};
use injection::Injection;
use realtime::{Wanted, obtain};
use signal_bus::{Bus, BusError};
use signals::Source;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, stdin, stdout};
use std::os::unix::process::parent_id;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
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

/// What the supervisor wants while the cycles run; written by a thread that listens, read by the loop.
#[derive(Debug, Default)]
pub(crate) struct Wishes {
    stop: AtomicBool,
    finish: AtomicBool,
    orphaned: AtomicBool,
}

impl Wishes {
    /// The cycles shall end now.
    pub(crate) fn stop(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.orphaned()
    }

    /// The process shall end.
    pub(crate) fn finish(&self) -> bool {
        self.finish.load(Ordering::Relaxed)
    }

    /// The supervisor is gone.
    pub(crate) fn orphaned(&self) -> bool {
        self.orphaned.load(Ordering::Relaxed)
    }
}

/// What a process has once it is on the bus.
pub(crate) struct Child {
    pub(crate) source: Source,
    pub(crate) bus: Bus,
    pub(crate) pace: Pace,
    pub(crate) recorded: bool,
    pub(crate) timeline: closed_loop::Timeline,
    pub(crate) phase_ns: u64,
    pub(crate) wishes: Arc<Wishes>,
    pub(crate) wanted: Wanted,
    /// Faults planned before the start; `None` where none are allowed.
    pub(crate) injections: Option<Vec<Injection>>,
    /// Where operators disarm the valve straight away.
    pub(crate) disarm_desk: Option<Arc<DisarmDesk>>,
    orders: Receiver<ToChild>,
    /// Orders that came before the start.
    early: RefCell<VecDeque<ToChild>>,
}

/// The core of a process in lockstep, where there are two: trajectory and controller take turns, so they share one and hand
/// it to each other; the plant works beside them on the other, and leaves it to the recorder while it waits.
pub(crate) fn lockstep_core(source: Source) -> Option<usize> {
    let two = std::thread::available_parallelism().is_ok_and(|cores| cores.get() >= 2);
    match source {
        Source::Trajectory | Source::Controller if two => Some(0),
        Source::Plant | Source::Recorder if two => Some(1),
        _ => None,
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

    fn finish(&self, summary: ChildSummary) -> Result<(), ChildError> {
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

/// Runs the process `source` to its end: the whole `main` of its binary.
pub fn run(source: Source) -> ExitCode {
    match live(source) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Whoever reads stdout may be gone; stderr is there for that.
            let refused = matches!(error, ChildError::Link { .. } | ChildError::Drive { .. });
            let words = if refused { FromChild::Refused } else { FromChild::Failed };
            let _ = write_frame(stdout(), &words(error.to_string()));
            complain(format_args!("{source}: {error}"));
            ExitCode::FAILURE
        }
    }
}

fn live(source: Source) -> Result<(), ChildError> {
    let Some(part) = read_part(source)? else { return Ok(()) };
    let lock = File::open(&part.membership.lock).map_err(ChildError::Lock)?;
    lock.lock_shared().map_err(ChildError::Lock)?;
    if parent_id() != part.membership.supervisor {
        // It died before the lock was held: the place may be another supervisor's by now.
        return Ok(());
    }
    let bus = Bus::open(&part.membership.place, part.membership.generation)?;
    let wishes = Arc::new(Wishes::default());
    let orders = listen(&wishes);
    let disarm_desk = part.disarm_socket.map(|path| DisarmDesk::open(&path)).transpose();
    let child = Child {
        source,
        bus,
        pace: part.pace,
        recorded: part.recorded,
        timeline: part.timeline,
        phase_ns: part.timing.phase_ns,
        wishes,
        wanted: Wanted {
            priority: part.timing.priority,
            core: part.timing.core,
            lock_memory: source != Source::Recorder,
        },
        injections: part.injections,
        disarm_desk: disarm_desk.map_err(ChildError::DisarmSocket)?,
        orders,
        early: RefCell::default(),
    };
    let summary = match part.task {
        Task::Plant(part) => plant::run(&child, *part),
        Task::Bridge(part) => bridge::run(&child, *part),
        Task::Trajectory(part) => trajectory::run(&child, *part),
        Task::Controller(part) => controller::run(&child, &part),
        Task::Recorder(part) => recorder::run(&child, &part),
    }?;
    match summary {
        Some(summary) => child.finish(summary),
        None => Ok(()),
    }
}

/// The part; `None` where the supervisor ended before it sent one.
fn read_part(source: Source) -> Result<Option<Part>, ChildError> {
    match read_frame(stdin())? {
        None => Ok(None),
        Some(ToChild::Part(part)) if part.task.source() == source => Ok(Some(*part)),
        Some(ToChild::Part(part)) => {
            Err(ChildError::WrongPart { found: part.task.source(), expected: source })
        }
        Some(_) => Err(ChildError::OutOfOrder { found: "another order", expected: "a part" }),
    }
}

/// Listens to the supervisor on a thread of the normal scheduler, so that the loop need not.
fn listen(wishes: &Arc<Wishes>) -> Receiver<ToChild> {
    let (sender, receiver) = channel();
    let wishes = Arc::clone(wishes);
    std::thread::spawn(move || hear(&wishes, &sender));
    receiver
}

fn hear(wishes: &Wishes, orders: &Sender<ToChild>) {
    loop {
        let order = read_frame::<ToChild>(stdin());
        match &order {
            Ok(Some(ToChild::Stop)) => wishes.stop.store(true, Ordering::Relaxed),
            Ok(Some(ToChild::Finish)) => {
                wishes.stop.store(true, Ordering::Relaxed);
                wishes.finish.store(true, Ordering::Relaxed);
            }
            Ok(Some(_)) => {}
            Ok(None) | Err(_) => {
                wishes.orphaned.store(true, Ordering::Relaxed);
                return;
            }
        }
        if let Ok(Some(order)) = order
            && orders.send(order).is_err()
        {
            return;
        }
    }
}
