//! Laws without a name, in words: how they go, what usually makes such a thing, and the comment above them in a model.

use crate::makers::cause_of;
use crate::words::{self, numbers, short, unit};
use diagnosis::{Found, Unnamed, UnnamedRule};

/// Laws as a sentence goes on after the error's size; empty where there are none.
pub fn sentence(found: &Found) -> String {
    let laws = &found.diagnosis.unnamed;
    let Some(gain) = found.diagnosis.gain.unnamed.as_ref().filter(|_| !laws.is_empty()) else {
        return String::new();
    };
    let told: Vec<String> = laws.iter().map(goes).collect();
    let unit = unit(found.channel);
    let as_well: String = laws.iter().filter_map(as_well).map(|told| format!(" {told}.")).collect();
    format!(
        " Beyond the list, {}. With that the error on runs not used for fitting falls from {} to {} {unit}.{as_well}",
        told.join("; beside it, "),
        short(gain.rms_before),
        short(gain.rms_after)
    )
}

/// How a law goes, and what the list has of its kind.
pub fn goes(law: &Unnamed) -> String {
    let kind = law.kind.map_or(String::new(), |id| format!(": {id}, of another form than the list has"));
    format!("{}{kind}", form(law))
}

/// The laws that would do as well in its place; `None` where there are none.
pub fn as_well(law: &Unnamed) -> Option<String> {
    let told: Vec<String> = law.rivals.iter().map(form).collect();
    (!told.is_empty()).then(|| format!("As well: {}", told.join("; or ")))
}

fn form(law: &Unnamed) -> String {
    let acts = match law.acts_on.as_str() {
        "level" => "friction's levels change",
        "viscous" => "viscous friction changes",
        _ => "a torque depends",
    };
    let on = quantities(law);
    match &law.rule {
        UnnamedRule::Formula { expression } => {
            let (preposition, like) = if law.acts_on == "torque" { ("on", "like") } else { ("with", "by") };
            format!("{acts} {preposition} {on} {like} {expression} ({})", numbers(&law.parameters))
        }
        UnnamedRule::Table { knots, .. } => {
            let preposition = if law.acts_on == "torque" { "on" } else { "with" };
            let count = knots.first().map_or(0, Vec::len);
            format!("{acts} {preposition} {on} as a table of {count} knots says")
        }
    }
}

fn quantities(law: &Unnamed) -> String {
    let plain: Vec<String> = law.depends_on.iter().map(|of| of.replace('_', " ")).collect();
    words::listed(&plain.iter().map(String::as_str).collect::<Vec<_>>())
}

/// What usually makes such a law, and how it is looked for.
pub fn could(law: &Unnamed) -> (&'static str, &'static str) {
    let on: Vec<&str> = law.depends_on.iter().map(String::as_str).collect();
    let acts_on_friction = law.acts_on != "torque";
    match on.as_slice() {
        ["time"] if law.parameters.contains_key("w") => (
            "a pump, the mains, a structure that rings",
            "stop what turns nearby; measure the torque at rest and see whether the tone is there",
        ),
        ["angle"] if law.parameters.contains_key("order") => (
            "something geared to the spool: a gear, a belt, a bearing's balls",
            "count the teeth or balls: the order is their number for a turn of the spool",
        ),
        ["speed"] if !acts_on_friction => (
            "drag of churned oil, a fan, eddy currents; friction of another form",
            "run constant speeds both ways over the whole range, without oil if that can be",
        ),
        ["time"] | ["distance"] => (
            "something that warms up, runs in or wears",
            "repeat the first runs at the end, and after a rest of an hour",
        ),
        [first, ..] => cause_of(first, acts_on_friction),
        [] => cause_of("", false),
    }
}

/// What to say above a law in the extended model.
pub fn comment(law: &Unnamed, found: &Found) -> String {
    let (makes, _) = could(law);
    let mut lines = vec![
        "Found by stepvalve diagnose in what no cause of its list explains; it describes and names nothing."
            .to_owned(),
        format!("What could make it: {makes}."),
    ];
    lines.extend(as_well(law));
    lines.extend(law.kind.map(|id| format!("It acts as {id} does, in another form than the list has.")));
    if let Some(gain) = &found.diagnosis.gain.unnamed {
        lines.push(format!(
            "With all laws without a name, and what is corrected beside them, the error on runs not used for fitting is {} times as large (95 % \
             between {} and {}).",
            short(gain.ratio),
            short(gain.ratio_ci95[0]),
            short(gain.ratio_ci95[1])
        ));
    }
    lines.extend(words::known(&law.parameters));
    lines.join("\n")
}
