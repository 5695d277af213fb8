//! A capture: the messages of some cycles, and what they were kept for. As a file it is a record like any other.

use crate::block::{Block, has_cycle};
use crate::history::Lost;
use crate::trigger::Window;
use recording::{AnyMessage, RecordInfo, RecordingError, Writer, read_record};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// No file above this is opened: a capture is read into memory as a whole.
const MOST_BYTES: u64 = 512 << 20;

/// Why something was captured, and where it begins and ends. It stands in the file as a note.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Cause {
    /// A word for file names: `edge`, `fault`, `view`.
    pub(crate) word: String,
    /// The same for people.
    pub(crate) text: String,
    /// Which cycles.
    pub(crate) window: Window,
}

/// What the note in the file begins with.
pub const CAPTURE_NOTE: &str = "scope capture: ";

/// Messages that were kept.
#[derive(Debug, Clone)]
pub(crate) struct Capture {
    /// Counts the captures of this server.
    pub(crate) id: u64,
    pub(crate) cause: Cause,
    pub(crate) info: RecordInfo,
    pub(crate) block: Block,
    pub(crate) lost: Vec<Lost>,
}

/// What keeps a file from being opened.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Unreadable {
    #[error(transparent)]
    Record(#[from] RecordingError),
    #[error("{path}: {megabytes} MB, expected at most {} MB: stepvalve convert and report take any", MOST_BYTES >> 20)]
    TooLong { path: String, megabytes: u64 },
    #[error("{0}: no message of any cycle in it")]
    Empty(String),
}

impl Capture {
    /// Writes it as a record of one segment.
    ///
    /// # Errors
    /// [`RecordingError`]; where the file exists, too.
    pub(crate) fn write(&self, path: &Path) -> Result<(), RecordingError> {
        let begun_ns = self.block.iter().map(|stored| stored.published_ns()).min();
        let info = RecordInfo {
            started_unix_ns: self.info.unix_offset_ns.zip(begun_ns).map(|(offset, begun)| offset + begun),
            ..self.info.clone()
        };
        let mut writer = Writer::create(path, &info)?;
        for stored in self.block.iter() {
            writer.write_bytes(stored.topic, stored.bytes)?;
        }
        for lost in &self.lost {
            writer.note_gap(&lost.gap)?;
        }
        let cause = serde_json::to_string(&self.cause).unwrap_or_default();
        writer.note(&format!("{CAPTURE_NOTE}{cause}"))?;
        writer.finish()
    }

    /// Reads a capture, or any other short record.
    ///
    /// # Errors
    /// [`Unreadable`].
    pub(crate) fn read(path: &Path, id: u64) -> Result<Self, Unreadable> {
        let shown = path.display().to_string();
        let bytes = std::fs::metadata(path).map_or(0, |found| found.len());
        if bytes > MOST_BYTES {
            return Err(Unreadable::TooLong { path: shown, megabytes: bytes >> 20 });
        }
        let mut block = Block::default();
        let report = read_record(&[path], |message| add(&mut block, message))?;
        let mut cycles = block.iter().filter(|stored| has_cycle(stored.topic)).map(|stored| stored.cycle);
        let first = cycles.next().ok_or(Unreadable::Empty(shown))?;
        let (from, to) = cycles.fold((first, first), |(from, to), cycle| (from.min(cycle), to.max(cycle)));
        let noted = report
            .notes
            .iter()
            .find_map(|note| serde_json::from_str(note.text.strip_prefix(CAPTURE_NOTE)?).ok());
        let cause = noted.unwrap_or_else(|| Cause {
            word: "record".to_owned(),
            text: report.info.title.clone(),
            window: Window { trigger: None, zero: 0, from, to },
        });
        Ok(Self { id, cause, info: report.info, block, lost: Vec::new() })
    }
}

fn add(block: &mut Block, message: &AnyMessage) {
    if let Some(topic) = message.topic() {
        block.push(topic, message.header().cycle, |bytes| {
            message.each_word(|word| bytes.extend_from_slice(&word.to_le_bytes()));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use recording::Topic;
    use signals::{Feedback, Header, Message, Source};

    fn capture() -> Capture {
        let mut block = Block::default();
        for cycle in 100..200 {
            let body = Feedback { angle_rad: (cycle as f64).sqrt() / 100.0, ..Feedback::default() };
            let header = Header::new::<Feedback>(Source::Plant, 3, cycle + 7, cycle, cycle * 1_000_000);
            let message = Message::seal(header, body);
            block.push(Topic::Feedback, cycle, |bytes| message.append_bytes(bytes));
        }
        let window = Window { trigger: Some(150), zero: 150, from: 100, to: 199 };
        let cause = Cause { word: "edge".to_owned(), text: "an edge".to_owned(), window };
        let info = RecordInfo { period_ns: 1_000_000, generation: 3, ..RecordInfo::default() };
        Capture { id: 1, cause, info, block, lost: Vec::new() }
    }

    #[test]
    fn a_file_holds_the_same_bytes_and_the_same_window() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("capture.mcap");
        let written = capture();
        written.write(&path).unwrap();
        let read = Capture::read(&path, 2).unwrap();
        assert_eq!(read.cause, written.cause);
        assert!(read.block.iter().eq(written.block.iter()));
        assert!(written.write(&path).is_err(), "nothing is overwritten");
    }

    #[test]
    fn what_is_no_record_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("text.mcap");
        std::fs::write(&path, "not a record").unwrap();
        assert!(Capture::read(&path, 1).unwrap_err().to_string().contains("text.mcap"));
    }
}
