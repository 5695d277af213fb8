//! The model of a diagnosis, with the numbers that the caller knows exactly.

use crate::files::{self, name};
use anyhow::{Context, anyhow};
use std::path::Path;
use supervisor::Failure;
use toml::{Table, Value};
use valve_model::{EffectId, EffectValue, Model};

/// Reads a model, sets numbers that are known exactly, and says which effects are no question then.
///
/// # Errors
/// [`Failure::Input`] where the model can't be read, has no such number, or not with such a value.
pub fn read(file: &Path, fixes: &[String]) -> Result<(Model, Vec<EffectId>), Failure> {
    let text = files::read(file)?;
    let model = config::parse_model(&text, &name(file)).map_err(Failure::input)?;
    if fixes.is_empty() {
        return Ok((model, Vec::new()));
    }
    let mut table: Table = toml::from_str(&text).with_context(|| name(file)).map_err(Failure::Input)?;
    let mut fixed = Vec::new();
    for fix in fixes {
        let named = || format!("--fix {fix}");
        let of = set(&mut table, fix).with_context(named).map_err(Failure::Input)?;
        fixed.extend(of);
    }
    let text = toml::to_string(&table).with_context(|| name(file)).map_err(Failure::Input)?;
    let named = format!("{} with --fix {}", name(file), fixes.join(" --fix "));
    Ok((config::parse_model(&text, &named).map_err(Failure::input)?, fixed))
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
