//! report.html: the answer in one sentence, then what it rests on.

use super::words::{headline, short, unit};
use diagnosis::{Cause, Dependence, Evidence, Found, Judged, Shown, Verdict};
use log_data::{Channel, Log};
use log_quality::Finding;
use report::{Axis, Block, Page, Section, Style, Table, XyPlot, XySeries};
use valve_model::EffectId;

/// Runs that are shown over time.
const RUNS: usize = 4;
/// Points of a residual map.
const POINTS: usize = 6000;

/// The page.
pub fn page(found: &Found, quality: &[Finding], log: &Log, (log_file, model_file): (&str, &str)) -> String {
    let mut page = Page::new(format!("Diagnosis: {}", log.title), headline(found));
    let seen =
        found.diagnosis.observations.iter().filter(|_| found.diagnosis.verdict != Verdict::Unexplained);
    let summary = seen.fold(Section::new(""), |section, seen| section.with(Block::Text(seen.clone())));
    page.sections.push(summary.with(Block::Facts(facts(found, log))));
    page.sections.push(super::quality::section(quality));
    page.sections.push(runs(found));
    page.sections.push(maps(found));
    page.sections.push(ranking(found));
    page.sections.push(parameters(found));
    page.sections.push(structure(found));
    page.sections.push(super::leftover::section(found));
    page.sections.push(judged("What these data can't test", "", &found.diagnosis.untestable));
    let next = found.diagnosis.next_experiment.clone();
    page.sections.push(Section::new("What to measure next").with(Block::Text(next)));
    let from = format!("{log_file}, held against {model_file} by stepvalve diagnose.");
    page.sections.push(Section::folded("Made from").with(Block::Text(from)));
    page.to_html()
}

fn facts(found: &Found, log: &Log) -> Vec<(String, String)> {
    let diagnosis = &found.diagnosis;
    let unit = unit(found.channel);
    let gain = &diagnosis.gain;
    let mut facts = vec![("verdict".to_owned(), diagnosis.verdict.name().to_owned())];
    for residual in &diagnosis.residual {
        facts.push((
            format!("error of the model, {}", residual.quantity),
            format!("{} {unit}", short(residual.rms)),
        ));
        facts.push(("the measurement's own noise".to_owned(), format!("{} {unit}", short(residual.noise))));
    }
    let held = format!("{} before, {} {unit} after", short(gain.rms_before), short(gain.rms_after));
    if extended(found) {
        facts.push(("error on runs not used for fitting".to_owned(), held));
        let (low, high) = (short(gain.ratio_ci95[0]), short(gain.ratio_ci95[1]));
        let text =
            format!("{} (other runs would give {low} to {high}, with 95 % certainty)", short(gain.ratio));
        facts.push(("error after over before".to_owned(), text));
    }
    if let Some(closed) = &gain.closed_loop {
        let (before, after) = (closed.following_error_rms_before_rad, closed.following_error_rms_after_rad);
        let text = format!(
            "{} rad with the given model, {} rad with the extended one ({} times as much; a simulated sine of 1 Hz, the \
             extended model as the valve)",
            short(before),
            short(after),
            short(closed.ratio)
        );
        facts.push(("following error in the loop, the controller believing".to_owned(), text));
    }
    let (all, looked_at) = found.samples;
    let part = if looked_at < all { format!(", of which {looked_at} were looked at") } else { String::new() };
    facts.push(("runs".to_owned(), format!("{}, {all} samples{part}", log.runs.len())));
    for nuisance in &diagnosis.nuisances {
        facts.push(("no cause, but there".to_owned(), nuisance.clone()));
    }
    facts
}

/// The runs on which the extension changes most, and at least one that it was not fitted on.
fn chosen(found: &Found) -> Vec<&Shown> {
    let square = |one: &[f64], two: &[f64]| -> f64 {
        one.iter().zip(two).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / one.len().max(1) as f64
    };
    let mut pieces: Vec<(f64, &Shown)> = found
        .shown
        .iter()
        .map(|shown| {
            let changed = square(&shown.before, &shown.after);
            (if changed > 0.0 { changed } else { square(&shown.measured, &shown.before) }, shown)
        })
        .collect();
    pieces.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut kinds: Vec<&str> = Vec::new();
    let held_first = pieces.iter().filter(|(_, shown)| shown.held_out).take(RUNS / 2);
    let rest = pieces.iter().filter(|(_, shown)| {
        let new = !kinds.contains(&shown.kind.as_str());
        kinds.push(&shown.kind);
        new
    });
    let mut chosen: Vec<&Shown> = held_first.map(|(_, shown)| *shown).collect();
    for (_, shown) in rest {
        if chosen.len() < RUNS && !chosen.iter().any(|other| std::ptr::eq(*other, *shown)) {
            chosen.push(shown);
        }
    }
    chosen
}

fn runs(found: &Found) -> Section {
    let mut section = Section::new("Measured and simulated").with(Block::Text(
        "The runs that show most. \"Not fitted\" are runs that were kept aside: the model had not seen them."
            .to_owned(),
    ));
    let angle = found.channel != Channel::Torque;
    for shown in chosen(found) {
        let begin = shown.time_s.first().copied().unwrap_or(0.0);
        // Of an angle the lag behind the command is what friction makes.
        let against = |values: &[f64]| -> Vec<(f64, f64)> {
            let points = shown.time_s.iter().zip(values).zip(&shown.angle_rad);
            points
                .map(|((time, value), command)| (time - begin, if angle { value - command } else { *value }))
                .collect()
        };
        let mut series = vec![
            XySeries { name: "measured".to_owned(), style: Style::Points, points: against(&shown.measured) },
            XySeries {
                name: "model as given".to_owned(),
                style: Style::Line,
                points: against(&shown.before),
            },
        ];
        if extended(found) {
            let points = against(&shown.after);
            series.push(XySeries { name: "model extended".to_owned(), style: Style::Line, points });
        }
        let kept = if shown.held_out { "not fitted" } else { "fitted" };
        section = section.with(Block::XyPlot(XyPlot {
            title: if shown.kind.is_empty() {
                format!("{} ({kept})", shown.name)
            } else {
                format!("{} ({}, {kept})", shown.name, shown.kind)
            },
            x: Axis::new("time", "s"),
            y: if angle { Axis::new("angle less command", "rad") } else { Axis::new("torque", "N·m") },
            series,
        }));
    }
    section
}

/// Whether there is an extended model to show beside the given one.
fn extended(found: &Found) -> bool {
    !found.diagnosis.causes.is_empty()
}

/// What a sample is plotted against, if the run has it.
type Covariate = fn(&Shown, usize) -> Option<f64>;

fn maps(found: &Found) -> Section {
    let mut section = Section::new("Where the error sits").with(Block::Text(
        "Measured less simulated, sample by sample. What is flat and as thin as the noise is right; a slope, a step or a wave is something that the model misses."
            .to_owned(),
    ));
    let all: [(&str, &str, Covariate); 5] = [
        ("speed", "rad/s", |shown, index| shown.speed_rad_per_s.get(index).copied()),
        ("angle", "rad", |shown, index| shown.angle_rad.get(index).copied()),
        ("time", "s", |shown, index| shown.time_s.get(index).copied()),
        ("pressure drop", "MPa", |shown, index| shown.pressure_pa.get(index).map(|pressure| pressure / 1e6)),
        ("oil temperature", "°C", |shown, index| shown.temperature_c.get(index).copied()),
    ];
    for (name, unit, of) in all {
        let before = map(found, of, |shown| &shown.before);
        if before.is_empty() {
            continue;
        }
        let mut series =
            vec![XySeries { name: "model as given".to_owned(), style: Style::Points, points: before }];
        if extended(found) {
            let points = map(found, of, |shown| &shown.after);
            series.push(XySeries { name: "model extended".to_owned(), style: Style::Points, points });
        }
        section = section.with(Block::XyPlot(XyPlot {
            title: format!("Error over {name}"),
            x: Axis::new(name, unit),
            y: Axis::new("measured less simulated", super::words::unit(found.channel)),
            series,
        }));
    }
    section
}

fn map(found: &Found, of: Covariate, predicted: fn(&Shown) -> &Vec<f64>) -> Vec<(f64, f64)> {
    let total: usize = found.shown.iter().map(|shown| shown.time_s.len()).sum();
    let stride = total.div_ceil(POINTS).max(1);
    let mut points = Vec::new();
    for shown in &found.shown {
        let pairs = shown.measured.iter().zip(predicted(shown)).enumerate().skip(1).step_by(stride);
        points.extend(
            pairs.filter_map(|(index, (measured, model))| Some((of(shown, index)?, measured - model))),
        );
    }
    points
}

/// A cause that alone would cut the error by less, in parts of the noise, is named, no more.
const OF_NO_USE: f64 = 0.01;

fn ranking(found: &Found) -> Section {
    let mut rows = Vec::new();
    let mut row = |id: EffectId, judgement: &str, speaks_for: String, against: String| {
        rows.push(vec![id.to_string(), judgement.to_owned(), screened(found, id), speaks_for, against]);
    };
    for cause in &found.diagnosis.causes {
        let mut speaks_for = format!(
            "{}; without it {:.1} % of the error on kept-aside runs comes back",
            super::words::sentence(cause),
            100.0 * cause.rms_gain
        );
        for evidence in cause.evidence.values() {
            if let Evidence::Text(text) = evidence {
                speaks_for.push_str(&format!("; {text}"));
            }
        }
        row(cause.id, "accepted", speaks_for, "nothing that was tested".to_owned());
    }
    for group in &found.diagnosis.ambiguous {
        for id in &group.ids {
            row(
                *id,
                "can't be told apart",
                match group.best.as_ref().filter(|best| best.id == *id) {
                    None => "explains it".to_owned(),
                    Some(best) => {
                        format!("explains it, and fitted best: {}", super::words::numbers(&best.parameters))
                    }
                },
                format!("so do its rivals: {}", group.reason),
            );
        }
    }
    let alone = |id: EffectId| alone(found, id).unwrap_or(0.0);
    let (mut some, none): (Vec<&Judged>, Vec<&Judged>) =
        found.diagnosis.rejected.iter().partition(|judged| alone(judged.id) > OF_NO_USE);
    some.sort_by(|a, b| alone(b.id).total_cmp(&alone(a.id)));
    for judged in some {
        row(judged.id, "not it", "alone it would explain some".to_owned(), judged.reason.clone());
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

fn parameters(found: &Found) -> Section {
    let mut rows = Vec::new();
    for cause in &found.diagnosis.causes {
        for (key, of) in &cause.parameters {
            let unit = if of.unit == "1" { "" } else { of.unit.as_str() };
            let within = format!("{} to {} {unit}", short(of.ci95[0]), short(of.ci95[1]));
            rows.push(vec![cause.id.to_string(), key.clone(), format!("{} {unit}", short(of.value)), within]);
        }
    }
    let section = Section::new("Parameters");
    if rows.is_empty() {
        return section.with(Block::Text("No cause was accepted, so there are none.".to_owned()));
    }
    let header = ["cause", "parameter", "value", "with 95 % certainty within"].map(str::to_owned).to_vec();
    let section = section.with(Block::Table(Table { header, rows }));
    let waves = |cause: &Cause| cause.parameters.keys().any(|key| key.starts_with("cos["));
    if !found.diagnosis.causes.iter().any(waves) {
        return section;
    }
    section.with(Block::Text(
        "cos[n] and sin[n] are the two parts of a wave that comes n times in a turn; for detent-torque in a full step, for \
         microstep-error in a pitch of the rotor's teeth."
            .to_owned(),
    ))
}

fn structure(found: &Found) -> Section {
    let table = |found: &[Dependence]| {
        let rows = found
            .iter()
            .take(8)
            .map(|of| {
                let how = if of.as_friction { "against the motion" } else { "the same both ways" };
                vec![of.on.clone(), how.to_owned(), format!("{:.1} %", 100.0 * of.share)]
            })
            .collect();
        let header = ["depends on", "acts", "share of the error's square"].map(str::to_owned).to_vec();
        Block::Table(Table { header, rows })
    };
    let mut section = Section::new("What the error depends on").with(Block::Text(
        "Tests of the error against everything that was recorded, corrected for their number.".to_owned(),
    ));
    let both = [
        ("Model as given:", &found.diagnosis.structure_before),
        ("Model extended:", &found.diagnosis.structure_after),
    ];
    for (text, dependences) in both.into_iter().take(if extended(found) { 2 } else { 1 }) {
        let says = if dependences.is_empty() {
            format!("{text} on nothing beyond chance.")
        } else {
            text.to_owned()
        };
        section = section.with(Block::Text(says));
        if !dependences.is_empty() {
            section = section.with(table(dependences));
        }
    }
    section
}

fn judged(heading: &str, text: &str, list: &[Judged]) -> Section {
    let section = Section::new(heading);
    if list.is_empty() {
        return section.with(Block::Text("Nothing.".to_owned()));
    }
    let rows = list.iter().map(|of| vec![of.id.to_string(), of.reason.clone()]).collect();
    let header = ["cause", "why"].map(str::to_owned).to_vec();
    section.with(Block::Text(text.to_owned())).with(Block::Table(Table { header, rows }))
}
