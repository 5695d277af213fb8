//! Resident memory of each process while a real-time run goes, as the kernel counts it.

use crate::output::{Sheet, digits};
use crate::programs::{LOOP, Workplace};
use crate::scenario::Variant;
use anyhow::Result;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::time::Duration;

/// Resident memory of a process, kB.
#[derive(Debug, Clone, Copy, Default)]
struct Resident {
    peak_kb: u64,
    now_kb: u64,
    // Of what is resident now: its own, and shared memory.
    own_kb: u64,
    shared_memory_kb: u64,
    locked_kb: u64,
}

/// Looks at all processes of a run of a few seconds; also says what scheduling they had.
///
/// # Errors
/// Where the run fails.
pub fn run(place: &Workplace) -> Result<((Sheet, Value), String)> {
    let scenario = place.path("memory.toml");
    Variant::of_1khz(3_000).write(&scenario)?;
    let mut run = place.start_simulate(&scenario, "realtime", &[])?;
    let mut found: BTreeMap<String, Resident> = BTreeMap::new();
    while run.process.try_wait()?.is_none() {
        for pid in children(run.process.id()) {
            if let Some((name, resident)) = resident(pid) {
                let seen = found.entry(name).or_default();
                if resident.now_kb >= seen.now_kb {
                    *seen = resident;
                }
            }
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let summary = run.finish()?;
    Ok((table(&found), crate::programs::scheduling(&summary)))
}

fn table(found: &BTreeMap<String, Resident>) -> (Sheet, Value) {
    let header = ["process", "VmHWM, MB", "VmRSS, MB", "of it own, MB", "shared memory, MB", "locked, MB"];
    let mut sheet = Sheet::new("sim-memory", "Resident memory in a real-time run, at its largest", &header);
    let mut data = serde_json::Map::new();
    for name in LOOP.into_iter().chain(["run-recorder"]) {
        let Some(resident) = found.get(name) else { continue };
        let kb = [
            resident.peak_kb,
            resident.now_kb,
            resident.own_kb,
            resident.shared_memory_kb,
            resident.locked_kb,
        ];
        sheet.row([name.to_owned()].into_iter().chain(kb.map(|kb| digits(kb as f64 / 1024.0))));
        let [peak, now, own, shared, locked] = kb;
        data.insert(
            name.to_owned(),
            json!({
                "vm_hwm_kb": peak, "vm_rss_kb": now, "rss_anon_kb": own, "rss_shmem_kb": shared,
                "vm_lck_kb": locked,
            }),
        );
    }
    (sheet, Value::Object(data))
}

fn children(supervisor: u32) -> Vec<u32> {
    // Its threads start children too: each lists its own.
    let tasks = std::fs::read_dir(format!("/proc/{supervisor}/task")).into_iter().flatten().flatten();
    let lists = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("children")).ok());
    lists
        .flat_map(|list| list.split_whitespace().filter_map(|pid| pid.parse().ok()).collect::<Vec<_>>())
        .collect()
}

fn resident(pid: u32) -> Option<(String, Resident)> {
    let program = std::fs::read_link(format!("/proc/{pid}/exe")).ok()?;
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let kb = |key: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(key))?;
        line.split_whitespace().find_map(|word| word.parse().ok())
    };
    let resident = Resident {
        peak_kb: kb("VmHWM:")?,
        now_kb: kb("VmRSS:")?,
        own_kb: kb("RssAnon:")?,
        shared_memory_kb: kb("RssShmem:")?,
        locked_kb: kb("VmLck:")?,
    };
    Some((program.file_name()?.to_string_lossy().into_owned(), resident))
}
