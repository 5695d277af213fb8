//! What the command line has read and checked and hands over to the supervisor, and how that ended.

use crate::runtime_folder::InstanceName;
use closed_loop::Parts;
use injection::Injection;
use processes::{BridgePart, ChildSummary, Keep, Pace, TaskTiming};
use realtime::Obtained;
use recording::RecordInfo;
use serde::{Deserialize, Serialize};
use signals::Source;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A run to supervise: validated data, no text left to parse.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mission {
    /// The instance's name.
    pub name: InstanceName,
    /// Real time or lockstep.
    pub pace: Pace,
    /// Whether it goes on until somebody ends it: then operators are answered, and processes that died are started again.
    pub stays: bool,
    /// What each process of the loop is told.
    pub parts: Parts,
    /// The real drive in the simulated plant's place; `None` without one.
    pub bridge: Option<BridgePart>,
    /// Whether the encoder knows its angle whatever moved it meanwhile.
    pub absolute_encoder: bool,
    /// When and where each process runs.
    pub timings: Timings,
    /// The folder that the record goes to.
    pub folder: PathBuf,
    /// How much of it is kept.
    pub keep: Keep,
    /// What the record says of itself; the generation counts from the one given here.
    pub info: RecordInfo,
    /// Faults to inject; `None` where none are allowed, now or later.
    pub injections: Option<Vec<Injection>>,
    /// Whether degraded scheduling is refused.
    pub require_realtime: bool,
    /// Opaque bytes for the command line, returned in `Conclusion`.
    pub errand: Vec<u8>,
}

/// When and where each process runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Timings {
    /// The plant side.
    pub plant: TaskTiming,
    /// trajectory-generator.
    pub trajectory: TaskTiming,
    /// step-controller.
    pub controller: TaskTiming,
    /// run-recorder.
    pub recorder: TaskTiming,
}

impl Timings {
    /// Those of one process.
    pub fn of(&self, source: Source) -> TaskTiming {
        match source {
            Source::Plant => self.plant,
            Source::Trajectory => self.trajectory,
            Source::Controller => self.controller,
            Source::Recorder | Source::Supervisor => self.recorder,
        }
    }
}

/// How a run ended.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ending {
    /// Starts of the processes of a run that stays.
    pub generations: u64,
    /// What each process of the last generation had to say.
    pub processes: BTreeMap<String, ProcessEnding>,
    /// Messages that the supervisor itself published in the last generation.
    pub published: u64,
    /// Whether the user ended it.
    pub interrupted: bool,
    /// Whether that was by SIGTERM.
    pub terminated: bool,
    /// What went wrong.
    pub failure: Option<String>,
    /// How often the recorder had to be replaced.
    pub recorder_restarts: u32,
    /// Whether it was not replaced any more in the end.
    pub recorder_given_up: bool,
}

impl Ending {
    /// What is not in the record and should be; `None` for a whole one.
    pub fn lost_record(&self) -> Option<String> {
        if self.recorder_given_up {
            return Some(format!("the recorder died {} times and was given up", self.recorder_restarts + 1));
        }
        self.processes.iter().find_map(|(name, process)| {
            let reason = process.counts.as_ref()?.recording_error.as_ref()?;
            Some(format!("{name}: {reason}"))
        })
    }
}

/// How a process ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProcessEnding {
    /// The scheduling really obtained; `None` outside real time.
    pub scheduling: Option<Obtained>,
    /// What it said at its end; `None` for one that died.
    pub counts: Option<ChildSummary>,
}

/// What the command line gets back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Conclusion {
    /// The mission's errand, unopened.
    pub errand: Vec<u8>,
    /// How the run ended.
    pub ending: Ending,
}
