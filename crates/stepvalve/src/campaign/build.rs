//! Which program makes the rows: its version, and a checksum of the program itself. Two builds of one version may compute other numbers.

use anyhow::Context;
use std::fs::File;
use std::io::Read;
use supervisor::Failure;

/// The version with the build: "0.1.0, build 1a2b3c4d".
///
/// # Errors
/// Where the program can't be read.
pub fn version() -> Result<String, Failure> {
    // The running program, also where another lies at its place by now.
    let path = "/proc/self/exe";
    let checksum = File::open(path).and_then(checksum).context(path).map_err(Failure::Failed)?;
    Ok(format!("{}, build {checksum:08x}", env!("CARGO_PKG_VERSION")))
}

fn checksum(mut file: File) -> std::io::Result<u32> {
    let (mut sum, mut part) = (0, vec![0; 1 << 20]);
    loop {
        match file.read(&mut part)? {
            0 => return Ok(sum),
            length => sum = crc32c::crc32c_append(sum, part.get(..length).unwrap_or_default()),
        }
    }
}
