//! A MAT file that unpacks a thousandfold.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::io::{Read, Write};
use std::path::Path;

/// A MAT file of v5 with one compressed array of so many zeros, 8 bytes each: as MATLAB's `save` writes it, a thousandth in size.
pub fn mat_v5_packed_zeros(path: &Path, count: u32) {
    let element = |kind: u32, bytes: u32| [kind.to_le_bytes(), bytes.to_le_bytes()].concat();
    let flags = [element(6, 8), 6u32.to_le_bytes().to_vec(), 0u32.to_le_bytes().to_vec()].concat();
    let shape = [element(5, 8), count.to_le_bytes().to_vec(), 1u32.to_le_bytes().to_vec()].concat();
    let name = [element(1, 1), b"x\0\0\0\0\0\0\0".to_vec()].concat();
    let head = [flags, shape, name, element(9, 8 * count)].concat();
    let mut packed = libflate::zlib::Encoder::new(Vec::new()).unwrap();
    packed.write_all(&element(14, head.len() as u32 + 8 * count)).unwrap();
    packed.write_all(&head).unwrap();
    std::io::copy(&mut std::io::repeat(0).take(8 * u64::from(count)), &mut packed).unwrap();
    let packed = packed.finish().into_result().unwrap();
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(124, b' ');
    file.extend([0, 1, b'I', b'M']);
    file.extend(element(15, packed.len() as u32));
    file.extend(packed);
    std::fs::write(path, file).unwrap();
}
