//! The object dictionary: values in their bytes, by index and subindex, with who may write them (ETG.1000.6, clause 5.6).

use crate::al::AlState;
use std::collections::{BTreeMap, BTreeSet};

/// Why an access is refused (ETG.1000.6, table 41).
pub(crate) mod abort {
    pub(crate) const UNKNOWN_COMMAND: u32 = 0x0504_0001;
    pub(crate) const TOGGLE: u32 = 0x0503_0000;
    pub(crate) const READ_ONLY: u32 = 0x0601_0002;
    pub(crate) const NO_OBJECT: u32 = 0x0602_0000;
    pub(crate) const NOT_MAPPABLE: u32 = 0x0604_0041;
    pub(crate) const LENGTH: u32 = 0x0607_0010;
    pub(crate) const NO_SUBINDEX: u32 = 0x0609_0011;
    pub(crate) const WRONG_STATE: u32 = 0x0800_0022;
}

/// Who may write an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    ReadOnly,
    Always,
    InPreOp,
}

#[derive(Debug, Clone)]
struct Entry {
    data: Vec<u8>,
    access: Access,
}

/// All objects of a device.
#[derive(Debug, Clone, Default)]
pub(crate) struct Dictionary {
    entries: BTreeMap<(u16, u8), Entry>,
    /// Refusals that a test asked for.
    refusals: BTreeMap<(u16, u8), u32>,
    /// Entries that keep their value, whatever is written.
    stubborn: BTreeSet<(u16, u8)>,
}

impl Dictionary {
    pub(crate) fn add(&mut self, index: u16, sub: u8, access: Access, data: impl AsRef<[u8]>) {
        self.entries.insert((index, sub), Entry { data: data.as_ref().to_vec(), access });
    }

    pub(crate) fn remove(&mut self, index: u16, sub: u8) {
        self.entries.remove(&(index, sub));
    }

    /// Every access to this entry is refused from now on.
    pub(crate) fn refuse(&mut self, index: u16, sub: u8, code: u32) {
        self.refusals.insert((index, sub), code);
    }

    /// Writes to this entry are accepted from now on, and change nothing.
    pub(crate) fn keep(&mut self, index: u16, sub: u8) {
        self.stubborn.insert((index, sub));
    }

    /// What a main device reads.
    pub(crate) fn upload(&self, index: u16, sub: u8) -> Result<&[u8], u32> {
        self.allowed(index, sub)?;
        self.entries.get(&(index, sub)).map(|entry| &*entry.data).ok_or_else(|| self.missing(index))
    }

    /// What a main device writes.
    pub(crate) fn download(&mut self, index: u16, sub: u8, data: &[u8], state: AlState) -> Result<(), u32> {
        self.allowed(index, sub)?;
        let missing = self.missing(index);
        let entry = self.entries.get_mut(&(index, sub)).ok_or(missing)?;
        match entry.access {
            Access::ReadOnly => return Err(abort::READ_ONLY),
            Access::InPreOp if state != AlState::PreOp => return Err(abort::WRONG_STATE),
            _ => {}
        }
        if entry.data.len() != data.len() {
            return Err(abort::LENGTH);
        }
        if !self.stubborn.contains(&(index, sub)) {
            entry.data.copy_from_slice(data);
        }
        Ok(())
    }

    fn allowed(&self, index: u16, sub: u8) -> Result<(), u32> {
        self.refusals.get(&(index, sub)).map_or(Ok(()), |code| Err(*code))
    }

    fn missing(&self, index: u16) -> u32 {
        let any = self.entries.range((index, 0)..=(index, u8::MAX)).next().is_some();
        if any { abort::NO_SUBINDEX } else { abort::NO_OBJECT }
    }

    /// A value as a signed number; 0 where there is none.
    pub(crate) fn value(&self, index: u16, sub: u8) -> i64 {
        let Some(entry) = self.entries.get(&(index, sub)) else { return 0 };
        let negative = entry.data.last().is_some_and(|byte| byte & 0x80 != 0);
        let mut bytes = if negative { [0xFF; 8] } else { [0; 8] };
        for (place, byte) in bytes.iter_mut().zip(&entry.data) {
            *place = *byte;
        }
        i64::from_le_bytes(bytes)
    }

    /// The same without a sign.
    pub(crate) fn unsigned(&self, index: u16, sub: u8) -> u64 {
        let Some(entry) = self.entries.get(&(index, sub)) else { return 0 };
        let mut bytes = [0; 8];
        for (place, byte) in bytes.iter_mut().zip(&entry.data) {
            *place = *byte;
        }
        u64::from_le_bytes(bytes)
    }

    /// Sets a value in the entry's own width.
    pub(crate) fn set(&mut self, index: u16, sub: u8, value: i64) {
        if let Some(entry) = self.entries.get_mut(&(index, sub)) {
            for (place, byte) in entry.data.iter_mut().zip(value.to_le_bytes()) {
                *place = byte;
            }
        }
    }

    /// The objects mapped by the PDOs that `assignment` (0x1C12, 0x1C13) names: index, subindex, bits.
    pub(crate) fn mapped(&self, assignment: u16) -> Vec<(u16, u8, u8)> {
        let count = |index: u16| u8::try_from(self.unsigned(index, 0)).unwrap_or(0);
        let pdos = (1..=count(assignment)).map(|sub| self.unsigned(assignment, sub) as u16);
        pdos.flat_map(|pdo| (1..=count(pdo)).map(move |sub| (pdo, sub)))
            .map(|(pdo, sub)| self.unsigned(pdo, sub))
            .map(|entry| ((entry >> 16) as u16, (entry >> 8) as u8, entry as u8))
            .collect()
    }

    /// Whether an object of so many bits is there to be mapped; index 0 is a gap.
    pub(crate) fn mappable(&self, index: u16, sub: u8, bits: u8) -> bool {
        let width = |entry: &Entry| entry.data.len() * 8 == usize::from(bits);
        index == 0 || self.entries.get(&(index, sub)).is_some_and(width)
    }

    /// Takes the outputs into the objects that they are mapped to.
    pub(crate) fn unpack(&mut self, mapping: &[(u16, u8, u8)], outputs: &[u8]) {
        let mut at = 0;
        for (index, sub, bits) in mapping {
            let bytes = usize::from(*bits) / 8;
            if let (Some(entry), Some(data)) =
                (self.entries.get_mut(&(*index, *sub)), outputs.get(at..at + bytes))
            {
                entry.data.clear();
                entry.data.extend_from_slice(data);
            }
            at += bytes;
        }
    }

    /// The inputs from the objects that they are mapped to.
    pub(crate) fn pack(&self, mapping: &[(u16, u8, u8)], inputs: &mut Vec<u8>) {
        inputs.clear();
        for (index, sub, bits) in mapping {
            let bytes = usize::from(*bits) / 8;
            match self.entries.get(&(*index, *sub)) {
                Some(entry) => inputs.extend_from_slice(&entry.data),
                None => inputs.resize(inputs.len() + bytes, 0),
            }
        }
    }
}
