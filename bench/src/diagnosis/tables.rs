//! The tables: rates beside what they are held to, outcomes by class and by effect, confusion, intervals, held-out error, cost.

use super::Family;
use super::cases::Class;
use super::row::Row;
use crate::output::{Sheet, digits};
use hidden_effect_rig::{Interval, LogKind, Outcome};
use log_data::quantile;
use statrs::distribution::{Beta, ContinuousCDF};
use std::collections::BTreeMap;

const CLASSES: [(Class, &str); 7] = [
    (Class::Clean, "nothing hidden"),
    (Class::Strong, "one strong effect"),
    (Class::Weak, "one weak effect"),
    (Class::Two, "two strong effects"),
    (Class::Twin, "twins without the data that separate them"),
    (Class::Outside, "an effect outside the list"),
    (Class::Unseen, "an effect that the data can't show"),
];
const OUTCOMES: [Outcome; 5] =
    [Outcome::Right, Outcome::Part, Outcome::Ambiguous, Outcome::Missed, Outcome::Wrong];
const LOGS: [(LogKind, &str); 2] = [(LogKind::Torque, "torque"), (LogKind::Angle, "angle")];
const FAMILIES: [(Family, &str); 3] =
    [(Family::Exact, "exact"), (Family::Real, "real"), (Family::Own, "own recordings")];

/// All tables.
pub fn all(rows: &[Row]) -> Vec<Sheet> {
    vec![
        rates(rows),
        outcomes(rows),
        beside_regression(rows),
        by_effect(rows),
        confusion(rows),
        coverage(rows),
        held_out(rows),
        costs(rows),
    ]
}

/// A rate with its exact (Clopper-Pearson) 95 % interval.
pub(super) fn rate(hits: usize, of: usize) -> String {
    if of == 0 {
        return "-".to_owned();
    }
    let (k, n) = (hits as f64, of as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(p));
    let low = if hits == 0 { 0.0 } else { quantile(k, n - k + 1.0, 0.025) };
    let high = if hits == of { 1.0 } else { quantile(k + 1.0, n - k, 0.975) };
    format!("{:.1} % ({:.1} to {:.1}; {hits} of {of})", 100.0 * k / n, 100.0 * low, 100.0 * high)
}

/// Every family and kind of log that there are rows of, with its names.
fn parts(rows: &[Row]) -> Vec<(Family, &'static str, LogKind, &'static str)> {
    let pairs = FAMILIES.iter().flat_map(|family| LOGS.iter().map(move |log| (family, log)));
    pairs
        .map(|((family, family_name), (log, log_name))| (*family, *family_name, *log, *log_name))
        .filter(|(family, _, log, _)| rows.iter().any(|row| row.family == *family && row.log == *log))
        .collect()
}

fn of_part(rows: &[Row], family: Family, log: LogKind) -> Vec<&Row> {
    rows.iter().filter(|row| row.family == family && row.log == log).collect()
}

fn counts(found: &[Outcome]) -> Vec<String> {
    OUTCOMES.iter().map(|wanted| found.iter().filter(|one| *one == wanted).count().to_string()).collect()
}

/// A rate that the diagnosis is held to: its name, the classes that it counts in, whether a row counts, and the bound of
/// each family.
type Target = (&'static str, &'static [Class], fn(&Row) -> bool, [&'static str; 3]);

const NAMED: &[Class] = &[Class::Strong, Class::Weak, Class::Two, Class::Twin, Class::Outside];
const TARGETS: [Target; 10] = [
    ("false alarms", &[Class::Clean], is_wrong, ["≤ 2 %", "≤ 3 %", "0 of 200"]),
    (
        "nothing hidden: nothing accused, but something left or no answer",
        &[Class::Clean],
        is_missed,
        ["-", "-", "-"],
    ),
    ("single strong effect, exactly right", &[Class::Strong], is_right, ["≥ 95 %", "≥ 90 %", "≥ 90 %"]),
    ("single weak effect, exactly right", &[Class::Weak], is_right, ["≥ 80 %", "≥ 70 %", "-"]),
    ("two at once, both", &[Class::Two], is_right, ["≥ 80 %", "≥ 70 %", "-"]),
    ("twins: said to be ambiguous", &[Class::Twin], is_right, ["-", "-", "-"]),
    ("outside the list: a listed name", &[Class::Outside], is_wrong, ["0", "0", "-"]),
    ("wrong names, everything hidden", NAMED, is_wrong, ["≤ 2 %", "≤ 3 %", "≤ 2 %"]),
    ("can't be shown: nothing else named", &[Class::Unseen], is_not_wrong, ["-", "-", "-"]),
    ("no answer in time, or refused", &[], has_no_answer, ["-", "-", "-"]),
];

fn is_wrong(row: &Row) -> bool {
    row.outcome == Outcome::Wrong
}
fn is_not_wrong(row: &Row) -> bool {
    row.outcome != Outcome::Wrong
}
fn is_right(row: &Row) -> bool {
    row.outcome == Outcome::Right
}
fn is_missed(row: &Row) -> bool {
    row.outcome == Outcome::Missed
}
fn has_no_answer(row: &Row) -> bool {
    row.verdict.starts_with("no answer") || row.verdict.starts_with("refused")
}

/// The rates that the diagnosis is held to.
fn rates(rows: &[Row]) -> Sheet {
    let title = "Rates with their 95 % intervals (Clopper and Pearson), and what they are held to";
    let header = ["family", "rate", "wanted", "all logs", "torque", "angle"];
    let mut sheet = Sheet::new("diagnosis-rates", title, &header);
    for (place, (family, name)) in FAMILIES.iter().enumerate() {
        for (words, classes, counts, wanted) in TARGETS {
            let all: Vec<&Row> = rows
                .iter()
                .filter(|row| row.family == *family && (classes.is_empty() || classes.contains(&row.class)))
                .collect();
            let of = |log: Option<LogKind>| {
                let part: Vec<&&Row> =
                    all.iter().filter(|row| log.is_none_or(|log| row.log == log)).collect();
                rate(part.iter().filter(|row| counts(row)).count(), part.len())
            };
            if !all.is_empty() {
                let wanted = wanted.get(place).copied().unwrap_or("-");
                let cells = [(*name).to_owned(), words.to_owned(), wanted.to_owned()];
                let found = [of(None), of(Some(LogKind::Torque)), of(Some(LogKind::Angle))];
                sheet.row(cells.into_iter().chain(found));
            }
        }
    }
    sheet
}

fn outcomes(rows: &[Row]) -> Sheet {
    let header =
        ["family", "what is hidden", "log", "campaigns", "right", "part", "ambiguous", "missed", "wrong"];
    let mut sheet = Sheet::new("diagnosis-outcomes", "Findings by what is hidden", &header);
    for (family, family_name, log, log_name) in parts(rows) {
        for (class, words) in CLASSES {
            let of_class = of_part(rows, family, log).into_iter().filter(|row| row.class == class);
            let found: Vec<Outcome> = of_class.map(|row| row.outcome).collect();
            if !found.is_empty() {
                let cells = [family_name, words, log_name].map(str::to_owned);
                sheet.row(cells.into_iter().chain([found.len().to_string()]).chain(counts(&found)));
            }
        }
    }
    sheet
}

fn beside_regression(rows: &[Row]) -> Sheet {
    let header =
        ["family", "what is hidden", "by", "campaigns", "right", "part", "ambiguous", "missed", "wrong"];
    let title =
        "Torque logs: stepvalve diagnose beside a stepwise regression and FROLS on the same campaigns";
    let mut sheet = Sheet::new("diagnosis-regression", title, &header);
    for (family, family_name) in FAMILIES {
        for (class, words) in CLASSES {
            let both = |row: &&Row| row.family == family && row.class == class && row.regression.is_some();
            let compared: Vec<&Row> = rows.iter().filter(both).collect();
            if compared.is_empty() {
                continue;
            }
            let by = |outcome: &dyn Fn(&Row) -> Option<Outcome>| -> Vec<Outcome> {
                compared.iter().filter_map(|row| outcome(row)).collect()
            };
            let methods = [
                ("diagnose", by(&|row| Some(row.outcome))),
                ("regression", by(&|row| row.regression.as_ref().map(|other| other.outcome))),
                ("FROLS", by(&|row| row.frols.as_ref().map(|other| other.outcome))),
            ];
            for (name, found) in methods {
                let cells = [family_name, words, name].map(str::to_owned);
                sheet.row(cells.into_iter().chain([found.len().to_string()]).chain(counts(&found)));
            }
        }
    }
    sheet
}

fn by_effect(rows: &[Row]) -> Sheet {
    let header =
        ["effect", "family", "log", "strong: right", "other", "wrong", "weak: right", "other", "wrong"];
    let mut sheet = Sheet::new("diagnosis-effects", "Single effects, by strength", &header);
    let mut effects: BTreeMap<(&str, &str, &str), [[usize; 3]; 2]> = BTreeMap::new();
    for (family, family_name, log, log_name) in parts(rows) {
        for row in of_part(rows, family, log) {
            let strength = match row.class {
                Class::Strong => 0,
                Class::Weak => 1,
                _ => continue,
            };
            let Some(effect) = row.hidden.first() else { continue };
            let kind = match row.outcome {
                Outcome::Right => 0,
                Outcome::Wrong => 2,
                _ => 1,
            };
            let cells = effects.entry((effect, family_name, log_name)).or_default();
            if let Some(cell) = cells.get_mut(strength).and_then(|cells| cells.get_mut(kind)) {
                *cell += 1;
            }
        }
    }
    for ((effect, family, log), cells) in effects {
        let numbers = cells.iter().flatten().map(ToString::to_string);
        sheet.row([effect, family, log].map(str::to_owned).into_iter().chain(numbers));
    }
    sheet
}

fn confusion(rows: &[Row]) -> Sheet {
    let header = ["hidden", "family", "log", "found", "times"];
    let title = "Confusion: what was found where it was not exactly what is hidden";
    let mut sheet = Sheet::new("diagnosis-confusion", title, &header);
    let mut found_times: BTreeMap<(String, &str, &str, String), usize> = BTreeMap::new();
    for (family, family_name, log, log_name) in parts(rows) {
        for row in of_part(rows, family, log).into_iter().filter(|row| row.outcome != Outcome::Right) {
            let hidden = if row.hidden.is_empty() { "nothing".to_owned() } else { row.hidden.join(" + ") };
            let mut found: Vec<String> = row.named.iter().cloned().collect();
            found.extend(row.groups.iter().map(|group| {
                format!("one of ({})", group.iter().map(String::as_str).collect::<Vec<_>>().join(", "))
            }));
            let found = if found.is_empty() { row.verdict.clone() } else { found.join(" + ") };
            *found_times.entry((hidden, family_name, log_name, found)).or_default() += 1;
        }
    }
    for ((hidden, family, log, found), times) in found_times {
        sheet.row([hidden, family.to_owned(), log.to_owned(), found, times.to_string()]);
    }
    sheet
}

fn coverage(rows: &[Row]) -> Sheet {
    let title =
        "95 % intervals that hold the true parameter (90 to 99 % wanted), single effects named rightly";
    let mut sheet = Sheet::new("diagnosis-intervals", title, &["family", "parameters", "held"]);
    let mut row = |family: &str, words: String, intervals: Vec<&Interval>| {
        let held = intervals.iter().filter(|interval| interval.holds()).count();
        sheet.row([family.to_owned(), words, rate(held, intervals.len())]);
    };
    for (family, family_name, log, log_name) in parts(rows) {
        let of = of_part(rows, family, log);
        let same = of.iter().flat_map(|row| &row.intervals).collect();
        row(family_name, format!("same form, {log_name} logs"), same);
        let other: Vec<&Interval> = of.iter().flat_map(|row| &row.best_fits).collect();
        if !other.is_empty() {
            let words = "another form, against the best fit to noise-free data";
            row(family_name, format!("{words}, {log_name} logs"), other);
        }
    }
    for (family, family_name) in FAMILIES {
        let mut each: BTreeMap<&str, Vec<&Interval>> = BTreeMap::new();
        for interval in rows.iter().filter(|row| row.family == family).flat_map(|row| &row.intervals) {
            each.entry(interval.of.split('[').next().unwrap_or_default()).or_default().push(interval);
        }
        each.into_iter().for_each(|(of, intervals)| row(family_name, of.to_owned(), intervals));
    }
    sheet
}

/// A quantile as a cell.
fn part_of(sorted: &[f64], part: f64) -> String {
    quantile(sorted, part).map_or("-".to_owned(), digits)
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    all
}

fn held_out(rows: &[Row]) -> Sheet {
    let title = "Held-out RMS after extension over the rig's noise, single effects named rightly";
    let header = ["family", "log", "median", "95th percentile", "within 1.2"];
    let mut sheet = Sheet::new("diagnosis-held-out", title, &header);
    for (family, family_name, log, log_name) in parts(rows) {
        let rms = sorted(of_part(rows, family, log).iter().filter_map(|row| row.rms_over_noise));
        let within = rms.iter().filter(|ratio| **ratio <= 1.2).count();
        let cells = [family_name.to_owned(), log_name.to_owned(), part_of(&rms, 0.5), part_of(&rms, 0.95)];
        sheet.row(cells.into_iter().chain([rate(within, rms.len())]));
    }
    sheet
}

fn costs(rows: &[Row]) -> Sheet {
    let title = "What a diagnosis took, with as many beside it as the bench was told";
    let header =
        ["family", "log", "campaigns", "samples (median)", "median, s", "95th percentile, s", "most, s"];
    let mut sheet = Sheet::new("diagnosis-costs", title, &header);
    for (family, family_name, log, log_name) in parts(rows) {
        let of = of_part(rows, family, log);
        let walls = sorted(of.iter().map(|row| row.wall_s));
        let samples = sorted(of.iter().map(|row| row.samples as f64));
        let cells = [family_name.to_owned(), log_name.to_owned(), of.len().to_string()];
        let middle = quantile(&samples, 0.5).map_or("-".to_owned(), |count| format!("{count:.0}"));
        let numbers = [middle, part_of(&walls, 0.5), part_of(&walls, 0.95), part_of(&walls, 1.0)];
        sheet.row(cells.into_iter().chain(numbers));
    }
    sheet
}
