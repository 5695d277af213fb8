//! Holds a finding against the truth.

use crate::truth::{Imperfect, Truth};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

/// What a finding is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Outcome {
    /// Exactly what is hidden, and where these data can't tell: that they can't; where they hardly can, either.
    Right,
    /// Some of what is hidden, and nothing else.
    Part,
    /// Reported as one of a group that can't be told apart, or the right name where the data hold no reason for it.
    Ambiguous,
    /// Nothing named; where nothing is hidden in the real family: something is said to be left, and nothing accused.
    Missed,
    /// A name that is not hidden.
    Wrong,
}

/// What a diagnosis that ends says; anything else is none.
const VERDICTS: [&str; 5] = ["explained", "partly-explained", "ambiguous", "unexplained", "no-discrepancy"];
/// A number found off by so many tolerances is within them.
const WITHIN: f64 = 2.0;

/// A finding as far as it is judged.
#[derive(Debug, Clone, Default)]
pub struct Finding {
    /// The verdict.
    pub verdict: String,
    /// Causes named.
    pub named: BTreeSet<String>,
    /// Groups that can't be told apart.
    pub groups: Vec<BTreeSet<String>>,
    /// The factors by which numbers are off that are named, or are the best of a group.
    pub factors: BTreeMap<String, f64>,
    /// The interval of a named delay, s.
    pub delay_s: Option<[f64; 2]>,
}

/// A parameter's interval beside the truth.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Interval {
    /// "effect: parameter".
    pub of: String,
    /// What is true.
    pub truth: f64,
    /// What was found.
    pub value: f64,
    /// The 95 % interval.
    pub ci95: [f64; 2],
}

impl Interval {
    /// Whether it holds the truth.
    pub fn holds(&self) -> bool {
        self.ci95[0] <= self.truth && self.truth <= self.ci95[1]
    }
}

impl Finding {
    /// What `diagnosis.json` says.
    pub fn of(diagnosis: &Value) -> Self {
        let id = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
        Self {
            verdict: id(&diagnosis["verdict"]),
            named: list(&diagnosis["causes"]).iter().map(|cause| id(&cause["id"])).collect(),
            groups: list(&diagnosis["ambiguous"])
                .iter()
                .map(|group| list(&group["ids"]).iter().map(id).collect())
                .collect(),
            factors: list(&diagnosis["causes"])
                .iter()
                .chain(list(&diagnosis["ambiguous"]).iter().map(|group| &group["best"]))
                .filter_map(|cause| {
                    let factor = cause["parameters"]["factor"]["value"].as_f64()?;
                    Some((id(&cause["id"]), factor))
                })
                .collect(),
            delay_s: list(&diagnosis["causes"]).iter().find_map(|cause| {
                let ci95 = &cause["parameters"]["delay_s"]["ci95"];
                Some([ci95[0].as_f64()?, ci95[1].as_f64()?])
            }),
        }
    }

    /// The same without what may be said of an imperfect measurement: numbers within their tolerance, and what is true
    /// though it isn't hidden. A transducer is late even where it hardly shows: a delay whose interval holds its lag is true.
    fn beyond(&self, imperfect: &Imperfect, hidden: &BTreeSet<String>) -> Self {
        let lag = self.delay_s.zip(imperfect.torque_lag_s);
        let late = lag.is_some_and(|([least, most], lag)| (least..=most).contains(&lag));
        let true_too = |id: &String| imperfect.also_true.contains(id) || (late && id == "sensor-delay");
        let known = |id: &String| true_too(id) && !hidden.contains(id);
        let within = |id: &String| {
            let off = self.factors.get(id).map_or(f64::INFINITY, |factor| (factor - 1.0).abs());
            off <= WITHIN * imperfect.tolerance && !hidden.contains(id)
        };
        let mut left = self.clone();
        left.named.retain(|id| !known(id) && !within(id));
        left.groups.retain(|group| !group.iter().any(|id| known(id) || within(id)));
        left
    }

    /// Whether everything hidden is named, by itself or in a group with its near twins alone.
    fn names_beside(&self, listed: &BTreeSet<String>, near_twins: &[String]) -> bool {
        let known = |id: &String| listed.contains(id) || near_twins.contains(id);
        let named =
            |id: &String| self.named.contains(id) || self.groups.iter().any(|group| group.contains(id));
        !near_twins.is_empty()
            && self.groups.iter().all(|group| group.iter().all(known))
            && listed.iter().all(named)
    }

    /// The causes named that are not true: neither hidden nor what the instruments have anyway.
    pub fn named_wrongly(&self, truth: &Truth) -> BTreeSet<String> {
        let hidden: BTreeSet<String> = truth.effects.iter().map(|effect| effect.id.clone()).collect();
        let left = truth.imperfect.as_ref().map_or_else(|| self.clone(), |of| self.beyond(of, &hidden));
        left.named.into_iter().filter(|id| !hidden.contains(id)).collect()
    }

    /// Judges it.
    pub fn judge(&self, truth: &Truth) -> Outcome {
        let hidden: BTreeSet<String> = truth.effects.iter().map(|effect| effect.id.clone()).collect();
        match &truth.imperfect {
            Some(imperfect) => self.beyond(imperfect, &hidden).judge_by(truth, &hidden),
            None => self.judge_by(truth, &hidden),
        }
    }

    fn judge_by(&self, truth: &Truth, hidden: &BTreeSet<String>) -> Outcome {
        let listed: BTreeSet<String> =
            hidden.iter().filter(|id| !id.starts_with("outside-")).cloned().collect();
        if self.named.iter().any(|id| !listed.contains(id)) {
            return Outcome::Wrong;
        }
        let grouped = |id: &String| self.groups.iter().any(|group| group.contains(id));
        let silent = self.named.is_empty() && self.groups.is_empty();
        if !truth.twins.is_empty() {
            let group = self.groups.iter().any(|group| {
                hidden.iter().all(|id| group.contains(id)) && truth.twins.iter().any(|id| group.contains(id))
            });
            return match (group, silent) {
                (true, _) if self.verdict == "ambiguous" => Outcome::Right,
                (_, true) => Outcome::Missed,
                _ => Outcome::Ambiguous,
            };
        }
        let outside = listed.len() < hidden.len();
        if !VERDICTS.contains(&self.verdict.as_str()) {
            // Of an imperfect measurement a false alarm is a cause accused, and none is.
            let clean = hidden.is_empty() && truth.imperfect.is_none();
            return if clean { Outcome::Wrong } else { Outcome::Missed };
        }
        match () {
            () if hidden.is_empty() && silent && self.verdict == "no-discrepancy" => Outcome::Right,
            // An imperfect model leaves something; what counts is that no cause is accused of it.
            () if hidden.is_empty() && silent && truth.imperfect.is_some() => match self.verdict.as_str() {
                "unexplained" => Outcome::Missed,
                _ => Outcome::Right,
            },
            () if hidden.is_empty() => Outcome::Wrong,
            () if outside && silent && self.verdict == "no-discrepancy" => Outcome::Missed,
            () if outside && silent => Outcome::Right,
            () if outside => Outcome::Ambiguous,
            () if self.named == listed || self.names_beside(&listed, &truth.near_twins) => Outcome::Right,
            () if listed.iter().any(grouped) => Outcome::Ambiguous,
            () if !self.named.is_empty() => Outcome::Part,
            () if !self.groups.is_empty() => Outcome::Wrong,
            () => Outcome::Missed,
        }
    }
}

/// The intervals of the parameters that rig and finding share, of effects named rightly. `of_same_form` alone, or
/// those of another form alone, whose truth is then to be replaced by a best fit.
pub fn intervals(truth: &Truth, diagnosis: &Value, of_same_form: bool) -> Vec<Interval> {
    let mut found = Vec::new();
    for effect in truth.effects.iter().filter(|effect| effect.same_form == of_same_form) {
        let causes = diagnosis["causes"].as_array().cloned().unwrap_or_default();
        let Some(cause) = causes.into_iter().find(|cause| cause["id"] == effect.id.as_str()) else {
            continue;
        };
        for (key, parameter) in cause["parameters"].as_object().into_iter().flatten() {
            let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
            let ci95 = [number(&parameter["ci95"][0]), number(&parameter["ci95"][1])];
            if ci95[0] == ci95[1] {
                continue;
            }
            let of = format!("{}: {key}", effect.id);
            let value = number(&parameter["value"]);
            let truth = same_turn(key, true_value(&effect.parameters, key), value);
            found.push(Interval { of, truth, value, ci95 });
        }
    }
    found
}

/// A phase in the turn that the value found is nearest to it in; anything else as it is.
fn same_turn(key: &str, truth: f64, value: f64) -> f64 {
    let turns = if key.ends_with("phase_rad") { ((value - truth) / TAU).round() } else { 0.0 };
    truth + turns * TAU
}

/// A parameter of the truth: a number, or an entry of a list, `cos[2]`, counted from 1; 0 beyond the list.
fn true_value(parameters: &serde_json::Map<String, Value>, key: &str) -> f64 {
    let Some((list, index)) = key.strip_suffix(']').and_then(|key| key.split_once('[')) else {
        return parameters.get(key).and_then(Value::as_f64).unwrap_or(f64::NAN);
    };
    let index: usize = index.parse().unwrap_or(0);
    parameters
        .get(list)
        .and_then(|list| list.get(index.wrapping_sub(1)))
        .and_then(Value::as_f64)
        .unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Hidden, HiddenEffect, LogKind};
    use serde_json::json;

    fn truth(effects: &[&str], twins: &[&str]) -> Truth {
        let effects = effects.iter().map(|id| HiddenEffect {
            id: (*id).to_owned(),
            parameters: serde_json::Map::new(),
            same_form: true,
            strength: 5.0,
            acts_in: Vec::new(),
        });
        Truth {
            seed: 0,
            log: Hidden::none(LogKind::Torque).log,
            effects: effects.collect(),
            noise: 1.0,
            encoder_step_rad: 0.0,
            twins: twins.iter().map(|id| (*id).to_owned()).collect(),
            near_twins: Vec::new(),
            verdict: "explained",
            imperfect: None,
        }
    }

    fn outcome(truth: &Truth, verdict: &str, causes: &[&str], groups: &[&[&str]]) -> Outcome {
        let causes: Vec<Value> = causes.iter().map(|id| json!({ "id": id })).collect();
        let groups: Vec<Value> = groups.iter().map(|ids| json!({ "ids": ids })).collect();
        Finding::of(&json!({ "verdict": verdict, "causes": causes, "ambiguous": groups })).judge(truth)
    }

    #[test]
    fn a_phase_counts_but_for_whole_turns() {
        let mut truth = truth(&["encoder-eccentricity"], &[]);
        truth.effects[0].parameters =
            json!({ "phase_rad": 4.064, "amplitude_rad": 1.0 }).as_object().unwrap().clone();
        let number = |value: f64| json!({ "value": value, "ci95": [value - 0.02, value + 0.02] });
        let cause = json!({ "id": "encoder-eccentricity", "parameters": { "phase_rad": number(-2.219), "amplitude_rad": number(1.0 + TAU) } });
        let found = intervals(&truth, &json!({ "causes": [cause] }), true);
        let holds: Vec<(&str, bool)> = found.iter().map(|of| (of.of.as_str(), of.holds())).collect();
        assert_eq!(
            holds,
            [("encoder-eccentricity: amplitude_rad", false), ("encoder-eccentricity: phase_rad", true)]
        );
    }

    #[test]
    fn of_an_imperfect_measurement_more_may_be_said() {
        let also_true = vec!["sensor-delay".to_owned()];
        let imperfect = Some(Imperfect { tolerance: 0.03, also_true, ..Imperfect::default() });
        let clean = Truth { imperfect: imperfect.clone(), ..truth(&[], &[]) };
        let level = |factor: f64| {
            let cause = json!({ "id": "coulomb-level", "parameters": { "factor": { "value": factor } } });
            Finding::of(&json!({ "verdict": "explained", "causes": [cause], "ambiguous": [] }))
        };
        assert_eq!(level(1.05).judge(&clean), Outcome::Right, "within twice the tolerance");
        assert_eq!(level(0.9).judge(&clean), Outcome::Wrong);
        assert_eq!(outcome(&clean, "explained", &["sensor-delay"], &[]), Outcome::Right);
        assert_eq!(outcome(&clean, "ambiguous", &[], &[&["sensor-delay", "a"]]), Outcome::Right);
        let best = json!({ "id": "a", "parameters": { "factor": { "value": 1.04 } } });
        let group = json!({ "ids": ["a", "b"], "best": best });
        let group = json!({ "verdict": "ambiguous", "causes": [], "ambiguous": [group] });
        assert_eq!(Finding::of(&group).judge(&clean), Outcome::Right, "the best of it is within tolerance");
        let hardly = Imperfect { tolerance: 0.03, torque_lag_s: Some(7e-4), ..Imperfect::default() };
        let hardly = Truth { imperfect: Some(hardly), ..truth(&[], &[]) };
        let late = |ci95: [f64; 2]| {
            let cause = json!({ "id": "sensor-delay", "parameters": { "delay_s": { "ci95": ci95 } } });
            Finding::of(&json!({ "verdict": "explained", "causes": [cause], "ambiguous": [] }))
        };
        assert_eq!(late([6e-4, 9e-4]).judge(&hardly), Outcome::Right, "it is as late as that");
        assert_eq!(late([8e-4, 9e-4]).judge(&hardly), Outcome::Wrong);
        assert_eq!(outcome(&clean, "unexplained", &[], &[]), Outcome::Missed);
        assert_eq!(outcome(&clean, "explained", &["a"], &[]), Outcome::Wrong);
        assert_eq!(outcome(&clean, "no answer in 9 s", &[], &[]), Outcome::Missed);
        let one = Truth { imperfect, near_twins: vec!["b".to_owned()], ..truth(&["a"], &[]) };
        assert_eq!(outcome(&one, "explained", &["a", "sensor-delay"], &[]), Outcome::Right);
        assert_eq!(outcome(&one, "ambiguous", &[], &[&["a", "b"]]), Outcome::Right);
        assert_eq!(outcome(&one, "explained", &["b"], &[]), Outcome::Wrong);
        assert_eq!(outcome(&one, "no-discrepancy", &[], &[]), Outcome::Missed);
    }

    #[test]
    fn names_are_judged() {
        let one = truth(&["a"], &[]);
        assert_eq!(outcome(&one, "explained", &["a"], &[]), Outcome::Right);
        assert_eq!(outcome(&one, "explained", &["a", "b"], &[]), Outcome::Wrong);
        assert_eq!(outcome(&one, "ambiguous", &[], &[&["a", "b"]]), Outcome::Ambiguous);
        assert_eq!(outcome(&one, "ambiguous", &[], &[&["c", "b"]]), Outcome::Wrong);
        assert_eq!(outcome(&one, "unexplained", &[], &[]), Outcome::Missed);
        let none = truth(&[], &[]);
        assert_eq!(outcome(&none, "no-discrepancy", &[], &[]), Outcome::Right);
        assert_eq!(outcome(&none, "unexplained", &[], &[]), Outcome::Wrong);
        assert_eq!(outcome(&none, "no answer in 9 s", &[], &[]), Outcome::Wrong);
        assert_eq!(outcome(&truth(&["a", "b"], &[]), "partly-explained", &["a"], &[]), Outcome::Part);
        let twin = truth(&["a"], &["b"]);
        assert_eq!(outcome(&twin, "ambiguous", &[], &[&["a", "b"]]), Outcome::Right);
        assert_eq!(outcome(&twin, "explained", &["a"], &[]), Outcome::Ambiguous);
        assert_eq!(outcome(&twin, "explained", &["b"], &[]), Outcome::Wrong);
        let near = Truth { near_twins: vec!["b".to_owned()], ..truth(&["a", "c"], &[]) };
        assert_eq!(outcome(&near, "partly-explained", &["c"], &[&["a", "b"]]), Outcome::Right);
        assert_eq!(outcome(&near, "explained", &["a", "c"], &[]), Outcome::Right);
        assert_eq!(outcome(&near, "partly-explained", &["c"], &[&["a", "b", "d"]]), Outcome::Ambiguous);
        assert_eq!(outcome(&near, "ambiguous", &[], &[&["a", "b"]]), Outcome::Ambiguous);
        assert_eq!(outcome(&near, "explained", &["b", "c"], &[]), Outcome::Wrong);
        let outside = truth(&["outside-hum"], &[]);
        assert_eq!(outcome(&outside, "unexplained", &[], &[]), Outcome::Right);
        assert_eq!(outcome(&outside, "explained", &["a"], &[]), Outcome::Wrong);
        assert_eq!(outcome(&outside, "no answer in 9 s", &[], &[]), Outcome::Missed);
    }
}
