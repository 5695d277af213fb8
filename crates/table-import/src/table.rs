//! A table of numbers, whatever file it comes from, and the run that the maps make of it.

use crate::expression::{Bound, Cells, Condition, Map};
use crate::filter::low_pass;
use crate::rows::Rows;
use crate::units;
use anyhow::{anyhow, bail, ensure};
use log_data::{Channel, Extra, Run};
use std::num::NonZero;

/// What takes a row: the line (or row) of the file that it stands in, from 1; its number among the rows, from 0; and the
/// wanted columns' values.
pub type Take<'a> = dyn FnMut(u64, usize, &[f64]) -> anyhow::Result<()> + 'a;

/// The corner of the low-pass before rows are left out, in parts of half the new sampling rate.
const CORNER: f64 = 0.8;

/// A last line without an end whose last cell is shorter than that of any row before: a file that was cut off within a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CutLine {
    /// Its number.
    pub line: u64,
    /// What stands in its last cell.
    pub cell: String,
}

/// A table with named columns, read once from top to bottom.
pub trait Table {
    /// The columns' names.
    fn names(&self) -> &[String];

    /// The columns' units, as far as the table states any.
    fn units(&self) -> &[String] {
        &[]
    }

    /// What a row's place in the file is called: "line" or "row".
    fn place(&self) -> &'static str;

    /// What to try where a column isn't there.
    fn hint(&self) -> &str {
        ""
    }

    /// The last line, where it was left out because the file was cut off within it; known once all rows are read.
    fn cut(&self) -> Option<&CutLine> {
        None
    }

    /// Whether a cell that was read says that its sample is missing, as the format's text at this place of the list does.
    fn says_missing(&self, _place: usize) -> bool {
        false
    }

    /// Hands over the wanted columns row by row, until all are read or one is refused.
    ///
    /// # Errors
    /// What is wrong in the file, with its place; what `take` refuses.
    fn each(&mut self, wanted: &[usize], take: &mut Take<'_>) -> anyhow::Result<()>;
}

/// Which of a table's rows are taken.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// A range of rows; all where there is none.
    pub rows: Option<Rows>,
    /// Only rows in which all of these hold.
    pub conditions: Vec<Condition>,
    /// Every nth of the range.
    pub every: Option<NonZero<usize>>,
    /// A low-pass on every channel, then every Nth row.
    pub decimate: Option<NonZero<usize>>,
    /// The most numbers, of all columns read and channels made.
    pub numbers: usize,
}

/// The rows read: the columns, and where each row stood.
#[derive(Default)]
struct Taken {
    columns: Vec<Vec<f64>>,
    rows: Vec<usize>,
    places: Vec<u64>,
}

/// Fills a run with what the maps make of a table.
///
/// # Errors
/// A variable that is no column, a number that is none, a time that doesn't increase; with the place in the file.
pub fn collect(
    table: &mut dyn Table,
    maps: &[Map],
    selection: &Selection,
    run: &mut Run,
) -> anyhow::Result<()> {
    let mut wanted = Vec::new();
    let (names, place) = (table.names().to_vec(), table.place());
    let bound = bind(maps, |map| map.bind(&names, &mut wanted))
        .map_err(|error| anyhow!("{error:#}{}", table.hint()))?;
    maps.iter().try_for_each(|map| units::check(map, &names, table.units()))?;
    let conditions = bind(&selection.conditions, |condition| condition.bind(&names, &mut wanted))?;
    let mut taken = read(table, &wanted, maps.len(), selection)?;
    keep(&mut taken, &conditions, selection)?;
    ensure!(!taken.rows.is_empty(), "no row to import, expected at least one");
    let at = |index: usize| format!("{place} {}", taken.places.get(index).copied().unwrap_or_default());
    let mut channels: Vec<Vec<f64>> = vec![Vec::new(); maps.len()];
    let is_time = |map: &Map| map.target() == Channel::Time.name();
    let mut time_s: Option<Vec<f64>> = None;
    // The time first: functions of the others refer to it.
    let order =
        |of_time: bool| (0..maps.len()).filter(move |index| maps.get(*index).is_some_and(is_time) == of_time);
    for index in order(true).chain(order(false)) {
        let (Some(map), Some(bound), Some(channel)) =
            (maps.get(index), bound.get(index), channels.get_mut(index))
        else {
            continue;
        };
        let cells = Cells { columns: &taken.columns, rows: &taken.rows, time_s: time_s.as_deref() };
        let values = bound.values(&cells).map_err(|error| anyhow!("{map}: {error}"))?;
        check(map, &values).map_err(|(row, error)| anyhow!("{}: {map}: {error}", at(row)))?;
        if is_time(map) {
            time_s = Some(values.clone());
        }
        *channel = values;
    }
    if let Some(every) = selection.decimate.filter(|every| every.get() > 1) {
        for (map, channel) in maps.iter().zip(&mut channels) {
            decimate(channel, every.get(), is_time(map))?;
        }
    }
    for (map, values) in maps.iter().zip(channels) {
        put(run, map, values);
    }
    Ok(())
}

fn bind<'a, T>(
    all: &'a [T],
    mut bind: impl FnMut(&'a T) -> anyhow::Result<Bound<'a>>,
) -> anyhow::Result<Vec<Bound<'a>>> {
    all.iter().map(&mut bind).collect()
}

/// Reads every nth row of the range.
fn read(
    table: &mut dyn Table,
    wanted: &[usize],
    channels: usize,
    selection: &Selection,
) -> anyhow::Result<Taken> {
    let place = table.place();
    let every = selection.every.map_or(1, NonZero::get);
    let (mut taken, mut seen, mut numbers) = (Taken::default(), 0, 0);
    taken.columns = vec![Vec::new(); wanted.len()];
    table.each(wanted, &mut |at, row, values| {
        if selection.rows.is_some_and(|rows| !rows.holds(row)) {
            return Ok(());
        }
        seen += 1;
        if (seen - 1) % every != 0 {
            return Ok(());
        }
        numbers += channels + wanted.len() + 2;
        let most = selection.numbers;
        ensure!(
            numbers <= most,
            "{place} {at}: more numbers than fit ({most}): take fewer rows (--rows, --every)"
        );
        for (column, value) in taken.columns.iter_mut().zip(values) {
            column.push(*value);
        }
        taken.rows.push(row);
        taken.places.push(at);
        Ok(())
    })?;
    Ok(taken)
}

/// Leaves out the rows in which a condition doesn't hold.
fn keep(taken: &mut Taken, conditions: &[Bound<'_>], selection: &Selection) -> anyhow::Result<()> {
    for (bound, condition) in conditions.iter().zip(&selection.conditions) {
        let cells = Cells { columns: &taken.columns, rows: &taken.rows, time_s: None };
        let values = bound.values(&cells).map_err(|error| anyhow!("{condition}: {error}"))?;
        // A condition on a missing sample doesn't hold.
        let holds: Vec<bool> = values.iter().map(|value| !value.is_nan() && *value != 0.0).collect();
        if !holds.contains(&true) && !holds.is_empty() {
            bail!("{condition}: holds in none of {} rows, expected at least one", holds.len());
        }
        taken.columns.iter_mut().for_each(|column| retain(column, &holds));
        retain(&mut taken.rows, &holds);
        retain(&mut taken.places, &holds);
    }
    Ok(())
}

fn retain<T>(values: &mut Vec<T>, holds: &[bool]) {
    let mut holds = holds.iter();
    values.retain(|_| holds.next().copied().unwrap_or(false));
}

fn check(map: &Map, values: &[f64]) -> Result<(), (usize, String)> {
    let is_time = map.target() == Channel::Time.name();
    let mut last_s = f64::NEG_INFINITY;
    for (row, &value) in values.iter().enumerate() {
        if is_time && !value.is_finite() {
            return Err((row, format!("time is {value}, expected a finite number")));
        }
        if is_time && value <= last_s {
            return Err((row, not_later(map, value, last_s)));
        }
        if value.is_infinite() {
            return Err((row, format!("{value}, expected a finite number or NaN")));
        }
        last_s = value;
    }
    Ok(())
}

/// What is wrong with a time that is no later than the one before it.
fn not_later(map: &Map, time_s: f64, last_s: f64) -> String {
    if time_s < last_s {
        return format!("time is {time_s} s after {last_s} s, expected it to increase");
    }
    let taken = map.right_side();
    format!(
        "time is {time_s} s as in the row before, expected it to increase; --where 'row==0 || difference({taken})>0' leaves repeated rows out"
    )
}

fn decimate(channel: &mut Vec<f64>, every: usize, is_time: bool) -> anyhow::Result<()> {
    ensure!(channel.len() > every, "--decimate {every}: {} rows, expected more", channel.len());
    if !is_time {
        *channel = low_pass(channel, CORNER * 0.5 / every as f64);
    }
    *channel = channel.iter().step_by(every).copied().collect();
    Ok(())
}

fn put(run: &mut Run, map: &Map, values: Vec<f64>) {
    match Channel::from_name(map.target()) {
        Some(channel) => run.set_channel(channel, values),
        None => run.extra.push(Extra { name: map.target().to_owned(), unit: map.unit().to_owned(), values }),
    }
}
