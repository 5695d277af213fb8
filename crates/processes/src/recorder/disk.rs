//! The record on the disk: segment after segment, made safe by a thread of its own, given up when the disk fails.

use super::boundary::Boundary;
use super::ring::Ring;
use crate::aside::Complaints;
use crate::part::{Keep, RecorderPart};
use crate::segments::SegmentName;
use injection::Fault;
use recording::{Gap, RecordInfo, RecordingError, Writer};
use signal_bus::Service;
use signals::{Message, Source};
use std::fs::File;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{JoinHandle, spawn};
use std::time::{Duration, Instant};

/// A disk that failed is tried again, with a new segment, after this.
const TRY_AGAIN_AFTER: Duration = Duration::from_secs(10);
/// At most one fsync in this time.
const SYNC_EVERY: Duration = Duration::from_secs(1);

/// A segment is ended anywhere once it is so many times as large as it was to be: its boundary is a second away at most.
const FULL_TIMES: u64 = 8;

/// A segment whose last messages may still come, and the cycle from which on they belong to the next one.
struct Ending {
    writer: Writer,
    before_cycle: u64,
}

/// What may take long, for the thread that may wait.
enum Slow {
    Sync(File),
    Finish(Box<Writer>),
}

/// A record that may fail without stopping the recorder: what can't be written is counted by its absence.
pub(crate) struct Disk {
    folder: PathBuf,
    info: RecordInfo,
    ring: Ring,
    recording: bool,
    boundary: Boundary,
    writer: Option<Writer>,
    ending: Option<Ending>,
    number: u32,
    faults: u32,
    error: Option<String>,
    recorded: u64,
    bytes: u64,
    last_sync: Instant,
    slow: SyncSender<Slow>,
    slow_thread: JoinHandle<()>,
    complaints: Complaints,
}

impl Disk {
    pub(crate) fn create(part: &RecorderPart) -> Result<Self, RecordingError> {
        let (slow, work) = sync_channel(4);
        let mut disk = Self {
            folder: part.folder.clone(),
            info: part.info.clone(),
            ring: Ring::new(&part.folder, part.keep),
            recording: part.keep != Keep::None,
            boundary: Boundary::new(part.info.period_ns),
            writer: None,
            ending: None,
            number: part.segment,
            faults: 0,
            error: None,
            recorded: 0,
            bytes: 0,
            last_sync: Instant::now(),
            slow,
            slow_thread: spawn(move || do_slow_work(&work)),
            complaints: Complaints::default(),
        };
        if disk.recording {
            match disk.begin() {
                Ok(writer) => disk.writer = Some(writer),
                // At the start of a run it is the user's to mend; later the loop must not notice.
                Err(error) if part.first => return Err(error),
                Err(error) => disk.fail(error.to_string()),
            }
        }
        Ok(disk)
    }

    /// Writes a message to the segment of the cycle that it was published in; `None` is now.
    pub(crate) fn write<B: Service>(
        &mut self,
        source: Source,
        message: &Message<B>,
        published_in: Option<u64>,
    ) {
        let published_in = published_in.unwrap_or(self.boundary.newest_cycle());
        if let Some(from_cycle) = self.boundary.crossed(published_in)
            && self.writer.is_some()
        {
            self.next_segment(from_cycle);
        }
        let written = match &mut self.ending {
            Some(ending) if published_in < ending.before_cycle => {
                let written = ending.writer.write(source, message);
                self.judge(written)
            }
            _ => self.attempt(|writer| writer.write(source, message)),
        };
        self.recorded += u64::from(written);
    }

    /// The controller stated its state before this cycle.
    pub(crate) fn state_was_taken(&mut self, before_cycle: u64) {
        self.boundary.state_was_taken(before_cycle);
    }

    pub(crate) fn declare(&mut self, gap: &Gap) {
        self.attempt(|writer| writer.note_gap(gap));
    }

    pub(crate) fn note(&mut self, text: &str) {
        self.attempt(|writer| writer.note(text));
    }

    /// This segment, the one before and the one after stay.
    pub(crate) fn keep_for_fault(&mut self) {
        // Named when they are closed; the one before is closed already.
        self.ring.mark_fault(self.number.saturating_sub(1));
        self.faults = 2;
    }

    pub(crate) fn flush(&mut self) {
        self.try_again();
        if self.boundary.all_have_come()
            && let Some(ending) = self.ending.take()
        {
            self.hand_over(Slow::Finish(Box::new(ending.writer)));
        }
        let flushed = self.ending.as_mut().map_or(Ok(()), |ending| ending.writer.flush());
        if !self.judge(flushed) || !self.attempt(Writer::flush) {
            return;
        }
        self.bytes = self.writer.as_ref().map_or(0, Writer::bytes_written);
        let most = self.ring.segment_bytes();
        if self.bytes >= most.saturating_mul(FULL_TIMES) {
            self.boundary.plan_at_once();
        } else if self.bytes >= most && self.ending.is_none() {
            self.boundary.plan();
        }
        if self.last_sync.elapsed() >= SYNC_EVERY {
            self.last_sync = Instant::now();
            match self.writer.as_ref().map(Writer::sync_handle) {
                Some(Ok(file)) => self.hand_over(Slow::Sync(file)),
                Some(Err(error)) => self.fail(error.to_string()),
                None => {}
            }
        }
    }

    pub(crate) fn recorded(&self) -> u64 {
        self.recorded
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    pub(crate) fn healthy(&self) -> bool {
        self.error.is_none()
    }

    /// Ends the record; says why it could not be written, if so.
    pub(crate) fn finish(mut self) -> Option<String> {
        let ending = self.ending.take().map(|ending| ending.writer);
        for writer in ending.into_iter().chain(self.writer.take()) {
            let finished = writer.finish();
            self.judge(finished);
        }
        if self.faults > 0 {
            self.ring.mark_fault(self.number);
        }
        drop(self.slow);
        let _ = self.slow_thread.join();
        self.error
    }

    /// A disk may have room again. What was not written meanwhile is missing between two segments, and told so.
    fn try_again(&mut self) {
        if self.recording && self.writer.is_none() && self.last_sync.elapsed() >= TRY_AGAIN_AFTER {
            self.last_sync = Instant::now();
            self.number += 1;
            match self.begin() {
                Ok(writer) => {
                    self.writer = Some(writer);
                    self.error = None;
                }
                Err(error) => self.error = Some(error.to_string()),
            }
        }
    }

    fn begin(&self) -> Result<Writer, RecordingError> {
        let name = SegmentName { number: self.number, fault: false };
        Writer::create(&name.path(&self.folder), &self.info)
    }

    /// The next segment is open before the last one is closed, which may take as long as the disk wants.
    fn next_segment(&mut self, from_cycle: u64) {
        let closed = self.number;
        self.number += 1;
        match self.begin() {
            Ok(writer) => {
                let old = self.writer.replace(writer);
                self.ending = old.map(|writer| Ending { writer, before_cycle: from_cycle });
            }
            Err(error) => self.fail(error.to_string()),
        }
        if self.faults > 0 {
            self.faults -= 1;
            // A file keeps its writer when it gets another name.
            self.ring.mark_fault(closed);
        }
        self.ring.trim(self.number);
    }

    fn hand_over(&mut self, work: Slow) {
        match self.slow.try_send(work) {
            // A sync that is still going on is enough.
            Ok(()) | Err(TrySendError::Full(Slow::Sync(_))) => {}
            Err(TrySendError::Full(Slow::Finish(_))) => {
                self.fail("the disk is slower than the record grows".to_owned());
            }
            Err(TrySendError::Disconnected(_)) => {
                self.fail("the thread that syncs the record has ended".to_owned())
            }
        }
    }

    /// A fault of the disk, as far as the record can tell: it takes nothing for a while, or refuses everything.
    pub(crate) fn inject(&mut self, fault: &Fault) {
        match fault {
            Fault::DiskStalled { ms } => std::thread::sleep(Duration::from_millis(*ms)),
            Fault::DiskFull => self.fail("No space left on device (injected)".to_owned()),
            _ => {}
        }
    }

    fn attempt(&mut self, write: impl FnOnce(&mut Writer) -> Result<(), RecordingError>) -> bool {
        let Some(writer) = &mut self.writer else { return false };
        let written = write(writer);
        self.judge(written)
    }

    /// Whether it was written; where not, the record ends here for now.
    fn judge(&mut self, written: Result<(), RecordingError>) -> bool {
        match written {
            Ok(()) => true,
            Err(error) => {
                self.fail(error.to_string());
                false
            }
        }
    }

    fn fail(&mut self, reason: String) {
        self.complaints.tell(format!("run-recorder: {reason}; the loop goes on unrecorded"));
        self.writer = None;
        self.ending = None;
        self.last_sync = Instant::now();
        self.error.get_or_insert(reason);
    }
}

/// What fails here fails in the next write too, and is told there.
fn do_slow_work(work: &Receiver<Slow>) {
    for piece in work {
        match piece {
            Slow::Sync(file) => drop(file.sync_data()),
            Slow::Finish(writer) => drop(writer.finish()),
        }
    }
}
