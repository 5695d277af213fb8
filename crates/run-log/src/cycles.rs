//! Messages put in the rows of their cycles.

use crate::messages;
use hdf5::{Group, Result};
use recording::Topic;
use std::collections::BTreeMap;

/// More cycles than this in one run are refused: a day at 1 kHz is 86 million.
const MAX_CYCLES: u64 = 200_000_000;

/// The cycles of one generation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Span {
    pub(crate) generation: u64,
    pub(crate) first_cycle: u64,
    pub(crate) last_cycle: u64,
    /// Earliest time of a Feedback less its cycle's: what cycle 0 would have had.
    epoch_ns: i128,
    /// Where cycle 0 stands on the log's clock, in cycles: 0 for the record's first generation.
    start_cycles: i128,
}

impl Span {
    /// The number of rows: every cycle from the first to the last, recorded or not.
    pub(crate) fn rows(&self) -> usize {
        (self.last_cycle - self.first_cycle) as usize + 1
    }

    /// Each row's time on the log's clock.
    pub(crate) fn times_s(&self, period_ns: u64) -> Vec<f64> {
        let time =
            |cycle: u64| ((self.start_cycles + i128::from(cycle)) * i128::from(period_ns)) as f64 / 1e9;
        (self.first_cycle..=self.last_cycle).map(time).collect()
    }

    fn row(&self, generation: u64, cycle: u64) -> Option<usize> {
        let inside = generation == self.generation && (self.first_cycle..=self.last_cycle).contains(&cycle);
        inside.then(|| (cycle - self.first_cycle) as usize)
    }
}

/// The spans of all generations that sent Feedback, in their order, on one clock.
pub(crate) fn spans(file: &Group, period_ns: u64) -> Result<Vec<Span>> {
    let Some(feedback) = table(file, Topic::Feedback)? else { return Ok(Vec::new()) };
    let words = |name: &str| feedback.dataset(name)?.read_raw::<u64>();
    let (generations, cycles, times) = (words("generation")?, words("cycle")?, words("monotonic_ns")?);
    let mut spans: BTreeMap<u64, Span> = BTreeMap::new();
    for ((&generation, &cycle), &time_ns) in generations.iter().zip(&cycles).zip(&times) {
        let epoch_ns = i128::from(time_ns) - i128::from(cycle) * i128::from(period_ns);
        let new = Span { generation, first_cycle: cycle, last_cycle: cycle, epoch_ns, start_cycles: 0 };
        let span = spans.entry(generation).or_insert(new);
        span.first_cycle = span.first_cycle.min(cycle);
        span.last_cycle = span.last_cycle.max(cycle);
        span.epoch_ns = span.epoch_ns.min(epoch_ns);
    }
    let mut spans: Vec<Span> = spans.into_values().collect();
    if let Some(span) = spans.iter().find(|span| span.last_cycle - span.first_cycle >= MAX_CYCLES) {
        let (first, last) = (span.first_cycle, span.last_cycle);
        return Err(format!("cycles {first} to {last} in one run, expected at most {MAX_CYCLES}").into());
    }
    put_on_one_clock(&mut spans, i128::from(period_ns));
    Ok(spans)
}

/// A later generation begins as much later as its clock says, in whole periods, and never before the earlier ends.
fn put_on_one_clock(spans: &mut [Span], period_ns: i128) {
    let Some(first_epoch_ns) = spans.first().map(|span| span.epoch_ns) else { return };
    let mut end_cycles = i128::MIN;
    for span in spans {
        let by_clock = (span.epoch_ns - first_epoch_ns + period_ns / 2).div_euclid(period_ns);
        span.start_cycles = by_clock.max(end_cycles.saturating_sub(i128::from(span.first_cycle)));
        end_cycles = span.start_cycles + i128::from(span.last_cycle) + 1;
    }
}

/// The messages of one topic, put in the rows of a span.
pub(crate) struct CycleTable {
    group: Group,
    /// For each message, its row, where it has one.
    message_rows: Vec<Option<usize>>,
    rows: usize,
}

impl CycleTable {
    /// A topic's messages in a span; `None` where it has none.
    pub(crate) fn open(file: &Group, topic: Topic, span: &Span) -> Result<Option<Self>> {
        let Some(group) = table(file, topic)? else { return Ok(None) };
        let generations = group.dataset("generation")?.read_raw::<u64>()?;
        let cycles = group.dataset("cycle")?.read_raw::<u64>()?;
        let keys = generations.iter().zip(&cycles);
        let message_rows: Vec<_> = keys.map(|(generation, cycle)| span.row(*generation, *cycle)).collect();
        let any = message_rows.iter().any(Option::is_some);
        Ok(any.then_some(Self { group, message_rows, rows: span.rows() }))
    }

    /// A field as a column: NaN where a cycle has no message. Counts and codes become `f64`.
    pub(crate) fn column(&self, field: &str) -> Result<Vec<f64>> {
        let values = self.group.dataset(field)?.read_raw::<f64>()?;
        let mut column = vec![f64::NAN; self.rows];
        for (row, value) in self.message_rows.iter().zip(values) {
            if let Some(place) = row.and_then(|row| column.get_mut(row)) {
                *place = value;
            }
        }
        Ok(column)
    }
}

/// A topic's group in `/messages`; `None` where the record has no such message.
fn table(file: &Group, topic: Topic) -> Result<Option<Group>> {
    let place = format!("messages/{}", messages::path(topic));
    // Asked step by step: HDF5 takes a missing group in between for an error.
    let mut so_far = String::new();
    for step in place.split('/') {
        so_far.push_str(step);
        if !file.link_exists(&so_far) {
            return Ok(None);
        }
        so_far.push('/');
    }
    file.group(&place).map(Some)
}
