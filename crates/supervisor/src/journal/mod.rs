//! The journal of an instance: what happens to it, a line each, on stderr and in `events.jsonl` beside its record.
//!
//! A thread of its own writes, so that neither a disk nor a terminal that takes nothing holds up the supervisor.

mod advice;
mod entry;
mod file;
mod transitions;

pub use advice::{advice, advice_on_alarm, reason};
pub use entry::{Entry, EventKind};
pub use file::{journal_path, older_journal_path};
pub(crate) use transitions::{Seen, Transitions};

use file::JournalFile;
use jiff::Timestamp;
use nix::unistd::{Uid, User};
use processes::complain;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, channel, sync_channel};
use std::time::Duration;

/// So many events wait for the disk; more are lost, and counted.
const WAITING: usize = 256;
/// How long the end of the supervisor waits for a disk that takes nothing.
const END_PATIENCE: Duration = Duration::from_secs(2);

/// Where events go.
pub(crate) struct Journal {
    instance: String,
    /// `None` for a run that ends by itself: what happens to it goes to stderr alone.
    writer: Option<Writer>,
    lost: AtomicU64,
}

struct Writer {
    entries: SyncSender<(Entry, Option<Peer>)>,
    ended: Receiver<()>,
}

impl Journal {
    /// The journal of an instance that stays, in its record's folder.
    pub(crate) fn open(instance: &str, folder: &Path) -> Self {
        let (entries, waiting) = sync_channel(WAITING);
        let (end, ended) = channel();
        let file = JournalFile::open(folder)
            .inspect_err(|error| complain(format_args!("no journal is kept: {error:#}")))
            .ok();
        std::thread::spawn(move || {
            write_all(file, &waiting);
            let _ = end.send(());
        });
        Self {
            instance: instance.to_owned(),
            writer: Some(Writer { entries, ended }),
            lost: AtomicU64::new(0),
        }
    }

    /// No journal: stderr alone.
    pub(crate) fn none(instance: &str) -> Self {
        Self { instance: instance.to_owned(), writer: None, lost: AtomicU64::new(0) }
    }

    /// Notes an event. Never waits.
    pub(crate) fn note(&self, at: At, event: EventKind, text: impl Into<String>) {
        self.note_by(at, event, None, text);
    }

    /// The same, with whose order it was.
    pub(crate) fn note_by(&self, at: At, event: EventKind, by: Option<Peer>, text: impl Into<String>) {
        let Some(writer) = &self.writer else { return complain(text.into()) };
        let lost = self.lost.swap(0, Ordering::Relaxed);
        let mut text = text.into();
        if lost > 0 {
            text = format!(
                "{text} ({lost} events before this one were lost: the disk or the terminal took nothing)"
            );
        }
        let entry = Entry {
            time: format!("{:.3}", Timestamp::now()),
            instance: self.instance.clone(),
            generation: at.generation,
            cycle: at.cycle,
            event,
            by: None,
            text,
        };
        if writer.entries.try_send((entry, by)).is_err() {
            self.lost.fetch_add(lost + 1, Ordering::Relaxed);
        }
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        if let Some(Writer { entries, ended }) = self.writer.take() {
            drop(entries);
            let _ = ended.recv_timeout(END_PATIENCE);
        }
    }
}

/// Whose order it was.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Peer {
    /// The user.
    pub(crate) uid: u32,
    /// The process.
    pub(crate) pid: i32,
}

impl Peer {
    /// In words.
    fn name(self) -> String {
        let user = User::from_uid(Uid::from_raw(self.uid)).ok().flatten();
        let user = user.map_or_else(|| self.uid.to_string(), |user| user.name);
        format!("user {user}, process {}", self.pid)
    }
}

/// When in a run something happens.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct At {
    /// The generation.
    pub(crate) generation: u64,
    /// The controller's cycle.
    pub(crate) cycle: u64,
}

fn write_all(mut file: Option<JournalFile>, entries: &Receiver<(Entry, Option<Peer>)>) {
    for (entry, by) in entries {
        // Looking a name up may wait for a server.
        let entry = Entry { by: by.map(|by| by.name()), ..entry };
        complain(&entry);
        if let Some(open) = &mut file
            && let Err(error) = open.append(&entry)
        {
            complain(format_args!("the journal is not kept any more: {error:#}"));
            file = None;
        }
    }
}
