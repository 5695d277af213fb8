//! Of the report: what the models leave, and what to do next, in words to act on.

use diagnosis::{Dependence, Found, Verdict};
use log_quality::Finding;
use report::{Block, Section, Table};
use study::cause_of;
use study::quality::mend_first;
use study::words::{first_guesses, names, short, unit};

/// Dependences that are spelled out.
const MOST: usize = 4;

/// The section.
pub fn section(found: &Found, quality: &[Finding]) -> Section {
    let section = Section::new("What remains, and what to do next").with(Block::Text(left(found)));
    let mut rows: Vec<Vec<String>> = Vec::new();
    // Where a group explains it, that is what remains.
    let open =
        found.diagnosis.structure_after.iter().filter(|_| found.diagnosis.verdict != Verdict::Ambiguous);
    for row in open.map(remaining) {
        if rows.len() < MOST && !rows.iter().any(|known| known.get(1) == row.get(1)) {
            rows.push(row);
        }
    }
    let section = if rows.is_empty() {
        section
    } else {
        let header =
            ["what remains", "what makes such an error", "how to look for it"].map(str::to_owned).to_vec();
        section.with(Block::Table(Table { header, rows }))
    };
    steps(found, quality)
        .into_iter()
        .enumerate()
        .fold(section, |section, (index, step)| section.with(Block::Text(format!("{}. {step}", index + 1))))
}

/// How much is left, beside the noise.
fn left(found: &Found) -> String {
    let after = found.diagnosis.description_after.rms_over_noise;
    let noise = found.diagnosis.residual.first().map_or(f64::NAN, |residual| residual.noise);
    let noise = format!("{} {} on average", short(noise), unit(found.channel));
    let times = format!(
        "each sample counted by how well it is known, {after:.1} times the measurement's own noise, which is {noise}"
    );
    match found.diagnosis.verdict {
        Verdict::NoDiscrepancy | Verdict::Explained => {
            format!("What remains is as large as the measurement's own noise, {noise}, and looks like it.")
        }
        Verdict::PartlyExplained => {
            format!("What remains is, {times}.")
        }
        Verdict::Unexplained if !found.diagnosis.unnamed.is_empty() => {
            format!("No cause is accepted. What remains beside the laws without a name is, {times}.")
        }
        Verdict::Unexplained if !found.diagnosis.within_tolerance.is_empty() => {
            format!(
                "No cause is accepted. What remains with the numbers corrected within their tolerance is, {times}."
            )
        }
        Verdict::Ambiguous | Verdict::Unexplained => {
            format!("No cause is accepted, so all of the model's error remains: {times}.")
        }
    }
}

fn remaining(of: &Dependence) -> Vec<String> {
    let how = if of.as_friction { "as friction, against the motion" } else { "the same both ways" };
    let what = format!("an error by {}, {how}: {:.0} % of its square", of.on, 100.0 * of.share);
    let (makes, look) = cause_of(&of.on, of.as_friction);
    [what.as_str(), makes, look].map(str::to_owned).to_vec()
}

/// What to do, in order.
fn steps(found: &Found, quality: &[Finding]) -> Vec<String> {
    let diagnosis = &found.diagnosis;
    let mut steps = mend_first(quality);
    steps.extend(first_guesses(diagnosis));
    if !diagnosis.causes.is_empty() {
        steps.push(
            "Take model-extended.toml for the simulation; a controller makes use of it as its belief, with [compensation] level = \
             \"full-with-effects\" where it has effects."
                .to_owned(),
        );
    }
    if !diagnosis.unnamed.is_empty() {
        steps.push(
            "The laws without a name are in model-extended.toml: take it where a good prediction is wanted, within what these runs \
             cover. To find out what makes them, see what could, below."
                .to_owned(),
        );
    }
    for group in &diagnosis.ambiguous {
        steps.push(match &group.best {
            Some(best) => format!(
                "{} can't be told apart by these data. Until they can, {} may stand for them: its entry is in model-extended.toml, \
                 behind comment marks.",
                names(&group.ids),
                best.id
            ),
            None => format!("{} can't be told apart by these data: {}.", names(&group.ids), group.reason),
        });
    }
    if diagnosis.verdict == Verdict::NoDiscrepancy && steps.is_empty() {
        steps.push(if diagnosis.within_tolerance.is_empty() {
            "Nothing has to be done: the model may be used as it is, over the range that these runs cover."
                .to_owned()
        } else {
            format!(
                "Nothing has to be done. The given model is off by {} {unit} on the runs kept aside, and model-extended.toml, which has \
                 these corrections, by {}: take it where the difference matters.",
                short(diagnosis.gain.rms_before),
                short(diagnosis.gain.rms_after),
                unit = unit(found.channel)
            )
        });
    }
    steps.push(diagnosis.next_experiment.clone());
    steps
}
