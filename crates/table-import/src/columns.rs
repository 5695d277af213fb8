//! A table that is in memory already.

use crate::table::{Table, Take};
use anyhow::ensure;

/// Columns of one length, and scalars that hold in every row.
pub struct Columns {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
    rows: usize,
}

impl Columns {
    /// Columns with their names; one of a single number holds in every row. The table has as many rows as most of the
    /// others; columns of other lengths are left out.
    ///
    /// # Errors
    /// No column of more than one number.
    pub fn new(named: Vec<(String, Vec<f64>)>) -> anyhow::Result<Self> {
        let lengths: Vec<usize> = named.iter().map(|(_, column)| column.len()).filter(|n| *n > 1).collect();
        let votes = |length: &usize| (lengths.iter().filter(|other| *other == length).count(), *length);
        let rows = lengths.iter().copied().max_by_key(votes);
        ensure!(rows.is_some(), "no vector of numbers in it, expected some");
        let rows = rows.unwrap_or_default();
        let (names, columns) =
            named.into_iter().filter(|(_, column)| column.len() == rows || column.len() == 1).unzip();
        Ok(Self { names, columns, rows })
    }
}

/// An array of up to two dimensions as columns: the longer side is time, whichever way it lies. `numbers` has the first
/// index running fastest. A vector keeps the name; a matrix gives name_1, name_2 and so on.
/// `None` where it has more dimensions.
pub fn columns_of(name: &str, shape: &[u64], numbers: Vec<f64>) -> Option<Vec<(String, Vec<f64>)>> {
    let long = shape.iter().filter(|size| **size > 1).count();
    if long <= 1 {
        return Some(vec![(name.to_owned(), numbers)]);
    }
    let [first, second] = *shape else { return None };
    let (first, second) = (first as usize, second as usize);
    let named = |number: usize, column: Vec<f64>| (format!("{name}_{}", number + 1), column);
    Some(if first >= second {
        let columns = numbers.chunks(first.max(1)).map(<[f64]>::to_vec);
        columns.enumerate().map(|(number, column)| named(number, column)).collect()
    } else {
        let row = |row: usize| numbers.iter().skip(row).step_by(first).copied().collect();
        (0..first).map(|number| named(number, row(number))).collect()
    })
}

impl Table for Columns {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn place(&self) -> &'static str {
        "row"
    }

    fn each(&mut self, wanted: &[usize], take: &mut Take<'_>) -> anyhow::Result<()> {
        let columns: Vec<&Vec<f64>> = wanted.iter().filter_map(|column| self.columns.get(*column)).collect();
        let mut values = vec![f64::NAN; columns.len()];
        for row in 0..self.rows {
            for (value, column) in values.iter_mut().zip(&columns) {
                // A scalar's only element holds for every row.
                *value = column.get(row).or(column.first()).copied().unwrap_or(f64::NAN);
            }
            take(row as u64 + 1, row, &values)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_lie_either_way() {
        let upright = columns_of("d", &[3, 2], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
        let lying = columns_of("d", &[2, 3], vec![1.0, 4.0, 2.0, 5.0, 3.0, 6.0]).unwrap();
        assert_eq!(upright, lying);
        assert_eq!(lying[1], ("d_2".to_owned(), vec![4.0, 5.0, 6.0]));
        assert_eq!(columns_of("v", &[1, 2], vec![1.0, 2.0]).unwrap(), [("v".to_owned(), vec![1.0, 2.0])]);
        assert!(columns_of("d", &[2, 2, 2], vec![0.0; 8]).is_none());
    }

    #[test]
    fn scalars_hold_and_odd_lengths_are_left_out() {
        let named = [("t", 3), ("x", 3), ("gain", 1), ("other", 2)];
        let named = named.map(|(name, length)| (name.to_owned(), vec![7.0; length])).to_vec();
        assert_eq!(Columns::new(named).unwrap().names(), ["t", "x", "gain"]);
        assert!(Columns::new(vec![("gain".to_owned(), vec![1.0])]).is_err());
    }
}
