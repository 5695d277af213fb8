//! report.html: the answer in one sentence, then what it rests on.

use super::{causes, explore, leftover, numbers, quality, remains, runs, unnamed};
use diagnosis::{Cause, Dependence, Found, Judged, Verdict};
use log_data::Log;
use report::{Block, Page, Section, Table};
use study::headline::is_ruled_by_few;
use study::words::{self, behind, is_changed, short, unit, with_interval};
use study::{Answer, Residuals};

/// What a page is made of.
pub struct Material<'a> {
    /// The page's title.
    pub title: &'a str,
    /// What was found.
    pub answer: &'a Answer,
    /// The log's samples, predicted.
    pub residuals: &'a Residuals,
    /// The files: logs and model.
    pub files: (&'a str, &'a str),
}

/// The page.
pub fn page(material: &Material<'_>) -> String {
    let Material { title, answer, residuals, files: (log_file, model_file) } = material;
    let Answer { found, log, quality: findings, .. } = answer;
    let mut page = Page::new(format!("Diagnosis: {title}"), answer.headline());
    let seen =
        found.diagnosis.observations.iter().filter(|_| found.diagnosis.verdict != Verdict::Unexplained);
    let summary = seen.fold(Section::new(""), |section, seen| section.with(Block::Text(seen.clone())));
    page.sections.push(summary.with(Block::Facts(facts(found, log))));
    page.sections.push(remains::section(found, findings));
    page.sections.push(quality::section(findings));
    // What was found, with its numbers, comes before what it was found from.
    page.sections.extend(unnamed::section(found));
    page.sections.push(causes::section(found));
    page.sections.push(parameters(found));
    page.sections.extend(numbers::section(found));
    page.sections.push(runs::section(found, log, residuals));
    page.sections.push(explore::section(found));
    page.sections.push(structure(found));
    page.sections.push(leftover::section(found));
    page.sections.push(judged("What these data can't test", "", &found.diagnosis.untestable));
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
            format!("error of the {}, all runs, {}", words::GIVEN, residual.quantity),
            format!("{} {unit}", short(residual.rms)),
        ));
        facts.push(("the measurement's own noise".to_owned(), format!("{} {unit}", short(residual.noise))));
    }
    if is_changed(found) {
        let on = if gain.held_out_runs.is_empty() {
            "error on the runs that were fitted (too few to keep some aside)"
        } else {
            "error on the runs kept aside"
        };
        let (before, after) = (short(gain.rms_before), short(gain.rms_after));
        let held = format!("{} {before} {unit}, {} {after} {unit}", words::GIVEN, words::changed(found));
        facts.push((on.to_owned(), held));
        if is_ruled_by_few(gain) {
            let (before, after) = (gain.over_noise_before, gain.over_noise_after);
            facts.push((
                "the same, each sample counted by how well it is known".to_owned(),
                format!("{before:.2} and {after:.2} times the noise"),
            ));
        }
        let [low, high] = gain.ratio_ci95;
        let text = if low < high {
            let (low, high) = (short(low), short(high));
            format!("{} (other runs would give {low} to {high}, with 95 % certainty)", short(gain.ratio))
        } else {
            format!("{} (on a single run: what others would give is not known)", short(gain.ratio))
        };
        facts.push(("the latter over the former".to_owned(), text));
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

fn parameters(found: &Found) -> Section {
    let mut rows = Vec::new();
    let causes = found.diagnosis.causes.iter().map(|cause| (cause.id, &cause.parameters));
    let laws = found.diagnosis.unnamed.iter().map(|law| (law.id, &law.parameters));
    for (id, parameters) in causes.chain(laws) {
        for (key, of) in parameters {
            let unit = behind(of);
            let [value, from, to] = with_interval(of);
            let within = format!("{from} to {to}{unit}");
            rows.push(vec![id.to_string(), key.clone(), format!("{value}{unit}"), within]);
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
        (words::GIVEN, &found.diagnosis.structure_before),
        (words::changed(found), &found.diagnosis.structure_after),
    ];
    for (model, dependences) in both.into_iter().take(if is_changed(found) { 2 } else { 1 }) {
        let text = format!("{}:", words::with_capital(model));
        let says = if dependences.is_empty() { format!("{text} on nothing beyond chance.") } else { text };
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
