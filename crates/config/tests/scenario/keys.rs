//! Every key that the readers ask for is told to users and is in the fuzz corpus.

use config::parse_scenario;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// What may stand before a key in a reader's source.
const READERS: [&str; 14] = [
    "find",
    "require",
    "quantity",
    "integer_or",
    "text",
    "section",
    "ramp",
    "angle",
    "optional",
    "list",
    "number",
    "optional_number",
    "count",
    "optional_section",
];

/// The keys that a source names: a text in small letters, first in the arguments of a reader or in a list of keys.
fn keys_of(source: &str) -> BTreeSet<String> {
    let is_key = |text: &str| {
        text.starts_with(|c: char| c.is_ascii_lowercase())
            && text.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
    };
    let mut keys = BTreeSet::new();
    for (at, _) in source.match_indices('"') {
        let (before, after) = (source[..at].trim_end(), &source[at + 1..]);
        let Some(key) = after.split('"').next().filter(|key| is_key(key)) else { continue };
        let call = before.trim_end_matches("&root,").trim_end_matches("friction,").trim_end();
        let read = READERS.iter().any(|reader| call.ends_with(&format!("{reader}(")))
            || call.ends_with("read_profile(")
            || call.ends_with("either(");
        let listed = before
            .rsplit(';')
            .next()
            .is_some_and(|line| line.contains("const KINDS") || line.contains("KEYS"));
        if read || listed {
            keys.insert(key.to_owned());
        }
    }
    keys
}

/// The keys that the readers of a folder of the sources ask for.
fn keys_in(folder: &str) -> BTreeSet<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(folder);
    let sources = std::fs::read_dir(folder).unwrap().flatten().map(|entry| entry.path());
    let readers = sources.filter(|path| path.file_name().unwrap().to_str().unwrap().starts_with("read"));
    readers.flat_map(|path| keys_of(&std::fs::read_to_string(path).unwrap())).collect()
}

fn keys() -> BTreeSet<String> {
    let found = keys_in("scenario");
    assert!(found.len() > 60 && found.contains("unhomed_speed") && found.contains("pulse_rate"), "{found:?}");
    found
}

#[test]
fn every_key_is_in_the_fuzz_corpus() {
    let folder = repository().join("fuzz/corpus/configuration");
    let texts = ["scenario", "limited", "rotating"].map(|name| {
        let text = std::fs::read_to_string(folder.join(format!("{name}.toml"))).unwrap();
        parse_scenario(&text, name).unwrap_or_else(|errors| panic!("{errors}"));
        text
    });
    let words: BTreeSet<&str> =
        texts.iter().flat_map(|text| text.split(|c: char| !c.is_alphanumeric() && c != '_')).collect();
    let missing: Vec<String> = keys().into_iter().filter(|key| !words.contains(key.as_str())).collect();
    assert!(missing.is_empty(), "not in fuzz/corpus/configuration: {missing:?}");
}

#[test]
fn every_key_is_in_the_documents() {
    let model = keys_in("model");
    assert!(model.len() > 45 && model.contains("maxwell_elements"), "{} keys: {model:?}", model.len());
    for (document, keys) in [("docs/scenario.md", keys()), ("docs/model.md", model)] {
        let text = std::fs::read_to_string(repository().join(document)).unwrap();
        let told: BTreeSet<&str> = text
            .split('`')
            .skip(1)
            .step_by(2)
            .flat_map(|code| code.split(|c: char| !c.is_alphanumeric() && c != '_'))
            .collect();
        let missing: Vec<String> = keys.into_iter().filter(|key| !told.contains(key.as_str())).collect();
        assert!(missing.is_empty(), "not in {document}: {missing:?}");
    }
}
