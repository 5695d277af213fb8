//! MATLAB's MAT files, v5 and v7.3 (HDF5): their arrays of numbers.

use super::array::Array;
use anyhow::{anyhow, bail};
use matfile::{MatFile, NumericData};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// A MAT file's end of header, at which its version stands.
const VERSION_AT: usize = 124;
/// The kind of an element that is compressed: alone not padded to 8 bytes.
const COMPRESSED: u32 = 15;
/// What HDF5 begins with.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Where HDF5 begins in a file of v7.3.
const HDF5_AT: usize = 512;

/// Hands over the arrays of a file, at most `most` numbers.
///
/// # Errors
/// No whole MAT file, or more numbers.
pub(super) fn arrays(
    path: &Path,
    most: usize,
    each: &mut dyn FnMut(Array) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut head = Vec::new();
    File::open(path)?.take(HDF5_AT as u64 + 8).read_to_end(&mut head)?;
    let hdf5 = head.starts_with(HDF5) || head.get(HDF5_AT..) == Some(HDF5);
    if hdf5 {
        return run_log::read_mat_arrays(path, most, &mut |array| {
            each(Array { name: array.name, shape: array.shape, numbers: array.numbers })
        });
    }
    if head.len() < VERSION_AT + 4 {
        bail!("{} bytes, expected a MAT file, v5 or v7.3", head.len());
    }
    if !head.starts_with(b"MATLAB") {
        bail!("the file doesn't begin with MATLAB, expected a MAT file, v5 or v7.3 (v4 is not read)");
    }
    whole_v5(path, &head)?;
    let file = MatFile::parse(BufReader::new(File::open(path)?))
        .map_err(|error| anyhow!("no whole MAT file of v5: {error}"))?;
    let mut left = most;
    file.arrays().iter().try_for_each(|array| each(from_v5(array, &mut left)?))
}

/// Checks that the elements of a v5 file fill it to its end: the parser passes over what is cut off.
fn whole_v5(path: &Path, head: &[u8]) -> anyhow::Result<()> {
    let little = head.get(VERSION_AT + 2..VERSION_AT + 4) == Some(b"IM");
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut at = VERSION_AT as u64 + 4;
    while at < length {
        let mut tag = [[0; 4]; 2];
        file.seek(SeekFrom::Start(at))?;
        if file.read_exact(tag.as_flattened_mut()).is_err() {
            bail!("cut off at byte {at}, expected a whole element");
        }
        let [kind, size] =
            tag.map(|word| if little { u32::from_le_bytes(word) } else { u32::from_be_bytes(word) });
        let padded = if kind == COMPRESSED { u64::from(size) } else { u64::from(size).div_ceil(8) * 8 };
        at += 8 + padded;
        if at > length {
            bail!(
                "the file ends at byte {length}, expected an element to reach to byte {at}: cut off, or damaged"
            );
        }
    }
    Ok(())
}

fn from_v5(array: &matfile::Array, left: &mut usize) -> anyhow::Result<Array> {
    let count: usize = array.size().iter().product();
    *left = left.checked_sub(count).ok_or_else(|| anyhow!("more numbers than a log takes"))?;
    let numbers = match array.data() {
        NumericData::Int8 { real, .. } => wide(real),
        NumericData::UInt8 { real, .. } => wide(real),
        NumericData::Int16 { real, .. } => wide(real),
        NumericData::UInt16 { real, .. } => wide(real),
        NumericData::Int32 { real, .. } => wide(real),
        NumericData::UInt32 { real, .. } => wide(real),
        NumericData::Int64 { real, .. } => real.iter().map(|value| *value as f64).collect(),
        NumericData::UInt64 { real, .. } => real.iter().map(|value| *value as f64).collect(),
        NumericData::Single { real, .. } => wide(real),
        NumericData::Double { real, .. } => real.clone(),
    };
    let shape = array.size().iter().map(|size| *size as u64).collect();
    Ok(Array { name: array.name().to_owned(), shape, numbers })
}

fn wide<T: Copy + Into<f64>>(values: &[T]) -> Vec<f64> {
    values.iter().map(|value| (*value).into()).collect()
}
