//! run-recorder: every message of the bus into an MCAP record; what it can't keep is counted, the loop never waits.

mod boundary;
mod disk;
mod flight;
mod ring;
mod streams;

use crate::aside::Complaints;
use crate::child::{Child, ChildError};
use crate::part::{ChildSummary, FromChild, Pace, RecorderPart, ToChild};
use disk::Disk;
use flight::Flight;
use signal_bus::Writer;
use signals::{RecorderProgress, Source};
use std::time::{Duration, Instant};
use streams::{News, Streams};

/// Pause between two rounds in real time: well under the 20 ms within which everything is handed to the system.
const PAUSE: Duration = Duration::from_millis(5);
/// The same in lockstep, where the plant may be waiting.
const LOCKSTEP_PAUSE: Duration = Duration::from_micros(200);
/// What is in memory is handed to the system after at most this.
const FLUSH_AFTER: Duration = Duration::from_millis(15);
/// Without a supervisor the recorder ends when nothing was published for so long.
const ORPHAN_PATIENCE: Duration = Duration::from_secs(1);

pub(crate) fn run(child: &Child, part: &RecorderPart) -> Result<Option<ChildSummary>, ChildError> {
    let mut recorder = Recorder {
        streams: Streams::open(&child.bus, part.first)?,
        progress: child.bus.writer::<RecorderProgress>(Source::Recorder)?,
        disk: Disk::create(part)?,
        flight: Flight::new(part.folder.clone()),
        complaints: Complaints::default(),
        last_flush: Instant::now(),
        last_message: Instant::now(),
    };
    if child.ready()?.is_none() {
        return Ok(None);
    }
    recorder.progress.connect();
    let pause = if child.pace == Pace::Lockstep { LOCKSTEP_PAUSE } else { PAUSE };
    loop {
        // Asked for before the round: what was published until then is in it.
        let over = child.wishes.finish()
            || child.wishes.orphaned() && recorder.last_message.elapsed() > ORPHAN_PATIENCE;
        let busy = recorder.round();
        recorder.obey(child);
        if over {
            return Ok(Some(recorder.end()));
        }
        if !busy || child.pace == Pace::Realtime {
            std::thread::sleep(pause);
        }
    }
}

struct Recorder {
    streams: Streams,
    progress: Writer<RecorderProgress>,
    disk: Disk,
    flight: Flight,
    complaints: Complaints,
    last_flush: Instant,
    last_message: Instant,
}

impl Recorder {
    /// Takes everything that is there; `false` if that was nothing.
    fn round(&mut self) -> bool {
        let News { count, fault } = self.streams.drain(&mut self.disk, &mut self.flight);
        if count > 0 {
            self.last_message = Instant::now();
        }
        if fault {
            self.disk.keep_for_fault();
        }
        if self.last_flush.elapsed() >= FLUSH_AFTER {
            self.disk.flush();
            self.last_flush = Instant::now();
        }
        if let Err(reason) = self.flight.save_if_slow() {
            self.complaints.tell(format!("run-recorder: {reason}"));
        }
        self.report();
        count > 0
    }

    fn obey(&mut self, child: &Child) {
        while let Some(order) = child.order() {
            match order {
                ToChild::Mark(text) => self.disk.note(&text),
                ToChild::Inject(injection) if child.injections.is_some() => {
                    self.disk.inject(&injection.fault)
                }
                ToChild::SaveTiming => child.say(&FromChild::Saved(self.flight.save_now())),
                _ => {}
            }
        }
    }

    fn report(&mut self) {
        let body = RecorderProgress {
            feedback_cycle: self.streams.feedback_cycle(),
            recorded: self.disk.recorded(),
            missed: self.streams.missed(),
            bytes_written: self.disk.bytes(),
            healthy: u64::from(self.disk.healthy()),
        };
        self.progress.write(self.streams.feedback_cycle(), realtime::now_ns(), body);
    }

    fn end(self) -> ChildSummary {
        ChildSummary {
            missed_samples: self.streams.missed(),
            published: self.progress.published(),
            unsent: self.progress.failures(),
            recorded: self.disk.recorded(),
            recording_error: self.disk.finish(),
            ..ChildSummary::default()
        }
    }
}
