//! NumPy's `.npy` files: an array of numbers, or a structured one, whose fields are columns.

use super::array::Array;
use anyhow::{anyhow, bail, ensure};
use npyz::{DType, Endianness, NpyHeader, Order, TypeChar};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// What an array without a name of its own is called: alone, its columns are c1 to cN.
const UNNAMED: &str = "data";

/// A number within an item.
struct Field {
    name: String,
    at: usize,
    bytes: usize,
    kind: TypeChar,
    big_endian: bool,
}

/// Hands over the array of a file, or an array for each field.
///
/// # Errors
/// No array of numbers, more than `most`, a file that ends too early.
pub(super) fn arrays(
    path: &Path,
    most: usize,
    each: &mut dyn FnMut(Array) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let file = File::open(path)?;
    let size = file.metadata()?.len();
    let mut file = BufReader::new(file);
    let mut begin = [0; 6];
    file.read_exact(&mut begin).ok();
    ensure!(&begin == b"\x93NUMPY", "the file doesn't begin as a NumPy array does (.npy)");
    let mut file = BufReader::new(File::open(path)?);
    let header = NpyHeader::from_reader(&mut file).map_err(|error| anyhow!("no NumPy array: {error}"))?;
    let shape = header.shape().to_vec();
    let count = shape.iter().try_fold(1_u64, |count, size| count.checked_mul(*size));
    let mut fields = Vec::new();
    let item = item(&header.dtype(), String::new(), 0, &mut fields)?;
    let count = count
        .and_then(|count| usize::try_from(count).ok())
        .filter(|count| count.checked_mul(fields.len().max(1)).is_some_and(|numbers| numbers <= most));
    let Some(count) = count else { bail!("more numbers than a log takes ({most})") };
    // What a header claims costs nothing; what the file holds does.
    ensure!(
        (count as u64).saturating_mul(item as u64) <= size,
        "{count} items of {item} bytes in a file of {size} bytes, expected a whole file"
    );
    let mut columns: Vec<Vec<f64>> = fields.iter().map(|_| Vec::with_capacity(count)).collect();
    let mut bytes = vec![0; item];
    for _ in 0..count {
        file.read_exact(&mut bytes).map_err(|_| anyhow!("cut off, expected {count} items"))?;
        for (field, column) in fields.iter().zip(&mut columns) {
            column.push(field.number(&bytes)?);
        }
    }
    let c_order = header.order() == Order::C;
    for (field, mut numbers) in fields.into_iter().zip(columns) {
        if let (true, [rows, columns]) = (c_order, shape.as_slice()) {
            numbers = transposed(&numbers, *rows as usize, *columns as usize);
        }
        let name = if field.name.is_empty() { UNNAMED.to_owned() } else { field.name };
        each(Array { name, shape: shape.clone(), numbers })?;
    }
    Ok(())
}

/// Adds the numbers of an item; returns where the item ends.
fn item(dtype: &DType, name: String, at: usize, fields: &mut Vec<Field>) -> anyhow::Result<usize> {
    match dtype {
        DType::Plain(kind) => {
            let bytes = kind.num_bytes().ok_or_else(|| anyhow!("{kind}: too large"))?;
            ensure!(bytes <= 1 << 20, "{kind}: {bytes} bytes an item, expected a number");
            // Texts and times beside numbers are passed over.
            if matches!(kind.type_char(), TypeChar::Bool | TypeChar::Int | TypeChar::Uint | TypeChar::Float) {
                let big_endian = kind.endianness() == Endianness::Big;
                fields.push(Field { name, at, bytes, kind: kind.type_char(), big_endian });
            }
            Ok(at + bytes)
        }
        DType::Record(record) => {
            let mut end = at;
            for field in record {
                ensure!(
                    !matches!(field.dtype, DType::Record(_)),
                    "{}: a structure within a structure",
                    field.name
                );
                end = item(&field.dtype, field.name.clone(), end, fields)?;
            }
            ensure!(!fields.is_empty(), "no field of numbers, expected some");
            Ok(end)
        }
        DType::Array(..) => bail!("{name}: an array within a structure, expected numbers"),
    }
}

impl Field {
    fn number(&self, item: &[u8]) -> anyhow::Result<f64> {
        let mut bytes = [0; 8];
        let of = item.get(self.at..self.at + self.bytes).unwrap_or_default();
        for (slot, byte) in bytes.iter_mut().zip(of) {
            *slot = *byte;
        }
        if self.big_endian {
            bytes.get_mut(..self.bytes.min(8)).unwrap_or_default().reverse();
        }
        let whole = u64::from_le_bytes(bytes);
        Ok(match (self.kind, self.bytes) {
            (TypeChar::Float, 8) => f64::from_bits(whole),
            (TypeChar::Float, 4) => f64::from(f32::from_bits(whole as u32)),
            (TypeChar::Float, 2) => half(whole as u16),
            (TypeChar::Int, 1 | 2 | 4 | 8) => {
                let unused = 64 - 8 * self.bytes as u32;
                ((whole << unused) as i64 >> unused) as f64
            }
            (TypeChar::Uint | TypeChar::Bool, 1 | 2 | 4 | 8) => whole as f64,
            (_, bytes) => bail!("numbers of {bytes} bytes, expected at most 8"),
        })
    }
}

/// A number of half precision (IEEE 754 binary16).
fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f64::from(bits & 0x3ff));
    let magnitude = match exponent {
        0 => fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction / 1024.0) * 2f64.powi(exponent - 15),
    };
    if bits & 0x8000 == 0 { magnitude } else { -magnitude }
}

/// Rows one after the other become columns one after the other.
fn transposed(numbers: &[f64], rows: usize, columns: usize) -> Vec<f64> {
    let at = |column: usize| numbers.iter().skip(column).step_by(columns.max(1)).copied();
    (0..if rows == 0 { 0 } else { columns }).flat_map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_every_kind() {
        let field = |kind, bytes, big_endian| Field { name: String::new(), at: 1, bytes, kind, big_endian };
        let number = |field: Field, item: &[u8]| field.number(item).unwrap();
        assert_eq!(number(field(TypeChar::Int, 2, false), &[9, 0xfe, 0xff]), -2.0);
        assert_eq!(number(field(TypeChar::Int, 2, true), &[9, 0xff, 0xfe]), -2.0);
        assert_eq!(number(field(TypeChar::Uint, 1, false), &[9, 200]), 200.0);
        assert_eq!(number(field(TypeChar::Float, 4, true), &[9, 0x3f, 0xc0, 0, 0]), 1.5);
        assert_eq!(number(field(TypeChar::Float, 2, false), &[9, 0x00, 0x3e]), 1.5);
        assert!(field(TypeChar::Float, 16, false).number(&[0; 17]).is_err());
        assert_eq!(transposed(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 2, 3), [1.0, 4.0, 2.0, 5.0, 3.0, 6.0]);
    }
}
