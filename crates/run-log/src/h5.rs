//! The few things of HDF5 that this crate uses, in one manner: no time stamps, texts as UTF-8 of any length.

use hdf5::types::{FixedAscii, FixedUnicode, TypeDescriptor, VarLenAscii, VarLenUnicode};
use hdf5::{Container, Dataset, Extent, Group, H5Type, Location, Result};
use log_data::Attribute;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// What an HDF5 file begins with, or what follows a block of the user's own.
const SIGNATURE: &[u8; 8] = b"\x89HDF\r\n\x1a\n";
/// Rows of a chunk, where a dataset has chunks.
pub(crate) const CHUNK_ROWS: usize = 16 * 1024;
/// A fixed-length text longer than this is not read.
const FIXED_TEXT_BYTES: usize = 4096;

/// How files are opened: without HDF5's lock. A process started meanwhile would inherit it and hold it after we
/// have closed the file; and a file on a read-only or network disk may not allow one.
fn options() -> hdf5::FileBuilder {
    let mut options = hdf5::File::with_options();
    options.with_fapl(|access| access.file_locking(false));
    options
}

/// Opens a file for reading.
pub(crate) fn open(path: &Path) -> Result<hdf5::File> {
    options().open(path)
}

/// Whether a file has HDF5's signature, at one of the places where HDF5 looks for it.
pub(crate) fn is_hdf5(path: &Path) -> std::io::Result<bool> {
    let mut file = std::fs::File::open(path)?;
    let length = file.metadata()?.len();
    let mut signature = [0; SIGNATURE.len()];
    for at in std::iter::once(0).chain(std::iter::successors(Some(512), |at| Some(2 * at))) {
        if at + signature.len() as u64 > length {
            return Ok(false);
        }
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(&mut signature)?;
        if &signature == SIGNATURE {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Begins a file; one of this name is emptied.
pub(crate) fn create(path: &Path) -> Result<hdf5::File> {
    options().create(path)
}

/// A text as HDF5 keeps it. A zero byte, which it can't keep, becomes the replacement character.
fn text(text: &str) -> VarLenUnicode {
    text.replace('\0', "\u{fffd}").parse().unwrap_or_default()
}

/// Adds an attribute with a text.
pub(crate) fn put_text(place: &Location, name: &str, value: &str) -> Result<()> {
    place.new_attr::<VarLenUnicode>().create(name)?.write_scalar(&text(value))
}

/// Adds an attribute with a number.
pub(crate) fn put_number<T: H5Type>(place: &Location, name: &str, value: T) -> Result<()> {
    place.new_attr::<T>().create(name)?.write_scalar(&value)
}

/// Adds an attribute.
pub(crate) fn put_attribute(place: &Location, name: &str, value: &Attribute) -> Result<()> {
    match value {
        Attribute::Text(value) => put_text(place, name, value),
        Attribute::Number(value) => put_number(place, name, *value),
    }
}

/// Adds a dataset with one text: an attribute holds 64 kB at most.
pub(crate) fn put_text_dataset(group: &Group, name: &str, value: &str) -> Result<()> {
    let dataset = group.new_dataset::<VarLenUnicode>().obj_track_times(false).create(name)?;
    dataset.write_scalar(&text(value))
}

/// Adds a column of texts.
pub(crate) fn put_texts(group: &Group, name: &str, values: &[&str]) -> Result<()> {
    let values: Vec<VarLenUnicode> = values.iter().map(|value| text(value)).collect();
    group.new_dataset_builder().with_data(&values).obj_track_times(false).create(name)?;
    Ok(())
}

/// Adds a column of numbers with its unit.
pub(crate) fn put_column<T: H5Type>(group: &Group, name: &str, unit: &str, values: &[T]) -> Result<Dataset> {
    let builder = group.new_dataset_builder().with_data(values).obj_track_times(false);
    // Shuffled bytes of slow signals compress well, and fast. Small ones are not worth the chunks.
    let dataset = match values.len() {
        rows if rows < CHUNK_ROWS => builder.create(name)?,
        _ => builder.chunk(CHUNK_ROWS).shuffle().deflate(1).create(name)?,
    };
    put_text(&dataset, "unit", unit)?;
    Ok(dataset)
}

/// Adds a column that grows, with its unit.
pub(crate) fn growing_column<T: H5Type>(group: &Group, name: &str, unit: &str) -> Result<Dataset> {
    let builder = group.new_dataset::<T>().chunk(CHUNK_ROWS).shuffle().deflate(1).obj_track_times(false);
    let dataset = builder.shape(Extent::resizable(0)).create(name)?;
    put_text(&dataset, "unit", unit)?;
    Ok(dataset)
}

/// Appends to a column that grows.
pub(crate) fn append<T: H5Type>(dataset: &Dataset, values: &[T]) -> Result<()> {
    let rows = dataset.size();
    dataset.resize(rows + values.len())?;
    dataset.write_slice(values, rows..rows + values.len())
}

/// The one text that an attribute or a dataset holds; `None` where it is none.
pub(crate) fn text_of(container: &Container) -> Result<Option<String>> {
    if container.size() != 1 {
        return Ok(None);
    }
    // Others write texts in all four manners, and not all of it is UTF-8.
    let lossy = |bytes: &[u8]| Some(String::from_utf8_lossy(bytes).into_owned());
    Ok(match container.dtype()?.to_descriptor()? {
        TypeDescriptor::VarLenUnicode => {
            container.read_raw::<VarLenUnicode>()?.first().and_then(|text| lossy(text.as_bytes()))
        }
        TypeDescriptor::VarLenAscii => {
            container.read_raw::<VarLenAscii>()?.first().and_then(|text| lossy(text.as_bytes()))
        }
        TypeDescriptor::FixedUnicode(length) if length <= FIXED_TEXT_BYTES => {
            let texts = container.read_raw::<FixedUnicode<FIXED_TEXT_BYTES>>()?;
            texts.first().and_then(|text| lossy(text.as_bytes()))
        }
        TypeDescriptor::FixedAscii(length) if length <= FIXED_TEXT_BYTES => {
            let texts = container.read_raw::<FixedAscii<FIXED_TEXT_BYTES>>()?;
            texts.first().and_then(|text| lossy(text.as_bytes()))
        }
        _ => None,
    })
}

/// Whether it holds real numbers.
pub(crate) fn is_numeric(container: &Container) -> bool {
    matches!(
        container.dtype().and_then(|dtype| dtype.to_descriptor()),
        Ok(TypeDescriptor::Float(_) | TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_))
    )
}

/// The one number that an attribute holds; `None` where it is none.
pub(crate) fn number_of(container: &Container) -> Result<Option<f64>> {
    if container.size() != 1 || !is_numeric(container) {
        return Ok(None);
    }
    Ok(container.read_raw::<f64>()?.first().copied())
}

/// An attribute's text; `None` where the attribute is missing or no text.
pub(crate) fn text_attribute(place: &Location, name: &str) -> Result<Option<String>> {
    if !place.attr_names()?.iter().any(|known| known == name) {
        return Ok(None);
    }
    let attribute = place.attr(name)?;
    text_of(&attribute)
}

/// An attribute's number; `None` where the attribute is missing or no number.
pub(crate) fn number_attribute(place: &Location, name: &str) -> Result<Option<f64>> {
    if !place.attr_names()?.iter().any(|known| known == name) {
        return Ok(None);
    }
    let attribute = place.attr(name)?;
    number_of(&attribute)
}
