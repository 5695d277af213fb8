//! A plan with the texts of its scenarios: how many runs there are, and what each is made of.

use crate::base::{Base, BaseTexts, Source};
use crate::design::{Points, grid_levels};
use crate::error::CampaignError;
use config::{
    ConfigError, ConfigErrors, DesignKind, Editable, FailureLimit, How, Plan, Setting, Target, Vary,
    parse_model, parse_plan, parse_scenario,
};
use statrs::distribution::{ContinuousCDF, Normal};

/// The three texts of a run.
pub type RunTexts = BaseTexts;

/// A plan that fits its scenarios.
#[derive(Debug, Clone)]
pub struct Campaign {
    pub(crate) plan: Plan,
    source: Source,
    pub(crate) bases: Vec<Base>,
    /// Points of a scenario.
    points: u64,
    /// Of a grid, the number of levels of each quantity; else empty.
    sizes: Vec<u64>,
    design: Points,
}

impl Campaign {
    /// A plan's text with those of its scenarios, in the plan's order.
    ///
    /// # Errors
    /// Texts that are wrong by themselves, and a plan that varies what its scenarios don't have.
    pub fn new(source: Source, texts: Vec<BaseTexts>) -> Result<Self, CampaignError> {
        let plan = parse_plan(&source.text, &source.file)?;
        let bases = texts.into_iter().map(Base::new).collect::<Result<Vec<_>, _>>()?;
        let refused: Vec<ConfigError> = plan
            .vary
            .iter()
            .filter_map(|vary| bases.iter().find_map(|base| refusal(vary, base, &source.file)))
            .collect();
        if !refused.is_empty() {
            return Err(CampaignError::Plan(refused));
        }
        let is_grid = plan.design.kind == DesignKind::Grid;
        let sizes: Vec<u64> = if is_grid { plan.vary.iter().map(levels).collect() } else { Vec::new() };
        let points = if is_grid { sizes.iter().product() } else { plan.design.runs.unwrap_or(1) };
        let design = Points::new(plan.design.kind, plan.design.seed, points, plan.vary.len());
        Ok(Self { plan, source, bases, points, sizes, design })
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Its text.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// The scenarios with their models, before anything is varied.
    pub fn bases(&self) -> impl Iterator<Item = &BaseTexts> {
        self.bases.iter().map(|base| &base.texts)
    }

    /// What is allowed in the scenarios but may surprise, behind the scenario's file.
    pub fn warnings(&self) -> Vec<String> {
        let of = |base: &Base| {
            let file = base.texts.scenario.file.clone();
            base.warnings().into_iter().map(move |warning| format!("{file}: {warning}"))
        };
        self.bases.iter().flat_map(of).collect()
    }

    /// How many runs there are: all points of the first scenario, then all of the next.
    pub fn runs(&self) -> u64 {
        self.points * self.bases.len() as u64
    }

    /// How many of them may fail.
    pub fn failures_allowed(&self) -> u64 {
        match self.plan.failure_limit {
            FailureLimit::Count(count) => count,
            // 29 % of 100 are 29, though 0.29 times 100 is a little less.
            FailureLimit::Share(share) => (share * self.runs() as f64 * (1.0 + 1e-12)).floor() as u64,
        }
    }

    pub(crate) fn base(&self, run: u64) -> Option<&Base> {
        self.bases.get(usize::try_from(run / self.points.max(1)).ok()?)
    }

    /// The file of a run's scenario.
    pub fn scenario(&self, run: u64) -> &str {
        self.base(run).map_or("", |base| base.texts.scenario.file.as_str())
    }

    /// What a run's quantities are, in the plan's order: values or factors, as the plan has them.
    pub fn settings(&self, run: u64) -> Vec<Setting> {
        let point = run % self.points.max(1);
        if self.plan.design.kind == DesignKind::Grid {
            let levels = grid_levels(point, &self.sizes);
            return self.plan.vary.iter().zip(levels).map(|(vary, level)| at_level(vary, level)).collect();
        }
        let units = self.design.at(point, self.plan.vary.len());
        self.plan.vary.iter().zip(units).map(|(vary, unit)| at_unit(vary, unit)).collect()
    }

    /// The texts of a run; `None` where the run is none of the plan's.
    pub fn texts(&self, run: u64) -> Option<RunTexts> {
        let base = self.base(run)?;
        let settings = self.settings(run);
        let text = |target: Target| {
            let source = base.texts.of(target);
            let of = || self.plan.vary.iter().zip(&settings).filter(|(vary, _)| vary.target == target);
            if of().next().is_none() {
                return Some(source.clone());
            }
            let written: Vec<(&str, Setting)> = of()
                .map(|(vary, setting)| {
                    Some((vary.key.as_str(), written(vary, setting, base.editable(target))?))
                })
                .collect::<Option<_>>()?;
            let changes = written.iter().map(|(key, setting)| (*key, setting));
            Some(Source { file: source.file.clone(), text: base.editable(target).with(changes)? })
        };
        Some(RunTexts {
            scenario: text(Target::Scenario)?,
            truth: text(Target::Truth)?,
            belief: text(Target::Belief)?,
        })
    }

    /// Whether anything in this text is varied.
    pub(crate) fn varies(&self, target: Target) -> bool {
        self.plan.vary.iter().any(|vary| vary.target == target)
    }
}

/// What is to stand in the text: a factor times what stands there, in its unit.
fn written(vary: &Vary, setting: &Setting, text: &Editable) -> Option<Setting> {
    match (vary.is_factor, setting) {
        (true, Setting::Number { number: factor, .. }) => match text.get(&vary.key)? {
            Setting::Number { number, unit } => Some(Setting::Number { number: factor * number, unit }),
            _ => None,
        },
        _ => Some(setting.clone()),
    }
}

/// How many levels a grid has of a quantity.
fn levels(vary: &Vary) -> u64 {
    match &vary.how {
        How::Values(values) => values.len() as u64,
        _ => vary.levels.unwrap_or(1),
    }
}

/// A level of a grid: ends included, of a normal distribution the middles of parts of equal probability.
fn at_level(vary: &Vary, level: u64) -> Setting {
    let count = levels(vary);
    match &vary.how {
        How::Values(values) => value_at(values, level as usize),
        How::Normal { .. } => at_unit(vary, (level as f64 + 0.5) / count as f64),
        How::Range { .. } | How::Log { .. } => at_unit(vary, level as f64 / (count.max(2) - 1) as f64),
    }
}

/// The value at a part from 0 to 1 of the distribution.
fn at_unit(vary: &Vary, unit_part: f64) -> Setting {
    match &vary.how {
        How::Values(values) => value_at(values, (unit_part * values.len() as f64) as usize),
        How::Range { from, to, unit } => {
            Setting::Number { number: from + unit_part * (to - from), unit: unit.clone() }
        }
        How::Log { from, to, unit } => {
            Setting::Number { number: from * (to / from).powf(unit_part), unit: unit.clone() }
        }
        How::Normal { mean, sd, unit } => {
            // Both were checked when the plan was read.
            let number = Normal::new(*mean, *sd).map_or(*mean, |normal| normal.inverse_cdf(unit_part));
            Setting::Number { number, unit: unit.clone() }
        }
    }
}

fn value_at(values: &[Setting], index: usize) -> Setting {
    let last = values.len().saturating_sub(1);
    values.get(index.min(last)).cloned().unwrap_or(Setting::Flag(false))
}

/// Why a quantity can't be varied in a scenario; `None` where it can.
fn refusal(vary: &Vary, base: &Base, file: &str) -> Option<ConfigError> {
    let text = base.editable(vary.target);
    let source = base.texts.of(vary.target);
    let unknown = || {
        let alike = text.alike(&vary.key);
        let alike: Vec<String> = alike.iter().map(|key| format!("{}.{key}", vary.target.name())).collect();
        let found = format!("{}, which {} does not have", vary.path.text, source.file);
        Some(vary.path.refuse(file, found, format!("a path such as {}", alike.join(", "))))
    };
    match text.get(&vary.key).filter(|_| vary.is_factor) {
        None if vary.is_factor => return unknown(),
        Some(other @ (Setting::Word(_) | Setting::Flag(_))) => {
            let found = format!("a factor of the word {}", other.shown());
            return Some(vary.path.refuse(file, found, "a path to a number"));
        }
        _ => {}
    }
    // A value that no run could take is a mistake of the plan; one of several may be tried on purpose.
    let mut first = None;
    for probe in probes(vary) {
        let value = written(vary, &probe, text);
        let Some(changed) = value.and_then(|value| text.with([(vary.key.as_str(), &value)])) else {
            return unknown();
        };
        // Good: so the quantity is, too.
        let errors = errors_of(vary.target, &changed, &source.file)?;
        if errors.errors().iter().any(|error| error.found == "an unknown key") {
            return unknown();
        }
        let expected = errors.errors().first().map_or(String::new(), |error| error.expected.clone());
        first.get_or_insert_with(|| (probe.shown(), expected));
    }
    let (shown, mut expected) = first?;
    let is_whole = |number: f64| number.fract() == 0.0;
    if let (How::Range { .. } | How::Log { .. } | How::Normal { .. }, Setting::Number { number, .. }) =
        (&vary.how, at_unit(vary, 0.5))
        && !is_whole(number)
    {
        expected.push_str(" (whole numbers are listed: values = [2, 3, 4])");
    }
    Some(vary.path.refuse(file, format!("the value {shown} for {}", vary.path.text), expected))
}

/// Values to try a quantity with: all that are listed, else the middle.
fn probes(vary: &Vary) -> Vec<Setting> {
    match &vary.how {
        How::Values(values) => values.clone(),
        _ => vec![at_unit(vary, 0.5)],
    }
}

fn errors_of(target: Target, text: &str, file: &str) -> Option<ConfigErrors> {
    match target {
        Target::Scenario => parse_scenario(text, file).err(),
        Target::Truth | Target::Belief => parse_model(text, file).err(),
    }
}
