//! Files that are locked while their owner lives: the lock goes with the process, however that ends.

use anyhow::{Context, Result};
use rustix::fs::OFlags;
use std::fs::{File, OpenOptions, TryLockError};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::Path;

/// Opens a lock file, made where it is missing. Links are not followed.
pub(crate) fn open_lock(path: &Path) -> Result<File> {
    OpenOptions::new()
        .create(true)
        .truncate(false)
        .write(true)
        .read(true)
        .mode(0o600)
        .custom_flags(OFlags::NOFOLLOW.bits().cast_signed())
        .open(path)
        .with_context(|| path.display().to_string())
}

/// Opens a lock file and locks it; `None` where another holds the lock.
pub(crate) fn lock(path: &Path) -> Result<Option<File>> {
    loop {
        let file = open_lock(path)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Error(error)) => return Err(error).with_context(|| path.display().to_string()),
        }
        // Its last owner may have removed the file between opening and locking: then it locks nothing.
        let same = |found: std::fs::Metadata| file.metadata().is_ok_and(|ours| ours.ino() == found.ino());
        if std::fs::metadata(path).is_ok_and(same) {
            return Ok(Some(file));
        }
    }
}
