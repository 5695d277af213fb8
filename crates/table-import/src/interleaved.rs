//! Lines of "name, time, value", one sample each: a column for every name, a row for every time.

use crate::columns::Columns;
use crate::separated::Separated;
use crate::table::Table;
use anyhow::{anyhow, bail, ensure};
use std::collections::BTreeMap;
use std::str::FromStr;

/// More names than this are refused.
const MOST_NAMES: usize = 1000;

/// The columns that hold a sample's name, its time and its value.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Interleaved {
    columns: [String; 3],
}

impl FromStr for Interleaved {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let columns: Vec<String> = text.split(',').map(|column| column.trim().to_owned()).collect();
        let columns = columns.try_into();
        columns.map(|columns| Self { columns }).map_err(|_| format!("{text:?}, expected NAME,TIME,VALUE"))
    }
}

impl TryFrom<String> for Interleaved {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Interleaved> for String {
    fn from(interleaved: Interleaved) -> Self {
        interleaved.columns.join(",")
    }
}

impl Interleaved {
    /// Sorts a text's lines by their names: columns `time` (as it stands there) and one of each name, NaN at times at
    /// which that name has no sample. At most `most` numbers.
    ///
    /// # Errors
    /// A column that isn't there, a cell that is no number, two samples of a name at one time, more than fits.
    pub fn sorted(&self, text: &mut Separated, most: usize) -> anyhow::Result<Columns> {
        let names = text.names().to_vec();
        let find = |column: &String| {
            let number = || column.strip_prefix('c')?.parse::<usize>().ok()?.checked_sub(1);
            let place = names.iter().position(|name| name == column).or_else(number);
            place.filter(|place| *place < names.len()).ok_or_else(|| {
                anyhow!(
                    "--interleaved: no column {column:?}; there are {}: {}",
                    names.len(),
                    names.join(", ")
                )
            })
        };
        let [name_at, time_at, value_at] = &self.columns;
        let (name_at, time_at, value_at) = (find(name_at)?, find(time_at)?, find(value_at)?);
        let mut samples: BTreeMap<String, Vec<(f64, f64, u64)>> = BTreeMap::new();
        let mut count = 0_usize;
        let (rows, reader) = text.parts();
        rows.each(&mut |line, _, cells| {
            let name = reader.text(cells, line, name_at)?.into_owned();
            let (time, value) = (reader.number(cells, line, time_at)?, reader.number(cells, line, value_at)?);
            ensure!(time.is_finite(), "line {line}: time is {time}, expected a finite number");
            count += 3;
            ensure!(count <= most, "line {line}: more numbers than fit ({most})");
            samples.entry(name).or_default().push((time, value, line));
            ensure!(samples.len() <= MOST_NAMES, "line {line}: more than {MOST_NAMES} names");
            Ok(())
        })?;
        columns(samples, most)
    }
}

fn columns(mut samples: BTreeMap<String, Vec<(f64, f64, u64)>>, most: usize) -> anyhow::Result<Columns> {
    let mut times: Vec<f64> = samples.values().flatten().map(|(time, ..)| *time).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let numbers = times.len().saturating_mul(samples.len() + 1);
    ensure!(
        numbers <= most,
        "{} names at {} times: more numbers than fit ({most})",
        samples.len(),
        times.len()
    );
    let mut named = Vec::with_capacity(samples.len() + 1);
    for (name, samples) in &mut samples {
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut column = vec![f64::NAN; times.len()];
        let mut before = None;
        for (time, value, line) in samples {
            if before.replace(*time) == Some(*time) {
                bail!("line {line}: {name} at time {time} once more, expected it once");
            }
            let row = times.partition_point(|known| *known < *time);
            if let Some(slot) = column.get_mut(row) {
                *slot = *value;
            }
        }
        named.push((name.clone(), column));
    }
    ensure!(times.len() > 1, "{} times, expected at least 2", times.len());
    named.insert(0, ("time".to_owned(), times));
    Columns::new(named)
}
