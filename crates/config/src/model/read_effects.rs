//! `[[effect]]`: what a valve does beyond the nominal model. Names and ranges come from `valve_model::EffectId`.

use valve_model::{Effect, EffectId, EffectSpec, EffectValue, MOST_CUSTOM, ParameterSpec, ValueKind};

use crate::asked::Shape;
use crate::model::read_custom::{IDS, read_custom};
use crate::reader::{Field, Section};
use crate::suggest::nearest;

/// All effects that could be read, in the file's order.
pub(super) fn read_effects(root: &Section<'_>) -> Vec<Effect> {
    let fields = root.list("effect");
    let mut effects: Vec<Effect> = Vec::new();
    for field in &fields {
        if let Some(effect) = read_effect(field) {
            check_beside(field, &effect, &effects);
            effects.push(effect);
        }
    }
    effects
}

/// What a model checks of its effects together, refused where it stands.
fn check_beside(field: &Field<'_>, effect: &Effect, before: &[Effect]) {
    let own = effect.id();
    if before.iter().any(|other| other.id() == own) {
        field.refuse_as(format!("{own}, given twice"), "each effect and each name once");
    }
    let custom = 1 + before.iter().filter(|other| other.id().is_custom()).count();
    if own.is_custom() && custom > MOST_CUSTOM {
        field.refuse_as(format!("{custom} formulas and tables"), format!("at most {MOST_CUSTOM} of them"));
    }
}

fn read_effect(field: &Field<'_>) -> Option<Effect> {
    let section = field.section("a table [[effect]]")?;
    let id = section.require("id", "the name of an effect")?;
    section.expects("id", Shape::Choice(known_ids()));
    let name = id.text("the name of an effect");
    section.depends_on("id", &name);
    if IDS.contains(&name.as_str()) {
        return read_custom(section, &name);
    }
    let Some(effect) = EffectId::from_name(&name) else {
        refuse_id(&id, &name);
        return None;
    };
    let parts = read_parts(&section, effect.spec());
    let parts: Vec<(&str, EffectValue)> = parts.into_iter().map(|part| (part.key, part.value)).collect();
    let effect = Effect::new(effect, &parts);
    let validated = effect.as_ref().map_or_else(|error| Err(error.clone()), |_| Ok(()));
    section.conclude(validated);
    effect.ok()
}

/// What an effect's `id` may be.
fn known_ids() -> Vec<String> {
    let listed = EffectId::ALL.iter().map(|id| id.name().to_owned());
    listed.chain(IDS.map(str::to_owned)).collect()
}

fn refuse_id(id: &Field<'_>, name: &str) {
    // An empty name has been refused as a text already.
    if name.is_empty() {
        return;
    }
    let known = known_ids();
    let hint =
        nearest(name, &known).map_or_else(String::new, |near| format!("{near} (did you mean it?) or "));
    id.refuse(format!("{hint}one of {}", known.join(", ")));
}

/// A parameter with its place in the file.
struct Part {
    start: usize,
    key: &'static str,
    value: EffectValue,
}

/// The parameters that are there, in the file's order: it is kept when the model is written back.
fn read_parts(section: &Section<'_>, spec: &EffectSpec) -> Vec<Part> {
    let read = |row: &'static ParameterSpec| {
        section.expects(
            row.key,
            match row.kind {
                ValueKind::Number => Shape::Number,
                ValueKind::List(_) => Shape::List,
            },
        );
        section.expects(&format!("{}[]", row.key), Shape::Number);
        let field = section.find(row.key)?;
        let value = match row.kind {
            ValueKind::Number => EffectValue::Number(field.number(row.range)),
            ValueKind::List(_) => EffectValue::List(field.numbers(row.range)),
        };
        Some(Part { start: field.start(), key: row.key, value })
    };
    let mut parts: Vec<Part> = spec.parameters.iter().filter_map(read).collect();
    parts.sort_by_key(|part| part.start);
    parts
}
