//! Arrays of a MAT file of v7.3, which is HDF5: numeric datasets at the root.

use crate::error::Context;
use crate::{RunLogError, h5};
use std::path::Path;

/// More members of the root than this are refused.
const MAX_MEMBERS: u64 = 10_000;

/// An array as MATLAB has it.
#[derive(Debug, Clone, PartialEq)]
pub struct MatArray {
    /// Its name.
    pub name: String,
    /// Its size in each dimension.
    pub shape: Vec<u64>,
    /// Its numbers, the first index running fastest.
    pub numbers: Vec<f64>,
}

/// Hands over the numeric arrays at the root one after the other, at most `most` numbers in all.
///
/// # Errors
/// [`RunLogError`], which names the file and the array; what `each` returns.
pub fn read_mat_arrays<E: From<RunLogError>>(
    path: &Path,
    most: usize,
    each: &mut dyn FnMut(MatArray) -> Result<(), E>,
) -> Result<(), E> {
    let file = h5::open(path).context(path, || "not a readable HDF5 file".to_owned())?;
    let format = |place: &str, found: String, expected: String| RunLogError::Format {
        path: path.to_owned(),
        place: place.to_owned(),
        found,
        expected,
    };
    if file.len() > MAX_MEMBERS {
        return Err(
            format("root", format!("{} members", file.len()), format!("at most {MAX_MEMBERS}")).into()
        );
    }
    let mut left = most;
    for name in file.member_names().context(path, || "reading the root".to_owned())? {
        let Ok(dataset) = file.dataset(&name) else { continue };
        // MATLAB's name for what the numbers are; texts and logicals are numbers to HDF5 too.
        let class = h5::text_attribute(&dataset, "MATLAB_class").context(path, || format!("array {name}"))?;
        if !h5::is_numeric(&dataset) || class.as_deref() == Some("char") {
            continue;
        }
        left = left.checked_sub(dataset.size()).ok_or_else(|| {
            format(&name, format!("{} numbers", dataset.size()), format!("at most {most} in all"))
        })?;
        let numbers = dataset.read_raw::<f64>().context(path, || format!("reading array {name}"))?;
        // HDF5's last index runs fastest, MATLAB's first: the same numbers, the shape the other way round.
        let shape = dataset.shape().iter().rev().map(|size| *size as u64).collect();
        each(MatArray { name, shape, numbers })?;
    }
    Ok(())
}
