//! `/messages`: every message of a record with all its bits, a dataset for each field.

use crate::h5;
use hdf5::{Dataset, Group, Result};
use recording::{AnyMessage, Topic};
use signals::{Field, Header, Kind, SetPointKind};
use std::collections::BTreeMap;

/// Streams messages into the file: a block of rows of each topic is in memory, whatever the record's length.
pub(crate) struct Messages {
    root: Group,
    tables: BTreeMap<Topic, Table>,
}

impl Messages {
    /// Begins `/messages`.
    pub(crate) fn new(file: &Group) -> Result<Self> {
        Ok(Self { root: file.create_group("messages")?, tables: BTreeMap::new() })
    }

    /// Adds a message.
    pub(crate) fn add(&mut self, message: &AnyMessage) -> Result<()> {
        let Some(topic) = message.topic() else { return Ok(()) };
        let table = self.tables.entry(topic).or_insert_with(|| Table::new(topic));
        message.each_word(|word| table.words.push(word));
        table.rows += 1;
        match table.rows < h5::CHUNK_ROWS {
            true => Ok(()),
            false => table.append(&self.root),
        }
    }

    /// Writes what is left.
    pub(crate) fn finish(mut self) -> Result<()> {
        self.tables.values_mut().try_for_each(|table| table.finish(&self.root))
    }
}

/// The messages of one topic.
struct Table {
    topic: Topic,
    /// Rows in memory, and their words, row by row.
    rows: usize,
    words: Vec<u64>,
    /// One dataset for each field, once there is more than a block.
    datasets: Vec<Dataset>,
}

impl Table {
    fn new(topic: Topic) -> Self {
        Self { topic, rows: 0, words: Vec::new(), datasets: Vec::new() }
    }

    fn fields(&self) -> impl Iterator<Item = &'static Field> + use<> {
        Header::FIELDS.iter().chain(self.topic.body_fields())
    }

    /// The bits of field number `index` in all rows in memory.
    fn column(&self, index: usize) -> impl Iterator<Item = u64> {
        let width = self.fields().count();
        self.words.iter().skip(index).step_by(width).copied()
    }

    fn append(&mut self, root: &Group) -> Result<()> {
        if self.datasets.is_empty() {
            let group = root.create_group(path(self.topic))?;
            let create = |field: &Field| {
                let dataset = match field.kind {
                    Kind::U64 => h5::growing_column::<u64>(&group, field.name, field.unit),
                    Kind::I64 => h5::growing_column::<i64>(&group, field.name, field.unit),
                    Kind::F64 => h5::growing_column::<f64>(&group, field.name, field.unit),
                }?;
                explain(&dataset, self.topic, field.name)?;
                Ok(dataset)
            };
            self.datasets = self.fields().map(create).collect::<Result<_>>()?;
        }
        for ((index, field), dataset) in self.fields().enumerate().zip(&self.datasets) {
            match field.kind {
                Kind::U64 => h5::append(dataset, &self.column(index).collect::<Vec<_>>()),
                Kind::I64 => h5::append(dataset, &signed(self.column(index))),
                Kind::F64 => h5::append(dataset, &floats(self.column(index))),
            }?;
        }
        self.words.clear();
        self.rows = 0;
        Ok(())
    }

    fn finish(&mut self, root: &Group) -> Result<()> {
        if !self.datasets.is_empty() {
            return self.append(root);
        }
        let group = root.create_group(path(self.topic))?;
        for (index, field) in self.fields().enumerate() {
            let (name, unit) = (field.name, field.unit);
            let dataset = match field.kind {
                Kind::U64 => h5::put_column(&group, name, unit, &self.column(index).collect::<Vec<_>>()),
                Kind::I64 => h5::put_column(&group, name, unit, &signed(self.column(index))),
                Kind::F64 => h5::put_column(&group, name, unit, &floats(self.column(index))),
            }?;
            explain(&dataset, self.topic, name)?;
        }
        Ok(())
    }
}

/// A topic's group within `/messages`.
pub(crate) fn path(topic: Topic) -> &'static str {
    topic.path().trim_start_matches('/')
}

/// Says what a column's codes or flags mean, where it carries such.
pub(crate) fn explain(dataset: &Dataset, topic: Topic, field: &str) -> Result<()> {
    let meaning = match (topic, field) {
        (Topic::SetPoint, "value") => Some(format!("unit by kind: {}", units_by_kind())),
        _ => recording::codes(topic, field).map(|codes| codes.to_string()),
    };
    match meaning {
        Some(meaning) => h5::put_text(dataset, "codes", &meaning),
        None => Ok(()),
    }
}

/// `0 hold 1, 1 angle rad, ...`: a set-point's value has the unit of its kind.
fn units_by_kind() -> String {
    let parts: Vec<_> =
        SetPointKind::ALL.iter().map(|kind| format!("{} {kind} {}", kind.code(), kind.unit())).collect();
    parts.join(", ")
}

fn signed(words: impl Iterator<Item = u64>) -> Vec<i64> {
    words.map(u64::cast_signed).collect()
}

fn floats(words: impl Iterator<Item = u64>) -> Vec<f64> {
    words.map(f64::from_bits).collect()
}
