//! What a diagnosis of a record says, as far as it is looked at.

use serde_json::Value;
use std::path::PathBuf;

/// diagnosis.json, the folder beside it, and how long it took.
pub struct Found {
    /// diagnosis.json.
    pub json: Value,
    /// Its folder.
    pub folder: PathBuf,
    /// Time, s.
    pub wall_s: f64,
}

impl Found {
    /// The causes named.
    pub fn named(&self) -> Vec<&str> {
        ids(self.json.get("causes"))
    }

    /// Whether it is named, or one of a group, or what a law of another form is told to be.
    pub fn names_or_groups(&self, id: &str) -> bool {
        let groups = self.json.get("ambiguous").and_then(Value::as_array);
        let grouped = |group: &Value| {
            let ids = group.get("ids").and_then(Value::as_array);
            ids.is_some_and(|ids| ids.iter().any(|one| one == id))
        };
        self.named().contains(&id)
            || groups.is_some_and(|groups| groups.iter().any(grouped))
            || self.kinds_of_laws().contains(&id)
    }

    /// The causes whose kind the laws without a name are.
    fn kinds_of_laws(&self) -> Vec<&str> {
        let laws = self.json.get("unnamed").and_then(Value::as_array);
        laws.into_iter().flatten().filter_map(|law| law.get("kind")?.as_str()).collect()
    }

    /// A parameter's value, of a cause or of the best of a group.
    pub fn number(&self, id: &str, key: &str) -> Option<f64> {
        let causes = self.json.get("causes")?.as_array()?;
        let cause = causes.iter().find(|cause| cause.get("id").is_some_and(|found| found == id))?;
        cause.get("parameters")?.get(key)?.get("value")?.as_f64()
    }

    /// The amplitude of an order of `position-torque`.
    pub fn order_nm(&self, order: usize) -> Option<f64> {
        let part = |key: &str| self.number("position-torque", &format!("{key}[{order}]"));
        Some(part("cos")?.hypot(part("sin")?))
    }

    /// Whether any of its texts holds all of the words.
    pub fn says(&self, words: &[&str]) -> bool {
        fn any(value: &Value, words: &[&str]) -> bool {
            match value {
                Value::String(text) => words.iter().all(|word| text.contains(word)),
                Value::Array(all) => all.iter().any(|value| any(value, words)),
                Value::Object(all) => all.values().any(|value| any(value, words)),
                _ => false,
            }
        }
        any(&self.json, words)
    }

    /// By what part the error falls on runs held out, or with the best of a group.
    pub fn removed(&self) -> Option<f64> {
        let before = self.json.pointer("/gain/rms_before")?.as_f64()?;
        let of_group = |path: &str| self.json.pointer(path).and_then(Value::as_f64);
        let best =
            of_group("/ambiguous/0/best/rms_after").or_else(|| of_group("/ambiguous/0/rivals/0/rms_after"));
        let after = self.json.pointer("/gain/rms_after").and_then(Value::as_f64)?;
        Some(1.0 - best.map_or(after, |best| best.min(after)) / before)
    }

    /// Verdict, causes and groups in a line.
    pub fn words(&self) -> String {
        let verdict = self.json.get("verdict").and_then(Value::as_str).unwrap_or("no verdict");
        let groups = self.json.get("ambiguous").and_then(Value::as_array);
        let group = |group: &Value| {
            let ids = group.get("ids").and_then(Value::as_array).into_iter().flatten();
            format!("one of ({})", ids.filter_map(Value::as_str).collect::<Vec<_>>().join(", "))
        };
        let groups = groups.into_iter().flatten().map(group);
        let laws = self.kinds_of_laws().into_iter().map(|id| format!("{id} of another form"));
        let all: Vec<String> =
            self.named().into_iter().map(str::to_owned).chain(groups).chain(laws).collect();
        format!("{verdict}: {} in {:.0} s", all.join(" + "), self.wall_s)
    }
}

fn ids(list: Option<&Value>) -> Vec<&str> {
    let list = list.and_then(Value::as_array).into_iter().flatten();
    list.filter_map(|one| one.get("id").and_then(Value::as_str)).collect()
}
