//! `stepvalve schema`: what an editor is told of a file is what the reader takes. Every shipped file is mutated, key by key, and
//! both must refuse the same.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use jsonschema::Validator;
use stepvalve_tests::{TestPlace, repository};
use toml::{Table, Value};

/// Whether a text is a file of its kind.
type Reader = fn(&str) -> bool;

const KINDS: [(&str, &[&str], Reader); 4] = [
    ("scenario", &["rt-config/scenarios", "fuzz/corpus/configuration/limited.toml"], |text| {
        config::parse_scenario(text, "").is_ok()
    }),
    ("model", &["rt-config/models", "fuzz/corpus/configuration/model.toml"], |text| {
        config::parse_model(text, "").is_ok()
    }),
    ("drive", &["rt-config/drives"], |text| config::parse_drive(text, "").is_ok()),
    (
        "plan",
        &[
            "rt-config/campaigns",
            "fuzz/corpus/configuration/campaign.toml",
            "fuzz/corpus/configuration/campaign-grid.toml",
        ],
        |text| config::parse_plan(text, "").is_ok(),
    ),
];

/// Where shipped files of a kind are.
fn folder(kind: &str) -> String {
    if kind == "plan" { "rt-config/campaigns".to_owned() } else { format!("rt-config/{kind}s") }
}

/// What the schema can't say: the reader refuses it, the schema does not.
fn only_the_reader_knows(kind: &str, mutation: &str) -> bool {
    // Which numbers a valve can have, the model's own checks say, after the reader.
    if kind == "model" && mutation.ends_with(": huge") {
        return true;
    }
    // What a text says and which number is greater; one of four kinds of values, and levels in a grid alone.
    let told = [": a word", ": huge", ": a list", ": gone"].iter().any(|end| mutation.ends_with(end));
    if kind == "plan" && told && (mutation.starts_with("vary.") || mutation.starts_with("failure_limit")) {
        return true;
    }
    [
        // Needed unless [seals] or [clearance] gives them.
        "friction.coulomb_torque_nm: gone",
        "friction.static_torque_nm: gone",
        "friction.viscous_nm_s_per_rad: gone",
        // Both or none.
        "limits.min_angle: gone",
        "limits.max_angle: gone",
        // Exactly one kind a set-point.
        "set_point",
        // An encoder that is not there; effects whose keys need each other; sections that need each other.
        "encoder.",
        "encoder: ",
        "effect",
        "oil: gone",
        // Phases in their order.
        "timing.step-controller: gone",
        "timing.step-controller.phase: gone",
        // A whole number that may be negative.
        "homing.offset: huge",
    ]
    .iter()
    .any(|beginning| mutation.starts_with(beginning))
}

fn texts(places: &[&str]) -> Vec<String> {
    let files = places.iter().flat_map(|place| {
        let path = repository().join(place);
        if path.is_file() {
            return vec![path];
        }
        let entries = std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path());
        entries.filter(|path| path.extension().is_some_and(|kind| kind == "toml")).collect()
    });
    files.map(|path| std::fs::read_to_string(path).unwrap()).collect()
}

fn schema(kind: &str) -> Validator {
    let printed = TestPlace::new().stepvalve(&["schema", kind]).expect_code(0).stdout;
    jsonschema::validator_for(&serde_json::from_str(&printed).unwrap()).unwrap()
}

/// What a value may become.
fn wrong() -> [(&'static str, Value); 6] {
    [
        ("empty", Value::String(String::new())),
        ("a word", Value::String("nonsense".to_owned())),
        ("true", Value::Boolean(true)),
        ("huge", Value::Float(-1e300)),
        ("a list", Value::Array(vec![Value::Boolean(true)])),
        ("a table", Value::Table(Table::from_iter([("x".to_owned(), Value::Integer(1))]))),
    ]
}

/// Every table with a key too many, every key gone, every value another: with the path and what was done.
fn mutations(whole: &Value) -> Vec<(String, Value)> {
    let mut found = Vec::new();
    let mut note = |what: String, mutated: Value| found.push((what, mutated));
    for path in paths(whole) {
        let shown = path.join(".");
        if let Some(Value::Table(_)) = get(whole, &path) {
            let mut more = whole.clone();
            let Some(Value::Table(table)) = get_mut(&mut more, &path) else { panic!() };
            table.insert("no_such_key".to_owned(), Value::Integer(1));
            note(format!("{shown}: a key too many"), more);
        }
        let Some((last, above)) = path.split_last() else { continue };
        let mut less = whole.clone();
        if let Some(Value::Table(table)) = get_mut(&mut less, above) {
            table.remove(last);
            note(format!("{shown}: gone"), less);
        }
        for (what, value) in wrong() {
            let mut other = whole.clone();
            *get_mut(&mut other, &path).unwrap() = value;
            note(format!("{shown}: {what}"), other);
        }
    }
    found
}

fn paths(value: &Value) -> Vec<Vec<String>> {
    let mut found = vec![Vec::new()];
    let children: Vec<(String, &Value)> = match value {
        Value::Table(table) => table.iter().map(|(key, value)| (key.clone(), value)).collect(),
        Value::Array(list) => {
            list.iter().enumerate().map(|(index, value)| (index.to_string(), value)).collect()
        }
        _ => Vec::new(),
    };
    for (key, child) in children {
        found.extend(paths(child).into_iter().map(|below| [vec![key.clone()], below].concat()));
    }
    found
}

fn get<'v>(value: &'v Value, path: &[String]) -> Option<&'v Value> {
    path.iter().try_fold(value, |value, key| match value {
        Value::Array(list) => list.get(key.parse::<usize>().ok()?),
        value => value.get(key),
    })
}

fn get_mut<'v>(value: &'v mut Value, path: &[String]) -> Option<&'v mut Value> {
    path.iter().try_fold(value, |value, key| match value {
        Value::Array(list) => list.get_mut(key.parse::<usize>().ok()?),
        value => value.get_mut(key),
    })
}

#[test]
fn schema_and_reader_refuse_the_same() {
    let (mut tried, mut looser) = (0, Vec::new());
    for (kind, places, reads) in KINDS {
        let schema = schema(kind);
        let fits = |value: &Value| schema.is_valid(&serde_json::to_value(value).unwrap());
        for text in texts(places) {
            let whole: Value = toml::from_str(&text).unwrap();
            assert!(reads(&text) && fits(&whole), "{kind}:\n{text}");
            for (what, mutated) in mutations(&whole) {
                tried += 1;
                match (reads(&toml::to_string(&mutated).unwrap()), fits(&mutated)) {
                    (true, false) => panic!("{kind}: {what}: the schema refuses what the reader takes"),
                    (false, true) if !only_the_reader_knows(kind, &what) => {
                        looser.push(format!("{kind}: {what}"))
                    }
                    _ => {}
                }
            }
        }
    }
    looser.sort();
    looser.dedup();
    assert!(looser.is_empty(), "of {tried}, the reader alone refuses:\n{}", looser.join("\n"));
    assert!(tried > 5000, "{tried}");
}

#[test]
fn the_shipped_schemas_are_what_the_command_prints() {
    for (kind, _, _) in KINDS {
        let printed = TestPlace::new().stepvalve(&["schema", kind]).expect_code(0).stdout;
        let path = repository().join("rt-config/schemas").join(format!("{kind}.json"));
        let shipped = std::fs::read_to_string(&path).unwrap();
        assert!(printed == shipped, "stepvalve schema {kind} > {}", path.display());
        let folder = repository().join(folder(kind));
        for entry in std::fs::read_dir(folder).unwrap().flatten() {
            let text = std::fs::read_to_string(entry.path()).unwrap();
            let line = format!("#:schema ../schemas/{kind}.json\n");
            assert!(text.starts_with(&line), "{} does not begin with {line}", entry.path().display());
        }
    }
}
