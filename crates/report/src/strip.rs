//! What was the case when: named intervals and marks on the time axis.

use serde_json::{Value, json};

/// More intervals than this in a strip are joined, so that a signal that flaps all day does not swell the page.
const MAX_INTERVALS: usize = 4000;

/// How much an interval or a mark matters; decides its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// At rest, nothing of note.
    Neutral,
    /// At work, as it should be.
    Normal,
    /// Limited, degraded, stopping.
    Attention,
    /// Failed.
    Fault,
}

impl Level {
    fn number(self) -> u8 {
        match self {
            Self::Neutral => 0,
            Self::Normal => 1,
            Self::Attention => 2,
            Self::Fault => 3,
        }
    }
}

/// A stretch of time in which something was the case.
#[derive(Debug, Clone, PartialEq)]
pub struct Interval {
    /// Begin (s).
    pub from_s: f64,
    /// End (s).
    pub to_s: f64,
    /// What was the case.
    pub label: String,
    /// How much it matters.
    pub level: Level,
}

/// A row of intervals: the controller's state, the active limit, the fault.
#[derive(Debug, Clone, PartialEq)]
pub struct Strip {
    /// Its name.
    pub name: String,
    /// Its intervals in the order of time; where there is none, the strip is empty.
    pub intervals: Vec<Interval>,
}

/// A moment of note: a fault, a set-point, an operator's mark. A line through all plots.
#[derive(Debug, Clone, PartialEq)]
pub struct Marker {
    /// When (s).
    pub time_s: f64,
    /// What happened.
    pub label: String,
    /// How much it matters.
    pub level: Level,
}

impl Strip {
    /// From a signal of codes: one interval for each stretch of the same code, until the next sample that differs.
    /// `meaning` gives label and level, None for codes that leave the strip empty; so do missing samples (NaN).
    pub fn from_codes(
        name: impl Into<String>,
        time_s: &[f64],
        codes: impl IntoIterator<Item = f64>,
        meaning: impl Fn(u64) -> Option<(String, Level)>,
    ) -> Self {
        let mut intervals: Vec<Interval> = Vec::new();
        let mut open: Option<f64> = None;
        for (&time, code) in time_s.iter().zip(codes) {
            if let (Some(_), Some(last)) = (open, intervals.last_mut()) {
                last.to_s = time;
            }
            if open == Some(code) {
                continue;
            }
            open = None;
            let known = if code >= 0.0 { meaning(code as u64) } else { None };
            if let Some((label, level)) = known {
                open = Some(code);
                intervals.push(Interval { from_s: time, to_s: time, label, level });
            }
        }
        Self { name: name.into(), intervals }
    }

    pub(crate) fn to_json(&self) -> Value {
        let joined = joined(&self.intervals);
        let rows: Vec<Value> =
            joined.iter().map(|i| json!([i.from_s, i.to_s, i.label, i.level.number()])).collect();
        json!({ "name": self.name, "intervals": rows })
    }
}

impl Marker {
    pub(crate) fn to_json(&self) -> Value {
        json!([self.time_s, self.label, self.level.number()])
    }
}

/// The intervals, those that begin within the same four-thousandth of the span joined where there are too many.
/// The most serious gives its name and level.
fn joined(intervals: &[Interval]) -> Vec<Interval> {
    let (Some(first), Some(last)) = (intervals.first(), intervals.last()) else { return Vec::new() };
    if intervals.len() <= MAX_INTERVALS {
        return intervals.to_vec();
    }
    let cell_s = (last.from_s - first.from_s) / MAX_INTERVALS as f64;
    let cell = |interval: &Interval| ((interval.from_s - first.from_s) / cell_s).floor();
    let mut joined: Vec<(f64, usize, Interval)> = Vec::new();
    for interval in intervals {
        match joined.last_mut() {
            Some((at, count, all)) if *at == cell(interval) => {
                *count += 1;
                all.to_s = all.to_s.max(interval.to_s);
                if interval.level > all.level {
                    all.level = interval.level;
                    all.label.clone_from(&interval.label);
                }
            }
            _ => joined.push((cell(interval), 1, interval.clone())),
        }
    }
    let named = joined.into_iter().map(|(_, count, mut all)| {
        if count > 1 {
            all.label = format!("{} and {} more", all.label, count - 1);
        }
        all
    });
    named.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(code: u64) -> Option<(String, Level)> {
        (code > 0).then(|| (format!("state {code}"), if code == 3 { Level::Fault } else { Level::Normal }))
    }

    #[test]
    fn codes_become_intervals() {
        let time = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let strip = Strip::from_codes("state", &time, [0.0, 1.0, 1.0, f64::NAN, 2.0, 3.0], state);
        let found: Vec<_> = strip.intervals.iter().map(|i| (i.from_s, i.to_s, i.label.as_str())).collect();
        assert_eq!(found, [(1.0, 3.0, "state 1"), (4.0, 5.0, "state 2"), (5.0, 5.0, "state 3")]);
    }

    #[test]
    fn a_flapping_signal_is_joined_and_keeps_its_faults() {
        let time: Vec<f64> = (0..1_000_000).map(|k| f64::from(k) * 1e-3).collect();
        let codes = (0..1_000_000).map(|k| if k == 777_777 { 3.0 } else { f64::from(1 + k % 2) });
        let strip = Strip::from_codes("state", &time, codes, state);
        let joined = joined(&strip.intervals);
        assert!(joined.len() <= MAX_INTERVALS + 1, "{}", joined.len());
        let fault = joined.iter().find(|interval| interval.level == Level::Fault).unwrap();
        assert!(fault.from_s <= 777.777 && 777.777 <= fault.to_s, "{fault:?}");
        assert!(fault.label.starts_with("state 3 and "), "{fault:?}");
    }
}
