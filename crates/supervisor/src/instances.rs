//! The instances of this user that can be found, live or dead, wherever their runtime folders are.

use crate::control::socket_path;
use crate::instance::name_locks;
use crate::runtime_folder::base_path;
use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// An instance's folder, and who keeps it alive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundInstance {
    /// Its name.
    pub name: String,
    /// Its folder.
    pub folder: PathBuf,
    /// Whether a process of it lives.
    pub alive: bool,
    /// Its supervisor's process, where that lives.
    pub supervisor: Option<i32>,
}

impl FoundInstance {
    /// Whether its supervisor could be asked something.
    pub fn listens(&self) -> bool {
        self.alive && socket_path(&self.folder).exists()
    }
}

/// The folders that instances may be in: that of this environment, the login session's, those of services, and the one for
/// where there is neither. Only folders that belong to this user are looked into (root: to anybody).
pub fn base_folders() -> Vec<PathBuf> {
    let uid = nix::unistd::getuid();
    let mut folders = vec![
        base_path(),
        PathBuf::from(format!("/run/user/{uid}/stepvalve")),
        std::env::temp_dir().join(format!("stepvalve-{uid}")),
    ];
    let services = std::fs::read_dir("/run").into_iter().flatten().flatten();
    let services = services.filter(|entry| entry.file_name().to_string_lossy().starts_with("stepvalve-"));
    folders.extend(services.map(|entry| entry.path().join("stepvalve")));
    folders.retain(|folder| is_own(folder));
    folders.sort();
    folders.dedup();
    folders
}

fn is_own(folder: &Path) -> bool {
    let uid = nix::unistd::getuid();
    std::fs::symlink_metadata(folder)
        .is_ok_and(|found| found.is_dir() && (uid.is_root() || found.uid() == uid.as_raw()))
}

/// The instances in a folder, by name. `locks` is the text of `/proc/locks`: looking there stands in nobody's way, as trying a
/// lock would in that of an instance that starts just now.
pub fn instances(base: &Path, locks: &str) -> Vec<FoundInstance> {
    let holders = lock_holders(locks);
    let entries = std::fs::read_dir(base).into_iter().flatten().flatten();
    let folders = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
    let mut found: Vec<_> = folders
        .map(|entry| {
            let folder = entry.path();
            let holder = |name: &str| {
                let inode = std::fs::symlink_metadata(folder.join(name)).ok()?.ino();
                holders.get(&inode).copied()
            };
            let supervisor = holder("supervisor.lock");
            FoundInstance {
                name: entry.file_name().to_string_lossy().into_owned(),
                alive: supervisor.or_else(|| holder("members.lock")).is_some(),
                supervisor,
                folder,
            }
        })
        .collect();
    found.sort_by(|a, b| a.name.cmp(&b.name));
    found
}

/// The supervisors whose runtime folder was removed: they hold the lock of their name beside the memory, and are none of those in any folder that
/// instances may be in. No order reaches them.
pub fn without_a_folder(locks: &str) -> Vec<i32> {
    let holders = lock_holders(locks);
    let known: Vec<i32> = base_folders()
        .iter()
        .flat_map(|base| instances(base, locks))
        .filter_map(|found| found.supervisor)
        .collect();
    let held = name_locks().filter_map(|lock| holders.get(&lock.ino()).copied());
    held.filter(|process| !known.contains(process)).collect()
}

/// Who holds a lock on which inode, as `/proc/locks` tells. The device is left out: what is said of it differs between file
/// systems, and a like number elsewhere makes a dead instance look alive, which does no harm.
fn lock_holders(locks: &str) -> BTreeMap<u64, i32> {
    // "1: FLOCK  ADVISORY  WRITE 4711 00:1b:123 0 EOF"; one that waits has "->" as its second word.
    let holder = |line: &str| {
        let words: Vec<_> = line.split_whitespace().filter(|word| *word != "->").collect();
        let inode = words.get(5)?.splitn(3, ':').nth(2)?.parse().ok()?;
        Some((inode, words.get(4)?.parse().ok()?))
    };
    locks.lines().filter(|line| !line.contains("->")).filter_map(holder).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn locks_tell_who_lives() {
        let base = tempfile::tempdir().unwrap();
        let inode = |name: &str, file: &str| {
            std::fs::create_dir_all(base.path().join(name)).unwrap();
            let path = base.path().join(name).join(file);
            std::fs::write(&path, "").unwrap();
            std::fs::metadata(path).unwrap().ino()
        };
        let (led, left) = (inode("led", "supervisor.lock"), inode("orphaned", "members.lock"));
        let dead = inode("dead", "supervisor.lock");
        let locks = format!(
            "1: FLOCK  ADVISORY  WRITE 4711 00:1b:{led} 0 EOF\n2: FLOCK  ADVISORY  READ  4712 00:1b:{left} 0 EOF\n\
             2: -> FLOCK  ADVISORY  WRITE 4713 00:1b:{dead} 0 EOF\n3: OFDLCK ADVISORY  READ -1 00:05:7 0 EOF\nnonsense\n"
        );
        let told: Vec<_> = instances(base.path(), &locks)
            .into_iter()
            .map(|found| (found.name, found.alive, found.supervisor))
            .collect();
        assert_eq!(
            told,
            [
                ("dead".to_owned(), false, None),
                ("led".to_owned(), true, Some(4711)),
                ("orphaned".to_owned(), true, None)
            ]
        );
    }
}
