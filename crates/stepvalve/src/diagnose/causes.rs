//! Of the report: every cause that was looked at, and what speaks for and against each.

use diagnosis::{Evidence, Found, Judged};
use log_data::Channel;
use report::{Block, Section, Table};
use study::words;
use valve_model::EffectId;

/// A cause that alone would cut the error by less, in parts of the noise, is named, no more.
const OF_NO_USE: f64 = 0.01;

/// The section.
pub fn section(found: &Found) -> Section {
    let mut rows = Vec::new();
    let mut row = |id: EffectId, judgement: &str, speaks_for: String, against: String| {
        rows.push(vec![id.to_string(), judgement.to_owned(), screened(found, id), speaks_for, against]);
    };
    for cause in &found.diagnosis.causes {
        let mut speaks_for = format!(
            "{}; without it {:.1} % of the error on kept-aside runs comes back",
            words::sentence(cause, found.channel),
            100.0 * cause.rms_gain
        );
        for evidence in cause.evidence.values() {
            if let Evidence::Text(text) = evidence {
                speaks_for.push_str(&format!("; {text}"));
            }
        }
        row(cause.id, "accepted", speaks_for, "nothing found".to_owned());
    }
    for group in &found.diagnosis.ambiguous {
        for id in &group.ids {
            row(
                *id,
                "can't be told apart",
                match group.best.as_ref().filter(|best| best.id == *id) {
                    None => group.rivals.iter().find(|rival| rival.id == *id).map_or_else(
                        || "explains it".to_owned(),
                        |rival| format!("explains it: {}", words::numbers(&rival.parameters)),
                    ),
                    Some(best) => {
                        format!("explains it, and fitted best: {}", words::numbers(&best.parameters))
                    }
                },
                format!("so do its rivals: {}", group.reason),
            );
        }
    }
    let alone = |id: EffectId| alone(found, id).unwrap_or(0.0);
    // What was fitted, or not decided, was of use enough to be looked at.
    let looked_at = |judged: &Judged| {
        ["fit", "not decided", "stood in"].iter().any(|word| judged.reason.starts_with(word))
    };
    let (mut some, none): (Vec<&Judged>, Vec<&Judged>) =
        found.diagnosis.rejected.iter().partition(|judged| alone(judged.id) > OF_NO_USE || looked_at(judged));
    some.sort_by(|a, b| alone(b.id).total_cmp(&alone(a.id)));
    for judged in some {
        let undecided = judged.reason.starts_with("not decided");
        let judgement = if undecided { "not decided" } else { "not it" };
        row(judged.id, judgement, "alone it would explain some".to_owned(), judged.reason.clone());
    }
    let mut section = causes_table(rows, found.channel);
    if !none.is_empty() {
        let names: Vec<&str> = none.iter().map(|judged| judged.id.name()).collect();
        section = section.with(Block::Text(format!(
            "Tested too, and of no use (of the wrong sign, or less than a hundredth of the noise): {}.",
            names.join(", ")
        )));
    }
    section
}

fn causes_table(rows: Vec<Vec<String>>, channel: Channel) -> Section {
    let section = Section::new("Causes, and what speaks for and against each");
    if rows.is_empty() {
        return section;
    }
    let header = ["cause", "judgement", "alone would cut the error by, in noises", "for it", "against it"];
    let mut number = "The number is a first estimate, in parts of the measurement's noise, on runs that were kept aside in turn; \
                      what speaks for and against comes from fits through the model."
        .to_owned();
    if channel == Channel::Angle {
        number.push_str(
            " A run that is far off counts by the logarithm of its error in these numbers: a rotor that slips a moment earlier \
             or later than the model's must not drown the others.",
        );
    }
    section
        .with(Block::Text(number))
        .with(Block::Table(Table { header: header.map(str::to_owned).to_vec(), rows }))
}

fn screened(found: &Found, id: EffectId) -> String {
    alone(found, id).map_or_else(|| "–".to_owned(), |gain| format!("{:.3}", gain.max(0.0)))
}

/// By how much a cause alone would cut the error, in parts of the noise; `None` where it was not screened.
fn alone(found: &Found, id: EffectId) -> Option<f64> {
    found.ranking.iter().find(|(other, _)| *other == id).map(|(_, gain)| *gain)
}
