//! What the source must not hold: `unsafe` outside `realtime` and `fmu-binary`, atomics that guard anything.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::path::{Path, PathBuf};
use stepvalve_tests::repository;

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The files of the product's crates that hold a word, and how often.
fn files_with(word: &str) -> Vec<(String, usize)> {
    let mut all = Vec::new();
    sources(&repository().join("crates"), &mut all);
    let mut found: Vec<_> = all
        .iter()
        .filter(|path| !path.components().any(|part| part.as_os_str() == "tests"))
        .filter_map(|path| {
            let count = std::fs::read_to_string(path).unwrap().matches(word).count();
            let name = path.strip_prefix(repository()).unwrap().display().to_string();
            (count > 0).then_some((name, count))
        })
        .collect();
    found.sort();
    found
}

#[test]
fn unsafe_is_in_realtime_and_the_c_interface_alone() {
    for word in ["unsafe {", "unsafe fn", "unsafe impl"] {
        for (file, _) in files_with(word) {
            let may =
                ["crates/realtime/", "crates/fmu-binary/"].iter().any(|folder| file.starts_with(folder));
            assert!(may, "{word} in {file}");
        }
    }
}

/// Relaxed flags and counts order nothing, so there is no interleaving that a model checker could find wrong. An atomic
/// with any other ordering would need one (loom).
#[test]
fn atomics_are_relaxed_flags_and_counts() {
    for ordering in
        ["Ordering::Acquire", "Ordering::Release", "Ordering::AcqRel", "Ordering::SeqCst", "fence("]
    {
        assert!(files_with(ordering).is_empty(), "{ordering}: {:?}", files_with(ordering));
    }
    let atomics: Vec<_> = files_with("Ordering::Relaxed").into_iter().map(|(file, _)| file).collect();
    for file in &atomics {
        let text = std::fs::read_to_string(repository().join(file)).unwrap();
        assert!(!text.contains("AtomicPtr") && !text.contains("compare_exchange"), "{file}");
    }
    assert!(atomics.iter().any(|file| file.contains("wishes.rs")), "{atomics:?}");
}
