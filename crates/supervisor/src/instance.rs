//! An instance: its name, its folder, and the locks that say who is alive.
//!
//! In `stepvalve/NAME/` of the runtime folder:
//! - `supervisor.lock`: held by the supervisor. A second start with the name is refused.
//! - `members.lock`: shared by every process of the generation. While anybody holds it, nothing is wiped.
//! - `control.sock`, `place.json`: how operators speak to it, and where its generation's services are to be found.
//! - `generation-N/`: iceoryx2's files.
//!
//! Locks go with their processes, however these end, so what a crash left can be told from what lives. A third lock lies
//! beside the shared memory: it says that the instance lives when somebody has removed its folder.

use crate::exit::Failure;
use crate::lock::{lock, open_lock};
use crate::runtime_folder::{InstanceName, base_folder, instance_folder, make_private};
use anyhow::{Context, Result, anyhow, bail};
use recording::RecordInfo;
use serde::{Deserialize, Serialize};
use signal_bus::Place;
use std::fs::File;
use std::io::Read;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long the processes of a supervisor that died may take to stop the valve and end.
const PATIENCE: Duration = Duration::from_secs(15);

/// Where POSIX shared memory appears as files.
const SHARED_MEMORY: &str = "/dev/shm";

/// An instance that this process supervises. Dropped, it leaves nothing behind.
pub struct Instance {
    folder: PathBuf,
    // In the order in which they are let go.
    _supervisor: File,
    name: Option<File>,
}

/// Where a running instance's services are to be found, as its folder tells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Whereabouts {
    /// Root folder and prefix.
    pub place: Place,
    /// The generation that its messages carry.
    pub generation: u64,
    /// The folder of its record and its journal.
    pub record: PathBuf,
    /// What a record of it says of itself.
    pub info: RecordInfo,
}

impl Instance {
    /// Takes the name, and cleans up what an earlier supervisor of this name, or of any other that is gone, left.
    ///
    /// # Errors
    /// [`Failure::Input`] for a name that is taken; [`Failure::Failed`] where the folder can't be used.
    pub fn acquire(instance: &InstanceName) -> Result<Self, Failure> {
        let taken = |how: &str| {
            Failure::Input(anyhow!(
                "instance \"{instance}\" is running already{how}; --instance gives another name"
            ))
        };
        let base = base_folder()?;
        let folder = instance_folder(&base, instance);
        // First the lock that outlives the folder: a refused start leaves nothing of its own behind.
        let name = match lock_beside_memory(&folder)? {
            BesideMemory::Ours(lock) => Some(lock),
            BesideMemory::SomebodyElses => None,
            BesideMemory::Held if is_held(&folder.join("supervisor.lock")) => return Err(taken("")),
            BesideMemory::Held => return Err(taken(", though its runtime folder was removed")),
        };
        match prepared(&base, &folder).and_then(|lock| lock.ok_or_else(|| taken(""))) {
            Ok(supervisor) => Ok(Self { folder, _supervisor: supervisor, name }),
            Err(failure) => {
                // Held: so it is ours.
                let _ = name.map(|_held| std::fs::remove_file(name_lock(&folder)));
                Err(failure)
            }
        }
    }

    /// The file that every process of the generation shares a lock on.
    pub fn members_lock(&self) -> PathBuf {
        self.folder.join("members.lock")
    }

    /// The instance's folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// A fresh place for a generation. Its names can't be foretold, so nobody can take them before.
    ///
    /// # Errors
    /// Where the system gives no random number.
    pub fn place(&self, generation: u64) -> Result<Place> {
        let mut nonce = [0; 4];
        File::open("/dev/urandom")
            .and_then(|mut source| source.read_exact(&mut nonce))
            .context("/dev/urandom")?;
        Ok(Place {
            root: self.folder.join(format!("generation-{generation}")),
            prefix: format!("{}{generation}-{:08x}_", prefix(&self.folder), u32::from_le_bytes(nonce)),
        })
    }

    /// Removes what a generation has left once its processes have ended.
    ///
    /// # Errors
    /// Where something can't be removed.
    pub fn wipe_generation(&self, generation: u64) -> Result<()> {
        let root = self.folder.join(format!("generation-{generation}"));
        Ok(Place { root, prefix: format!("{}{generation}-", prefix(&self.folder)) }.wipe()?)
    }

    /// Tells others of this user where the generation's services are.
    ///
    /// # Errors
    /// Where the file can't be written.
    pub fn announce(&self, whereabouts: &Whereabouts) -> Result<()> {
        let path = self.folder.join("place.json");
        whole_file::write(&path, serde_json::to_vec(whereabouts)?).with_context(|| path.display().to_string())
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // What can't be removed now is removed by the next start.
        if wait_for_members(&self.folder).is_ok() && wipe_generations(&self.folder).is_ok() {
            let _ = std::fs::remove_dir_all(&self.folder);
            // Held: so it is ours.
            let _ = self.name.as_ref().map(|_| std::fs::remove_file(name_lock(&self.folder)));
        }
    }
}

/// Makes the instance's folder, and removes what earlier ones left. The supervisor's lock, `None` where another holds it.
fn prepared(base: &Path, folder: &Path) -> Result<Option<File>, Failure> {
    sweep(base, folder);
    make_private(folder)?;
    let Some(supervisor) = lock(&folder.join("supervisor.lock"))? else { return Ok(None) };
    open_lock(&folder.join("members.lock"))?;
    wait_for_members(folder)?;
    wipe_generations(folder)?;
    Ok(Some(supervisor))
}

/// Where the services of a running instance are to be found.
///
/// # Errors
/// Where no such instance runs.
pub fn whereabouts(folder: &Path) -> Result<Whereabouts> {
    let path = folder.join("place.json");
    let text = std::fs::read(&path).with_context(|| path.display().to_string())?;
    serde_json::from_slice(&text).with_context(|| path.display().to_string())
}

/// What the names of the locks that outlive runtime folders begin with.
const NAME_LOCK: &str = "stepvalve-lock";

/// The lock that outlives the runtime folder.
fn name_lock(folder: &Path) -> PathBuf {
    Path::new(SHARED_MEMORY).join(format!("{NAME_LOCK}{}", prefix(folder).trim_start_matches("stepvalve")))
}

/// The locks of this user's instances beside the memory, whoever holds them.
pub(crate) fn name_locks() -> impl Iterator<Item = std::fs::Metadata> {
    let entries = std::fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
    let locks = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(NAME_LOCK));
    let own = |found: &std::fs::Metadata| found.uid() == nix::unistd::geteuid().as_raw();
    locks.filter_map(|entry| std::fs::symlink_metadata(entry.path()).ok()).filter(own)
}

/// What became of taking the lock that outlives the runtime folder.
enum BesideMemory {
    Ours(File),
    Held,
    /// Somebody else's file in its place must keep nobody from starting.
    SomebodyElses,
}

fn lock_beside_memory(folder: &Path) -> Result<BesideMemory> {
    let path = name_lock(folder);
    let own = |found: std::fs::Metadata| found.uid() == nix::unistd::geteuid().as_raw();
    if !open_lock(&path).and_then(|file| Ok(file.metadata()?)).is_ok_and(own) {
        return Ok(BesideMemory::SomebodyElses);
    }
    Ok(lock(&path)?.map_or(BesideMemory::Held, BesideMemory::Ours))
}

/// Whether somebody holds the lock of a file, which is not made where it is missing.
fn is_held(path: &Path) -> bool {
    path.exists() && open_lock(path).is_ok_and(|file| file.try_lock().is_err())
}

/// Waits until no process of an earlier generation is left.
fn wait_for_members(folder: &Path) -> Result<()> {
    let path = folder.join("members.lock");
    let file = open_lock(&path)?;
    let begun = Instant::now();
    while file.try_lock().is_err() {
        if begun.elapsed() > PATIENCE {
            bail!(
                "{}: processes of an earlier run still hold it after {} s",
                path.display(),
                PATIENCE.as_secs()
            );
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    Ok(())
}

/// Removes what instances left whose supervisor and processes are all gone.
fn sweep(base: &Path, except: &Path) {
    for entry in std::fs::read_dir(base).into_iter().flatten().flatten() {
        let folder = entry.path();
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if folder == except || !is_folder {
            continue;
        }
        let free = |file: &str| open_lock(&folder.join(file)).ok().filter(|lock| lock.try_lock().is_ok());
        let (Some(_supervisor), Some(_members)) = (free("supervisor.lock"), free("members.lock")) else {
            continue;
        };
        // A folder that was removed and made anew has free locks while its instance lives.
        let beside = lock_beside_memory(&folder).unwrap_or(BesideMemory::Held);
        if !matches!(beside, BesideMemory::Held) && wipe_generations(&folder).is_ok() {
            let _ = std::fs::remove_dir_all(&folder);
            if let BesideMemory::Ours(_held) = beside {
                let _ = std::fs::remove_file(name_lock(&folder));
            }
        }
    }
}

/// Removes every generation's files and shared memory.
fn wipe_generations(folder: &Path) -> Result<()> {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with("generation-") {
            std::fs::remove_dir_all(entry.path()).with_context(|| entry.path().display().to_string())?;
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
