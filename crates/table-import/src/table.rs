//! A table of numbers, whatever file it comes from, and the run that the maps make of it.

use super::expression::{Bound, Map};
use super::rows::Rows;
use anyhow::{anyhow, ensure};
use log_data::{Channel, Extra, Run};

/// What takes a row: its place in the file, in words, its number from 0, and the wanted columns' values.
pub type Take<'a> = dyn FnMut(&dyn Fn() -> String, usize, &[f64]) -> anyhow::Result<()> + 'a;

/// A table with named columns, read once from top to bottom.
pub trait Table {
    /// The columns' names.
    fn names(&self) -> &[String];

    /// Hands over the wanted columns row by row, until all are read or one is refused.
    ///
    /// # Errors
    /// What is wrong in the file, with its place; what `take` refuses.
    fn each(&mut self, wanted: &[usize], take: &mut Take<'_>) -> anyhow::Result<()>;
}

/// How much of a table is taken.
pub struct Limits {
    /// The rows; all where there is none.
    pub rows: Option<Rows>,
    /// The most numbers, of all channels.
    pub numbers: usize,
}

/// Fills a run with what the maps make of a table.
///
/// # Errors
/// A variable that is no column, a number that is none, a time that doesn't increase; with the place in the file.
pub fn collect(table: &mut dyn Table, maps: &[Map], limits: &Limits, run: &mut Run) -> anyhow::Result<()> {
    let mut wanted = Vec::new();
    let names = table.names().to_vec();
    let mut bound =
        maps.iter().map(|map| map.bind(&names, &mut wanted)).collect::<anyhow::Result<Vec<Bound<'_>>>>()?;
    let mut channels: Vec<Vec<f64>> = vec![Vec::new(); maps.len()];
    let (mut numbers, mut last_s) = (0, f64::NEG_INFINITY);
    table.each(&wanted, &mut |place, row, columns| {
        if limits.rows.is_some_and(|rows| !rows.holds(row)) {
            return Ok(());
        }
        numbers += maps.len();
        ensure!(numbers <= limits.numbers, "{}: more numbers than a log takes ({})", place(), limits.numbers);
        for (bound, channel) in bound.iter_mut().zip(&mut channels) {
            let value = bound.at(row, columns).map_err(|error| anyhow!("{}: {error}", place()))?;
            let map = bound.map();
            check(map, value, last_s).map_err(|error| anyhow!("{}: {map}: {error}", place()))?;
            if map.target() == Channel::Time.name() {
                last_s = value;
            }
            channel.push(value);
        }
        Ok(())
    })?;
    ensure!(numbers > 0, "no row to import, expected at least one");
    for (map, values) in maps.iter().zip(channels) {
        match Channel::from_name(map.target()) {
            Some(channel) => run.set_channel(channel, values),
            None => {
                run.extra.push(Extra { name: map.target().to_owned(), unit: map.unit().to_owned(), values })
            }
        }
    }
    Ok(())
}

fn check(map: &Map, value: f64, last_s: f64) -> anyhow::Result<()> {
    if map.target() == Channel::Time.name() {
        ensure!(value.is_finite(), "time is {value}, expected a finite number");
        ensure!(value > last_s, "time is {value} s after {last_s} s, expected it to increase");
    }
    ensure!(!value.is_infinite(), "{value}, expected a finite number or NaN");
    Ok(())
}
