//! What `tools/fuzz` does for minutes, briefly and without its tools: the committed corpus, and changes of it, through the
//! same functions. The seed is printed with a panic.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

#[path = "../../fuzz/src/lib.rs"]
mod fuzz;
#[path = "shared/changed.rs"]
mod shared;

use injection::SplitSeed;
use shared::changed;
use std::path::PathBuf;
use stepvalve_tests::repository;

fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = repository().join("fuzz/corpus").join(target);
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().flatten().map(|entry| entry.path()).collect();
    files.sort();
    files.iter().map(|file| std::fs::read(file).unwrap()).collect()
}

fn briefly(target: &str, run: fn(&[u8]), times: u64) {
    let all = corpus(target);
    assert!(!all.is_empty(), "no corpus for {target}");
    all.iter().for_each(|bytes| run(bytes));
    for seed in 0..times {
        let bytes = changed(&mut SplitSeed::new(seed), &all);
        if std::panic::catch_unwind(|| run(&bytes)).is_err() {
            panic!("{target}: seed {seed}");
        }
    }
}

#[test]
fn configuration() {
    briefly("configuration", fuzz::configuration, 4000);
}

#[test]
fn bus_replies() {
    briefly("bus_replies", fuzz::bus_replies, 300);
}

#[test]
fn message_check() {
    briefly("message_check", fuzz::message_check, 20_000);
}

#[test]
fn record_recovery() {
    briefly("record_recovery", fuzz::record_recovery, 4000);
}

#[test]
fn text_table() {
    briefly("text_table", fuzz::text_table, 4000);
}

#[test]
fn log_diagnosis() {
    briefly("log_diagnosis", fuzz::log_diagnosis, 8);
}
