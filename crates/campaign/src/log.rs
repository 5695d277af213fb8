//! Rows as bytes: a head and then row after row, each with a checksum, so that a log cut at any place gives back all rows before.
//!
//! ```text
//! "stepvalve rows 1\n"   then records: length u32, CRC-32C of length and payload u32, payload (postcard); little-endian
//! first record: the head (plan, scenarios, models, version)          further records: rows, in the order in which they were made
//! ```
//! The head holds the texts themselves, not hashes of them: what changed can be named, and a log is enough to make the table.

use crate::base::{BaseTexts, Source};
use crate::error::CampaignError;
use crate::plan::Campaign;
use crate::row::Row;
use config::says_the_same;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use thiserror::Error;

const MAGIC: &[u8] = b"stepvalve rows 1\n";
/// Length and checksum.
const PREFIX_BYTES: usize = 8;

/// What a log's rows were made of.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Head {
    /// The program's version: another may compute other numbers.
    pub program_version: String,
    /// The plan.
    pub plan: Source,
    /// Its scenarios with their models.
    pub bases: Vec<BaseTexts>,
}

impl Head {
    /// Of a campaign that this version of the program runs.
    pub fn new(campaign: &Campaign, program_version: &str) -> Self {
        Self {
            program_version: program_version.to_owned(),
            plan: campaign.source().clone(),
            bases: campaign.bases().cloned().collect(),
        }
    }

    /// The campaign that the rows belong to.
    ///
    /// # Errors
    /// Texts that this version of the program doesn't read any more.
    pub fn campaign(&self) -> Result<Campaign, CampaignError> {
        Campaign::new(self.plan.clone(), self.bases.clone())
    }

    /// What differs in another head, in words; empty where nothing does. Names of files are none of it (a plan may be moved), nor are comments
    /// and what changes no row.
    pub fn differences(&self, other: &Self) -> Vec<String> {
        let mut found = Vec::new();
        if self.program_version != other.program_version {
            found.push(format!("stepvalve {} is {} now", self.program_version, other.program_version));
        }
        let mut compare = |what: &str, one: &Source, other: &Source, but: &[&str]| {
            if let Some(line) = first_difference(&one.text, &other.text)
                && !says_the_same(&one.text, &other.text, but)
            {
                found.push(format!("{what} {}, line {line}", other.file));
            }
        };
        // How many may fail changes no row.
        compare("the plan", &self.plan, &other.plan, &["failure_limit", "name"]);
        for (one, other) in self.bases.iter().zip(&other.bases) {
            compare("the scenario", &one.scenario, &other.scenario, &[]);
            compare("the truth", &one.truth, &other.truth, &[]);
            compare("the belief", &one.belief, &other.belief, &[]);
        }
        found.dedup();
        found
    }
}

/// The first line, from 1, in which two texts differ.
fn first_difference(one: &str, other: &str) -> Option<usize> {
    if one == other {
        return None;
    }
    let same = one.split('\n').zip(other.split('\n')).take_while(|(a, b)| a == b).count();
    Some(same + 1)
}

/// Why bytes are no log.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LogError {
    /// It begins otherwise.
    #[error("found something else than a campaign's rows, expected a file that stepvalve campaign wrote")]
    Format,
    /// The head is damaged or cut.
    #[error("byte {at}: found a damaged head, expected the campaign's plan: begin anew with --force")]
    Head {
        /// Where the head begins.
        at: usize,
    },
    /// A text doesn't fit a record.
    #[error("found {bytes} bytes of plan, scenarios and models, expected less than 4 GB")]
    TooLong {
        /// Its length.
        bytes: usize,
    },
}

/// What a log holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Contents {
    /// What its rows were made of.
    pub head: Head,
    /// The rows by their runs.
    pub rows: BTreeMap<u64, Row>,
    /// How many bytes there are up to the end of the last record; what follows is none.
    pub whole_bytes: usize,
    /// How many of these belong to damaged records.
    pub damaged_bytes: usize,
}

/// The beginning of a log.
///
/// # Errors
/// [`LogError::TooLong`].
pub fn begin(head: &Head) -> Result<Vec<u8>, LogError> {
    Ok([MAGIC, &record(head)?].concat())
}

/// A row as bytes, to be written behind all others.
///
/// # Errors
/// [`LogError::TooLong`]; no row is so long.
pub fn row(row: &Row) -> Result<Vec<u8>, LogError> {
    record(row)
}

/// Reads a log. A record that is damaged costs itself: what follows is found again by the next checksum that is right.
///
/// # Errors
/// [`LogError::Format`] and [`LogError::Head`].
pub fn read(bytes: &[u8]) -> Result<Contents, LogError> {
    let rest = bytes.strip_prefix(MAGIC).ok_or(LogError::Format)?;
    let (head, mut rest) = take::<Head>(rest).ok_or(LogError::Head { at: MAGIC.len() })?;
    let (mut rows, mut damaged_bytes) = (BTreeMap::new(), 0);
    loop {
        while let Some((row, behind)) = take::<Row>(rest) {
            // A run that was made twice, by a shard that was given two folders, has the same row twice.
            rows.entry(row.run).or_insert(row);
            rest = behind;
        }
        let Some(next) = (1..rest.len()).find(|skipped| starts_a_row(rest, *skipped)) else { break };
        damaged_bytes += next;
        rest = rest.get(next..).unwrap_or_default();
    }
    Ok(Contents { head, rows, whole_bytes: bytes.len() - rest.len(), damaged_bytes })
}

/// The longest row is far shorter: a length beyond it is none.
const LONGEST_ROW: usize = 1 << 16;

fn starts_a_row(bytes: &[u8], at: usize) -> bool {
    let Some(rest) = bytes.get(at..) else { return false };
    let length = rest.first_chunk::<4>().map_or(0, |length| u32::from_le_bytes(*length) as usize);
    (1..LONGEST_ROW).contains(&length) && take::<Row>(rest).is_some()
}

fn record(content: &impl Serialize) -> Result<Vec<u8>, LogError> {
    let payload = postcard::to_stdvec(content).map_err(|_| LogError::TooLong { bytes: usize::MAX })?;
    let length = u32::try_from(payload.len()).map_err(|_| LogError::TooLong { bytes: payload.len() })?;
    let length = length.to_le_bytes();
    Ok([&length[..], &checksum(&length, &payload).to_le_bytes(), &payload].concat())
}

fn checksum(length: &[u8], payload: &[u8]) -> u32 {
    crc32c::crc32c_append(crc32c::crc32c(length), payload)
}

/// The record that bytes begin with, and what is behind it; `None` where it is cut or damaged.
fn take<T: DeserializeOwned>(bytes: &[u8]) -> Option<(T, &[u8])> {
    let (prefix, rest) = bytes.split_at_checked(PREFIX_BYTES)?;
    let (length, expected) = prefix.split_at_checked(4)?;
    let payload_bytes = u32::from_le_bytes(length.try_into().ok()?) as usize;
    let (payload, rest) = rest.split_at_checked(payload_bytes)?;
    if checksum(length, payload) != u32::from_le_bytes(expected.try_into().ok()?) {
        return None;
    }
    // Some bytes may be left over only in what another version wrote.
    match postcard::take_from_bytes(payload).ok()? {
        (content, []) => Some((content, rest)),
        _ => None,
    }
}
