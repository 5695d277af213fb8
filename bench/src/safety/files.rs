//! Files that are wrong: configuration with every field in turn missing, of a wrong type or out of range; records cut
//! and damaged anywhere.

use super::ground::VARIANTS;
use super::tally::{Outcome, Tally};
use crate::scenario::repository;
use anyhow::{Context, Result};
use closed_loop::InProcess;
use config::{parse_model, parse_scenario};
use injection::SplitSeed;
use recording::{RecordInfo, Texts, Writer, read_record};
use signals::{Header, Message, Source};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use toml_edit::{DocumentMut, Item, Table, Value};

/// What a value is replaced by.
const REPLACEMENTS: [&str; 9] = [
    "\"a text\"",
    "true",
    "[1, 2]",
    "{ a = 1 }",
    "nan",
    "-inf",
    "-1e300",
    "9223372036854775807",
    "1979-05-27T07:32:00Z",
];

/// Runs all of it; `trials` records are cut.
///
/// # Errors
/// Where the shipped files can't be read.
pub fn campaign(seed: u64, trials: u64, tally: &mut Tally) -> Result<()> {
    for folder in ["rt-config/scenarios", "rt-config/models"] {
        for entry in std::fs::read_dir(repository().join(folder))?.flatten() {
            if entry.path().extension().is_some_and(|extension| extension == "toml") {
                configuration(&entry.path(), tally)?;
            }
        }
    }
    records(seed, trials / 4, tally)
}

/// Every key of a file, in turn, missing and replaced.
fn configuration(path: &Path, tally: &mut Tally) -> Result<()> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let document: DocumentMut = text.parse()?;
    let mut places = Vec::new();
    keys(document.as_table(), &mut Vec::new(), &mut places);
    for place in &places {
        let without = changed(&document, place, None);
        parse(path, &without, "configuration: a field missing", place, tally);
        for replacement in REPLACEMENTS {
            let with = changed(&document, place, replacement.parse().ok());
            parse(path, &with, "configuration: a field replaced", place, tally);
        }
    }
    Ok(())
}

/// The ways to all values.
fn keys(table: &Table, way: &mut Vec<String>, places: &mut Vec<Vec<String>>) {
    for (key, item) in table {
        way.push(key.to_owned());
        match item {
            Item::Table(inner) => keys(inner, way, places),
            Item::ArrayOfTables(inner) => inner.iter().take(1).for_each(|inner| keys(inner, way, places)),
            _ => places.push(way.clone()),
        }
        way.pop();
    }
}

fn changed(document: &DocumentMut, way: &[String], new: Option<Value>) -> String {
    let mut document = document.clone();
    let Some((key, tables)) = way.split_last() else { return document.to_string() };
    let mut table: Option<&mut Table> = Some(document.as_table_mut());
    for name in tables {
        table = table.and_then(|table| table.get_mut(name)).and_then(|item| match item {
            Item::Table(inner) => Some(inner),
            Item::ArrayOfTables(inner) => inner.get_mut(0),
            _ => None,
        });
    }
    if let Some(table) = table {
        table.remove(key);
        if let Some(new) = new {
            table.insert(key, Item::Value(new));
        }
    }
    document.to_string()
}

/// Parses a text: refused with at least one error that names a line, or accepted; never a panic.
fn parse(path: &Path, text: &str, fault: &str, place: &[String], tally: &mut Tally) {
    let name = path.display().to_string();
    let scenario = name.contains("scenarios");
    let said = catch_unwind(AssertUnwindSafe(|| {
        if scenario {
            parse_scenario(text, &name).err().map(|errors| errors.to_string())
        } else {
            parse_model(text, &name).err().map(|errors| errors.to_string())
        }
    }));
    let violations = match said {
        Ok(Some(words)) if !words.contains(&name) => vec![format!("the error names no file: {words}")],
        Ok(_) => Vec::new(),
        Err(_) => vec!["panic".to_owned()],
    };
    let exact = format!("{name}: {}", place.join("."));
    tally.note(Outcome { fault: fault.to_owned(), exact, violations, ..Outcome::default() });
}

/// A short record, cut and damaged.
fn records(seed: u64, trials: u64, tally: &mut Tally) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("run-0001.mcap");
    let whole = record(&path)?;
    let bytes = std::fs::read(&path)?;
    let cut = folder.path().join("cut.mcap");
    println!("records: seed {seed}, {} bytes, {whole} messages", bytes.len());
    let mut details = SplitSeed::new(seed);
    let mut before = 0;
    // At ascending bytes: what can be read never becomes less.
    let mut places: Vec<_> = (0..trials).map(|_| details.whole(0, bytes.len() as u64)).collect();
    places.sort_unstable();
    for place in places {
        let read = messages_in(&cut, bytes.get(..place as usize).unwrap_or(&bytes));
        let violations = match read {
            Ok(Some(count)) if count < before => {
                vec![format!("{count} messages, {before} of a shorter file")]
            }
            Ok(count) => {
                before = before.max(count.unwrap_or(0));
                Vec::new()
            }
            Err(()) => vec!["panic".to_owned()],
        };
        let exact = format!("seed {seed}: cut at byte {place}");
        tally.note(Outcome { fault: "record: cut".to_owned(), exact, violations, ..Outcome::default() });
    }
    for _ in 0..trials {
        let mut damaged = bytes.clone();
        let (place, bit) = (details.whole(0, bytes.len() as u64), details.whole(0, 8));
        if let Some(byte) = damaged.get_mut(place as usize) {
            *byte ^= 1 << bit;
        }
        let violations = match messages_in(&cut, &damaged) {
            Ok(Some(count)) if count > whole => vec![format!("{count} messages, {whole} were written")],
            Ok(_) => Vec::new(),
            Err(()) => vec!["panic".to_owned()],
        };
        let exact = format!("seed {seed}: bit {bit} of byte {place}");
        tally.note(Outcome {
            fault: "record: a bit flipped".to_owned(),
            exact,
            violations,
            ..Outcome::default()
        });
    }
    Ok(())
}

/// Messages that a file yields; `None` where it is refused.
fn messages_in(path: &Path, bytes: &[u8]) -> Result<Option<u64>, ()> {
    if std::fs::write(path, bytes).is_err() {
        return Err(());
    }
    catch_unwind(|| read_record(&[path], |_| {}).ok().map(|report| report.recorded())).map_err(|_| ())
}

fn record(path: &Path) -> Result<u64> {
    let ground = VARIANTS.first().context("a variant")?.ground()?;
    let info = RecordInfo {
        title: "cut".to_owned(),
        instance: String::new(),
        mode: "in-process".to_owned(),
        operated: false,
        program_version: String::new(),
        generation: 0,
        period_ns: ground.parts.timeline.period_ns,
        microstep_rad: None,
        started_unix_ns: None,
        unix_offset_ns: None,
        texts: Texts { scenario: ground.text, truth: String::new(), belief: String::new() },
        machine: BTreeMap::new(),
    };
    let mut writer = Writer::create(path, &info)?;
    let mut count = 0;
    for messages in InProcess::new(&ground.parts) {
        let cycle = messages.cycle;
        let header = Header::new::<signals::Feedback>(Source::Plant, 0, cycle, cycle, cycle);
        writer.write(Source::Plant, &Message::seal(header, messages.plant.feedback))?;
        count += 1;
        if cycle % 20 == 0 {
            writer.flush()?;
        }
    }
    writer.finish()?;
    Ok(count)
}
