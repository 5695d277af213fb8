//! The tables: outcomes by class and by effect, confusion, false alarms, intervals, held-out error, time.

use super::cases::Class;
use super::run::Judged;
use crate::output::{Sheet, digits};
use hidden_effect_rig::{Interval, LogKind, Outcome};
use statrs::distribution::{Beta, ContinuousCDF};
use std::collections::BTreeMap;

const CLASSES: [(Class, &str); 6] = [
    (Class::Clean, "nothing hidden"),
    (Class::Strong, "one effect, 5 times the noise"),
    (Class::Weak, "one effect, 2 times the noise"),
    (Class::Two, "two effects, 5 times each"),
    (Class::Twin, "twins without the data that separate them"),
    (Class::Outside, "an effect outside the list"),
];
const OUTCOMES: [Outcome; 5] =
    [Outcome::Right, Outcome::Part, Outcome::Ambiguous, Outcome::Missed, Outcome::Wrong];
const LOGS: [(LogKind, &str); 2] = [(LogKind::Torque, "torque"), (LogKind::Angle, "angle")];

/// All tables.
pub fn all(judged: &[Judged]) -> Vec<Sheet> {
    vec![
        outcomes(judged),
        beside_regression(judged),
        rates(judged),
        by_effect(judged),
        confusion(judged),
        coverage(judged),
        held_out(judged),
    ]
}

/// A rate with its exact (Clopper-Pearson) 95 % interval.
fn rate(hits: usize, of: usize) -> String {
    if of == 0 {
        return "-".to_owned();
    }
    let (k, n) = (hits as f64, of as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(p));
    let low = if hits == 0 { 0.0 } else { quantile(k, n - k + 1.0, 0.025) };
    let high = if hits == of { 1.0 } else { quantile(k + 1.0, n - k, 0.975) };
    format!("{:.1} % ({:.1} to {:.1}; {hits} of {of})", 100.0 * k / n, 100.0 * low, 100.0 * high)
}

fn of_class(judged: &[Judged], class: Class, log: LogKind) -> Vec<&Judged> {
    judged.iter().filter(|one| one.case.class == class && one.truth.log == log).collect()
}

fn counts(found: &[Outcome]) -> Vec<String> {
    OUTCOMES.iter().map(|wanted| found.iter().filter(|one| *one == wanted).count().to_string()).collect()
}

fn outcomes(judged: &[Judged]) -> Sheet {
    let header = ["what is hidden", "log", "campaigns", "right", "part", "ambiguous", "missed", "wrong"];
    let mut sheet = Sheet::new("diagnosis-outcomes", "Findings by what is hidden", &header);
    for (class, words) in CLASSES {
        for (log, name) in LOGS {
            let found: Vec<Outcome> = of_class(judged, class, log).iter().map(|one| one.outcome).collect();
            if !found.is_empty() {
                let cells = [words.to_owned(), name.to_owned(), found.len().to_string()];
                sheet.row(cells.into_iter().chain(counts(&found)));
            }
        }
    }
    sheet
}

fn beside_regression(judged: &[Judged]) -> Sheet {
    let header = ["what is hidden", "by", "campaigns", "right", "part", "ambiguous", "missed", "wrong"];
    let title = "Torque logs: stepvalve diagnose beside a stepwise regression on the same campaigns";
    let mut sheet = Sheet::new("diagnosis-regression", title, &header);
    for (class, words) in CLASSES {
        let both: Vec<(Outcome, Outcome)> = judged
            .iter()
            .filter(|one| one.case.class == class)
            .filter_map(|one| one.baseline.as_ref().map(|(_, outcome)| (one.outcome, *outcome)))
            .collect();
        if both.is_empty() {
            continue;
        }
        let (ours, theirs): (Vec<Outcome>, Vec<Outcome>) = both.into_iter().unzip();
        for (name, found) in [("diagnose", ours), ("regression", theirs)] {
            let cells = [words.to_owned(), name.to_owned(), found.len().to_string()];
            sheet.row(cells.into_iter().chain(counts(&found)));
        }
    }
    sheet
}

/// The rates that the diagnosis is held to.
fn rates(judged: &[Judged]) -> Sheet {
    let mut sheet =
        Sheet::new("diagnosis-rates", "Rates with their 95 % intervals", &["rate", "torque", "angle"]);
    let count = |log: LogKind, classes: &[Class], wanted: &dyn Fn(&Judged) -> bool| {
        let all: Vec<&Judged> =
            judged.iter().filter(|one| one.truth.log == log && classes.contains(&one.case.class)).collect();
        rate(all.iter().filter(|one| wanted(one)).count(), all.len())
    };
    let mut row = |words: &str, classes: &[Class], wanted: &dyn Fn(&Judged) -> bool| {
        sheet.row([
            words.to_owned(),
            count(LogKind::Torque, classes, wanted),
            count(LogKind::Angle, classes, wanted),
        ]);
    };
    let right = |one: &Judged| one.outcome == Outcome::Right;
    let wrong = |one: &Judged| one.outcome == Outcome::Wrong;
    row("false alarms (anything but no-discrepancy)", &[Class::Clean], &wrong);
    row("a cause named with nothing hidden", &[Class::Clean], &|one| !one.finding.named.is_empty());
    row("strong effects: exactly the right cause", &[Class::Strong], &right);
    row("weak effects: exactly the right cause", &[Class::Weak], &right);
    row("two effects: both", &[Class::Two], &right);
    row("twins: said to be ambiguous", &[Class::Twin], &right);
    row("outside the list: a listed name", &[Class::Outside], &wrong);
    let named = [Class::Strong, Class::Weak, Class::Two, Class::Twin, Class::Outside];
    row("wrong names, everything hidden", &named, &wrong);
    sheet
}

fn by_effect(judged: &[Judged]) -> Sheet {
    let header = ["effect", "log", "strong: right", "other", "wrong", "weak: right", "other", "wrong"];
    let mut sheet = Sheet::new("diagnosis-effects", "Single effects, by strength", &header);
    let mut effects: BTreeMap<(LogKind, &str), [[usize; 3]; 2]> = BTreeMap::new();
    for one in judged {
        let strength = match one.case.class {
            Class::Strong => 0,
            Class::Weak => 1,
            _ => continue,
        };
        let Some(effect) = one.truth.effects.first() else { continue };
        let kind = match one.outcome {
            Outcome::Right => 0,
            Outcome::Wrong => 2,
            _ => 1,
        };
        let row = effects.entry((one.truth.log, effect.id.as_str())).or_default();
        if let Some(cell) = row.get_mut(strength).and_then(|cells| cells.get_mut(kind)) {
            *cell += 1;
        }
    }
    for ((log, effect), cells) in effects {
        let name = LOGS.iter().find(|(kind, _)| *kind == log).map_or("", |(_, name)| name);
        let numbers = cells.iter().flatten().map(ToString::to_string);
        sheet.row([effect.to_owned(), name.to_owned()].into_iter().chain(numbers));
    }
    sheet
}

fn confusion(judged: &[Judged]) -> Sheet {
    let header = ["hidden", "log", "found", "times"];
    let title = "Confusion: what was found where it was not exactly what is hidden";
    let mut sheet = Sheet::new("diagnosis-confusion", title, &header);
    let mut rows: BTreeMap<(String, &str, String), usize> = BTreeMap::new();
    for one in judged.iter().filter(|one| one.outcome != Outcome::Right) {
        let hidden: Vec<&str> = one.truth.effects.iter().map(|effect| effect.id.as_str()).collect();
        let hidden = if hidden.is_empty() { "nothing".to_owned() } else { hidden.join(" + ") };
        let mut found: Vec<String> = one.finding.named.iter().cloned().collect();
        found.extend(one.finding.groups.iter().map(|group| {
            format!("one of ({})", group.iter().map(String::as_str).collect::<Vec<_>>().join(", "))
        }));
        let found = if found.is_empty() { one.finding.verdict.clone() } else { found.join(" + ") };
        let log = LOGS.iter().find(|(kind, _)| *kind == one.truth.log).map_or("", |(_, name)| name);
        *rows.entry((hidden, log, found)).or_default() += 1;
    }
    for ((hidden, log, found), times) in rows {
        sheet.row([hidden, log.to_owned(), found, times.to_string()]);
    }
    sheet
}

fn coverage(judged: &[Judged]) -> Sheet {
    let title = "95 % intervals that hold the true parameter, single effects named rightly";
    let mut sheet = Sheet::new("diagnosis-intervals", title, &["parameters", "held"]);
    let mut row = |words: String, intervals: Vec<&Interval>| {
        let held = intervals.iter().filter(|interval| interval.holds()).count();
        sheet.row([words, rate(held, intervals.len())]);
    };
    for (log, name) in LOGS {
        let of = |one: &&Judged| one.truth.log == log;
        row(
            format!("same form, {name} logs"),
            judged.iter().filter(of).flat_map(|one| &one.intervals).collect(),
        );
        row(
            format!("another form, against the best fit to noise-free data, {name} logs"),
            judged.iter().filter(of).flat_map(|one| &one.best_fits).collect(),
        );
    }
    let mut each: BTreeMap<&str, Vec<&Interval>> = BTreeMap::new();
    for interval in judged.iter().flat_map(|one| &one.intervals) {
        each.entry(interval.of.split('[').next().unwrap_or_default()).or_default().push(interval);
    }
    each.into_iter().for_each(|(of, intervals)| row(of.to_owned(), intervals));
    sheet
}

fn held_out(judged: &[Judged]) -> Sheet {
    let title = "Held-out RMS after extension over the rig's noise, single effects named rightly";
    let mut sheet = Sheet::new(
        "diagnosis-held-out",
        title,
        &["log", "median", "95th percentile", "within 1.2", "diagnosis, s (median)"],
    );
    for (log, name) in LOGS {
        let single = |one: &&Judged| {
            one.truth.log == log
                && matches!(one.case.class, Class::Strong | Class::Weak)
                && one.outcome == Outcome::Right
        };
        let sorted = |value: &dyn Fn(&Judged) -> f64| {
            let mut all: Vec<f64> = judged.iter().filter(single).map(value).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let (rms, wall) = (sorted(&|one| one.rms_over_noise), sorted(&|one| one.wall_s));
        let at = |all: &[f64], part: f64| {
            all.get((part * all.len() as f64) as usize).copied().map_or("-".to_owned(), digits)
        };
        let within = rms.iter().filter(|ratio| **ratio <= 1.2).count();
        sheet.row([name.to_owned(), at(&rms, 0.5), at(&rms, 0.95), rate(within, rms.len()), at(&wall, 0.5)]);
    }
    sheet
}
