//! The supervisor: starts a generation, watches it, ends it in the right order; restarts it where it is to stay.
//!
//! ```text
//!  services made ─▶ processes started, each told its part ─▶ all ready ─▶ go, with the common epoch
//!  ─▶ loop processes done ─▶ recorder finishes ─▶ everybody ends ─▶ nothing left
//! ```
//! A loop process that dies ends the generation: the plant's own guard stops the valve, and the plant ends last. A
//! recorder that dies is replaced by another that writes the next segment; the loop doesn't notice.

mod child;
mod generation;
mod inject;
mod notify;
mod operate;
mod progress;
mod watch;

use crate::files::Loaded;
use crate::instance::Instance;
use crate::output::Output;
use crate::signals::Interruption;
use crate::summary::ProcessSummary;
use anyhow::Result;
use generation::{DiedAtStart, Generation};
use injection::Injection;
use processes::complain;
use processes::{Keep, Mode};
use recording::RecordInfo;
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

pub use child::News;
pub use progress::Progress;

/// A generation is started anew so often,
const MAX_RESTARTS: usize = 3;
/// within this time.
const RESTART_WINDOW: Duration = Duration::from_secs(600);

/// Processes of a generation at its start.
const PROCESSES: u32 = 4;

/// A run to supervise.
pub struct Setup<'a> {
    /// Whose run it is.
    pub instance: &'a Instance,
    /// Its name.
    pub name: String,
    /// Real time or lockstep.
    pub pace: Mode,
    /// The scenario.
    pub loaded: &'a Loaded,
    /// Where the record goes.
    pub output: &'a Output,
    /// How much of it is kept.
    pub keep: Keep,
    /// What the record says of itself.
    pub info: RecordInfo,
    /// Faults to inject; `None` where none are allowed, now or later.
    pub injections: Option<Vec<Injection>>,
    /// Whether degraded scheduling is refused.
    pub require_realtime: bool,
    /// Whether the user wants it to end.
    pub interruption: Interruption,
}

/// How a generation ended.
pub struct Ending {
    /// What each process had to say.
    pub processes: BTreeMap<String, ProcessSummary>,
    /// Messages that the supervisor itself published.
    pub published: u64,
    /// Whether the user ended it.
    pub interrupted: bool,
    /// What went wrong.
    pub failure: Option<String>,
    /// How often the recorder had to be replaced.
    pub recorder_restarts: u32,
}

impl Ending {
    /// Of a generation that never ran.
    fn stillborn(failure: String) -> Self {
        Self {
            processes: BTreeMap::new(),
            published: 0,
            interrupted: false,
            failure: Some(failure),
            recorder_restarts: 0,
        }
    }
}

/// How an instance ended.
#[derive(Debug, Serialize)]
pub struct Stay {
    /// Starts of the processes.
    pub generations: u64,
    /// What went wrong for good.
    pub failure: Option<String>,
    /// Messages that the supervisor itself published in the last generation.
    pub published: u64,
    /// What each process had to say in the last generation.
    pub processes: BTreeMap<String, ProcessSummary>,
}

/// Where children and operators are heard.
pub struct Channel {
    sender: Sender<News>,
    receiver: Receiver<News>,
}

impl Channel {
    /// An empty one.
    pub fn new() -> Self {
        let (sender, receiver) = channel();
        Self { sender, receiver }
    }

    /// Its entrance.
    pub fn sender(&self) -> Sender<News> {
        self.sender.clone()
    }
}

/// The generation number in messages: 0 without a clock, so that recordings are identical.
pub fn generation_of(realtime: bool) -> u64 {
    u64::from(realtime)
}

/// Runs one generation to its end.
///
/// # Errors
/// Where it could not be started. What goes wrong later is in [`Ending::failure`].
pub fn run(setup: &Setup) -> Result<Ending> {
    let channel = Channel::new();
    let mut generation = Generation::start(setup, &channel, 0)?;
    while generation.goes_on() {
        generation.look_around();
    }
    Ok(generation.end())
}

/// Keeps an instance alive until the user ends it, or its processes die too often.
///
/// # Errors
/// Where the first generation could not be started.
pub fn stay(mut setup: Setup, channel: &Channel) -> Result<Stay> {
    let mut deaths = VecDeque::new();
    let mut started = 0;
    loop {
        let ending = match Generation::start(&setup, channel, started) {
            Ok(mut generation) => {
                notify::ready(setup.info.generation);
                while generation.goes_on() {
                    generation.look_around();
                    generation.answer_waiting();
                }
                started = generation.started();
                if !generation.failed() {
                    notify::stopping();
                }
                generation.end()
            }
            Err(error) if error.is::<DiedAtStart>() => {
                // Whatever was started then, nobody's last words may be taken for its successor's.
                started += PROCESSES;
                Ending::stillborn(format!("{error:#}"))
            }
            Err(error) => return Err(error),
        };
        // What a killed process left in shared memory goes now, not at the instance's end.
        setup.instance.place(setup.info.generation).wipe()?;
        let stay = |failure| Stay {
            generations: setup.info.generation,
            failure,
            published: ending.published,
            processes: ending.processes.clone(),
        };
        let Some(failure) = ending.failure.clone() else { return Ok(stay(None)) };
        complain(&failure);
        deaths.push_back(Instant::now());
        deaths.retain(|death: &Instant| death.elapsed() < RESTART_WINDOW);
        if ending.interrupted || deaths.len() > MAX_RESTARTS {
            let why = format!("{failure}; {} starts in {} min", deaths.len(), RESTART_WINDOW.as_secs() / 60);
            return Ok(stay(Some(why)));
        }
        complain("starting again, disarmed");
        setup.info.generation += 1;
    }
}
