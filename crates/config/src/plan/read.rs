//! The plan's file, section by section.

use crate::asked::{Shape, Visit};
use crate::edit::Setting;
use crate::error::ConfigErrors;
use crate::plan::{Design, DesignKind, FailureLimit, How, Named, Plan, Target, Task, Vary};
use crate::reader::{Field, Scalar, Section, asked as asked_of, parse};

const FORMAT: &str = "stepvalve-campaign";
const FORMAT_VERSION: u64 = 1;

/// The most runs of a scenario: 100 MB of rows, and the length of a night at a hundred a second.
const MOST_RUNS: u64 = 1_000_000;
/// The Sobol sequence's length.
const MOST_SOBOL_RUNS: u64 = 1 << 16;
/// The most quantities that are varied.
const MOST_VARIED: usize = 64;
const MOST_SCENARIOS: usize = 1000;

const KIND: &str = "\"grid\" or \"latin-hypercube\" or \"sobol\" or \"random\"";
const PATH: &str = "a path into truth, belief or scenario, such as truth.friction.coulomb_torque_nm";
const VALUE: &str = "a number, a text or true or false";
const ENDS: &str = "two numbers, or two texts with one unit: [0.5, 2.0] or [\"1MPa\", \"5MPa\"]";
const FACTOR: &str = "a number without a unit: a factor has none";
const HOW: [&str; 4] = ["values", "range", "log", "normal"];

/// Reads a campaign's plan from its text. `file` names it in errors.
///
/// # Errors
/// All that is wrong in the text. Whether its scenarios exist and have what is varied is not asked here.
pub fn parse_plan(text: &str, file: &str) -> Result<Plan, ConfigErrors> {
    parse(text, file, FORMAT, FORMAT_VERSION, |root| Some(read(root)))
}

/// What the reader asks of plans that together have every key.
pub(crate) fn asked() -> Vec<Visit> {
    let texts = [
        include_str!("../../../../fuzz/corpus/configuration/campaign.toml"),
        include_str!("../../../../fuzz/corpus/configuration/campaign-grid.toml"),
    ];
    let others = ["sobol", "random"].map(|kind| format!("[design]\nkind = \"{kind}\"\nruns = 1\n"));
    let texts = texts.into_iter().chain(others.iter().map(String::as_str));
    texts.flat_map(|text| asked_of(text, FORMAT, FORMAT_VERSION, read)).collect()
}

fn read(root: Section<'_>) -> Plan {
    let name = root.text("name", "a name");
    let scenarios = read_scenarios(&root);
    let choices = ("simulate", Task::Simulate);
    let others = [("diagnose", Task::Diagnose), ("both", Task::Both)];
    let task = root.find("task").and_then(|field| field.choice(choices, &others)).unwrap_or(Task::Simulate);
    let failure_limit =
        root.find("failure_limit").map_or(FailureLimit::Share(1.0), |field| read_limit(&field));
    let design = root.section("design").map(read_design);
    let kind = design.map(|design| design.kind);
    let fields = root.list("vary");
    if let Some(field) = fields.get(MOST_VARIED) {
        field.refuse_as("one quantity more", format!("at most {MOST_VARIED} that are varied"));
    }
    let vary: Vec<Vary> = fields.iter().filter_map(|field| read_vary(field, kind)).collect();
    for (index, one) in vary.iter().enumerate() {
        if vary.iter().take(index).any(|other| other.path.text == one.path.text)
            && let Some(field) = fields.get(index)
        {
            field.refuse_as(format!("{}, varied twice", one.path.text), "each path once");
        }
    }
    let design = design.unwrap_or(Design { kind: DesignKind::Grid, runs: None, seed: 0 });
    if design.kind == DesignKind::Grid {
        refuse_large_grid(&root, &vary);
    }
    root.finish();
    Plan { name, scenarios, task, failure_limit, design, vary }
}

fn read_scenarios(root: &Section<'_>) -> Vec<Named> {
    const EXPECTED: &str = "a list of scenario files, such as [\"../scenarios/sine-1hz.toml\"]";
    let Some(field) = root.require("scenarios", EXPECTED) else { return Vec::new() };
    root.expects("scenarios", Shape::List);
    let fields = if field.is_array() { field.elements() } else { Vec::new() };
    if fields.is_empty() || fields.len() > MOST_SCENARIOS {
        field.refuse(EXPECTED);
    }
    let mut scenarios: Vec<Named> = Vec::new();
    for field in &fields {
        let text = field.text("the path of a scenario file");
        if scenarios.iter().any(|other| other.text == text) && !text.is_empty() {
            field.refuse_as(format!("{text}, given twice"), "each scenario once");
        }
        scenarios.push(named(text, "scenarios", field));
    }
    scenarios
}

fn named(text: String, key: &str, field: &Field<'_>) -> Named {
    let (line, column) = field.position();
    Named { text, key: key.to_owned(), line, column }
}

fn read_limit(field: &Field<'_>) -> FailureLimit {
    const EXPECTED: &str = "a whole number of runs, or a share of all such as \"10%\"";
    match field.scalar(false, EXPECTED) {
        Some(Scalar::Number(count)) if count >= 0.0 && count.fract() == 0.0 => {
            return FailureLimit::Count(count as u64);
        }
        Some(Scalar::Text(text)) => {
            if let Setting::Number { number, unit } = Setting::of_text(&text)
                && unit == "%"
                && (0.0..=100.0).contains(&number)
            {
                return FailureLimit::Share(number / 100.0);
            }
            field.refuse(EXPECTED);
        }
        Some(_) => field.refuse(EXPECTED),
        None => {}
    }
    FailureLimit::Share(1.0)
}

fn read_design(section: Section<'_>) -> Design {
    let others = [
        ("latin-hypercube", DesignKind::LatinHypercube),
        ("sobol", DesignKind::Sobol),
        ("random", DesignKind::Random),
    ];
    let kind =
        section.require("kind", KIND).and_then(|field| field.choice(("grid", DesignKind::Grid), &others));
    let kind = kind.unwrap_or(DesignKind::Grid);
    let runs = match (kind, section.find("runs")) {
        (DesignKind::Grid, Some(field)) if section.is_clean() => {
            field.refuse("no `runs` in a grid: its size follows from the values and levels");
            None
        }
        (DesignKind::Grid, _) => None,
        (_, _) => {
            let most = if kind == DesignKind::Sobol { MOST_SOBOL_RUNS } else { MOST_RUNS };
            let expected = format!("a whole number from 1 to {most}");
            section.require("runs", &expected).map(|field| field.integer(1..=most))
        }
    };
    let seed = section.integer_or("seed", 0..=i64::MAX as u64, 0);
    section.finish();
    Design { kind, runs, seed }
}

fn read_vary(field: &Field<'_>, kind: Option<DesignKind>) -> Option<Vary> {
    let section = field.section("a table [[vary]]")?;
    let (target, key, path) = match section.require("path", PATH) {
        Some(path) => read_path(&path),
        None => (None, String::new(), None),
    };
    let is_factor = section
        .find("as")
        .and_then(|field| field.choice(("value", false), &[("factor", true)]))
        .unwrap_or(false);
    let how = read_how(&section, is_factor);
    let is_grid = kind == Some(DesignKind::Grid);
    let is_listed = matches!(how, Some(How::Values(_)));
    let levels = match section.find("levels") {
        Some(field) if !is_grid || is_listed => {
            field.refuse("`levels` only in a grid, with range, log or normal");
            None
        }
        Some(field) => Some(field.integer(2..=MOST_RUNS)),
        None if is_grid && !is_listed && how.is_some() => {
            section.require("levels", "how many values a grid has of it, such as 5").map(|_| 2)
        }
        None => None,
    };
    section.finish();
    Some(Vary { path: path?, target: target?, key, is_factor, how: how?, levels })
}

/// The text that a path leads into, the path in there, and where it stands.
fn read_path(field: &Field<'_>) -> (Option<Target>, String, Option<Named>) {
    let text = field.text(PATH);
    let (first, rest) = text.split_once('.').unwrap_or((&text, ""));
    let target = Target::ALL.into_iter().find(|target| target.name() == first);
    if !text.is_empty() && (target.is_none() || rest.is_empty()) {
        field.refuse(PATH);
    }
    if target == Some(Target::Scenario) && ["truth", "belief"].contains(&rest) {
        field.refuse("a value: for other models, list several scenarios");
    }
    (target, rest.to_owned(), Some(named(text.clone(), "vary.path", field)))
}

fn read_how(section: &Section<'_>, is_factor: bool) -> Option<How> {
    let present = section.present(&HOW);
    let [key] = present[..] else {
        let found = if present.is_empty() { "none of them".to_owned() } else { present.join(" and ") };
        section.refuse(found, "one of values, range, log or normal");
        return None;
    };
    let field = section.find(key)?;
    match key {
        "values" => read_values(&field, is_factor),
        "normal" => read_normal(field.section("a table { mean = 1.0, sd = 0.1 }")?, is_factor),
        _ => {
            let (from, to, unit) = read_ends(&field, is_factor)?;
            if key == "range" {
                return Some(How::Range { from, to, unit });
            }
            if from <= 0.0 {
                field.refuse("two numbers above zero: a logarithm has no other");
                return None;
            }
            Some(How::Log { from, to, unit })
        }
    }
}

fn read_values(field: &Field<'_>, is_factor: bool) -> Option<How> {
    let elements = field.elements();
    if elements.is_empty() {
        field.refuse("a list of one value at least");
        return None;
    }
    let settings: Vec<Setting> = elements.iter().filter_map(|element| setting(element, is_factor)).collect();
    (settings.len() == elements.len()).then_some(How::Values(settings))
}

/// A value; a factor is a bare number.
fn setting(field: &Field<'_>, is_factor: bool) -> Option<Setting> {
    let setting = setting_of(field.scalar(true, VALUE)?);
    let is_plain = matches!(&setting, Setting::Number { unit, .. } if unit.is_empty());
    if is_factor && !is_plain {
        field.refuse(FACTOR);
        return None;
    }
    Some(setting)
}

fn setting_of(scalar: Scalar) -> Setting {
    match scalar {
        Scalar::Number(number) => Setting::Number { number, unit: String::new() },
        Scalar::Text(text) => Setting::of_text(&text),
        Scalar::Flag(flag) => Setting::Flag(flag),
    }
}

/// A number with its unit; a factor has none.
fn number(field: &Field<'_>, is_factor: bool, expected: &str) -> Option<(f64, String)> {
    match setting_of(field.scalar(false, expected)?) {
        Setting::Number { unit, .. } if is_factor && !unit.is_empty() => field.refuse(FACTOR),
        Setting::Number { number, unit } => return Some((number, unit)),
        _ => field.refuse(expected),
    }
    None
}

fn read_ends(field: &Field<'_>, is_factor: bool) -> Option<(f64, f64, String)> {
    let elements = if field.is_array() { field.elements() } else { Vec::new() };
    let [from, to] = &elements[..] else {
        field.refuse(ENDS);
        return None;
    };
    let ((low, unit), (high, other)) = (number(from, is_factor, ENDS)?, number(to, is_factor, ENDS)?);
    if unit != other {
        field.refuse(ENDS);
        return None;
    }
    if high <= low {
        to.refuse(format!("more than {low}{unit}"));
        return None;
    }
    Some((low, high, unit))
}

fn read_normal(section: Section<'_>, is_factor: bool) -> Option<How> {
    let read = |key: &str, expected: &str| {
        section.expects(key, Shape::Number);
        section.expects(key, Shape::Text);
        let field = section.require(key, expected)?;
        Some((number(&field, is_factor, expected)?, field))
    };
    let mean = read("mean", "a number, with a unit or without");
    let sd = read("sd", "a number above zero, with the mean's unit");
    let how = mean.zip(sd).and_then(|(((mean, unit), _), ((sd, other), field))| {
        if sd <= 0.0 || unit != other {
            field.refuse("a number above zero, with the mean's unit");
            return None;
        }
        Some(How::Normal { mean, sd, unit })
    });
    section.finish();
    how
}

fn refuse_large_grid(root: &Section<'_>, vary: &[Vary]) {
    let levels = |of: &Vary| match &of.how {
        How::Values(values) => values.len() as u64,
        _ => of.levels.unwrap_or(1),
    };
    let size = vary.iter().map(levels).try_fold(1_u64, u64::checked_mul);
    if size.is_none_or(|size| size > MOST_RUNS) {
        let found = size.map_or("a grid beyond counting".to_owned(), |size| format!("a grid of {size} runs"));
        root.refuse_key("vary", found, format!("at most {MOST_RUNS} runs"));
    }
}
