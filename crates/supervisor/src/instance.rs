//! An instance: its name, its folder, and the locks that say who is alive.
//!
//! `$RUNTIME_DIRECTORY` or `$XDG_RUNTIME_DIR`, then `stepvalve/NAME/`:
//! - `supervisor.lock`: held by the supervisor. A second start with the name is refused.
//! - `members.lock`: shared by every process of the generation. While anybody holds it, nothing is wiped.
//! - `generation-N/`: iceoryx2's files.
//!
//! Both locks go with their processes, however these end, so what a crash left can be told from what lives.

use crate::exit::Failure;
use anyhow::{Context, anyhow, bail};
use signal_bus::Place;
use std::fs::{DirBuilder, File, OpenOptions, TryLockError};
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long the processes of a supervisor that died may take to stop the valve and end.
const PATIENCE: Duration = Duration::from_secs(15);

/// An instance that this process supervises. Dropped, it leaves nothing behind.
pub struct Instance {
    folder: PathBuf,
    _supervisor: File,
}

impl Instance {
    /// Takes the name, and cleans up what an earlier supervisor of this name, or of any other that is gone, left.
    ///
    /// # Errors
    /// [`Failure::Input`] for a bad name or one that is taken; [`Failure::Failed`] where the folder can't be used.
    pub fn acquire(instance: &str) -> Result<Self, Failure> {
        let good = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if instance.is_empty() || instance.len() > 32 || !instance.chars().all(good) {
            return Err(Failure::Input(anyhow!(
                "instance name \"{instance}\": expected 1 to 32 letters, digits, '-' or '_'"
            )));
        }
        let base = base_folder()?;
        sweep(&base, instance);
        let folder = base.join(instance);
        let Some(supervisor) = lock_folder(&folder)? else {
            return Err(Failure::Input(anyhow!(
                "instance \"{instance}\" is running already; --instance gives another name"
            )));
        };
        wait_for_members(&folder)?;
        wipe_generations(&folder)?;
        Ok(Self { folder, _supervisor: supervisor })
    }

    /// The file that every process of the generation shares a lock on.
    pub fn members_lock(&self) -> PathBuf {
        self.folder.join("members.lock")
    }

    /// The instance's folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// A fresh place for a generation.
    pub fn place(&self, generation: u64) -> Place {
        Place {
            root: self.folder.join(format!("generation-{generation}")),
            prefix: format!("{}{generation}_", prefix(&self.folder)),
        }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // What can't be removed now is removed by the next start.
        if wait_for_members(&self.folder).is_ok() && wipe_generations(&self.folder).is_ok() {
            let _ = std::fs::remove_dir_all(&self.folder);
        }
    }
}

/// `$RUNTIME_DIRECTORY/stepvalve` or `$XDG_RUNTIME_DIR/stepvalve`, or where neither is set one in the temporary folder
/// that belongs to this user.
///
/// # Errors
/// Where it can't be made, or belongs to somebody else.
pub fn base_folder() -> Result<PathBuf, anyhow::Error> {
    let base = base_path();
    let uid = nix::unistd::getuid();
    make_private(&base)?;
    let owner = std::fs::metadata(&base).with_context(|| name(&base))?.uid();
    if owner != uid.as_raw() {
        bail!(
            "{} belongs to user {owner}, expected {uid}: set XDG_RUNTIME_DIR to a folder of your own",
            name(&base)
        );
    }
    Ok(base)
}

/// Where [`base_folder`] is or will be.
pub fn base_path() -> PathBuf {
    let from = |variable: &str| {
        let value = std::env::var(variable).ok()?;
        // systemd separates several by colons; the first is the service's own.
        let first = value.split(':').next().filter(|path| path.starts_with('/'))?;
        Some(PathBuf::from(first).join("stepvalve"))
    };
    from("RUNTIME_DIRECTORY")
        .or_else(|| from("XDG_RUNTIME_DIR"))
        .unwrap_or_else(|| std::env::temp_dir().join(format!("stepvalve-{}", nix::unistd::getuid())))
}

/// A path as messages show it.
fn name(path: &Path) -> String {
    path.display().to_string()
}

fn make_private(folder: &Path) -> Result<(), anyhow::Error> {
    DirBuilder::new().recursive(true).mode(0o700).create(folder).with_context(|| name(folder))
}

/// Makes the folder and locks it for its supervisor; `None` where another holds the lock.
fn lock_folder(folder: &Path) -> Result<Option<File>, anyhow::Error> {
    let path = folder.join("supervisor.lock");
    loop {
        make_private(folder)?;
        let Ok(file) = open_lock(&path) else { continue };
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Error(error)) => return Err(error).with_context(|| name(&path)),
        }
        // Its last owner may have removed the file between opening and locking: then it locks nothing.
        let same = |found: std::fs::Metadata| file.metadata().is_ok_and(|ours| ours.ino() == found.ino());
        if std::fs::metadata(&path).is_ok_and(same) {
            open_lock(&folder.join("members.lock"))?;
            return Ok(Some(file));
        }
    }
}

fn open_lock(path: &Path) -> Result<File, anyhow::Error> {
    OpenOptions::new()
        .create(true)
        .truncate(false)
        .write(true)
        .read(true)
        .open(path)
        .with_context(|| name(path))
}

/// Waits until no process of an earlier generation is left.
fn wait_for_members(folder: &Path) -> Result<(), anyhow::Error> {
    let path = folder.join("members.lock");
    let file = open_lock(&path)?;
    let begun = Instant::now();
    while file.try_lock().is_err() {
        if begun.elapsed() > PATIENCE {
            bail!(
                "{}: processes of an earlier run still hold it after {} s",
                name(&path),
                PATIENCE.as_secs()
            );
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    Ok(())
}

/// Removes what instances left whose supervisor and processes are all gone.
fn sweep(base: &Path, except: &str) {
    for entry in std::fs::read_dir(base).into_iter().flatten().flatten() {
        let folder = entry.path();
        if entry.file_name().to_string_lossy() == except || !folder.is_dir() {
            continue;
        }
        let free = |file: &str| open_lock(&folder.join(file)).ok().filter(|lock| lock.try_lock().is_ok());
        if let (Some(_supervisor), Some(_members)) = (free("supervisor.lock"), free("members.lock"))
            && wipe_generations(&folder).is_ok()
        {
            let _ = std::fs::remove_dir_all(&folder);
        }
    }
}

/// Removes every generation's files and shared memory.
fn wipe_generations(folder: &Path) -> Result<(), anyhow::Error> {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with("generation-") {
            std::fs::remove_dir_all(entry.path()).with_context(|| name(&entry.path()))?;
        }
    }
    // By prefix, so that shared memory is found even where the folder was lost.
    Ok(Place { root: folder.join("generation-none"), prefix: prefix(folder) }.wipe()?)
}

/// What the names of an instance's shared memory begin with: the same for every start of it, and nobody else's.
pub fn prefix(folder: &Path) -> String {
    let hash = crc32c::crc32c(folder.as_os_str().as_encoded_bytes());
    format!("stepvalve_{}_{hash:08x}_", nix::unistd::getuid())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_checked() {
        for bad in ["", "a/b", "..", "a b", &"x".repeat(33)] {
            assert!(matches!(Instance::acquire(bad), Err(Failure::Input(_))), "{bad:?}");
        }
    }
}
