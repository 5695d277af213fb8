//! Memory beside the loop's own: swap, and the file system of shared memory.

use super::finding::{Finding, Topic};
use super::root::Root;
use nix::sys::statvfs::statvfs;
use nix::unistd::{AccessFlags, access};
use std::os::unix::fs::{MetadataExt, PermissionsExt};

const SWAP: Topic = Topic {
    id: "swap",
    what: "swap",
    why: "The loop's memory is locked and stays. Supervisor and recorder are not, and while the kernel swaps, the disk and \
          its interrupts are busy.",
};
const SHARED_MEMORY: Topic = Topic {
    id: "shared-memory",
    what: "shared memory (/dev/shm)",
    why: "All messages live there. When it is full the processes can't start, or die at the first touch of a page.",
};

/// What an instance takes, with room, bytes.
const INSTANCE_BYTES: u64 = 64 << 20;

/// Both.
pub fn look(root: &Root) -> Vec<Finding> {
    vec![swap(root), shared_memory(root)]
}

fn swap(root: &Root) -> Finding {
    let Some(text) = root.text("/proc/swaps") else { return SWAP.unknown("/proc/swaps can't be read", "") };
    let names: Vec<_> = text.lines().skip(1).filter_map(|line| line.split_whitespace().next()).collect();
    if names.is_empty() {
        return SWAP.ok("none");
    }
    SWAP.advice(names.join(", "), "swapoff --all; for good: take it out of /etc/fstab")
}

fn shared_memory(root: &Root) -> Finding {
    let path = root.path("/dev/shm");
    let Some(mounts) = root.text("/proc/mounts") else {
        return SHARED_MEMORY.unknown("/proc/mounts can't be read", "");
    };
    let mounted = mounts.lines().rev().find_map(|line| {
        let mut words = line.split_whitespace().skip(1);
        (words.next()? == "/dev/shm").then(|| words.next().map(str::to_owned))?
    });
    let mount = "mount -t tmpfs -o mode=1777,size=256M tmpfs /dev/shm";
    match mounted.as_deref() {
        Some("tmpfs") => {}
        Some(other) => {
            return SHARED_MEMORY.problem(format!("is a {other}, expected a tmpfs"), mount).blocking();
        }
        None => return SHARED_MEMORY.problem("is not mounted", mount).blocking(),
    }
    let (Ok(metadata), Ok(space)) = (std::fs::metadata(&path), statvfs(&path)) else {
        return SHARED_MEMORY.unknown("its size and owner can't be read", "");
    };
    let (owner, mode) = (metadata.uid(), metadata.permissions().mode() & 0o7777);
    let unit = space.fragment_size();
    let (size, free) = (space.blocks() * unit, space.blocks_available() * unit);
    let found = format!("{} MB, {} MB free, owner {owner}, mode {mode:04o}", size >> 20, free >> 20);
    if access(&path, AccessFlags::W_OK | AccessFlags::X_OK).is_err() {
        let found = format!("{found}: this user may not write");
        return SHARED_MEMORY.problem(found, "chown root:root /dev/shm; chmod 1777 /dev/shm").blocking();
    }
    if mode & 0o1002 == 0o0002 {
        let found = format!("{found}: everybody may remove everybody's files (no sticky bit)");
        return SHARED_MEMORY.problem(found, "chmod 1777 /dev/shm");
    }
    if free < INSTANCE_BYTES {
        let found = format!("{found}: an instance wants {} MB", INSTANCE_BYTES >> 20);
        let fix = "mount -o remount,size=256M /dev/shm, or remove what fills it: du -a /dev/shm";
        return SHARED_MEMORY.problem(found, fix).blocking();
    }
    SHARED_MEMORY.ok(found)
}
