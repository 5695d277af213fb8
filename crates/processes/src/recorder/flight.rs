//! The slow cycle's flight recorder: the last seconds of every process's timing, in memory, saved when a cycle was slow.

use serde::Serialize;
use signals::{LoopTiming, Message, Source};
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Cycles of each process that are held.
const HELD_CYCLES: usize = 4000;
/// What follows a slow cycle is told too: it is saved so long after it.
const AFTERMATH: Duration = Duration::from_millis(200);
/// A bad hour must not fill the disk: at most one file in this time,
const SAVE_EVERY: Duration = Duration::from_secs(10);
/// and so many by itself; later ones are only counted.
const MAX_FILES: u32 = 50;

/// One process in one cycle, times in ns.
#[derive(Debug, Clone, Copy, Serialize)]
struct Entry {
    cycle: u64,
    wake_up_latency_ns: u64,
    read_ns: u64,
    step_ns: u64,
    write_ns: u64,
    overruns: u64,
    skipped_cycles: u64,
}

/// The cycle that was slow.
#[derive(Debug, Clone, Serialize)]
struct Culprit {
    process: &'static str,
    cycle: u64,
    /// The longest part: `wake-up`, `read`, `step` or `write`.
    part: &'static str,
    late_by_ns: u64,
}

#[derive(Serialize)]
struct File<'a> {
    format: &'static str,
    format_version: u32,
    culprit: Option<&'a Culprit>,
    slow_cycles_since_the_last_file: u64,
    timing: BTreeMap<&'static str, &'a VecDeque<Entry>>,
}

/// The timing of the last seconds.
pub(crate) struct Flight {
    folder: PathBuf,
    held: BTreeMap<Source, VecDeque<Entry>>,
    culprit: Option<(Culprit, Instant)>,
    slow_cycles: u64,
    last_save: Option<Instant>,
    saved: u32,
}

impl Flight {
    pub(crate) fn new(folder: PathBuf) -> Self {
        Self { folder, held: BTreeMap::new(), culprit: None, slow_cycles: 0, last_save: None, saved: 0 }
    }

    pub(crate) fn note(&mut self, source: Source, message: &Message<LoopTiming>) {
        let body = &message.body;
        let entry = Entry {
            cycle: message.header.cycle,
            wake_up_latency_ns: body.wake_up_latency_ns,
            read_ns: body.read_ns,
            step_ns: body.step_ns,
            write_ns: body.write_ns,
            overruns: body.overruns,
            skipped_cycles: body.skipped_cycles,
        };
        let held = self.held.entry(source).or_default();
        let before = held.back().copied();
        if held.len() == HELD_CYCLES {
            held.pop_front();
        }
        held.push_back(entry);
        if let Some(before) = before
            && let Some(culprit) = culprit(source, &before, &entry)
        {
            self.slow_cycles += 1;
            self.culprit.get_or_insert((culprit, Instant::now()));
        }
    }

    /// Saves what led to a slow cycle, once its aftermath is there, and not too often.
    ///
    /// # Errors
    /// Why it was not saved.
    pub(crate) fn save_if_slow(&mut self) -> Result<(), String> {
        let due = self.culprit.as_ref().is_some_and(|(_, since)| since.elapsed() >= AFTERMATH);
        if !due {
            return Ok(());
        }
        let too_soon = self.last_save.is_some_and(|last| last.elapsed() < SAVE_EVERY);
        if too_soon || self.saved >= MAX_FILES {
            // The next file says how many there were.
            self.culprit = None;
            return Ok(());
        }
        self.saved += 1;
        self.save_now().map(drop)
    }

    /// Saves what is held; the file's path.
    pub(crate) fn save_now(&mut self) -> Result<PathBuf, String> {
        let newest =
            self.held.values().filter_map(|held| held.back()).map(|entry| entry.cycle).max().unwrap_or(0);
        let path = self.folder.join(format!("slow-cycle-{newest}.json"));
        let culprit = self.culprit.take().map(|(culprit, _)| culprit);
        let file = File {
            format: "stepvalve-timing",
            format_version: 1,
            culprit: culprit.as_ref(),
            slow_cycles_since_the_last_file: self.slow_cycles,
            timing: self.held.iter().map(|(source, held)| (source.name(), held)).collect(),
        };
        let text = serde_json::to_vec(&file).map_err(|error| error.to_string())?;
        whole_file::write(&path, &text).map_err(|error| format!("{}: {error}", path.display()))?;
        self.slow_cycles = 0;
        self.last_save = Some(Instant::now());
        Ok(path)
    }
}

/// Who made the counts of overruns or skipped cycles rise. An overrun is counted after its own timing went out: it shows
/// in the next cycle's counts, and was the cycle before.
fn culprit(source: Source, before: &Entry, entry: &Entry) -> Option<Culprit> {
    let overran = entry.overruns > before.overruns;
    if !overran && entry.skipped_cycles == before.skipped_cycles {
        return None;
    }
    let slow = if overran { before } else { entry };
    let parts = [
        ("wake-up", slow.wake_up_latency_ns),
        ("read", slow.read_ns),
        ("step", slow.step_ns),
        ("write", slow.write_ns),
    ];
    let (part, late_by_ns) = parts.into_iter().max_by_key(|(_, ns)| *ns)?;
    Some(Culprit { process: source.name(), cycle: slow.cycle, part, late_by_ns })
}

#[cfg(test)]
mod tests {
    use super::*;
    use signals::Header;

    fn timing(cycle: u64, step_ns: u64, overruns: u64) -> Message<LoopTiming> {
        let header = Header::new::<LoopTiming>(Source::Controller, 1, cycle, cycle, 0);
        Message::seal(header, LoopTiming { step_ns, overruns, ..LoopTiming::default() })
    }

    #[test]
    fn the_slow_part_of_the_slow_cycle_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let mut flight = Flight::new(folder.path().to_owned());
        for cycle in 0..100 {
            let slow = cycle == 70;
            flight.note(
                Source::Controller,
                &timing(cycle, if slow { 1_400_000 } else { 2000 }, u64::from(cycle > 70)),
            );
        }
        let path = flight.save_now().unwrap();
        let text = std::fs::read_to_string(path).unwrap();
        let file: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(file["culprit"]["process"], "step-controller");
        assert_eq!(file["culprit"]["cycle"], 70);
        assert_eq!(file["culprit"]["part"], "step");
        assert_eq!(file["culprit"]["late_by_ns"], 1_400_000);
        assert_eq!(file["timing"]["step-controller"].as_array().unwrap().len(), 100);
    }
}
