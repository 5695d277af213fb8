//! Laws that the caller suspects: `--hypothesis` and `--effects`, as rivals of the list's causes.

use anyhow::{Context, anyhow};
use diagnosis::{Suspect, SuspectParameter};
use valve_model::{
    ActsOn, CustomLaw, Effect, ExpressionError, Label, Rule, check_expression, parameter_names,
};

/// How a hypothesis is written.
const FORM: &str = "[NAME:] torque += EXPRESSION, level *= 1 + EXPRESSION or viscous *= 1 + EXPRESSION, each with ; PARAMETER = START behind it";

/// A file of laws: its name and its text.
#[derive(Debug, Clone, Copy)]
pub struct LawFile<'a> {
    /// As errors name it.
    pub file: &'a str,
    /// What it says.
    pub text: &'a str,
}

/// The laws of all `--hypothesis` and of the file of `--effects`.
///
/// # Errors
/// A text that is no law, with its column; a file that is wrong, with line and column; a name given twice.
pub fn suspects(hypotheses: &[String], effects: Option<LawFile<'_>>) -> anyhow::Result<Vec<Suspect>> {
    let mut suspects = Vec::new();
    for (index, text) in hypotheses.iter().enumerate() {
        let default = if index == 0 { "hypothesis".to_owned() } else { format!("hypothesis-{}", index + 1) };
        let suspect = hypothesis(text, &default);
        suspects.push(suspect.with_context(|| format!("--hypothesis '{text}'"))?);
    }
    if let Some(LawFile { file, text }) = effects {
        for own in config::parse_effects(text, file)? {
            let place = || format!("{file}:{}: effect {}", own.line, own.effect.id());
            let of = own.parameters.iter().map(|of| SuspectParameter {
                key: of.key,
                start: of.start,
                min: of.min,
                max: of.max,
                unit: of.unit.clone(),
            });
            let suspect = Suspect::new(own.effect.clone(), of.collect()).map_err(|error| anyhow!(error));
            suspects.push(suspect.with_context(place)?);
        }
    }
    let twice = suspects
        .iter()
        .enumerate()
        .find(|(index, of)| suspects.iter().take(*index).any(|other| other.effect.id() == of.effect.id()));
    match twice {
        None => Ok(suspects),
        Some((_, of)) => Err(anyhow!("found two laws called {}, expected each name once", of.effect.id())),
    }
}

/// A law from its text.
fn hypothesis(text: &str, default: &str) -> anyhow::Result<Suspect> {
    let (law, starts) = text.split_once(';').unwrap_or((text, ""));
    let (called, target) = match law.split_once(':') {
        Some((called, _)) => (called.trim(), called.len() + 1),
        None => (default, 0),
    };
    let (acts_on, begins) = acts_on(law, target)?;
    let (_, expression) = law.split_at(begins);
    let place = |error: ExpressionError| {
        let column = text.get(..begins).map_or(0, |before| before.chars().count()) + error.at + 1;
        anyhow!("column {column}: found {}, expected {}", error.found, error.expected)
    };
    let names = parameter_names(expression).map_err(place)?;
    let parameters = parameters(&names, starts)?;
    let numbers: Vec<(&str, f64)> =
        parameters.iter().map(|of| (of.key.as_str(), of.start.unwrap_or(1.0))).collect();
    check_expression(expression, &numbers, acts_on).map_err(place)?;
    let rule = Rule::Formula(expression.trim().to_owned());
    let effect = Effect::custom_named(called, CustomLaw { acts_on, rule }, &numbers)?;
    Suspect::new(effect, parameters).map_err(|error| anyhow!(error))
}

/// What a law acts on, and the byte at which its expression begins.
fn acts_on(law: &str, target: usize) -> anyhow::Result<(ActsOn, usize)> {
    let column = || law.get(..target).map_or(0, |before| before.chars().count()) + 1;
    let refused = || {
        anyhow!("column {}: found `{}`, expected {FORM}", column(), law.get(target..).unwrap_or("").trim())
    };
    let sides = law.get(target..).and_then(|rest| rest.split_once('='));
    let (left, right) = sides.ok_or_else(refused)?;
    let mut begins = target + left.len() + 1;
    let word: String = left.split_whitespace().collect();
    let acts_on = word.strip_suffix(['+', '*']).and_then(ActsOn::from_name).ok_or_else(refused)?;
    let adds = acts_on == ActsOn::Torque;
    if word.ends_with('+') != adds {
        return Err(refused());
    }
    if !adds {
        // The factor is 1 + the expression.
        let rest = right.trim_start().strip_prefix('1').map(str::trim_start);
        let behind = rest.and_then(|rest| rest.strip_prefix('+')).ok_or_else(refused)?;
        begins = law.len() - behind.len();
    }
    Ok((acts_on, begins))
}

/// The parameters with the starts that are given.
fn parameters(names: &[String], starts: &str) -> anyhow::Result<Vec<SuspectParameter>> {
    let mut parameters = Vec::new();
    for name in names {
        let key =
            Label::new(name).ok_or_else(|| anyhow!("found `{name}`, expected a name of at most 31 bytes"))?;
        parameters.push(SuspectParameter::unknown(key));
    }
    for start in starts.split(';').filter(|start| !start.trim().is_empty()) {
        let given =
            start.split_once('=').and_then(|(key, number)| Some((key.trim(), number.trim().parse().ok()?)));
        let (key, number) =
            given.ok_or_else(|| anyhow!("found `{}`, expected PARAMETER = START", start.trim()))?;
        let mut own = parameters.iter_mut().filter(|of| of.key == key);
        let own = own
            .next()
            .ok_or_else(|| anyhow!("found a start of `{key}`, expected one of {}", names.join(", ")))?;
        own.start = Some(number);
    }
    Ok(parameters)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_read_as_laws() {
        let law = |text: &str| hypothesis(text, "hypothesis").unwrap().effect;
        let drag = law("torque += a*speed*abs(speed)");
        assert_eq!(drag.id().name(), "hypothesis");
        assert_eq!(drag.custom().unwrap().acts_on, ActsOn::Torque);
        let level = law("worn: level *= 1 + a*max(0, cos(angle - b)) ; b = 0.5");
        assert_eq!((level.id().name(), level.number("b")), ("worn", 0.5));
        assert_eq!(level.custom().unwrap().rule, Rule::Formula("a*max(0, cos(angle - b))".to_owned()));
        assert_eq!(law("viscous*=1+a*speed").custom().unwrap().acts_on, ActsOn::Viscous);
    }

    #[test]
    fn errors_name_the_column() {
        for (text, expected) in [
            (
                "torque += a*sped",
                "column 13: found an unknown name `sped`, expected speed (did you mean it?)",
            ),
            ("drag: torque += a*speed*abs(speed, 2)", "column 25: found 2 argument(s), expected 1 of abs"),
            ("level *= 1 + a/speed", "column 15: found an operation that has no finite value near speed"),
            ("force += a*speed", "column 1: found `force += a*speed`, expected [NAME:] torque +="),
            ("torque *= 1 + a*speed", "column 1: found"),
            ("level *= a*speed", "column 1: found"),
            ("torque += 1 + a*speed", "found a law that acts whatever its parameters are"),
            ("torque += a*speed; c = 1", "found a start of `c`, expected one of a"),
            ("torque += a*speed; a", "found `a`, expected PARAMETER = START"),
        ] {
            let error = hypothesis(text, "hypothesis").unwrap_err().to_string();
            assert!(error.starts_with(expected), "{text}: {error}");
        }
    }
}
