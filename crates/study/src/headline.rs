//! The answer in one sentence or two.

use crate::words::{corrected, names, sentence_beside, short, unit};
use diagnosis::{BestOfGroup, Cause, Diagnosis, Found, Gain, IN_MODEL, Nearest, Verdict};
use valve_model::EffectId;

/// A plain RMS falls by this part less than one by how well each sample is known where few samples rule it.
const FEWER_SAMPLES_RULE: f64 = 0.8;
/// A plain RMS that falls by less than to this part hides what is gained.
const HARDLY_FALLS: f64 = 0.7;
/// An error of so many times the noise is more than that.
const LOUDER: f64 = 1.1;

/// The answer in one sentence, or two where causes have numbers; `laws` is the one on laws without a name.
pub fn headline(found: &Found, laws: &str) -> String {
    let diagnosis = &found.diagnosis;
    let unit = unit(found.channel);
    let residual = diagnosis.residual.first();
    let (rms, noise) = residual.map_or((f64::NAN, f64::NAN), |of| (of.rms, of.noise));
    let gain = &diagnosis.gain;
    let on = if gain.held_out_runs.is_empty() {
        "the error on the runs that it was fitted on (there are too few to hold some out)"
    } else {
        "the error on runs not used for fitting"
    };
    // What laws without a name bring is told apart.
    let falls = match gain.unnamed.as_ref() {
        None => format!("{on}{}", falls(gain, unit)),
        Some(of_laws) => {
            format!("{on} falls from {} to {} {unit}", short(gain.rms_before), short(of_laws.rms_before))
        }
    };
    let sentences: Vec<String> = diagnosis.causes.iter().map(|cause| sentence_beside(cause, found)).collect();
    let groups: Vec<String> = diagnosis.ambiguous.iter().map(|group| names(&group.ids)).collect();
    let beside = if groups.is_empty() {
        String::new()
    } else {
        format!(" Beside it there is one of these, which these data can't tell apart: {}.", groups.join("; "))
    };
    match diagnosis.verdict {
        Verdict::NoDiscrepancy if !diagnosis.within_tolerance.is_empty() => {
            let numbers: Vec<String> = diagnosis.within_tolerance.iter().map(corrected).collect();
            format!(
                "The model agrees with the measurement within the tolerance of its numbers: {}.",
                numbers.join(", ")
            )
        }
        Verdict::NoDiscrepancy => {
            format!(
                "The model agrees with the measurement: its error of {} {unit} is the measurement's own noise.",
                short(rms)
            )
        }
        Verdict::Unexplained => {
            let (rms, noise, louder) = (short(rms), short(noise), rms > LOUDER * noise);
            let mut says = if louder {
                let why = diagnosis.nearest.as_ref().map_or_else(|| no_cause(found), too_much_left);
                let corrected = within_tolerance_alone(diagnosis).unwrap_or_default();
                format!(
                    "The model is wrong by {rms} {unit} where the measurement scatters by {noise}{corrected}, and {why}."
                )
            } else {
                let over_noise = diagnosis.gain.over_noise_after;
                format!(
                    "The model is wrong by {rms} {unit}; the measurement's least certain samples scatter by as much, but each sample counted by how \
                     well it is known that is {over_noise:.2} times the noise, and not noise alone."
                )
            };
            says.push_str(laws);
            for seen in &diagnosis.observations {
                says.push(' ');
                says.push_str(seen);
            }
            says
        }
        Verdict::Ambiguous => {
            let mut says = format!(
                "The model is wrong by {} {unit}, and these data can't tell which of these it is: {}.",
                short(rms),
                groups.join("; ")
            );
            let best: Vec<&BestOfGroup> =
                diagnosis.ambiguous.iter().filter_map(|group| group.best.as_ref()).collect();
            if let Some(first) = best.first() {
                let ids: Vec<EffectId> = best.iter().map(|best| best.id).collect();
                says.push_str(&format!(
                    " With what fitted best ({}) the error on runs not used for fitting would fall from {} to {} {unit}.",
                    names(&ids),
                    short(gain.rms_before),
                    short(first.rms_after)
                ));
            }
            says
        }
        Verdict::Explained => {
            format!("{}{} {falls}.{beside}", joined(&sentences), lacking(&diagnosis.causes))
        }
        Verdict::PartlyExplained => {
            format!(
                "{}{} {falls}; something is left{}.{beside}{laws}",
                joined(&sentences),
                lacking(&diagnosis.causes),
                if groups.is_empty() { " that no cause explains" } else { "" }
            )
        }
    }
}

/// Corrections that leave less than this part of an error are told with it.
const CORRECTED: f64 = 0.9;

/// What corrections within the tolerance take of an error that no cause explains, where they take part of it.
fn within_tolerance_alone(diagnosis: &Diagnosis) -> Option<String> {
    let gain = &diagnosis.gain;
    let (before, after) = (gain.over_noise_before, gain.over_noise_after);
    let is_part = diagnosis.unnamed.is_empty() && !diagnosis.within_tolerance.is_empty();
    (is_part && after < CORRECTED * before).then(|| {
        let numbers: Vec<String> = diagnosis.within_tolerance.iter().map(corrected).collect();
        format!(
            "; with its numbers corrected within their tolerance ({}) it leaves {after:.1} in place of {before:.1} times the noise, each sample \
             counted by how well it is known",
            numbers.join(", ")
        )
    })
}

/// How the error falls: where a few samples rule a plain RMS, by how well each is known.
fn falls(gain: &Gain, unit: &str) -> String {
    let (before, after) = (gain.over_noise_before, gain.over_noise_after);
    let (plain_before, plain_after) = (short(gain.rms_before), short(gain.rms_after));
    if is_ruled_by_few(gain) {
        return format!(
            ", each sample counted by how well it is known, falls from {before:.2} to {after:.2} times the noise (a plain RMS of \
             {plain_before} and {plain_after} {unit} is ruled by a few that stand far out)"
        );
    }
    let way = if gain.rms_after < gain.rms_before { "falls" } else { "rises" };
    format!(" {way} from {plain_before} to {plain_after} {unit}")
}

/// Whether a plain RMS says much less of the gain than one by how well each sample is known.
pub fn is_ruled_by_few(gain: &Gain) -> bool {
    let over_noise = gain.over_noise_after / gain.over_noise_before;
    gain.ratio > HARDLY_FALLS && over_noise < FEWER_SAMPLES_RULE * gain.ratio
}

/// What the causes mean for the model: a number of it is another, it has other numbers of an effect, or it lacks something.
fn lacking(causes: &[Cause]) -> &'static str {
    let is_number = |cause: &Cause| cause.id.spec().folded_into.is_some();
    let has_it = |cause: &Cause| is_number(cause) || cause.evidence.contains_key(IN_MODEL);
    if causes.iter().all(is_number) {
        ". With that corrected,"
    } else if causes.iter().all(has_it) {
        "; the model has it with other numbers. With these in their place,"
    } else if causes.iter().any(|cause| !is_number(cause) && has_it(cause)) {
        ", some of which the model has with other numbers. With all of it,"
    } else if causes.iter().any(is_number) {
        "; the model has none of that. With all of it,"
    } else {
        "; the model has none of it. With it,"
    }
}

/// Why nothing is named where nothing comes near.
fn no_cause(found: &Found) -> String {
    let diagnosis = &found.diagnosis;
    if diagnosis.search_ended {
        let best = found
            .ranking
            .first()
            .map_or(String::new(), |(id, _)| format!("; the best candidate so far is {id}"));
        return format!("the search was ended before it was decided what explains it{best}");
    }
    if diagnosis.ripples.is_empty() {
        "none of the known causes explains it".to_owned()
    } else {
        "beside ripples over the angle none of the known causes explains it".to_owned()
    }
}

/// Why causes that remove most of it are not named.
fn too_much_left(nearest: &Nearest) -> String {
    let one = nearest.ids.len() == 1;
    let (verb, it, cause) = if one {
        ("removes", "it leaves", "it is not the cause")
    } else {
        ("remove", "they leave", "they are not the causes")
    };
    let removes =
        format!("{} {verb} the largest part, {:.0} %", names(&nearest.ids), 100.0 * nearest.removes);
    match &nearest.leaves_by {
        Some(on) => format!("{removes}, but what {it} goes by {on}: {cause} alone"),
        None => format!("{removes}, but {it} too much for that: {cause} alone"),
    }
}

/// Statements in one sentence: the first alone begins with a capital.
fn joined(sentences: &[String]) -> String {
    let mut all = sentences.iter().map(String::as_str);
    let mut text = all.next().unwrap_or_default().to_owned();
    for sentence in all {
        let mut letters = sentence.chars();
        let first = letters.next().map(|letter| letter.to_lowercase().to_string()).unwrap_or_default();
        text.push_str(&format!("; {first}{}", letters.as_str()));
    }
    text
}
