//! Values of a scenario or model text, found and changed by their paths, everything else left as it stands.
//!
//! A path is written as errors write it: `friction.coulomb_torque_nm`, `set_point[0].angle`, with indices from 0.

use toml_edit::{Decor, DocumentMut, Item, TableLike, Value};

use crate::suggest::most_alike;

/// How many alike paths are named for one that is not there.
const ALIKE: usize = 3;

/// No number has more characters.
const LONGEST_NUMBER: usize = 64;

/// A value that can be changed.
#[derive(Debug, Clone, PartialEq)]
pub enum Setting {
    /// A number with the unit that stands behind it; the unit is empty for a bare number.
    Number {
        /// The number, in this unit.
        number: f64,
        /// As in "17deg".
        unit: String,
    },
    /// Any other text.
    Word(String),
    /// True or false.
    Flag(bool),
}

impl Setting {
    /// A text as a number with its unit, if it begins with a number; else as a word.
    #[must_use]
    pub fn of_text(text: &str) -> Self {
        let (number, unit) = number_and_unit(text);
        match number.parse() {
            Ok(number) if f64::is_finite(number) => Self::Number { number, unit: unit.to_owned() },
            _ => Self::Word(text.to_owned()),
        }
    }

    /// As a person would write it.
    #[must_use]
    pub fn shown(&self) -> String {
        match self {
            Self::Number { number, unit } => format!("{number:?}{unit}"),
            Self::Word(word) => word.clone(),
            Self::Flag(flag) => flag.to_string(),
        }
    }

    /// As TOML; a whole number stays one where `whole` is asked for.
    fn value(&self, whole: bool) -> Value {
        match self {
            Self::Number { number, unit } if unit.is_empty() => match whole_number(*number).filter(|_| whole)
            {
                Some(whole) => Value::from(whole),
                // The shortest text that reads back as the same bits.
                None => format!("{number:?}").parse().unwrap_or_else(|_| Value::from(*number)),
            },
            Self::Number { .. } => Value::from(self.shown()),
            Self::Word(word) => Value::from(word.as_str()),
            Self::Flag(flag) => Value::from(*flag),
        }
    }

    fn of(value: &Value) -> Option<Self> {
        let number = |number: f64| Self::Number { number, unit: String::new() };
        match value {
            Value::Integer(integer) => Some(number(*integer.value() as f64)),
            Value::Float(float) => Some(number(*float.value())),
            Value::String(text) => Some(Self::of_text(text.value())),
            Value::Boolean(flag) => Some(Self::Flag(*flag.value())),
            _ => None,
        }
    }
}

/// A whole number that a double and TOML hold exactly.
fn whole_number(number: f64) -> Option<i64> {
    const EXACT: f64 = 9_007_199_254_740_992.0;
    (number.fract() == 0.0 && number.abs() < EXACT).then_some(number as i64)
}

/// Splits "1e-3 rad" behind its number.
fn number_and_unit(text: &str) -> (&str, &str) {
    let text = text.trim();
    let mut ends: Vec<usize> =
        text.char_indices().take(LONGEST_NUMBER).map(|(at, c)| at + c.len_utf8()).collect();
    ends.retain(|end| text.get(..*end).is_some_and(is_number));
    let longest = ends.last().copied().unwrap_or(0);
    let (number, unit) = text.split_at(longest);
    (number, unit.trim())
}

/// Words such as "inf" are none.
fn is_number(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
        && text.ends_with(|c: char| c.is_ascii_digit() || c == '.')
        && text.parse::<f64>().is_ok()
}

/// A part of a path.
enum Step<'p> {
    Key(&'p str),
    Index(usize),
}

/// The parts of a path; `None` where it is none.
fn steps(path: &str) -> Option<Vec<Step<'_>>> {
    let mut steps = Vec::new();
    for part in path.split('.') {
        let mut pieces = part.split('[');
        let key = pieces.next().filter(|key| !key.is_empty())?;
        steps.push(Step::Key(key));
        for index in pieces {
            steps.push(Step::Index(index.strip_suffix(']')?.parse().ok()?));
        }
    }
    Some(steps)
}

/// A text whose values can be changed.
#[derive(Debug, Clone, Default)]
pub struct Editable {
    document: DocumentMut,
}

impl Editable {
    /// Of a text; `None` where it is no TOML.
    #[must_use]
    pub fn new(text: &str) -> Option<Self> {
        Some(Self { document: text.parse().ok()? })
    }

    /// The value at a path; `None` where there is none, or one that is no number, text or truth value.
    #[must_use]
    pub fn get(&self, path: &str) -> Option<Setting> {
        let mut item = self.document.as_item();
        for step in steps(path)? {
            item = match step {
                Step::Key(key) => item.get(key)?,
                Step::Index(index) => item.get(index)?,
            };
        }
        Setting::of(item.as_value()?)
    }

    /// The paths of all values that can be changed, in the order of the text.
    #[must_use]
    pub fn paths(&self) -> Vec<String> {
        let mut paths = Vec::new();
        collect(self.document.as_table(), "", &mut paths);
        paths
    }

    /// The paths that are most like one that is not there.
    #[must_use]
    pub fn alike(&self, path: &str) -> Vec<String> {
        most_alike(path, &self.paths(), ALIKE).into_iter().map(str::to_owned).collect()
    }

    /// The text with values in place of its own. A key that is missing in its table is added; `None` where its table is missing.
    #[must_use]
    pub fn with<'s>(&self, changes: impl IntoIterator<Item = (&'s str, &'s Setting)>) -> Option<String> {
        let mut document = self.document.clone();
        for (path, setting) in changes {
            set(document.as_item_mut(), &steps(path)?, setting)?;
        }
        Some(document.to_string())
    }
}

fn set(item: &mut Item, steps: &[Step<'_>], setting: &Setting) -> Option<()> {
    match steps {
        [] => {
            let value = item.as_value_mut()?;
            let decor: Decor = value.decor().clone();
            *value = setting.value(value.is_integer());
            *value.decor_mut() = decor;
            Some(())
        }
        [Step::Key(key)] if item.get(key).is_none() => {
            item.as_table_like_mut()?.insert(key, Item::Value(setting.value(true)));
            Some(())
        }
        [Step::Key(key), rest @ ..] => set(item.get_mut(key)?, rest, setting),
        [Step::Index(index), rest @ ..] => set(item.get_mut(*index)?, rest, setting),
    }
}

fn collect(table: &dyn TableLike, path: &str, paths: &mut Vec<String>) {
    for (key, item) in table.iter() {
        collect_item(item, &if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }, paths);
    }
}

fn collect_item(item: &Item, path: &str, paths: &mut Vec<String>) {
    if let Some(table) = item.as_table_like() {
        return collect(table, path, paths);
    }
    if item.as_value().is_some_and(|value| Setting::of(value).is_some()) {
        paths.push(path.to_owned());
    }
    let mut index = 0;
    while let Some(element) = item.get(index).filter(|_| item.is_array_of_tables() || item.is_array()) {
        collect_item(element, &format!("{path}[{index}]"), paths);
        index += 1;
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const TEXT: &str = "a = 1 # one\nb = \"17 deg\"\n[table]\nc = 2.5\nd = true\nword = \"hold\"\n\
                        [[list]]\nsine = { amplitude = \"0.2rad\" }\n[[list]]\nknots = [[1.0, 2.0]]\n";

    fn number(number: f64, unit: &str) -> Setting {
        Setting::Number { number, unit: unit.to_owned() }
    }

    #[test]
    fn paths_lead_to_values() {
        let text = Editable::new(TEXT).unwrap();
        let paths = text.paths();
        let expected =
            "a b table.c table.d table.word list[0].sine.amplitude list[1].knots[0][0] list[1].knots[0][1]";
        assert_eq!(paths.join(" "), expected);
        assert!(paths.iter().all(|path| text.get(path).is_some()), "{paths:?}");
        assert_eq!(text.get("b"), Some(number(17.0, "deg")));
        assert_eq!(text.get("list[0].sine.amplitude"), Some(number(0.2, "rad")));
        assert_eq!(text.get("table.word"), Some(Setting::Word("hold".to_owned())));
        for none in
            ["", "x", "table", "table.c.x", "list[2].sine", "list[x]", "list[0", "a[0]", ".", "table..c"]
        {
            assert_eq!(text.get(none), None, "{none}");
        }
        assert_eq!(text.alike("tabel.c").first().map(String::as_str), Some("table.c"));
    }

    #[test]
    fn a_change_leaves_the_rest() {
        let text = Editable::new(TEXT).unwrap();
        assert_eq!(text.with([]).unwrap(), TEXT);
        let (five, eighteen, off) = (number(5.0, ""), number(18.5, "deg"), Setting::Flag(false));
        let changed =
            text.with([("a", &five), ("b", &eighteen), ("table.d", &off), ("table.e", &five)]).unwrap();
        let expected = TEXT.replace("a = 1", "a = 5").replace("17 deg", "18.5deg").replace("true", "false");
        assert_eq!(changed, expected.replace("\"hold\"\n", "\"hold\"\ne = 5\n"));
        assert_eq!(text.with([("none.e", &five)]), None);
        let tiny = number(1e-300, "");
        assert!(text.with([("table.c", &tiny)]).unwrap().contains("c = 1e-300"));
        let whole = number(3.0, "");
        assert!(text.with([("table.c", &whole)]).unwrap().contains("c = 3.0"));
    }

    #[test]
    fn numbers_and_their_units() {
        for (text, expected) in [
            ("17deg", number(17.0, "deg")),
            ("-1e-3 rad/s", number(-1e-3, "rad/s")),
            ("1.5e3", number(1500.0, "")),
            ("50%", number(50.0, "%")),
            ("1e5Hz", number(1e5, "Hz")),
            ("full", Setting::Word("full".to_owned())),
            ("inf", Setting::Word("inf".to_owned())),
            ("-", Setting::Word("-".to_owned())),
            ("", Setting::Word(String::new())),
        ] {
            assert_eq!(Setting::of_text(text), expected, "{text}");
        }
    }
}
