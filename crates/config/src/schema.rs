//! JSON Schema of the files that are read here, for editors: made from what the readers ask for ([`crate::asked`]) while they
//! read texts that together have every key, so it can't differ from them.
//!
//! It is never stricter than the reader. It is looser where the reader compares values with each other (limits, order of times,
//! one set-point one kind), and inside texts with units, whose range it can't see.

use crate::asked::{Key, Shape, Visit};
use crate::{drive_file, model, plan, scenario};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// A kind of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A scenario.
    Scenario,
    /// A model.
    Model,
    /// A drive.
    Drive,
    /// A campaign's plan.
    Plan,
}

/// Its schema.
pub fn schema(kind: FileKind) -> Value {
    let (title, visits) = match kind {
        FileKind::Scenario => ("stepvalve scenario", scenario::asked()),
        FileKind::Model => ("stepvalve model", model::asked()),
        FileKind::Drive => ("stepvalve drive", drive_file::asked()),
        FileKind::Plan => ("stepvalve campaign plan", plan::asked()),
    };
    let mut tables = BTreeMap::<String, Vec<Visit>>::new();
    for visit in visits {
        tables.entry(visit.path.clone()).or_default().push(visit);
    }
    let mut whole = table(&tables, "");
    // Where an editor is told which schema it is: taplo's line is a comment, others want a key.
    whole.insert("$schema".to_owned(), json!("http://json-schema.org/draft-07/schema#"));
    whole.insert("title".to_owned(), json!(title));
    Value::Object(whole)
}

type Tables = BTreeMap<String, Vec<Visit>>;

/// A table: all keys that any of its visits asked for, and what holds only beside some word of a choice.
fn table(tables: &Tables, path: &str) -> Map<String, Value> {
    let visits = tables.get(path).map(Vec::as_slice).unwrap_or_default();
    let names: BTreeSet<&str> =
        visits.iter().flat_map(|visit| visit.keys.keys()).map(String::as_str).collect();
    let own = names.iter().filter(|name| !name.contains("[]"));
    let properties: Map<_, _> =
        own.map(|name| ((*name).to_owned(), value(tables, path, visits, name))).collect();
    let mut made = Map::new();
    made.insert("type".to_owned(), json!("object"));
    made.insert("additionalProperties".to_owned(), json!(false));
    made.insert("required".to_owned(), json!(required(visits.iter())));
    let beside = variants(visits);
    if !beside.is_empty() {
        made.insert("allOf".to_owned(), Value::Array(beside));
    }
    made.insert("properties".to_owned(), Value::Object(properties));
    made
}

/// The keys that all of these visits wanted.
fn required<'v>(visits: impl Iterator<Item = &'v Visit> + Clone) -> Vec<&'v str> {
    let wanted = |visit: &Visit, name: &str| visit.keys.get(name).is_some_and(|key| key.required);
    let Some(first) = visits.clone().next() else { return Vec::new() };
    let names = first.keys.keys().filter(|name| visits.clone().all(|visit| wanted(visit, name)));
    names.map(String::as_str).collect()
}

/// What each word of a choice asks for beyond what all do, and what it does not know.
fn variants(visits: &[Visit]) -> Vec<Value> {
    let sets = |visit: &Visit| {
        let own = visit.keys.iter().filter(|(name, _)| !name.contains("[]"));
        own.map(|(name, key)| (name.clone(), key.required)).collect::<Vec<_>>()
    };
    let all: BTreeSet<&str> = visits.iter().flat_map(|visit| visit.keys.keys()).map(String::as_str).collect();
    let mut choices: BTreeSet<&str> =
        visits.iter().flat_map(|visit| visit.chosen.keys()).map(String::as_str).collect();
    choices.retain(|name| !name.contains("[]"));
    // The choice on which the keys depend, if any does: beside one word of it they are the same.
    let by_word = |choice: &str| {
        let mut groups = BTreeMap::<String, Vec<&Visit>>::new();
        for visit in visits {
            if let Some(word) = visit.chosen.get(choice) {
                groups.entry(word.clone()).or_default().push(visit);
            }
        }
        groups
    };
    let differ = |groups: &BTreeMap<String, Vec<&Visit>>| {
        let firsts: BTreeSet<_> =
            groups.values().filter_map(|group| group.first().map(|v| sets(v))).collect();
        firsts.len()
    };
    let Some(choice) = choices.into_iter().max_by_key(|choice| differ(&by_word(choice))) else {
        return Vec::new();
    };
    let groups = by_word(choice);
    if differ(&groups) < 2 {
        return Vec::new();
    }
    let common = required(visits.iter());
    let words = groups.iter().filter(|(word, _)| !word.is_empty());
    words
        .filter_map(|(word, group)| {
            let known: BTreeSet<&str> =
                group.iter().flat_map(|visit| visit.keys.keys()).map(String::as_str).collect();
            let unknown: Map<_, _> = all
                .iter()
                .filter(|name| !known.contains(*name) && !name.contains("[]"))
                .map(|name| ((*name).to_owned(), json!(false)))
                .collect();
            let more: Vec<_> =
                required(group.iter().copied()).into_iter().filter(|name| !common.contains(name)).collect();
            (!more.is_empty() || !unknown.is_empty()).then(|| {
                json!({
                    "if": { "properties": { choice: { "const": word } }, "required": [choice] },
                    "then": { "required": more, "properties": unknown },
                })
            })
        })
        .collect()
}

/// What a key's value may be: any of the shapes that it was asked for in.
fn value(tables: &Tables, path: &str, visits: &[Visit], name: &str) -> Value {
    let mut shapes: Vec<&Shape> = Vec::new();
    for key in visits.iter().filter_map(|visit| visit.keys.get(name)) {
        let Key { shapes: more, .. } = key;
        for shape in more {
            if !shapes.contains(&shape) {
                shapes.push(shape);
            }
        }
    }
    // A text that must be one of some words is one of those words.
    if shapes.iter().any(|shape| matches!(shape, Shape::Choice(_))) {
        shapes.retain(|shape| **shape != Shape::Text);
    }
    let here = if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
    let mut any: Vec<Value> = Vec::new();
    for shape in shapes {
        let one = shaped(tables, path, visits, name, &here, shape);
        if !any.contains(&one) {
            any.push(one);
        }
    }
    match any.len() {
        0 => json!({}),
        1 => any.pop().unwrap_or_default(),
        _ => json!({ "anyOf": any }),
    }
}

fn shaped(tables: &Tables, path: &str, visits: &[Visit], name: &str, here: &str, shape: &Shape) -> Value {
    match shape {
        Shape::Quantity(dimension, bounds) => {
            let (low, high, excluded) = bounds.ends();
            let least = if excluded { "exclusiveMinimum" } else { "minimum" };
            let units: Vec<_> = dimension.unit_names().map(escaped).collect();
            let pattern = format!(r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*({})\s*$", units.join("|"));
            json!({
                "description": bounds.describe(*dimension),
                "anyOf": [
                    { "type": "number", least: low, "maximum": high },
                    { "type": "string", "pattern": pattern },
                ],
            })
        }
        Shape::Number => json!({ "type": "number" }),
        Shape::Integer(low, high) => json!({ "type": "integer", "minimum": low, "maximum": high }),
        Shape::Text => json!({ "type": "string", "pattern": r"\S" }),
        Shape::Boolean => json!({ "type": "boolean" }),
        Shape::Choice(words) => json!({ "enum": words }),
        Shape::Table => Value::Object(table(tables, here)),
        Shape::NamedNumbers => {
            json!({ "type": "object", "additionalProperties": { "type": "number" } })
        }
        Shape::List => {
            let items = value(tables, path, visits, &format!("{name}[]"));
            json!({ "type": "array", "items": items })
        }
    }
}

/// A unit's name within a regular expression.
fn escaped(unit: &str) -> String {
    unit.replace('^', r"\^")
}
