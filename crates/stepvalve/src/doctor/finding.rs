//! What the doctor found about one thing: its state, why it matters, and what to do.

use serde::Serialize;

/// How it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// As a real-time loop wants it.
    Ok,
    /// It works, and could be better.
    Advice,
    /// It stands in the loop's way.
    Problem,
    /// The machine doesn't tell.
    Unknown,
}

/// One thing to look at.
pub struct Topic {
    /// Its name for machines.
    pub id: &'static str,
    /// Its name for people.
    pub what: &'static str,
    /// Why it matters to the loop.
    pub why: &'static str,
}

/// What was found about it.
#[derive(Debug, Clone, Serialize)]
pub struct Finding {
    /// The topic's name for machines.
    pub id: &'static str,
    /// The topic's name for people.
    pub what: &'static str,
    /// How it is.
    pub state: State,
    /// What was seen.
    pub found: String,
    /// Why it matters.
    pub why: &'static str,
    /// What to do; empty where nothing is to be done.
    pub fix: String,
    /// Whether the loop can't hold its period as long as this stays.
    pub blocks: bool,
}

impl Topic {
    /// Good.
    pub fn ok(&self, found: impl Into<String>) -> Finding {
        self.finding(State::Ok, found.into(), String::new())
    }

    /// Could be better.
    pub fn advice(&self, found: impl Into<String>, fix: impl Into<String>) -> Finding {
        self.finding(State::Advice, found.into(), fix.into())
    }

    /// Stands in the way.
    pub fn problem(&self, found: impl Into<String>, fix: impl Into<String>) -> Finding {
        self.finding(State::Problem, found.into(), fix.into())
    }

    /// Can't be known; `found` says what was looked for, `fix` how to find out.
    pub fn unknown(&self, found: impl Into<String>, fix: impl Into<String>) -> Finding {
        self.finding(State::Unknown, format!("unknown: {}", found.into()), fix.into())
    }

    fn finding(&self, state: State, found: String, fix: String) -> Finding {
        Finding { id: self.id, what: self.what, state, found, why: self.why, fix, blocks: false }
    }
}

impl Finding {
    /// The loop can't hold its period as long as this stays.
    pub fn blocking(self) -> Self {
        Self { blocks: true, ..self }
    }
}
