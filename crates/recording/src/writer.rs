//! Writes one segment of a record.
//!
//! Messages gather in a chunk in memory; [`Writer::flush`] closes it with its CRC and hands it to the system in
//! one piece. So a killed recorder loses at most what came after the last flush, and a cut file ends inside at
//! most one chunk. Chunks are compressed with zstd, at its quickest level and in the caller's thread: this is the recorder's
//! process, not the loop's.

use crate::schema::{self, Schema};
use crate::{Gap, RecordInfo, RecordingError, Topic, cdr};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Compression, McapError, WriteOptions};
use signals::{Body, Header, Message, Source};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// The channel of declared gaps.
pub(crate) const GAPS_PATH: &str = "/recorder/gaps";
/// The channel of the recorder's notes.
pub(crate) const NOTES_PATH: &str = "/recorder/notes";

/// A chunk is closed at this size even when nobody flushes, and the buffer before the file holds a whole one.
const CHUNK_BYTES: u64 = 1 << 20;

/// Beyond it a record shrinks little and costs several times the work.
const ZSTD_LEVEL: u32 = 1;

type Inner = mcap::Writer<NoSeek<BufWriter<File>>>;

/// The note in a record that ends before its scenario does, as the user wanted.
pub const INTERRUPTED: &str = "interrupted before the scenario's end";

/// Writes one segment of a record. Dropped unfinished it still ends the file properly, if the disk lets it.
pub struct Writer {
    path: PathBuf,
    inner: Inner,
    file: File,
    channels: BTreeMap<Topic, u16>,
    gaps_channel: u16,
    notes_channel: u16,
    /// From the loop's clock to the wall's, which viewers show.
    unix_offset_ns: u64,
    /// The newest time on the loop's clock, for what has no time of its own: so a lockstep record knows no clock.
    newest_ns: u64,
    notes: u32,
    payload: Vec<u8>,
}

impl Writer {
    /// Begins a segment in a new file and writes what it is of.
    ///
    /// # Errors
    /// [`RecordingError::Create`] where the file exists or can't be made; [`RecordingError::Write`].
    pub fn create(path: &Path, info: &RecordInfo) -> Result<Self, RecordingError> {
        let file = File::create_new(path).map_err(|source| create_error(path, source))?;
        Self::to_file(file, path, info)
    }

    /// Begins a segment in a file that is open for writing and empty; `path` is for messages only.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub fn to_file(file: File, path: &Path, info: &RecordInfo) -> Result<Self, RecordingError> {
        let handle = file.try_clone().map_err(|source| create_error(path, source))?;
        let begin = || -> Result<Self, McapError> {
            let buffered = BufWriter::with_capacity(2 * CHUNK_BYTES as usize, file);
            let mut inner = WriteOptions::new()
                .library(format!("stepvalve {}", info.program_version))
                .compression(Some(Compression::Zstd))
                .compression_level(ZSTD_LEVEL)
                // Workers of its own would take cores that the loop has.
                .compression_threads(0)
                .chunk_size(Some(CHUNK_BYTES))
                .disable_seeking(true)
                .create(NoSeek::new(buffered))?;
            for (name, metadata) in info.to_metadata() {
                inner.write_metadata(&Metadata { name: name.to_owned(), metadata })?;
            }
            let channels = message_channels(&mut inner)?;
            let gaps_channel = channel(&mut inner, GAPS_PATH, &schema::of_gaps())?;
            let notes_channel = channel(&mut inner, NOTES_PATH, &schema::of_notes())?;
            // The channels in a chunk of their own: damage to the first messages does not reach them.
            inner.flush()?;
            Ok(Self {
                path: path.to_owned(),
                inner,
                file: handle,
                channels,
                gaps_channel,
                notes_channel,
                unix_offset_ns: info.unix_offset_ns.unwrap_or(0),
                newest_ns: 0,
                notes: 0,
                payload: Vec::with_capacity(512),
            })
        };
        begin().map_err(|source| write_error(path, source))
    }

    /// Adds a message that `source` published. It is in memory until the next [`Self::flush`].
    ///
    /// # Errors
    /// [`RecordingError::WrongSource`]; [`RecordingError::Write`], after which the writer only returns errors.
    pub fn write<B: Body>(&mut self, source: Source, message: &Message<B>) -> Result<(), RecordingError> {
        let wrong = RecordingError::WrongSource { body: B::NAME, publisher: source };
        let channel = Topic::of::<B>(source).and_then(|topic| self.channels.get(&topic).copied());
        let channel = channel.ok_or(wrong)?;
        cdr::message(message, &mut self.payload);
        self.newest_ns = self.newest_ns.max(message.header.monotonic_ns);
        // MCAP's sequence numbers have 32 bits; the header keeps the whole one.
        self.put(channel, message.header.sequence as u32, message.header.monotonic_ns)
    }

    /// Adds a message from its bytes, as [`Message::append_bytes`] gives them, unchanged.
    ///
    /// # Errors
    /// [`RecordingError::Write`]; a channel that this file has not is one too.
    pub fn write_bytes(&mut self, topic: Topic, bytes: &[u8]) -> Result<(), RecordingError> {
        let channel = self.channels.get(&topic).copied();
        let missing = || io_error(&self.path, std::io::Error::other(format!("no channel {topic}")));
        let channel = channel.ok_or_else(missing)?;
        cdr::bytes(bytes, &mut self.payload);
        let header = Header::from_words(&mut words_of(bytes));
        self.newest_ns = self.newest_ns.max(header.monotonic_ns);
        self.put(channel, header.sequence as u32, header.monotonic_ns)
    }

    /// Declares messages that never reached the recorder.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn note_gap(&mut self, gap: &Gap) -> Result<(), RecordingError> {
        cdr::gap(gap, &mut self.payload);
        self.put(self.gaps_channel, gap.first_missing as u32, self.newest_ns)
    }

    /// Adds a note for people: a start, a partner that died, a disk that was slow.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn note(&mut self, text: &str) -> Result<(), RecordingError> {
        cdr::note(text, &mut self.payload);
        let sequence = self.notes;
        self.notes = self.notes.wrapping_add(1);
        self.put(self.notes_channel, sequence, self.newest_ns)
    }

    /// Closes the chunk and hands it to the system: it survives the end of this process, not yet of the machine.
    ///
    /// # Errors
    /// [`RecordingError::Write`], a full disk for instance.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.inner.flush().map_err(|source| write_error(&self.path, source))
    }

    /// Waits until what was flushed is on the disk. It may take long: see [`Self::sync_handle`].
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn sync(&self) -> Result<(), RecordingError> {
        self.file.sync_data().map_err(|source| io_error(&self.path, source))
    }

    /// The same file once more, so that another thread can call `sync_data` on it.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn sync_handle(&self) -> Result<File, RecordingError> {
        self.file.try_clone().map_err(|source| io_error(&self.path, source))
    }

    /// The segment's length in bytes so far, without the open chunk; 0 where the system won't say.
    pub fn bytes_written(&self) -> u64 {
        self.file.metadata().map_or(0, |metadata| metadata.len())
    }

    /// Closes the last chunk, writes summary and index, and waits for the disk.
    ///
    /// # Errors
    /// [`RecordingError::Write`]; what was flushed before can still be read.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.inner.finish().map_err(|source| write_error(&self.path, source))?;
        // finish() hands everything to the buffered writer and flushes that.
        let synced = self.file.sync_data();
        synced.map_err(|source| io_error(&self.path, source))
    }

    fn put(&mut self, channel_id: u16, sequence: u32, time_ns: u64) -> Result<(), RecordingError> {
        let log_time = time_ns.saturating_add(self.unix_offset_ns);
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: time_ns };
        let written = self.inner.write_to_known_channel(&header, &self.payload);
        written.map_err(|source| write_error(&self.path, source))
    }
}

fn words_of(bytes: &[u8]) -> impl Iterator<Item = u64> {
    bytes.as_chunks::<8>().0.iter().map(|word| u64::from_le_bytes(*word))
}

fn message_channels(inner: &mut Inner) -> Result<BTreeMap<Topic, u16>, McapError> {
    let add = |topic: &Topic| Ok((*topic, channel(inner, topic.path(), &schema::of_topic(*topic))?));
    Topic::ALL.iter().map(add).collect()
}

fn channel(inner: &mut Inner, path: &str, schema: &Schema) -> Result<u16, McapError> {
    let id = inner.add_schema(&schema.name, "ros2msg", schema.text.as_bytes())?;
    inner.add_channel(id, path, "cdr", &BTreeMap::new())
}

fn create_error(path: &Path, source: std::io::Error) -> RecordingError {
    RecordingError::Create { path: path.to_owned(), source }
}

fn write_error(path: &Path, source: McapError) -> RecordingError {
    match source {
        McapError::Io(source) => io_error(path, source),
        other => io_error(path, std::io::Error::other(other)),
    }
}

fn io_error(path: &Path, source: std::io::Error) -> RecordingError {
    RecordingError::Write { path: path.to_owned(), source }
}
