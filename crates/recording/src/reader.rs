//! Reads a record: its segments in order, each message once, and says what is missing and why.

use crate::ledger::Ledger;
use crate::segment::{self, Item, Walk};
use crate::{AnyMessage, Damage, KnownGap, RecordInfo, RecordingError, Tally, Topic};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What reading a record showed, beside its messages.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// What the record is of, as its first segment says.
    pub info: RecordInfo,
    /// The segments, in order.
    pub segments: Vec<Segment>,
    /// What became of the messages, by topic and generation.
    pub tallies: BTreeMap<(Topic, u64), Tally>,
    /// All messages known to be missing, in the order of topic, generation and sequence.
    pub gaps: Vec<KnownGap>,
    /// The recorder's notes, in order.
    pub notes: Vec<Note>,
    /// Messages whose check failed (length, schema hash, CRC, source, range), by topic; they count as missing.
    pub refused: BTreeMap<Topic, u64>,
    /// Payloads that are nothing of ours.
    pub unreadable: u64,
}

/// What an operator, or the recorder itself, noted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Note {
    /// In words.
    pub text: String,
    /// The newest Feedback in the record when it was noted, as generation and cycle; none before the first.
    pub after: Option<(u64, u64)>,
}

/// One file of a record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it; empty for one that was finished and is whole.
    pub damage: Vec<Damage>,
}

impl Report {
    /// Messages read, all topics together.
    pub fn recorded(&self) -> u64 {
        self.tallies.values().map(|tally| tally.recorded).sum()
    }

    /// Messages missing, all topics together.
    pub fn missed(&self) -> u64 {
        self.tallies.values().map(|tally| tally.missed).sum()
    }
}

/// What a segment is of, from the file's beginning alone.
///
/// # Errors
/// [`RecordingError::Read`], [`RecordingError::NotMcap`], [`RecordingError::NotARecord`].
pub fn read_info(path: &Path) -> Result<RecordInfo, RecordingError> {
    let mut metadata = BTreeMap::new();
    segment::walk(path, |item| match item {
        Item::Metadata(name, entries) => {
            metadata.insert(name, entries);
            Walk::On
        }
        _ => Walk::Stop,
    })?;
    let not_a_record = |missing| RecordingError::NotARecord { path: path.to_owned(), missing };
    RecordInfo::from_metadata(&metadata).map_err(not_a_record)
}

/// Reads the segments in the order given and hands every message, once, to `visit`: in the order in which the
/// recorder took them, which within a topic is the order of their sequence numbers.
///
/// Memory: one chunk and the list of gaps, however long the record is.
///
/// # Errors
/// [`RecordingError`] where a file can't be read or is no record, or where segments don't belong together. A cut
/// or damaged file is none: its whole chunks are read and [`Segment::damage`] tells the rest.
pub fn read_record<P: AsRef<Path>>(
    paths: &[P],
    mut visit: impl FnMut(&AnyMessage),
) -> Result<Report, RecordingError> {
    let first = paths.first().ok_or(RecordingError::NoSegment)?;
    let mut report = Report {
        info: read_info(first.as_ref())?,
        segments: Vec::new(),
        tallies: BTreeMap::new(),
        gaps: Vec::new(),
        notes: Vec::new(),
        refused: BTreeMap::new(),
        unreadable: 0,
    };
    let mut ledger = Ledger::default();
    let mut newest = None;
    let mut before = None;
    for (index, path) in paths.iter().map(AsRef::as_ref).enumerate() {
        let info = read_info(path)?;
        check_same_record(path, &info, before.as_ref().unwrap_or(&report.info))?;
        before = Some(info);
        let damage = segment::walk(path, |item| {
            take(item, index, (&mut ledger, &mut newest), &mut report, &mut visit);
            Walk::On
        })?;
        report.segments.push(Segment { path: path.to_owned(), damage });
    }
    (report.tallies, report.gaps) = ledger.close();
    Ok(report)
}

fn take(
    item: Item<'_>,
    segment: usize,
    (ledger, newest): (&mut Ledger, &mut Option<(u64, u64)>),
    report: &mut Report,
    visit: &mut impl FnMut(&AnyMessage),
) {
    match item {
        Item::Metadata(..) => {}
        Item::Gap(gap) => ledger.gap(&gap),
        Item::Note(text) => report.notes.push(Note { text, after: *newest }),
        Item::Unreadable => report.unreadable += 1,
        Item::Message(topic, payload) => match AnyMessage::decode(topic, payload) {
            Some(message) => {
                let header = message.header();
                if topic == Topic::Feedback {
                    *newest = (*newest).max(Some((header.generation, header.cycle)));
                }
                if ledger.message(topic, header.generation, header.sequence, segment) {
                    visit(&message);
                }
            }
            None => *report.refused.entry(topic).or_default() += 1,
        },
    }
}

fn check_same_record(path: &Path, found: &RecordInfo, before: &RecordInfo) -> Result<(), RecordingError> {
    let differs = |what, found: String, expected: String| {
        Err(RecordingError::SegmentMismatch { path: path.to_owned(), what, found, expected })
    };
    if found.title != before.title {
        return differs("title", found.title.clone(), before.title.clone());
    }
    if found.instance != before.instance {
        return differs("instance", found.instance.clone(), before.instance.clone());
    }
    if found.period_ns != before.period_ns {
        return differs("period_ns", found.period_ns.to_string(), before.period_ns.to_string());
    }
    if found.generation < before.generation {
        return differs(
            "generation",
            found.generation.to_string(),
            format!("{} or later", before.generation),
        );
    }
    // Every start of a program has an offset of its own, to the nanosecond.
    if found.generation == before.generation && found.unix_offset_ns != before.unix_offset_ns {
        return differs("start", "another".to_owned(), format!("the same, generation {}", found.generation));
    }
    if found.texts != before.texts {
        return differs("scenario or model text", "another".to_owned(), "the same".to_owned());
    }
    Ok(())
}
