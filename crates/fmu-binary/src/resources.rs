//! Where the unit's resources are: a path (FMI 3.0), or a percent-encoded URI (FMI 2.0).

use std::path::PathBuf;

/// The folder that a resource location names. What is no `file:` URI is taken for a path, as some importers hand it over.
pub fn folder(location: &str) -> PathBuf {
    let Some(rest) = location.strip_prefix("file:") else { return PathBuf::from(location) };
    // file:///path, file://localhost/path and file:/path are all about.
    let path = match rest.strip_prefix("//") {
        Some(authority) => {
            authority.find('/').map_or(authority, |at| authority.get(at..).unwrap_or(authority))
        }
        None => rest,
    };
    let path = decoded(path);
    let is_drive = |path: &str| path.get(2..3) == Some(":");
    match path.strip_prefix('/') {
        Some(bare) if is_drive(&path) => PathBuf::from(bare),
        _ => PathBuf::from(path),
    }
}

/// A text with %20 and the like as the bytes that they stand for.
fn decoded(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut all = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(byte) = bytes.get(at) {
        let hex = text.get(at + 1..at + 3).filter(|_| *byte == b'%');
        match hex.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(encoded) => {
                all.push(encoded);
                at += 3;
            }
            None => {
                all.push(*byte);
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&all).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn locations_as_importers_write_them() {
        for (location, expected) in [
            ("file:///tmp/a/resources", "/tmp/a/resources"),
            ("file:/tmp/a/resources", "/tmp/a/resources"),
            ("file://localhost/tmp/resources/", "/tmp/resources/"),
            ("file:///tmp/my%20valve/%C3%BC/resources", "/tmp/my valve/ü/resources"),
            ("file:///C:/valve/resources", "C:/valve/resources"),
            ("/tmp/with space/resources/", "/tmp/with space/resources/"),
            ("file:///tmp/100%/x", "/tmp/100%/x"),
            ("", ""),
        ] {
            assert_eq!(folder(location), PathBuf::from(expected), "{location}");
        }
    }
}
