//! Walks through one file: whole, cut at any byte, or damaged in between.

use crate::writer::{GAPS_PATH, NOTES_PATH};
use crate::{Gap, RecordingError, Topic, cdr};
use mcap::McapError;
use mcap::records::{ChunkHeader, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// What is wrong with a file. All that stands before it, and in whole chunks behind it, was read.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Damage {
    /// The file was never finished, and ends behind a whole record: at most the open chunk is lost.
    Unfinished {
        /// The file's length in bytes.
        at_byte: u64,
    },
    /// The file ends inside a record.
    Cut {
        /// Where that record begins.
        at_byte: u64,
    },
    /// What stands there is no record; nothing behind it was read.
    Garbled {
        /// Where it begins.
        at_byte: u64,
        /// What is wrong.
        what: String,
    },
    /// A chunk's bits changed; it was left out.
    Chunk {
        /// Where the chunk begins.
        at_byte: u64,
        /// What is wrong.
        what: String,
    },
    /// The CRC over everything but the summary is wrong: bits changed outside the chunks, or in one of those named.
    DataSection,
}

impl core::fmt::Display for Damage {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Unfinished { at_byte } => {
                write!(f, "not finished: its recorder still writes to it, or died; it ends at byte {at_byte}")
            }
            Self::Cut { at_byte } => {
                write!(f, "the file ends in the middle of the record that begins at byte {at_byte}")
            }
            Self::Garbled { at_byte, what } => {
                write!(f, "no record at byte {at_byte} ({what}); the rest was not read")
            }
            Self::Chunk { at_byte, what } => write!(f, "the chunk at byte {at_byte} was left out: {what}"),
            Self::DataSection => f.write_str("the CRC over the file's data is wrong"),
        }
    }
}

/// What a file holds, in its order.
pub(crate) enum Item<'a> {
    /// A metadata record.
    Metadata(String, BTreeMap<String, String>),
    /// A message's payload.
    Message(Topic, &'a [u8]),
    /// A declared gap.
    Gap(Gap),
    /// A note.
    Note(String),
    /// A payload that is not what its channel says.
    Unreadable,
}

/// What becomes of the walk after an item.
pub(crate) enum Walk {
    On,
    Stop,
}

/// No record that is ours is longer; a garbled length is not believed and not allocated.
const RECORD_LIMIT_BYTES: usize = 64 << 20;
/// Opcode and length in front of every record.
const RECORD_HEADER_BYTES: u64 = 9;

/// The record that ends the data holds their CRC alone.
const DATA_END_BYTES: usize = 4;

/// Hands each item of the file to `visit`; returns what is wrong with the file.
pub(crate) fn walk(path: &Path, visit: impl FnMut(Item<'_>) -> Walk) -> Result<Vec<Damage>, RecordingError> {
    let failed = |source| RecordingError::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(failed)?;
    let mut input = BufReader::with_capacity(1 << 20, file);
    let mut walker = Walker { channels: BTreeMap::new(), damage: Vec::new(), at_byte: 0, visit };
    let mut magic = [0; mcap::MAGIC.len()];
    let length = read_up_to(&mut input, &mut magic).map_err(failed)?;
    if magic.get(..length) != mcap::MAGIC.get(..length) {
        return Err(RecordingError::NotMcap { path: path.to_owned() });
    }
    if length < magic.len() {
        return Ok(vec![Damage::Cut { at_byte: 0 }]);
    }
    walker.at_byte = length as u64;
    walker.run(&magic, &mut input).map_err(failed)?;
    Ok(walker.damage)
}

struct Walker<V> {
    channels: BTreeMap<u16, Channel>,
    damage: Vec<Damage>,
    /// Where the next record begins.
    at_byte: u64,
    visit: V,
}

#[derive(Clone, Copy)]
enum Channel {
    Topic(Topic),
    Gaps,
    Notes,
}

impl<V: FnMut(Item<'_>) -> Walk> Walker<V> {
    fn run(&mut self, magic: &[u8], input: &mut impl Read) -> std::io::Result<()> {
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_validate_data_section_crc(true)
            .with_record_length_limit(RECORD_LIMIT_BYTES);
        let mut reader = LinearReader::new_with_options(options);
        feed(&mut reader, magic);
        let mut bytes_read = magic.len() as u64;
        while let Some(event) = reader.next_event() {
            match event {
                Ok(LinearReadEvent::ReadRequest(need)) => {
                    let read = read_up_to(input, reader.insert(need))?;
                    reader.notify_read(read);
                    bytes_read += read as u64;
                }
                // Behind it stands the summary, which repeats what was read.
                Ok(LinearReadEvent::Record { opcode: op::DATA_END, data }) => {
                    // A changed byte can make another record of this kind.
                    if data.len() != DATA_END_BYTES {
                        let what = format!("an end of {} bytes", data.len());
                        self.damage.push(Damage::Garbled { at_byte: self.at_byte, what });
                    }
                    break;
                }
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    let end = self.at_byte + RECORD_HEADER_BYTES + data.len() as u64;
                    if let Walk::Stop = self.record(opcode, data) {
                        break;
                    }
                    self.at_byte = end;
                }
                Err(error) => {
                    self.damage.push(self.ending(&error, bytes_read));
                    break;
                }
            }
        }
        Ok(())
    }

    fn ending(&self, error: &McapError, bytes_read: u64) -> Damage {
        let at_byte = self.at_byte;
        match error {
            McapError::UnexpectedEof if bytes_read == at_byte => Damage::Unfinished { at_byte },
            McapError::UnexpectedEof => Damage::Cut { at_byte },
            McapError::BadDataCrc { .. } => Damage::DataSection,
            other => Damage::Garbled { at_byte, what: other.to_string() },
        }
    }

    /// One record of the file.
    fn record(&mut self, opcode: u8, data: &[u8]) -> Walk {
        let at_byte = self.at_byte;
        // What the disk never got reads as zeros after a loss of power.
        if opcode == 0 {
            self.damage.push(Damage::Garbled { at_byte, what: "zeros".to_owned() });
            return Walk::Stop;
        }
        // Others are indexes and what other programs add.
        if opcode != op::METADATA && opcode != op::CHUNK {
            return Walk::On;
        }
        match mcap::parse_record(opcode, data) {
            Ok(Record::Metadata(metadata)) => (self.visit)(Item::Metadata(metadata.name, metadata.metadata)),
            Ok(Record::Chunk { header, data }) => self.chunk(&header, &data).unwrap_or_else(|what| {
                self.damage.push(Damage::Chunk { at_byte, what });
                Walk::On
            }),
            Ok(_) => Walk::On,
            Err(error) => {
                self.damage.push(Damage::Chunk { at_byte, what: error.to_string() });
                Walk::On
            }
        }
    }

    /// The records of a chunk, once its CRC has been found right.
    fn chunk(&mut self, header: &ChunkHeader, data: &[u8]) -> Result<Walk, String> {
        let unpacked;
        let data = match header.compression.as_str() {
            "" => data,
            "zstd" => {
                unpacked = unpacked_from(data, header.uncompressed_size)?;
                &unpacked
            }
            other => return Err(format!("compressed with {other}, expected zstd or nothing")),
        };
        let crc = crc32fast::hash(data);
        if crc != header.uncompressed_crc {
            return Err(format!("CRC {crc:#010x}, expected {:#010x}", header.uncompressed_crc));
        }
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_emit_chunks(true)
            .with_record_length_limit(data.len());
        let mut reader = LinearReader::new_with_options(options);
        feed(&mut reader, data);
        while let Some(event) = reader.next_event() {
            match event.map_err(|error| error.to_string())? {
                LinearReadEvent::ReadRequest(_) => reader.notify_read(0),
                LinearReadEvent::Record { opcode, data } => {
                    if let Walk::Stop = self.record_in_chunk(opcode, data)? {
                        return Ok(Walk::Stop);
                    }
                }
            }
        }
        Ok(Walk::On)
    }

    fn record_in_chunk(&mut self, opcode: u8, data: &[u8]) -> Result<Walk, String> {
        if opcode != op::CHANNEL && opcode != op::MESSAGE {
            return Ok(Walk::On);
        }
        Ok(match mcap::parse_record(opcode, data).map_err(|error| error.to_string())? {
            Record::Channel(channel) => {
                self.add_channel(channel.id, &channel.topic);
                Walk::On
            }
            Record::Message { header, data } => match self.channels.get(&header.channel_id) {
                Some(Channel::Topic(topic)) => (self.visit)(Item::Message(*topic, &data)),
                Some(Channel::Gaps) => (self.visit)(cdr::read_gap(&data).map_or(Item::Unreadable, Item::Gap)),
                Some(Channel::Notes) => {
                    (self.visit)(cdr::read_note(&data).map_or(Item::Unreadable, Item::Note))
                }
                None => (self.visit)(Item::Unreadable),
            },
            _ => Walk::On,
        })
    }

    fn add_channel(&mut self, id: u16, path: &str) {
        let channel = match path {
            GAPS_PATH => Some(Channel::Gaps),
            NOTES_PATH => Some(Channel::Notes),
            path => Topic::from_path(path).map(Channel::Topic),
        };
        if let Some(channel) = channel {
            self.channels.insert(id, channel);
        }
    }
}

/// A chunk's records. Its size is the header's word, which is believed up to the limit of a record.
fn unpacked_from(data: &[u8], size: u64) -> Result<Vec<u8>, String> {
    let size = usize::try_from(size).ok().filter(|size| *size <= RECORD_LIMIT_BYTES);
    let size = size.ok_or_else(|| format!("more than {} MB in a chunk", RECORD_LIMIT_BYTES >> 20))?;
    let unpacked = zstd::bulk::decompress(data, size).map_err(|error| format!("zstd: {error}"))?;
    if unpacked.len() == size {
        Ok(unpacked)
    } else {
        Err(format!("{} bytes, expected {size}", unpacked.len()))
    }
}

fn feed(reader: &mut LinearReader, bytes: &[u8]) {
    // Nothing at all would tell the reader that the input has ended.
    if !bytes.is_empty() {
        reader.insert(bytes.len()).copy_from_slice(bytes);
        reader.notify_read(bytes.len());
    }
}

/// Reads until the buffer is full or the input ends.
fn read_up_to(input: &mut impl Read, buffer: &mut [u8]) -> std::io::Result<usize> {
    let mut filled = 0;
    while let Some(rest) = buffer.get_mut(filled..).filter(|rest| !rest.is_empty()) {
        match input.read(rest) {
            Ok(0) => break,
            Ok(read) => filled += read,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}
