//! What can go wrong with the bus, outside the cycle.

use std::path::PathBuf;
use thiserror::Error;

/// A bus that could not be set up or taken down.
#[derive(Debug, Error)]
pub enum BusError {
    /// The root directory or the prefix can't be used as a name.
    #[error("{what} `{found}` can't be used by shared memory: {reason}")]
    BadName {
        /// Which name.
        what: &'static str,
        /// The name.
        found: String,
        /// Why not.
        reason: String,
    },
    /// iceoryx2 could not create this process's node.
    #[error("no node in {root}: {reason}")]
    Node {
        /// The root directory.
        root: PathBuf,
        /// What iceoryx2 says.
        reason: String,
    },
    /// A service could not be created or opened.
    #[error("service {service}: {reason}")]
    Service {
        /// Its name.
        service: String,
        /// What iceoryx2 says.
        reason: String,
    },
    /// Shared memory is too small for a generation's services: writing into what is not there would kill the writer.
    #[error(
        "{path} has {found_mb} MB of shared memory left, expected at least {needed_mb} MB: \
         mount -o remount,size=256M {path} (in a container: --shm-size=256m)"
    )]
    SharedMemory {
        /// Where shared memory lies.
        path: &'static str,
        /// What is left of it, MB.
        found_mb: u64,
        /// What a generation takes, MB.
        needed_mb: u64,
    },
    /// Leftovers could not be removed, or not be kept from other users.
    #[error("{path}: {source}")]
    Wipe {
        /// The file or directory.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}
