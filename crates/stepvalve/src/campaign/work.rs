//! Runs on several threads, rows to one file: whatever the order in which they are made, they are the same.

use super::progress::Progress;
use super::row_file::RowFile;
use ::campaign::{Campaign, Row};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use supervisor::{Failure, Interruption};

/// What is to be made.
pub struct Work<'a> {
    /// The campaign.
    pub campaign: &'a Campaign,
    /// Its runs that are wanted.
    pub wanted: &'a [u64],
    /// How many at a time.
    pub jobs: usize,
    /// Whether the user wants an end.
    pub interruption: &'a Interruption,
}

/// How it ended.
pub enum Ended {
    /// All rows are there.
    All,
    /// By the user.
    Interrupted,
    /// More runs failed than the plan allows.
    TooManyFailed {
        /// How many.
        failed: u64,
        /// The last of them.
        last: (u64, ::campaign::Failure),
    },
}

/// What the threads share.
struct Shared<'a> {
    work: &'a Work<'a>,
    open: Vec<u64>,
    next: AtomicUsize,
    given_up: AtomicBool,
}

impl Work<'_> {
    /// Makes the runs that have no row yet.
    ///
    /// # Errors
    /// Where a row can't be written.
    pub fn make(&self, rows: &mut RowFile) -> Result<Ended, Failure> {
        let open: Vec<u64> =
            self.wanted.iter().copied().filter(|run| !rows.rows().contains_key(run)).collect();
        let progress = Progress::new(self.wanted.len() as u64, (self.wanted.len() - open.len()) as u64);
        let jobs = self.jobs.min(open.len());
        let shared = Shared { work: self, open, next: AtomicUsize::new(0), given_up: AtomicBool::new(false) };
        std::thread::scope(|scope| {
            let (sender, made) = channel();
            for _ in 0..jobs {
                let (shared, sender) = (&shared, sender.clone());
                scope.spawn(move || shared.make_runs(&sender));
            }
            drop(sender);
            let taken = self.take(rows, &made, &progress);
            // On an error, too: the threads must not go on for nobody.
            shared.given_up.store(true, Ordering::Relaxed);
            taken
        })
    }

    /// Writes rows as they come, until there are no more.
    fn take(&self, rows: &mut RowFile, made: &Receiver<Row>, progress: &Progress) -> Result<Ended, Failure> {
        let allowed = self.campaign.failures_allowed();
        let mut failed = rows.rows().values().filter(|row| row.failure.is_some()).count() as u64;
        let mut last = rows.rows().values().rev().find_map(|row| Some((row.run, row.failure.clone()?)));
        loop {
            if let Some(last) = last.take_if(|_| failed > allowed) {
                return Ok(Ended::TooManyFailed { failed, last });
            }
            let Ok(row) = made.recv() else { break };
            if let Some(failure) = &row.failure {
                failed += 1;
                last = Some((row.run, failure.clone()));
            }
            rows.add(row)?;
            progress.one_more();
        }
        let all = self.wanted.iter().all(|run| rows.rows().contains_key(run));
        Ok(if all { Ended::All } else { Ended::Interrupted })
    }
}

impl Shared<'_> {
    fn is_over(&self) -> bool {
        self.given_up.load(Ordering::Relaxed) || self.work.interruption.wanted()
    }

    fn make_runs(&self, made: &Sender<Row>) {
        let is_over = || self.is_over();
        while !is_over() {
            let Some(run) = self.open.get(self.next.fetch_add(1, Ordering::Relaxed)) else { break };
            let Some(row) = self.work.campaign.run(*run, &is_over) else { break };
            if made.send(row).is_err() {
                break;
            }
        }
    }
}
