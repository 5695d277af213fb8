//! What a record says of itself, and of the way it was run.

use crate::loaded::Loaded;
use clap::ValueEnum;
use recording::RecordInfo;
use serde::{Deserialize, Serialize};
use std::time::{SystemTime, UNIX_EPOCH};

/// How to run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
pub enum Mode {
    /// Separate processes, each on its own absolute deadlines
    Realtime,
    /// Separate processes that wait for each other: no clock, the same result every time
    Lockstep,
    /// One thread, as fast as it goes
    InProcess,
}

impl Mode {
    /// The name that records and summaries have for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Realtime => "realtime",
            Self::Lockstep => "lockstep",
            Self::InProcess => "in-process",
        }
    }
}

/// What a record says of itself.
pub fn record_info(loaded: &Loaded, mode: Mode, instance: &str) -> RecordInfo {
    // In lockstep and in process nothing may differ between two runs of one scenario.
    let live = mode == Mode::Realtime;
    let since = SystemTime::now().duration_since(UNIX_EPOCH).ok().filter(|_| live);
    let started = since.map(|since| since.as_nanos() as u64);
    RecordInfo {
        operated: false,
        title: loaded.scenario.name.clone(),
        instance: if live { instance.to_owned() } else { String::new() },
        mode: mode.name().to_owned(),
        program_version: env!("CARGO_PKG_VERSION").to_owned(),
        // 0 without a clock, so that recordings are identical.
        generation: u64::from(live),
        period_ns: loaded.scenario.period_ns,
        microstep_rad: Some(loaded.microstep_rad),
        started_unix_ns: started,
        unix_offset_ns: started.map(|started| started.saturating_sub(realtime::now_ns())),
        texts: loaded.texts.clone(),
        machine: realtime::machine_facts().into_iter().collect(),
    }
}
