//! MAT and NumPy files as other programs write them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::path::Path;

/// A MAT file of v5 without compression, as MATLAB's `save -v6` writes it.
pub fn mat_v5(arrays: &[(&str, &[f64])]) -> Vec<u8> {
    let element = |kind: u32, data: &[u8]| {
        let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
        bytes.extend(data);
        bytes.resize(bytes.len().div_ceil(8) * 8, 0);
        bytes
    };
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(124, b' ');
    file.extend([0, 1, b'I', b'M']);
    for (name, values) in arrays {
        let numbers: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let flags = [6u32.to_le_bytes(), 0u32.to_le_bytes()].concat();
        let shape = [(values.len() as i32).to_le_bytes(), 1i32.to_le_bytes()].concat();
        let inner =
            [element(6, &flags), element(5, &shape), element(1, name.as_bytes()), element(9, &numbers)];
        file.extend(element(14, &inner.concat()));
    }
    file
}

/// A MAT file of v7.3: HDF5 behind a header of 512 bytes, arrays transposed.
pub fn mat_v73(path: &Path, arrays: &[(&str, &[f64])]) {
    let mut options = hdf5::File::with_options();
    let file = options.with_fcpl(|create| create.userblock(512)).create(path).unwrap();
    for (name, values) in arrays {
        let dataset = file.new_dataset::<f64>().shape((1, values.len())).create(*name).unwrap();
        dataset.write_raw(*values).unwrap();
    }
    file.close().unwrap();
    let mut bytes = std::fs::read(path).unwrap();
    let mut head = b"MATLAB 7.3 MAT-file".to_vec();
    head.resize(124, b' ');
    head.extend([0, 2, b'I', b'M']);
    bytes[..128].copy_from_slice(&head);
    std::fs::write(path, bytes).unwrap();
}

/// A NumPy file of version 1.0 with a header that says `descr` and `shape`.
pub fn npy(descr: &str, shape: &str, bytes: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}");
    while (header.len() + 11) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let length = (header.len() as u16).to_le_bytes();
    [&b"\x93NUMPY\x01\x00"[..], &length, header.as_bytes(), bytes].concat()
}
