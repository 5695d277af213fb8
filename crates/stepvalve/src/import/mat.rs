//! MATLAB's MAT files, v5 and v7.3 (HDF5).
//!
//! The parsers of both were not written against malice: a strange file may crash or exhaust them. So a process of its
//! own reads the file (`stepvalve read-mat`), and its end, however it ends, is an error message here.

use crate::files::name;
use anyhow::{Context, anyhow, bail};
use matfile::{MatFile, NumericData};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use supervisor::{Failure, Outcome};
use table_import::{Table, Take};

/// An array of a MAT file: name, shape, numbers with the first index running fastest.
type Array = (String, Vec<u64>, Vec<f64>);

/// A MAT file's end of header, at which its version stands.
const VERSION_AT: usize = 124;
/// The kind of an element that is compressed: alone not padded to 8 bytes.
const COMPRESSED: u32 = 15;
/// What HDF5 begins with.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Where HDF5 begins in a file of v7.3.
const HDF5_AT: usize = 512;

/// Reads a MAT file for another process.
#[derive(clap::Args)]
pub struct ReadMat {
    /// The file
    file: PathBuf,
    /// The most numbers
    most: usize,
}

/// The columns of a MAT file: vectors of one length, and scalars that hold for every row.
pub struct Mat {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
    rows: usize,
}

/// Writes the arrays of a MAT file to stdout.
///
/// # Errors
/// [`Failure::Input`] where the file can't be read.
pub fn read_mat(arguments: &ReadMat) -> Result<Outcome, Failure> {
    let arrays = arrays(&arguments.file, arguments.most).map_err(Failure::Input)?;
    let bytes = postcard::to_stdvec(&arrays).context("arrays")?;
    std::io::stdout().write_all(&bytes).context("stdout")?;
    Ok(Outcome::Done)
}

fn arrays(path: &Path, most: usize) -> anyhow::Result<Vec<Array>> {
    let mut head = Vec::new();
    File::open(path)?.take(HDF5_AT as u64 + 8).read_to_end(&mut head)?;
    let hdf5 = head.starts_with(HDF5) || head.get(HDF5_AT..) == Some(HDF5);
    if hdf5 {
        let arrays = run_log::read_mat_arrays(path, most)?;
        return Ok(arrays.into_iter().map(|array| (array.name, array.shape, array.numbers)).collect());
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
    file.arrays().iter().map(|array| from_v5(array, &mut left)).collect()
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
    Ok((array.name().to_owned(), shape, numbers))
}

fn wide<T: Copy + Into<f64>>(values: &[T]) -> Vec<f64> {
    values.iter().map(|value| (*value).into()).collect()
}

/// Has another process read a MAT file.
///
/// # Errors
/// What that process says; that it crashed; arrays that make no table.
pub fn open(path: &Path, most: usize) -> anyhow::Result<Mat> {
    let file = name(path);
    File::open(path).with_context(|| file.clone())?;
    let program = std::env::current_exe().context("the program's own path")?;
    let output = Command::new(program)
        .arg("read-mat")
        .arg(path)
        .arg(most.to_string())
        .stdin(Stdio::null())
        .output()
        .with_context(|| file.clone())?;
    if !output.status.success() {
        let complaint = String::from_utf8_lossy(&output.stderr);
        let said = complaint.trim();
        match output.status.code() {
            Some(2) if said.starts_with(&file) => bail!("{said}"),
            Some(2) => bail!("{file}: {said}"),
            _ => bail!("{file}: reading it failed ({}), expected a whole MAT file: {said}", output.status),
        }
    }
    let arrays: Vec<Array> = postcard::from_bytes(&output.stdout).with_context(|| file.clone())?;
    Mat::new(arrays).with_context(|| file)
}

impl Mat {
    /// Vectors become columns, a matrix's columns name_1, name_2 and so on, scalars hold throughout. The table has as
    /// many rows as most of the vectors; arrays of other lengths are left out.
    fn new(arrays: Vec<Array>) -> anyhow::Result<Self> {
        let mut named: Vec<(String, Vec<f64>)> = Vec::new();
        for (name, shape, numbers) in arrays {
            let long = shape.iter().filter(|size| **size > 1).count();
            if long <= 1 {
                named.push((name, numbers));
            } else if let [rows, _] = shape.as_slice() {
                let columns = numbers.chunks(*rows as usize).zip(1..);
                named.extend(columns.map(|(column, number)| (format!("{name}_{number}"), column.to_vec())));
            }
        }
        let lengths: Vec<usize> = named.iter().map(|(_, column)| column.len()).filter(|n| *n > 1).collect();
        let votes = |length: &usize| (lengths.iter().filter(|other| *other == length).count(), *length);
        let rows = lengths.iter().copied().max_by_key(votes);
        let rows = rows.ok_or_else(|| anyhow!("no vector of numbers in it, expected some"))?;
        let (names, columns) =
            named.into_iter().filter(|(_, column)| column.len() == rows || column.len() == 1).unzip();
        Ok(Self { names, columns, rows })
    }
}

impl Table for Mat {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn each(&mut self, wanted: &[usize], take: &mut Take<'_>) -> anyhow::Result<()> {
        let columns: Vec<&Vec<f64>> = wanted.iter().filter_map(|column| self.columns.get(*column)).collect();
        let mut values = vec![f64::NAN; columns.len()];
        for row in 0..self.rows {
            for (value, column) in values.iter_mut().zip(&columns) {
                // A scalar's only element holds for every row.
                *value = column.get(row).or(column.first()).copied().unwrap_or(f64::NAN);
            }
            take(&|| format!("row {}", row + 1), row, &values)?;
        }
        Ok(())
    }
}
