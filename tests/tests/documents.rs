//! Paths and links in the documents lead somewhere: code moves, and the map has to move with it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use stepvalve_tests::repository;

/// The top folders; a text in backticks that begins with one of them is a path.
const TOP: [&str; 8] = [".ci/", "bench/", "crates/", "docs/", "fuzz/", "rt-config/", "tests/", "tools/"];

/// What a command makes, and no clone has.
const MADE: [&str; 1] = ["tools/.venv"];

/// Every Markdown file at the top and in docs.
fn documents() -> Vec<PathBuf> {
    let folders = [repository(), repository().join("docs"), repository().join("bench")];
    let files = folders.iter().flat_map(|folder| std::fs::read_dir(folder).unwrap().flatten());
    let markdown = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "md");
    let mut found: Vec<_> = files.map(|file| file.path()).filter(markdown).collect();
    found.sort();
    found
}

/// The pieces of a text between a beginning and an end.
fn between<'a>(text: &'a str, begin: &'a str, end: char) -> impl Iterator<Item = &'a str> {
    text.split(begin).skip(1).filter_map(move |rest| rest.split_once(end).map(|(inner, _)| inner))
}

/// Paths in backticks, outside fenced blocks; those with a wildcard or a placeholder are left out.
fn paths(text: &str) -> BTreeSet<&str> {
    let prose = text.split("```").step_by(2);
    let spans = prose.flat_map(|prose| prose.split('`').skip(1).step_by(2));
    let words = spans.flat_map(str::split_whitespace);
    let is_path =
        |word: &&str| TOP.iter().any(|top| word.starts_with(top)) && !word.contains(['*', '{', '<']);
    words.map(|word| word.trim_end_matches([',', ';', ':', '.'])).filter(is_path).collect()
}

/// Files of the diagnosis in backticks, as its method's document names them: by folder and file of `crates/diagnosis/src`.
fn files_of_the_diagnosis(text: &str) -> BTreeSet<&str> {
    let spans = text.split('`').skip(1).step_by(2);
    spans.filter(|word| word.ends_with(".rs") && !TOP.iter().any(|top| word.starts_with(top))).collect()
}

/// The anchors of a document's headings, as GitHub makes them.
fn anchors(text: &str) -> BTreeSet<String> {
    let headings = text.lines().filter(|line| line.starts_with('#'));
    let kept = |c: &char| c.is_alphanumeric() || [' ', '-', '_'].contains(c);
    let anchor = |line: &str| -> String {
        line.trim_start_matches('#').trim().to_lowercase().chars().filter(kept).collect()
    };
    headings.map(|line| anchor(line).replace(' ', "-")).collect()
}

/// What is wrong with a link from a document; `None` where it leads somewhere.
fn broken(document: &Path, link: &str) -> Option<String> {
    if link.starts_with("http") {
        return None;
    }
    let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
    let path = if file.is_empty() { document.to_owned() } else { document.parent().unwrap().join(file) };
    if !path.exists() {
        return Some(format!("no file {file}"));
    }
    let known = anchor.is_empty() || anchors(&std::fs::read_to_string(path).unwrap()).contains(anchor);
    (!known).then(|| format!("no heading {anchor}"))
}

#[test]
fn every_path_exists() {
    let mut looked_at = 0;
    for document in documents() {
        let text = std::fs::read_to_string(&document).unwrap();
        for path in paths(&text).into_iter().filter(|path| !MADE.iter().any(|made| path.starts_with(made))) {
            assert!(repository().join(path).exists(), "{}: `{path}` does not exist", document.display());
            looked_at += 1;
        }
    }
    assert!(looked_at > 50, "{looked_at} paths");
}

#[test]
fn the_method_names_files_that_exist() {
    let text = std::fs::read_to_string(repository().join("docs/diagnosis-method.md")).unwrap();
    let files = files_of_the_diagnosis(&text);
    assert!(files.len() > 10, "{files:?}");
    for file in files {
        assert!(repository().join("crates/diagnosis/src").join(file).exists(), "`{file}` does not exist");
    }
}

#[test]
fn every_link_leads_somewhere() {
    let mut looked_at = 0;
    for document in documents() {
        let text = std::fs::read_to_string(&document).unwrap();
        for link in between(&text, "](", ')') {
            if let Some(why) = broken(&document, link) {
                panic!("{}: ({link}): {why}", document.display());
            }
            looked_at += 1;
        }
    }
    assert!(looked_at > 10, "{looked_at} links");
}

#[test]
fn these_tests_see_a_wrong_path() {
    assert_eq!(
        paths("see `crates/nowhere/src/lib.rs`, and `x.rs`"),
        BTreeSet::from(["crates/nowhere/src/lib.rs"])
    );
    assert!(paths("```\ncrates/in/a/block\n```").is_empty());
    let readme = repository().join("README.md");
    assert!(broken(&readme, "docs/nothing.md").is_some());
    assert!(broken(&readme, "docs/diagnosis.md#no-such-heading").is_some());
    assert!(broken(&readme, "docs/diagnosis.md#the-verdicts").is_none());
}
