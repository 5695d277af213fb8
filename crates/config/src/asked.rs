//! What a reader asks of a file, noted while it reads: which keys each table has, which of them must be there, what their
//! values may be. A schema for editors is made from it ([`crate::schema`]), so there is no second list of keys.

use crate::bounds::Bounds;
use crate::units::Dimension;
use std::cell::RefCell;
use std::collections::BTreeMap;

/// What a value may be.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Shape {
    /// A number in SI, or a text with a unit.
    Quantity(Dimension, Bounds),
    /// A number; its range is the model's.
    Number,
    /// A whole number from the first to the second.
    Integer(u64, u64),
    /// A text that says something.
    Text,
    /// True or false.
    Boolean,
    /// One of these words.
    Choice(Vec<String>),
    /// A table; its keys are a visit of their own.
    Table,
    /// A table of numbers, whose keys the user chooses.
    NamedNumbers,
    /// A list; its elements are noted under the key with `[]` behind it.
    List,
}

/// A key that was asked for.
#[derive(Debug, Clone, Default)]
pub(crate) struct Key {
    pub(crate) required: bool,
    pub(crate) shapes: Vec<Shape>,
}

/// A table that was read.
#[derive(Debug, Clone, Default)]
pub(crate) struct Visit {
    /// Its path, with `[]` for each index.
    pub(crate) path: String,
    pub(crate) keys: BTreeMap<String, Key>,
    /// The words that its choices had: which keys there are may depend on them.
    pub(crate) chosen: BTreeMap<String, String>,
}

/// All that was asked, where that is noted.
#[derive(Debug, Default)]
pub(crate) struct Asked {
    visits: Option<RefCell<Vec<Visit>>>,
}

impl Asked {
    /// Notes everything.
    pub(crate) fn noting() -> Self {
        Self { visits: Some(RefCell::default()) }
    }

    /// A table is read; its number.
    pub(crate) fn visit(&self, path: &str) -> usize {
        let Some(visits) = &self.visits else { return 0 };
        let mut visits = visits.borrow_mut();
        visits.push(Visit { path: without_indices(path), ..Visit::default() });
        visits.len() - 1
    }

    /// The value at a path within a visited table is asked for.
    pub(crate) fn note(&self, visit: usize, path: &str, note: impl FnOnce(&mut Key)) {
        self.each(visit, path, |visit, key| note(visit.keys.entry(key).or_default()));
    }

    /// A value may have this shape.
    pub(crate) fn shape(&self, visit: usize, path: &str, shape: Shape) {
        self.note(visit, path, |key| {
            if !key.shapes.contains(&shape) {
                key.shapes.push(shape);
            }
        });
    }

    /// A choice has this word.
    pub(crate) fn chosen(&self, visit: usize, path: &str, word: &str) {
        self.each(visit, path, |visit, key| _ = visit.chosen.insert(key, word.to_owned()));
    }

    fn each(&self, visit: usize, path: &str, act: impl FnOnce(&mut Visit, String)) {
        let Some(visits) = &self.visits else { return };
        if let Some(visit) = visits.borrow_mut().get_mut(visit) {
            let path = without_indices(path);
            let key = path.strip_prefix(&visit.path).unwrap_or(&path).trim_start_matches('.').to_owned();
            act(visit, key);
        }
    }

    /// What was noted.
    pub(crate) fn into_visits(self) -> Vec<Visit> {
        self.visits.map(RefCell::into_inner).unwrap_or_default()
    }
}

/// `effect[3].id` as `effect[].id`.
fn without_indices(path: &str) -> String {
    let mut inside = false;
    path.chars()
        .filter(|c| {
            let digit = inside && c.is_ascii_digit();
            inside = *c == '[' || digit;
            !digit
        })
        .collect()
}
