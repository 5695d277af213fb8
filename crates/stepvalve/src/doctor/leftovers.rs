//! What instances left that are dead: folders whose locks nobody holds, and shared memory that nobody maps.
//!
//! Looked at only: the locks are found in /proc/locks and not tried, which would stand in the way of an instance
//! that starts just now.

use super::finding::{Finding, Topic};
use super::root::Root;
use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;
use supervisor::{base_path, instances, prefix};

const LEFTOVERS: Topic = Topic {
    id: "leftovers",
    what: "leftovers of dead instances",
    why: "Shared memory of processes that were killed stays until somebody removes it, and counts as memory in use.",
};

/// So many are told one by one.
const MOST_TOLD: usize = 4;
/// Where POSIX shared memory appears as files.
const SHARED_MEMORY: &str = "/dev/shm";

/// Instances of this user's runtime directory, and shared memory of this user (of all users where this is root).
pub fn look(root: &Root) -> Finding {
    let Some(locks) = root.text("/proc/locks") else {
        return LEFTOVERS.unknown("/proc/locks can't be read", "");
    };
    let (alive, dead): (Vec<_>, Vec<_>) =
        instances(&base_path(), &locks).into_iter().partition(|found| found.alive);
    let dead: Vec<_> = dead.into_iter().map(|found| found.folder).collect();
    let Some(used) = mapped(root) else {
        return LEFTOVERS.unknown("no process's memory map can be read", "");
    };
    let mut live_prefixes: Vec<_> = alive.iter().map(|found| prefix(&found.folder)).collect();
    // The runtime folder of a live instance may be elsewhere: then what it maps says that it lives.
    live_prefixes.extend(used.lines().filter_map(prefix_mapped));
    let orphans = orphans(root, &used, &live_prefixes);
    if dead.is_empty() && orphans.is_empty() {
        let running: Vec<_> = alive.iter().map(|found| found.name.as_str()).collect();
        let running =
            if running.is_empty() { String::new() } else { format!("; running: {}", running.join(", ")) };
        return LEFTOVERS.ok(format!("none{running}"));
    }
    LEFTOVERS.advice(describe(&dead, &orphans), fix(&dead, &orphans))
}

/// Files of shared memory of one prefix.
struct Orphan {
    prefix: String,
    files: usize,
    bytes: u64,
}

fn describe(dead: &[PathBuf], orphans: &[Orphan]) -> String {
    let folders = dead.iter().map(|folder| folder.display().to_string());
    let memory = orphans.iter().map(|orphan| {
        let Orphan { prefix, files, bytes } = orphan;
        format!("{files} files {SHARED_MEMORY}/{prefix}* ({} kB)", bytes >> 10)
    });
    let told: Vec<String> = folders.chain(memory).collect();
    let others = told.len().saturating_sub(MOST_TOLD);
    let others = (others > 0).then(|| format!("and {others} more, which the commands name"));
    told.into_iter().take(MOST_TOLD).chain(others).collect::<Vec<_>>().join("; ")
}

fn fix(dead: &[PathBuf], orphans: &[Orphan]) -> String {
    let folders = dead.iter().map(|folder| format!("rm -r {}", folder.display()));
    let memory = orphans.iter().map(|orphan| format!("rm {SHARED_MEMORY}/{}*", orphan.prefix));
    let commands: Vec<_> = folders.chain(memory).collect();
    // A start finds what belongs to a folder; without its folder nothing does.
    let who = if dead.is_empty() {
        "nothing removes them by itself"
    } else {
        "the next start of such an instance removes what it left"
    };
    format!("{who}; now: {}", commands.join("; "))
}

/// The text of all memory maps that this user may read.
fn mapped(root: &Root) -> Option<String> {
    let processes = root.names("/proc")?.into_iter().filter(|name| name.parse::<u32>().is_ok());
    let maps: Vec<_> = processes.filter_map(|process| root.text(&format!("/proc/{process}/maps"))).collect();
    let ours = maps.iter().flat_map(|map| map.lines()).filter(|line| line.contains("stepvalve_"));
    (!maps.is_empty()).then(|| ours.collect::<Vec<_>>().join("\n"))
}

fn orphans(root: &Root, used: &str, live_prefixes: &[String]) -> Vec<Orphan> {
    let user = nix::unistd::geteuid();
    let mut found: BTreeMap<String, Orphan> = BTreeMap::new();
    for name in root.names(SHARED_MEMORY).unwrap_or_default() {
        let Some(prefix) = prefix_of(&name) else { continue };
        let Ok(metadata) = std::fs::metadata(root.path(&format!("{SHARED_MEMORY}/{name}"))) else { continue };
        let others = !user.is_root() && metadata.uid() != user.as_raw();
        let live = live_prefixes.iter().any(|live| name.starts_with(live.as_str()));
        if others || live || used.contains(&format!("/{name}")) {
            continue;
        }
        let orphan = found.entry(prefix.clone()).or_insert_with(|| Orphan { prefix, files: 0, bytes: 0 });
        orphan.files += 1;
        orphan.bytes += metadata.blocks() * 512;
    }
    found.into_values().collect()
}

/// The prefix of the shared memory that a line of a memory map shows.
fn prefix_mapped(line: &str) -> Option<String> {
    let name = line.split_once(&format!("{SHARED_MEMORY}/"))?.1;
    prefix_of(name)
}

/// "stepvalve_1000_89abcdef_" of a name that begins with it.
fn prefix_of(name: &str) -> Option<String> {
    let mut words = name.split('_');
    let (product, user, hash) = (words.next()?, words.next()?, words.next()?);
    words.next()?;
    (product == "stepvalve").then(|| format!("{product}_{user}_{hash}_"))
}
