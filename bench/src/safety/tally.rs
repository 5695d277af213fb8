//! Trials counted by kind of fault.

use crate::output::Sheet;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// No more findings are kept in words.
const MOST_WORDS: usize = 50;

/// What one trial came to.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Kind of the fault.
    pub fault: String,
    /// All of it, to do it again.
    pub exact: String,
    /// Whether the valve was stopped for it.
    pub stopped: bool,
    /// Cycles from the fault to the ramp's first, where the valve was stopped; and what they are bounded by.
    pub reaction: Option<(u64, u64)>,
    /// Cycles from the fault to the last pulse, alike.
    pub standstill: Option<(u64, u64)>,
    /// Everything that must not be, in words.
    pub violations: Vec<String>,
}

impl Outcome {
    /// What came later than its bound: its name, the cycles it took, and the bound.
    pub fn late(&self) -> Vec<(&'static str, u64, u64)> {
        let measured = [("reaction", self.reaction), ("standstill", self.standstill)];
        let late = measured.into_iter().filter_map(|(what, measured)| {
            measured.filter(|(seen, bound)| seen > bound).map(|(seen, bound)| (what, seen, bound))
        });
        late.collect()
    }
}

/// Trials of one kind.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Row {
    trials: u64,
    stopped: u64,
    reaction: Worst,
    standstill: Worst,
    violations: u64,
}

#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Worst {
    seen: Option<u64>,
    bound: u64,
}

impl Worst {
    fn note(&mut self, measured: Option<(u64, u64)>) {
        if let Some((seen, bound)) = measured {
            self.seen = Some(self.seen.unwrap_or(0).max(seen));
            self.bound = self.bound.max(bound);
        }
    }

    fn cells(&self) -> [String; 2] {
        match self.seen {
            Some(seen) => [self.bound.to_string(), seen.to_string()],
            None => ["-".to_owned(), "-".to_owned()],
        }
    }
}

/// All trials.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Tally {
    rows: BTreeMap<String, Row>,
    words: Vec<String>,
}

impl Tally {
    /// Counts a trial. What is beyond its bound is a violation.
    pub fn note(&mut self, mut outcome: Outcome) {
        for (what, seen, bound) in outcome.late() {
            outcome.violations.push(format!("{what} after {seen} cycles, expected at most {bound}"));
        }
        let row = self.rows.entry(outcome.fault).or_default();
        row.trials += 1;
        row.stopped += u64::from(outcome.stopped);
        row.reaction.note(outcome.reaction);
        row.standstill.note(outcome.standstill);
        row.violations += u64::from(!outcome.violations.is_empty());
        for violation in outcome.violations {
            eprintln!("{}: {violation}", outcome.exact);
            if self.words.len() < MOST_WORDS {
                self.words.push(format!("{}: {violation}", outcome.exact));
            }
        }
    }

    /// Counts the trials of another campaign too.
    pub fn add(&mut self, other: Self) {
        for (fault, more) in other.rows {
            let row = self.rows.entry(fault).or_default();
            row.trials += more.trials;
            row.stopped += more.stopped;
            row.violations += more.violations;
            for (worst, seen) in [(&mut row.reaction, more.reaction), (&mut row.standstill, more.standstill)]
            {
                worst.note(seen.seen.map(|cycles| (cycles, seen.bound)));
            }
        }
        self.words.extend(other.words);
    }

    /// Trials with something that must not be.
    pub fn violations(&self) -> u64 {
        self.rows.values().map(|row| row.violations).sum()
    }

    /// What was found, in words.
    pub fn found(&self) -> Value {
        json!(self.words)
    }

    fn total(&self) -> Row {
        let mut total = Row::default();
        for row in self.rows.values() {
            total.trials += row.trials;
            total.stopped += row.stopped;
            total.violations += row.violations;
        }
        total
    }

    /// The table with times.
    pub fn sheet(&self, id: &str, title: &str) -> Sheet {
        let header =
            ["fault", "trials", "stopped", "ramp by", "worst", "last pulse by", "worst", "violations"];
        let mut sheet = Sheet::new(id, title, &header);
        let total = self.total();
        for (fault, row) in self.rows.iter().map(|(k, v)| (k.as_str(), v)).chain([("all", &total)]) {
            let counts = [fault.to_owned(), row.trials.to_string(), row.stopped.to_string()];
            let [ramp, ramp_worst] = row.reaction.cells();
            let [pulse, pulse_worst] = row.standstill.cells();
            let times = [ramp, ramp_worst, pulse, pulse_worst, row.violations.to_string()];
            sheet.row(counts.into_iter().chain(times));
        }
        sheet
    }

    /// The table without.
    pub fn short_sheet(&self, id: &str, title: &str) -> Sheet {
        let mut sheet = Sheet::new(id, title, &["fault", "trials", "violations"]);
        let total = self.total();
        for (fault, row) in self.rows.iter().map(|(k, v)| (k.as_str(), v)).chain([("all", &total)]) {
            sheet.row([fault.to_owned(), row.trials.to_string(), row.violations.to_string()]);
        }
        sheet
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(fault: &str, reaction: Option<(u64, u64)>) -> Outcome {
        Outcome { fault: fault.to_owned(), stopped: reaction.is_some(), reaction, ..Outcome::default() }
    }

    #[test]
    fn two_campaigns_added_up_are_the_one_of_all_their_trials() {
        let trials = [outcome("drop", Some((3, 6))), outcome("delay", None), outcome("drop", Some((7, 6)))];
        let (mut whole, mut parts) = (Tally::default(), [Tally::default(), Tally::default()]);
        for (index, trial) in trials.into_iter().enumerate() {
            whole.note(trial.clone());
            parts[index % 2].note(trial);
        }
        let [mut sum, more] = parts;
        let text = serde_json::to_string(&more).unwrap();
        sum.add(serde_json::from_str(&text).unwrap());
        assert_eq!(sum.sheet("t", "t").rows, whole.sheet("t", "t").rows);
        assert_eq!((sum.violations(), sum.found()), (1, whole.found()));
    }
}
