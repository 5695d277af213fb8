//! How each process kept its cycles: latency and execution time over the run and as histograms.

use super::table::Table;
use ::report::{Axis, Distribution, Histogram, Panel, ReportError, TimeAxis};
use anyhow::Result;
use run_log::RunLogError;
use signals::Scheduling;

/// Signals that each process adds to the page.
pub const SERIES: usize = 2;
/// Each bin of a histogram is so much wider than the one before.
const BIN_GROWTH: f64 = 1.1;
/// The histograms' first edge, ns.
const FIRST_EDGE_NS: u64 = 100;

/// One process's timing, put into the rows of its cycles.
pub struct ProcessTiming {
    /// The process.
    pub name: String,
    /// The scheduling obtained, in words.
    pub scheduling: String,
    /// Wake-up after the deadline in each row, ns; NaN where there is none.
    wake_up_ns: Vec<f32>,
    /// Time spent in the cycle, ns, alike.
    execution_ns: Vec<f32>,
    /// Those of cycles without a row: the plant ends first. Histograms and largest values have them too.
    beyond: Beyond,
    /// The rows whose work ran past the next deadline.
    pub overruns: Vec<usize>,
    /// Cycles that ran past the next deadline.
    pub overrun_count: u64,
    /// Cycles skipped.
    pub skipped_count: u64,
}

/// Wake-up and execution time of cycles without a row, ns.
#[derive(Default)]
struct Beyond {
    wake_up_ns: Vec<f32>,
    execution_ns: Vec<f32>,
}

/// The timing of all processes that recorded it.
///
/// # Errors
/// [`RunLogError`].
pub fn read(table: &Table) -> Result<Vec<ProcessTiming>, RunLogError> {
    table.file.processes()?.into_iter().map(|name| Reader::new(table, &name)?.process(name)).collect()
}

/// Latency and execution time over the run.
///
/// # Errors
/// [`ReportError`], never with the axis of this table.
pub fn panels(timing: &[ProcessTiming], axis: &TimeAxis) -> Result<Vec<Panel>, ReportError> {
    let (mut wake_up, mut execution) = (Panel::new("Wake-up latency"), Panel::new("Time spent in the cycle"));
    for process in timing {
        let us = |values: &[f32]| axis.trace(values.iter().map(|&ns| f64::from(ns) / 1e3));
        wake_up = wake_up.with(&process.name, "µs", us(&process.wake_up_ns)?);
        execution = execution.with(&process.name, "µs", us(&process.execution_ns)?);
    }
    let panels = [wake_up, execution].into_iter().filter(|panel| !panel.series.is_empty());
    Ok(panels.collect())
}

/// The same as distributions.
///
/// # Errors
/// Where a histogram can't be made, never with these bounds.
pub fn histograms(timing: &[ProcessTiming]) -> Result<Vec<Histogram>> {
    if timing.is_empty() {
        return Ok(Vec::new());
    }
    let histogram = |title: &str, values: fn(&ProcessTiming) -> [&[f32]; 2]| -> Result<Histogram> {
        let distributions = timing.iter().map(|process| distribution(&process.name, values(process)));
        let distributions = distributions.collect::<Result<_>>()?;
        Ok(Histogram { title: title.to_owned(), x: Axis::log("time", "µs"), distributions })
    };
    Ok(vec![
        histogram("Wake-up latency", |process| [&process.wake_up_ns, &process.beyond.wake_up_ns])?,
        histogram("Time spent in the cycle", |process| {
            [&process.execution_ns, &process.beyond.execution_ns]
        })?,
    ])
}

fn distribution(name: &str, values_ns: [&[f32]; 2]) -> Result<Distribution> {
    let mut counts = hdrhistogram::Histogram::<u64>::new(3)?;
    for value in values_ns.into_iter().flatten().filter(|value| value.is_finite()) {
        counts.record(*value as u64)?;
    }
    let bins = counts
        .iter_log(FIRST_EDGE_NS, BIN_GROWTH)
        .map(|bin| (bin.value_iterated_to() as f64 / 1e3, bin.count_since_last_iteration()));
    Ok(Distribution { name: name.to_owned(), lower_edge: 0.0, bins: bins.collect() })
}

/// Reads one process's columns; knows to which row each of its messages belongs.
struct Reader<'a> {
    table: &'a Table,
    place: String,
    rows: Vec<Option<u32>>,
}

impl<'a> Reader<'a> {
    fn new(table: &'a Table, process: &str) -> Result<Self, RunLogError> {
        let mut reader = Self { table, place: format!("timing/{process}"), rows: Vec::new() };
        let generations: Vec<u64> =
            reader.column("generation", |values| values.map(|value| value as u64).collect())?;
        let row = |generation: u64, cycle: u64| u32::try_from(table.file.row_of(generation, cycle)?).ok();
        reader.rows = reader.column("cycle", |cycles| {
            generations.iter().zip(cycles).map(|(generation, cycle)| row(*generation, cycle as u64)).collect()
        })?;
        Ok(reader)
    }

    fn process(&self, name: String) -> Result<ProcessTiming, RunLogError> {
        let (execution_ns, executions_beyond) = self.sums(&["read_ns", "step_ns", "write_ns"])?;
        let (wake_up_ns, wake_ups_beyond) = self.sums(&["wake_up_latency_ns"])?;
        let mut overruns = Vec::new();
        let overrun_count = self.rises("overruns", |row| overruns.push(row))?;
        let skipped_count = self.rises("skipped_cycles", |_| ())?;
        Ok(ProcessTiming {
            name: name.replace('_', "-"),
            scheduling: self.scheduling()?,
            wake_up_ns,
            execution_ns,
            beyond: Beyond { wake_up_ns: wake_ups_beyond, execution_ns: executions_beyond },
            overruns,
            overrun_count,
            skipped_count,
        })
    }

    fn scheduling(&self) -> Result<String, RunLogError> {
        let first = |name| self.column(name, |values| values.next().unwrap_or(0.0));
        let (scheduling, priority) = (first("scheduling")?, first("priority")?);
        Ok(match Scheduling::from_code(scheduling as u64) {
            Some(Scheduling::Fifo) => format!("FIFO {priority}"),
            _ => "normal scheduler".to_owned(),
        })
    }

    /// By how much a count that begins again at every start rose in all, and in which rows. A cycle that has no row counts too.
    fn rises(&self, field: &str, mut note: impl FnMut(usize)) -> Result<u64, RunLogError> {
        self.column(field, |values| {
            let (mut before, mut sum) = (0, 0);
            for (row, count) in self.rows.iter().zip(values) {
                let count = count as u64;
                let rise = count.checked_sub(before).unwrap_or(count);
                if rise > 0 {
                    row.iter().for_each(|row| note(*row as usize));
                }
                (before, sum) = (count, sum + rise);
            }
            sum
        })
    }

    /// The sum of some fields in each row, NaN where there is none, and in each cycle without a row.
    fn sums(&self, fields: &[&str]) -> Result<(Vec<f32>, Vec<f32>), RunLogError> {
        let mut in_rows = vec![f32::NAN; self.table.time_s.len()];
        let mut beyond = vec![f32::NAN; self.rows.iter().filter(|row| row.is_none()).count()];
        for field in fields {
            self.column(field, |values| {
                let mut without_row = beyond.iter_mut();
                for (row, value) in self.rows.iter().zip(values) {
                    let place = match row {
                        Some(row) => in_rows.get_mut(*row as usize),
                        None => without_row.next(),
                    };
                    if let Some(sum) = place {
                        *sum = if sum.is_nan() { value as f32 } else { *sum + value as f32 };
                    }
                }
            })?;
        }
        Ok((in_rows, beyond))
    }

    fn column<T: Default>(
        &self,
        field: &str,
        visit: impl FnOnce(&mut dyn Iterator<Item = f64>) -> T,
    ) -> Result<T, RunLogError> {
        Ok(self.table.file.table_column(&self.place, field, visit)?.unwrap_or_default())
    }
}
