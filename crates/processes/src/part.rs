//! What supervisor and processes say to each other.

use closed_loop::{ControllerPart, PlantPart, Timeline, TrajectoryPart};
use ethercat_link::BridgeParams;
use injection::Injection;
use realtime::{LoopSummary, Obtained, PageFaults};
use recording::RecordInfo;
use serde::{Deserialize, Serialize};
use signal_bus::Place;
use signals::Source;
use std::path::PathBuf;

/// How the loop is paced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Pace {
    /// Every process on its own absolute deadlines.
    Realtime,
    /// Every process waits for the messages that it needs; no clock.
    Lockstep,
}

/// When and where a process runs in real time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct TaskTiming {
    /// Its deadline after the beginning of each cycle, ns.
    pub phase_ns: u64,
    /// The core to stay on; `None` for any.
    pub core: Option<usize>,
    /// SCHED_FIFO priority; `None` for the normal scheduler.
    pub priority: Option<u8>,
    /// It wakes so long before its deadline, readies itself and spins, ns; 0: it sleeps to the deadline.
    pub early_ns: u64,
}

/// What makes a process one of a generation.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Membership {
    /// Where the generation meets.
    pub place: Place,
    /// Its number in messages; 0 in lockstep.
    pub generation: u64,
    /// A file that every process holds a shared lock on: once nobody does, the generation is gone.
    pub lock: PathBuf,
    /// The supervisor's process id, whose children they are.
    pub supervisor: u32,
}

/// All that a process is told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Its generation.
    pub membership: Membership,
    /// How the loop is paced.
    pub pace: Pace,
    /// Whether the generation has a recorder.
    pub recorded: bool,
    /// The run's cycles.
    pub timeline: Timeline,
    /// When and where it runs.
    pub timing: TaskTiming,
    /// Faults to suffer; `None` where none are allowed, whatever comes later.
    pub injections: Option<Vec<Injection>>,
    /// For the controller of an instance that stays: the socket on which every connection is a disarm.
    pub disarm_socket: Option<PathBuf>,
    /// Its own work.
    pub task: Task,
}

/// A process's own work.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Task {
    /// plant-simulator.
    Plant(Box<PlantPart>),
    /// valve-bridge, in the simulator's place.
    Bridge(Box<BridgePart>),
    /// trajectory-generator.
    Trajectory(Box<TrajectoryPart>),
    /// step-controller.
    Controller(Box<ControllerPart>),
    /// run-recorder.
    Recorder(Box<RecorderPart>),
}

impl Task {
    /// The program that does it, in the supervisor's folder.
    pub fn program(&self) -> &'static str {
        match self {
            // The messages don't tell who is behind the plant's services; the processes do.
            Self::Bridge(_) => "valve-bridge",
            _ => self.source().name(),
        }
    }

    /// The process that it is for.
    pub fn source(&self) -> Source {
        match self {
            Self::Plant(_) | Self::Bridge(_) => Source::Plant,
            Self::Trajectory(_) => Source::Trajectory,
            Self::Controller(_) => Source::Controller,
            Self::Recorder(_) => Source::Recorder,
        }
    }
}

/// What the bridge to a real drive is told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BridgePart {
    /// The network interface that the drive is on.
    pub interface: String,
    /// The drive, the axis, and when its frame goes out.
    pub params: BridgeParams,
}

/// What the recorder is told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecorderPart {
    /// The folder that everything goes into.
    pub folder: PathBuf,
    /// The number of the segment to begin with; its file must not exist.
    pub segment: u32,
    /// Whether the recorder is there before the first message.
    pub first: bool,
    /// How much is kept.
    pub keep: Keep,
    /// What the record is of.
    pub info: RecordInfo,
}

/// How much of the record is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Keep {
    /// Nothing is recorded.
    None,
    /// Everything.
    All,
    /// The newest segments, of so many bytes together; and those around a fault.
    Ring {
        /// Bytes.
        bytes: u64,
    },
}

/// From the supervisor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ToChild {
    /// The first message.
    Part(Box<Part>),
    /// Begin: cycle 0 starts at this time on CLOCK_MONOTONIC, in ns.
    Go {
        /// The common epoch.
        epoch_ns: u64,
    },
    /// For the recorder: put a note into the record.
    Mark(String),
    /// For the recorder: save the last seconds of every process's timing.
    SaveTiming,
    /// Suffer a fault, where that is allowed.
    Inject(Injection),
    /// End the cycles now.
    Stop,
    /// End the process.
    Finish,
}

/// To the supervisor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum FromChild {
    /// On the bus, with this scheduling.
    Ready(Obtained),
    /// The recorder saved what was asked for, in this file; or says why it could not.
    Saved(Result<PathBuf, String>),
    /// All cycles are run.
    Done(Box<ChildSummary>),
    /// The device on the bus is not the one that it should be: nothing was started.
    Refused(String),
    /// It can't go on.
    Failed(String),
}

/// What a process has to say at its end.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChildSummary {
    /// How it kept its cycles.
    pub timing: LoopSummary,
    /// Messages lost or refused on the way to it.
    pub missed_samples: u64,
    /// Messages that it published.
    pub published: u64,
    /// Messages that it could not send.
    pub unsent: u64,
    /// Cycles after warm-up, to which the next three refer.
    pub steady_cycles: u64,
    /// Messages published after warm-up.
    pub steady_published: u64,
    /// Heap allocations of the loop's thread after warm-up.
    pub steady_allocations: u64,
    /// Page faults of the loop's thread after warm-up.
    pub steady_page_faults: PageFaults,
    /// For the recorder: messages written.
    pub recorded: u64,
    /// For the recorder: why it could not write, where it could not.
    pub recording_error: Option<String>,
}
