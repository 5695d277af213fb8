//! Where one generation's processes meet, and how all traces of it are removed.

use crate::BusError;
use iceoryx2::prelude::{Config, FileName, Path as IoxPath, SemanticString};
use serde::{Deserialize, Serialize};
use std::fs::Permissions;
use std::io;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

/// Where POSIX shared memory appears as files.
const SHARED_MEMORY: &str = "/dev/shm";

/// What a generation's services take of it, with room for ports that come later: `du` shows 17 MB.
const NEEDED_BYTES: u64 = 24 << 20;

/// A root directory and a prefix that one generation has for itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    /// Directory for iceoryx2's files; made by the first user, of this user alone.
    pub root: PathBuf,
    /// What the names of all its shared memory begin with.
    pub prefix: String,
}

impl Place {
    /// The place as iceoryx2 wants it.
    ///
    /// # Errors
    /// [`BusError::BadName`] for a root or prefix with characters or a length that iceoryx2 refuses.
    pub(crate) fn config(&self) -> Result<Config, BusError> {
        let root_text = self.root.to_string_lossy();
        let root = IoxPath::new(root_text.as_bytes()).map_err(|error| BusError::BadName {
            what: "root directory",
            found: root_text.to_string(),
            reason: format!("{error:?}"),
        })?;
        let mut config = Config::default();
        config.global.prefix = FileName::new(self.prefix.as_bytes()).map_err(|error| BusError::BadName {
            what: "prefix",
            found: self.prefix.clone(),
            reason: format!("{error:?}"),
        })?;
        config.global.set_root_path(&root);
        Ok(config)
    }

    /// Checks that there is shared memory enough for a generation.
    ///
    /// # Errors
    /// [`BusError::SharedMemory`] where there is not.
    pub(crate) fn check_room(&self) -> Result<(), BusError> {
        // A folder that can't be looked at is told of by the first service that can't be made.
        let Ok(found) = rustix::fs::statvfs(SHARED_MEMORY) else { return Ok(()) };
        let free_bytes = found.f_bavail.saturating_mul(found.f_frsize);
        if free_bytes >= NEEDED_BYTES {
            return Ok(());
        }
        let (found_mb, needed_mb) = (free_bytes >> 20, NEEDED_BYTES >> 20);
        Err(BusError::SharedMemory { path: SHARED_MEMORY, found_mb, needed_mb })
    }

    /// Removes the root directory and every shared-memory file whose name begins with the prefix. For the owner
    /// alone, after all processes of the generation have ended. What is not there is no error.
    ///
    /// # Errors
    /// [`BusError::Wipe`] for the first thing that could not be removed.
    pub fn wipe(&self) -> Result<(), BusError> {
        wipe_prefix(&self.prefix)?;
        ignore_missing(&self.root, std::fs::remove_dir_all(&self.root))
    }

    /// Takes from other users what iceoryx2 0.10 gives them: it makes the node's management segment (16 bytes) writable for
    /// everybody. Others are created for this user alone, and not touched: their permissions say when they are ready.
    pub(crate) fn close_to_others(&self) -> Result<(), BusError> {
        let shared = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "global_mgmt");
        files_with_prefix(&self.prefix).iter().filter(|path| shared(path)).try_for_each(|path| {
            let open = std::fs::metadata(path).is_ok_and(|found| found.permissions().mode() & 0o077 != 0);
            if !open {
                return Ok(());
            }
            ignore_missing(path, std::fs::set_permissions(path, Permissions::from_mode(0o600)))
        })
    }

    /// The shared-memory files of this place that exist now.
    pub fn shared_memory_files(&self) -> Vec<PathBuf> {
        files_with_prefix(&self.prefix)
    }
}

fn wipe_prefix(prefix: &str) -> Result<(), BusError> {
    files_with_prefix(prefix).iter().try_for_each(|path| ignore_missing(path, std::fs::remove_file(path)))
}

/// Whether a file is this user's. Anybody may make files in the folder of shared memory, under any name: those of others
/// are nothing that a generation left, and can't be removed.
fn is_ours(entry: &std::fs::DirEntry) -> bool {
    // The owner of /proc/self is this process's effective user.
    let user = std::fs::metadata("/proc/self").map(|own| own.uid());
    entry.metadata().is_ok_and(|found| user.is_ok_and(|user| user == found.uid()))
}

fn files_with_prefix(prefix: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
    let ours =
        entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(prefix) && is_ours(entry));
    ours.map(|entry| entry.path()).collect()
}

fn ignore_missing(path: &Path, result: io::Result<()>) -> Result<(), BusError> {
    match result {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            Err(BusError::Wipe { path: path.to_owned(), source })
        }
        _ => Ok(()),
    }
}
