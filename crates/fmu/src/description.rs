//! modelDescription.xml of FMI 2.0 and 3.0, and the page of documentation beside it.

use crate::unit::{canonical, model_of};
use crate::units::{UnitSpec, spec};
use crate::variables::TIME;
use crate::{Causality, Kind, LIBRARY, Unit, UnitError, Variable};
use std::fmt::Write;

/// A version of the standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0, which most tools read.
    Two,
    /// FMI 3.0.
    Three,
}

/// What tells a unit from one of another model or of another version of the program: an importer hands it from the description
/// to the library, which refuses a model that isn't the described one.
///
/// # Errors
/// A text that is no model.
pub fn token(text: &str) -> Result<String, UnitError> {
    let text = canonical(&model_of(text)?);
    let part = |seed: u32| {
        let sum = crc32c::crc32c_append(seed, env!("CARGO_PKG_VERSION").as_bytes());
        crc32c::crc32c_append(sum, text.as_bytes())
    };
    let [a, b, c, d] = [0x9e37_79b9, 0x7f4a_7c15, 0xf39c_c060, 0x5ced_c834].map(part);
    Ok(format!("{{{a:08x}-{:04x}-{:04x}-{:04x}-{:04x}{d:08x}}}", b >> 16, b & 0xffff, c >> 16, c & 0xffff))
}

/// modelDescription.xml of a model's text.
///
/// # Errors
/// A text that is no model of a whole valve.
pub fn description(text: &str, version: Version) -> Result<String, UnitError> {
    let unit = Unit::new(text)?;
    let name = model_of(text)?.name;
    let token = token(text)?;
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let head = [
        ("fmiVersion", if version == Version::Two { "2.0" } else { "3.0" }.to_owned()),
        ("modelName", name),
        (if version == Version::Two { "guid" } else { "instantiationToken" }, token),
        ("description", "A stepped rotary valve: stepper motor, friction, spool, orifice".to_owned()),
        ("generationTool", format!("stepvalve {}", env!("CARGO_PKG_VERSION"))),
        ("variableNamingConvention", "flat".to_owned()),
    ];
    element(&mut xml, 0, "fmiModelDescription", &head, Ends::Open);
    co_simulation(&mut xml, version);
    units(&mut xml, &unit);
    line(&mut xml, 1, "<LogCategories>");
    element(&mut xml, 2, "Category", &[("name", "logStatusError".to_owned())], Ends::Closed);
    line(&mut xml, 1, "</LogCategories>");
    let experiment =
        [("startTime", "0".to_owned()), ("stopTime", "1".to_owned()), ("stepSize", "0.001".to_owned())];
    element(&mut xml, 1, "DefaultExperiment", &experiment, Ends::Closed);
    line(&mut xml, 1, "<ModelVariables>");
    if version == Version::Three {
        let time = [
            ("name", "time".to_owned()),
            ("valueReference", TIME.to_string()),
            ("causality", "independent".to_owned()),
            ("variability", "continuous".to_owned()),
            ("unit", "s".to_owned()),
        ];
        element(&mut xml, 2, "Float64", &time, Ends::Closed);
    }
    unit.variables().iter().for_each(|of| variable(&mut xml, of, version));
    line(&mut xml, 1, "</ModelVariables>");
    structure(&mut xml, &unit, version);
    line(&mut xml, 0, "</fmiModelDescription>");
    Ok(xml)
}

/// documentation/index.html of a unit.
pub fn documentation(text: &str) -> Result<String, UnitError> {
    let unit = Unit::new(text)?;
    let mut rows = String::new();
    for of in unit.variables().iter() {
        let role = match of.causality {
            Causality::Input => "input",
            Causality::Output => "output",
            Causality::Fixed => "parameter, fixed",
            Causality::Tunable => "parameter, tunable",
        };
        let start = of.start.map_or(String::new(), |start| format!("{start}"));
        let cells = [of.name.as_str(), role, of.unit.as_deref().unwrap_or(""), &start, &of.about];
        rows.push_str("<tr>");
        cells.iter().for_each(|cell| rows.push_str(&format!("<td>{}</td>", escaped(cell))));
        rows.push_str("</tr>\n");
    }
    let name = escaped(&model_of(text)?.name);
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{name}</title></head><body>\n<h1>{name}</h1>\n\
         <p>A stepped rotary valve, exported by stepvalve {}. Each communication step moves the command from where it was to the input \
         <code>command</code> at a constant speed, as a driver does with its pulses; inputs hold for the whole step. Steps of 1 ms or less \
         are made at once, longer ones in equal parts of 1 ms at most. Tunable parameters act from the next step on, and are checked \
         together there. The model is in <code>resources/model.toml</code>.</p>\n<table border=\"1\">\n\
         <tr><th>variable</th><th>role</th><th>unit</th><th>start</th><th>what it is</th></tr>\n{rows}</table>\n</body></html>\n",
        env!("CARGO_PKG_VERSION")
    ))
}

fn co_simulation(xml: &mut String, version: Version) {
    let yes = || "true".to_owned();
    let mut about =
        vec![("modelIdentifier", LIBRARY.to_owned()), ("canHandleVariableCommunicationStepSize", yes())];
    match version {
        Version::Two => about.extend([
            ("canGetAndSetFMUstate", yes()),
            ("canSerializeFMUstate", yes()),
            ("canNotUseMemoryManagementFunctions", yes()),
        ]),
        Version::Three => about.extend([("canGetAndSetFMUState", yes()), ("canSerializeFMUState", yes())]),
    }
    element(xml, 1, "CoSimulation", &about, Ends::Closed);
}

fn units(xml: &mut String, unit: &Unit) {
    let mut used: Vec<&str> = unit.variables().iter().filter_map(|of| of.unit.as_deref()).collect();
    used.push("s");
    used.sort_unstable();
    used.dedup();
    line(xml, 1, "<UnitDefinitions>");
    for name in used {
        element(xml, 2, "Unit", &[("name", name.to_owned())], Ends::Open);
        if let Some(spec) = spec(name) {
            base(xml, spec);
        }
        line(xml, 2, "</Unit>");
    }
    line(xml, 1, "</UnitDefinitions>");
}

fn base(xml: &mut String, of: &UnitSpec) {
    if let Some(exponents) = of.base {
        let names = ["kg", "m", "s", "A", "K", "rad"];
        let mut about: Vec<(&str, String)> = names
            .into_iter()
            .zip(exponents)
            .filter(|(_, exponent)| *exponent != 0)
            .map(|(name, exponent)| (name, exponent.to_string()))
            .collect();
        if of.offset != 0.0 {
            about.push(("offset", format!("{:?}", of.offset)));
        }
        element(xml, 3, "BaseUnit", &about, Ends::Closed);
    }
    if let Some((name, factor)) = of.display {
        element(
            xml,
            3,
            "DisplayUnit",
            &[("name", name.to_owned()), ("factor", format!("{factor:?}"))],
            Ends::Closed,
        );
    }
}

fn variable(xml: &mut String, of: &Variable, version: Version) {
    let (causality, variability) = match (of.causality, of.kind) {
        (Causality::Input, _) => ("input", "continuous"),
        (Causality::Output, Kind::Real) => ("output", "continuous"),
        (Causality::Output, Kind::Integer) => ("output", "discrete"),
        (Causality::Fixed, _) => ("parameter", "fixed"),
        (Causality::Tunable, _) => ("parameter", "tunable"),
    };
    let mut about = vec![
        ("name", of.name.clone()),
        ("valueReference", of.reference.to_string()),
        ("description", of.about.clone()),
        ("causality", causality.to_owned()),
        ("variability", variability.to_owned()),
    ];
    match of.causality {
        Causality::Output => about.push(("initial", "calculated".to_owned())),
        Causality::Input => {}
        Causality::Fixed | Causality::Tunable => about.push(("initial", "exact".to_owned())),
    }
    let mut value = Vec::new();
    if of.kind == Kind::Real {
        value.extend(of.unit.clone().map(|unit| ("unit", unit)));
        let display = of.unit.as_deref().and_then(spec).and_then(|of| of.display);
        value.extend(display.map(|(name, _)| ("displayUnit", name.to_owned())));
    }
    value.extend(of.start.map(|start| ("start", format!("{start:?}"))));
    match version {
        Version::Two => {
            let kind = if of.kind == Kind::Real { "Real" } else { "Integer" };
            element(xml, 2, "ScalarVariable", &about, Ends::Open);
            element(xml, 3, kind, &value, Ends::Closed);
            line(xml, 2, "</ScalarVariable>");
        }
        Version::Three => {
            about.extend(value);
            element(xml, 2, if of.kind == Kind::Real { "Float64" } else { "Int64" }, &about, Ends::Closed);
        }
    }
}

fn structure(xml: &mut String, unit: &Unit, version: Version) {
    let outputs: Vec<(usize, &Variable)> = unit
        .variables()
        .iter()
        .enumerate()
        .filter(|(_, of)| of.causality == Causality::Output)
        .map(|(at, of)| (at + 1, of))
        .collect();
    line(xml, 1, "<ModelStructure>");
    match version {
        // References by place in the file, counted from 1.
        Version::Two => {
            for list in ["Outputs", "InitialUnknowns"] {
                line(xml, 2, &format!("<{list}>"));
                for (at, _) in &outputs {
                    element(xml, 3, "Unknown", &[("index", at.to_string())], Ends::Closed);
                }
                line(xml, 2, &format!("</{list}>"));
            }
        }
        Version::Three => {
            for name in ["Output", "InitialUnknown"] {
                for (_, of) in &outputs {
                    element(xml, 2, name, &[("valueReference", of.reference.to_string())], Ends::Closed);
                }
            }
        }
    }
    line(xml, 1, "</ModelStructure>");
}

#[derive(Clone, Copy, PartialEq)]
enum Ends {
    Open,
    Closed,
}

fn element(xml: &mut String, depth: usize, name: &str, about: &[(&str, String)], ends: Ends) {
    let mut text = format!("<{name}");
    for (key, value) in about {
        let _ = write!(text, " {key}=\"{}\"", escaped(value));
    }
    text.push_str(if ends == Ends::Open { ">" } else { "/>" });
    line(xml, depth, &text);
}

fn line(xml: &mut String, depth: usize, text: &str) {
    xml.push_str(&"  ".repeat(depth));
    xml.push_str(text);
    xml.push('\n');
}

/// A text as XML and HTML have it within quotes.
fn escaped(text: &str) -> String {
    let mut all = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => all.push_str("&amp;"),
            '<' => all.push_str("&lt;"),
            '>' => all.push_str("&gt;"),
            '"' => all.push_str("&quot;"),
            '\n' => all.push_str("&#10;"),
            other => all.push(other),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_xml_forbids_is_escaped() {
        assert_eq!(escaped("a<b> & \"c\""), "a&lt;b&gt; &amp; &quot;c&quot;");
    }
}
