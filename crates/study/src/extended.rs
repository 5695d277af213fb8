//! model-extended.toml: the given model with what was found, and comments that say how well it is known. Numbers of a section
//! that are off by a factor are corrected where they stand; everything else is an effect of its own.

use config::{ModelComments, write_model};
use diagnosis::{BestOfGroup, Cause, Corrected, Evidence, Found};
use valve_model::{Effect, EffectId, Model};

use crate::unnamed;
use crate::words::{corrected, is_changed, known, unit};

/// The given model with what was found, factors in the sections' numbers: there the controller looks for them too.
pub fn model(found: &Found) -> Model {
    // A factor on something that the model doesn't have was no candidate.
    found.extended.with_factors_in_its_numbers().unwrap_or_else(|_| found.extended.clone())
}

/// The text of the file.
pub fn text(found: &Found, given: &Model, log: &str, model_file: &str) -> String {
    let mut extended = model(found);
    let causes = &found.diagnosis.causes;
    let (corrections, laws) = (&found.diagnosis.within_tolerance, &found.diagnosis.unnamed);
    if is_changed(found) {
        extended.name =
            format!("{}, {}", given.name, if has_effects(found) { "extended" } else { "corrected" });
    }
    let mut comments = ModelComments::new().with_header(header(found, given, log, model_file));
    for (index, effect) in extended.effects.iter().enumerate() {
        let section = format!("effect[{index}]");
        let text = causes
            .iter()
            .find(|cause| cause.id == effect.id())
            .map(about)
            .or_else(|| corrections.iter().find(|of| of.id == effect.id()).map(about_correction))
            .or_else(|| {
                laws.iter().find(|law| law.id == effect.id()).map(|law| unnamed::comment(law, found))
            });
        let Some(text) = text else { continue };
        comments = comments.with_section(&section, text);
    }
    for (section, text) in sections(causes, corrections) {
        comments = comments.with_section(section, text);
    }
    write_model(&extended, &comments) + &alternatives(found, given) + &nearest(found) + &offered(found, given)
}

/// What to say above a number that is corrected within its tolerance.
fn about_correction(of: &Corrected) -> String {
    let text = format!("Corrected within its tolerance: {}.", corrected(of));
    if !of.is_of_transducer() {
        return text;
    }
    format!(
        "{text}\nIt is of the transducer, and the model's levels are fitted beside it: records of another transducer may need another."
    )
}

/// The best of each group that can't be told apart, in comments: whoever wants it takes the marks away.
fn alternatives(found: &Found, given: &Model) -> String {
    let mut text = String::new();
    for group in &found.diagnosis.ambiguous {
        // One that the model has already would have to be told from that.
        let new = |best: &&BestOfGroup| !given.effects.iter().any(|effect| effect.id() == best.id);
        let Some(best) = group.best.as_ref().filter(new) else { continue };
        let Some(effect) = found.proposed.iter().find(|effect| effect.id() == best.id) else { continue };
        let others: Vec<&str> = group.ids.iter().filter(|id| **id != best.id).map(|id| id.name()).collect();
        let mut lines = vec![
            format!(
                "These data can't tell {} from {}, which fitted best: {}.",
                others.join(" or "),
                best.id,
                group.reason
            ),
            format!(
                "With {} the error on runs not used for fitting is {:.4e} {}.",
                if found.proposed.len() > 1 { "all that is offered here" } else { "it" },
                best.rms_after,
                unit(found.channel)
            ),
        ];
        lines.extend(known(&best.parameters));
        lines.extend(entry(effect, given));
        text.push('\n');
        lines.iter().for_each(|line| text.push_str(&format!("# {line}\n")));
    }
    text
}

/// What the model with one of several causes that can't be told apart is called.
pub fn rival_file(id: EffectId) -> String {
    format!("model-{id}.toml")
}

/// A model for each effect of the groups that can't be told apart, by its file's name.
pub fn rivals(found: &Found, given: &Model) -> Vec<(String, String)> {
    let fits = || found.diagnosis.ambiguous.iter().flat_map(|group| &group.rivals);
    let model = |effect: &Effect| {
        let mut model = given.clone();
        model.name = format!("{}, with {}", given.name, effect.id());
        model.effects.retain(|present| present.id() != effect.id());
        model.effects.push(effect.clone());
        let mut comments = ModelComments::new();
        if let Some(fit) = fits().find(|fit| fit.id == effect.id()) {
            let mut lines = known(&fit.parameters);
            let error =
                format!("error on runs not used for fitting: {:.4e} {}", fit.rms_after, unit(found.channel));
            lines.push(error);
            let section = format!("effect[{}]", model.effects.len() - 1);
            comments = comments.with_section(&section, lines.join("\n"));
        }
        (rival_file(effect.id()), write_model(&model, &comments))
    };
    found.rivals.iter().map(model).collect()
}

/// What removes most of the error and was not accepted, with its numbers, in comments.
fn nearest(found: &Found) -> String {
    let Some(nearest) = &found.diagnosis.nearest else { return String::new() };
    let mut text =
        format!("\n# Not accepted, though {:.0} % of the error goes with it:\n", 100.0 * nearest.removes);
    for (id, parameters) in &nearest.parameters {
        text.push_str(&format!("# {id}\n"));
        known(parameters).iter().for_each(|line| text.push_str(&format!("#   {line}\n")));
    }
    text
}

/// What is there and was kept out, in comments: whoever wants it takes the marks away.
fn offered(found: &Found, given: &Model) -> String {
    let mut text = String::new();
    for offered in &found.diagnosis.offered {
        let Some(effect) = found.proposed.iter().find(|effect| effect.id() == offered.id) else { continue };
        let mut lines = vec![
            format!("{} is there, but kept out: {}.", offered.id, offered.reason),
            format!(
                "With it the error on runs not used for fitting is {:.4e} {}.",
                offered.rms_after,
                unit(found.channel)
            ),
        ];
        lines.extend(known(&offered.parameters));
        lines.extend(entry(effect, given));
        text.push('\n');
        lines.iter().for_each(|line| text.push_str(&format!("# {line}\n")));
    }
    text
}

/// The entry of an effect, to be commented out.
fn entry(effect: &Effect, given: &Model) -> Vec<String> {
    let alone = Model { effects: vec![effect.clone()], ..given.clone() };
    let written = write_model(&alone, &ModelComments::new());
    let Some((_, entry)) = written.split_once("[[effect]]\n") else { return Vec::new() };
    let how = "To try it, take the \"# \" off [[effect]] and the numbers below it.".to_owned();
    [how, "[[effect]]".to_owned()].into_iter().chain(entry.lines().map(str::to_owned)).collect()
}

/// What to say above each section whose numbers were corrected.
fn sections(causes: &[Cause], corrections: &[Corrected]) -> Vec<(&'static str, String)> {
    let of = |section: &'static str| {
        let number = |id: EffectId| id.spec().folded_into.filter(|number| number.section == section);
        let of_causes = causes.iter().filter_map(|cause| {
            Some(format!("{}: {} corrected. {}", cause.id, number(cause.id)?.keys, about(cause)))
        });
        let of_corrections = corrections
            .iter()
            .filter_map(|of| Some(format!("{}: {}", number(of.id)?.keys, about_correction(of))));
        let text = of_causes.chain(of_corrections).collect::<Vec<_>>().join("\n");
        (!text.is_empty()).then_some((section, text))
    };
    ["motor", "load", "friction"].into_iter().filter_map(of).collect()
}

fn header(found: &Found, given: &Model, log: &str, model: &str) -> String {
    let gain = &found.diagnosis.gain;
    let unit = unit(found.channel);
    let mut lines = vec![
        format!("{} ({model}), held against {log} by stepvalve diagnose.", given.name),
        format!("Verdict: {}.", found.diagnosis.verdict.name()),
    ];
    if is_changed(found) {
        lines.push(format!(
            "Error on runs not used for fitting: {:.4e} {unit} before, {:.4e} {unit} after.",
            gain.rms_before, gain.rms_after
        ));
    }
    if causes_are_effects(found) {
        lines.push(
            "A controller makes use of effects where its scenario says: [compensation] level = \"full-with-effects\"."
                .to_owned(),
        );
    }
    lines.join("\n")
}

/// Whether the model has causes or laws that it was not given.
fn has_effects(found: &Found) -> bool {
    !found.diagnosis.causes.is_empty() || !found.diagnosis.unnamed.is_empty()
}

/// Whether anything was found that is no factor on a section's number.
fn causes_are_effects(found: &Found) -> bool {
    !found.diagnosis.unnamed.is_empty()
        || found.diagnosis.causes.iter().any(|cause| cause.id.spec().folded_into.is_none())
}

fn about(cause: &Cause) -> String {
    let mut lines = vec![format!(
        "Found by stepvalve diagnose; without it the error on held-out runs is {:.1} % larger.",
        100.0 * cause.rms_gain / (1.0 - cause.rms_gain).max(1e-9)
    )];
    lines.extend(known(&cause.parameters));
    if let Some(Evidence::Text(taken)) = cause.evidence.get("taken") {
        lines.push(taken.clone());
    }
    lines.join("\n")
}
