//! The model of a diagnosis, with the numbers that the caller knows exactly.

use anyhow::{Context, anyhow};
use toml::{Table, Value};
use valve_model::{EffectId, EffectValue, Model};

/// A model with numbers that are known exactly.
#[derive(Debug, Clone)]
pub struct Fixed {
    /// The model.
    pub model: Model,
    /// The effects that they leave no question about.
    pub effects: Vec<EffectId>,
}

/// Reads a model and sets numbers that are known exactly, each `SECTION.KEY=VALUE` or `ID.KEY=VALUE`.
///
/// # Errors
/// A text that is no model, with file, line and column; one that has no such number, or not with such a value.
pub fn fixed(text: &str, file: &str, fixes: &[String]) -> anyhow::Result<Fixed> {
    let model = config::parse_model(text, file)?;
    if fixes.is_empty() {
        return Ok(Fixed { model, effects: Vec::new() });
    }
    let mut table: Table = toml::from_str(text).with_context(|| file.to_owned())?;
    let mut effects = Vec::new();
    for fix in fixes {
        effects.extend(set(&mut table, fix).with_context(|| format!("--fix {fix}"))?);
    }
    let text = toml::to_string(&table).with_context(|| file.to_owned())?;
    let named = format!("{file} with --fix {}", fixes.join(" --fix "));
    Ok(Fixed { model: config::parse_model(&text, &named)?, effects })
}

/// Sets one number; the effects that it leaves no question about.
fn set(table: &mut Table, fix: &str) -> anyhow::Result<Vec<EffectId>> {
    let parts = fix.split_once('=').and_then(|(name, value)| Some((name.split_once('.')?, value)));
    let Some(((place, key), text)) = parts else {
        return Err(anyhow!("expected SECTION.KEY=VALUE or ID.KEY=VALUE"));
    };
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    let number = number.ok_or_else(|| anyhow!("found {text}, expected a number"))?;
    if let Some(id) = EffectId::from_name(place) {
        return set_effect(table, id, key, number).map(|()| vec![id]);
    }
    let effects = factors_on(place, key);
    if effects.is_empty() {
        return Err(anyhow!("no cause is a factor on it; expected one of {}", known().join(", ")));
    }
    let section = table.get_mut(place).and_then(Value::as_table_mut);
    let section = section.ok_or_else(|| anyhow!("the model has no section [{place}]"))?;
    section.insert(key.to_owned(), Value::Float(number));
    Ok(effects)
}

/// The effects that are a factor on a number of the model.
fn factors_on(section: &str, key: &str) -> Vec<EffectId> {
    let is_on = |id: &&EffectId| {
        let number = id.spec().folded_into.filter(|number| number.section == section);
        number.is_some_and(|number| number.each_key().any(|own| own == key))
    };
    EffectId::ALL.iter().filter(is_on).copied().collect()
}

/// The numbers that may be fixed, as a message names them.
fn known() -> Vec<String> {
    let mut known: Vec<String> = Vec::new();
    for number in EffectId::ALL.iter().filter_map(|id| id.spec().folded_into) {
        for key in number.each_key() {
            let name = format!("{}.{key}", number.section);
            if !known.contains(&name) {
                known.push(name);
            }
        }
    }
    known
}

/// Puts an effect with its only number in the place of what the model has of it.
fn set_effect(table: &mut Table, id: EffectId, key: &str, number: f64) -> anyhow::Result<()> {
    let parameters = id.spec().parameters;
    let [only] = parameters else {
        return Err(anyhow!("{id} has {} parameters: write it into the model, [[effect]]", parameters.len()));
    };
    if only.key != key {
        return Err(anyhow!("{id} has no {key}, expected {}", only.key));
    }
    valve_model::Effect::new(id, &[(key, EffectValue::Number(number))])?;
    let effects = table.entry("effect").or_insert_with(|| Value::Array(Vec::new()));
    let effects = effects.as_array_mut().ok_or_else(|| anyhow!("effect is no list"))?;
    effects.retain(|effect| effect.get("id").and_then(Value::as_str) != Some(id.name()));
    let entry = [("id", Value::String(id.name().to_owned())), (key, Value::Float(number))];
    effects.push(Value::Table(entry.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()));
    Ok(())
}
