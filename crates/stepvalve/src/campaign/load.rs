//! A plan with all files that it names, read here and nowhere else.

use crate::files::{self, name};
use crate::loaded;
use ::campaign::{BaseTexts, Campaign, Source};
use anyhow::anyhow;
use config::{Named, parse_plan};
use std::path::Path;
use supervisor::Failure;

/// Reads and checks a plan, its scenarios and their models.
///
/// # Errors
/// [`Failure::Input`].
pub fn load(path: &Path) -> Result<Campaign, Failure> {
    let source = Source { file: name(path), text: files::read(path)? };
    let plan = parse_plan(&source.text, &source.file).map_err(Failure::input)?;
    let bases = plan.scenarios.iter().map(|named| base(path, named)).collect::<Result<Vec<_>, _>>()?;
    Campaign::new(source, bases).map_err(Failure::input)
}

/// The texts of a scenario. They are named as plan and scenario name them: rows, which quote those names, must not depend on
/// the folder that the program was started in.
fn base(plan: &Path, named: &Named) -> Result<BaseTexts, Failure> {
    let path = files::beside(plan, &named.text);
    let place = || format!("{}:{}:{}: {}", name(plan), named.line, named.column, named.key);
    let loaded = loaded::load(&path).map_err(|failure| match failure {
        Failure::Input(error) if !path.exists() => Failure::Input(error.context(place())),
        other => other,
    })?;
    if loaded.bridge.is_some() {
        return Err(Failure::Input(anyhow!(
            "{}: found {}, which has a real drive in [drive], expected a simulated valve",
            place(),
            name(&path)
        )));
    }
    let source = |file: &str, text: String| Source { file: file.to_owned(), text };
    let scenario = &loaded.scenario;
    Ok(BaseTexts {
        truth: source(&scenario.truth, loaded.texts.truth),
        belief: source(&scenario.belief, loaded.texts.belief),
        scenario: source(&named.text, loaded.texts.scenario),
    })
}
