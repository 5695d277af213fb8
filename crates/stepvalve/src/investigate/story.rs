//! The story of an investigation: a page and JSON.

use crate::files::name;
use anyhow::Context;
use diagnosis::{Cause, Found, Shown, Verdict};
use report::{Axis, Block, Hue, Page, Section, Style, Table, XyPlot, XySeries};
use serde::Serialize;
use std::path::Path;
use study::{Answer, words};
use supervisor::Failure;

/// The page's name.
pub const PAGE: &str = "investigation.html";
const JSON: &str = "investigation.json";
const MODEL: &str = "model-extended.toml";

/// Why an investigation ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum End {
    /// What was wrong is named, and nothing else is left.
    Decided,
    /// The model agrees with what was measured.
    Agrees,
    /// No experiment within the limits would say more.
    NothingMore,
    /// Something is left that no cause explains, so that there is nothing to decide between.
    Unexplained,
    /// As many experiments were made as were allowed.
    Enough,
    /// The time is over.
    Limit,
    /// The operator did not agree to an experiment.
    Declined,
}

impl End {
    /// As JSON has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Decided => "decided",
            Self::Agrees => "agrees",
            Self::NothingMore => "nothing-more",
            Self::Unexplained => "unexplained",
            Self::Enough => "enough",
            Self::Limit => "limit",
            Self::Declined => "declined",
        }
    }

    /// In a sentence.
    pub fn sentence(self) -> &'static str {
        match self {
            Self::Decided => "what was wrong is named, and what is left is noise",
            Self::Agrees => "the model agrees with what was measured",
            Self::NothingMore => "no experiment within these limits would tell more",
            Self::Unexplained => {
                "something is left that no cause of the list explains; the last report says what it depends on"
            }
            Self::Enough => "as many experiments were made as --experiments allows, and it is still open",
            Self::Limit => "the time of --limit is over, and it is still open",
            Self::Declined => "the next experiment was not agreed to",
        }
    }
}

/// A step, as it is told.
#[derive(Debug, Serialize)]
pub struct Told {
    verdict: &'static str,
    headline: String,
    causes: Vec<Cause>,
    /// What could not be told apart.
    open: Vec<Vec<String>>,
    samples: usize,
    /// What was proposed then.
    #[serde(skip_serializing_if = "Option::is_none")]
    proposed: Option<String>,
    /// The proposed experiment's file, where it is expected to decide.
    #[serde(skip_serializing_if = "Option::is_none")]
    plan: Option<String>,
    /// The newest record, measured and simulated.
    #[serde(skip)]
    plot: XyPlot,
}

impl Told {
    /// What a diagnosis came to.
    pub fn new(finished: &Answer, plan: Option<&Path>, number: usize) -> Self {
        let diagnosis = &finished.found.diagnosis;
        let group =
            |ids: &Vec<_>| ids.iter().map(|id: &valve_model::EffectId| id.name().to_owned()).collect();
        Self {
            verdict: diagnosis.verdict.name(),
            headline: finished.headline(),
            causes: diagnosis.causes.clone(),
            open: diagnosis.ambiguous.iter().map(|of| group(&of.ids)).collect(),
            samples: finished.found.samples.0,
            proposed: finished.next.as_ref().map(|next| next.said.clone()),
            plan: plan.map(name),
            plot: plot(&finished.found, number),
        }
    }
}

/// All steps.
#[derive(Debug, Default, Serialize)]
pub struct Story {
    pub steps: Vec<Told>,
}

#[derive(Serialize)]
struct Json<'a> {
    format: &'static str,
    format_version: u32,
    model: String,
    ended: End,
    steps: &'a [Told],
}

impl Story {
    /// Writes page, JSON, and the last step's extended model.
    ///
    /// # Errors
    /// Where the system refuses.
    pub fn write(&self, out: &Path, model: &Path, end: End) -> Result<(), Failure> {
        let json = Json {
            format: "stepvalve-investigation",
            format_version: 1,
            model: name(model),
            ended: end,
            steps: &self.steps,
        };
        let json = serde_json::to_string_pretty(&json).context("investigation.json")? + "\n";
        let last = out.join(self.steps.len().to_string()).join(MODEL);
        let extended = std::fs::read_to_string(&last).with_context(|| name(&last))?;
        for (file, text) in [(JSON, json), (MODEL, extended), (PAGE, self.page(model, end))] {
            let path = out.join(file);
            whole_file::write(&path, text).with_context(|| name(&path))?;
        }
        Ok(())
    }

    fn page(&self, model: &Path, end: End) -> String {
        let last = self.steps.last();
        let headline = last.map_or(String::new(), |last| last.headline.clone());
        let mut page = Page::new(format!("Investigation: {}", name(model)), headline);
        let samples = last.map_or(0, |last| last.samples);
        let first = self.steps.first().map_or(0, |first| first.samples);
        let mut summary = Section::new("");
        summary = summary.with(Block::Facts(vec![
            ("it ended".to_owned(), format!("{}: {}", end.name(), end.sentence())),
            (
                "experiments beyond the first record".to_owned(),
                (self.steps.len().saturating_sub(1)).to_string(),
            ),
            ("samples".to_owned(), format!("{samples}, of which the first record had {first}")),
        ]));
        page.sections.push(summary.with(Block::Table(self.table())));
        for (place, step) in self.steps.iter().enumerate() {
            page.sections.push(section(place + 1, step));
        }
        let extended = format!(
            "{MODEL} beside this page is the last step's; each step's own report, with plots, is report.html in its folder."
        );
        page.sections.push(Section::new("Files").with(Block::Text(extended)));
        page.to_html()
    }

    fn table(&self) -> Table {
        let row = |(place, step): (usize, &Told)| {
            let causes = step.causes.iter().map(|cause| cause.id.to_string()).collect::<Vec<_>>().join(", ");
            let open = step.open.iter().map(|group| group.join(" or ")).collect::<Vec<_>>().join("; ");
            vec![(place + 1).to_string(), step.verdict.to_owned(), causes, open, step.samples.to_string()]
        };
        Table {
            header: ["step", "verdict", "causes", "can't be told apart", "samples so far"]
                .map(str::to_owned)
                .to_vec(),
            rows: self.steps.iter().enumerate().map(row).collect(),
        }
    }
}

fn section(number: usize, step: &Told) -> Section {
    let heading = if number == 1 {
        "1. The first record".to_owned()
    } else {
        format!("{number}. With experiment {}", number - 1)
    };
    let mut section = Section::new(heading).with(Block::Text(step.headline.clone()));
    for cause in &step.causes {
        let numbers = format!("{}: {}", cause.id, words::numbers(&cause.parameters));
        section = section.with(Block::Text(numbers));
    }
    if let Some(proposed) = step.proposed.as_ref().filter(|_| step.verdict != Verdict::Explained.name()) {
        section = section.with(Block::Text(format!("Next: {proposed}.")));
    }
    if let Some(plan) = &step.plan {
        section = section.with(Block::Text(format!("Its plan: {plan}.")));
    }
    section.with(Block::XyPlot(step.plot.clone()))
}

/// What the newest record measured, and what the given model and the extended one make of it, over time.
fn plot(found: &Found, number: usize) -> XyPlot {
    // The runs of several logs are called after them.
    let newest = format!("run-{number}:");
    let is_newest = |shown: &&Shown| number == 1 || shown.name.starts_with(&newest);
    let blocks: Vec<&Shown> = found.shown.iter().filter(is_newest).collect();
    let line = |name: &str, hue: Hue, values: fn(&Shown) -> &Vec<f64>| {
        let of_block = |shown: &&Shown| {
            let points = shown.time_s.iter().copied().zip(values(shown).iter().copied());
            // A gap before the next block.
            points.chain([(f64::NAN, f64::NAN)]).collect::<Vec<_>>()
        };
        let points = blocks.iter().flat_map(of_block).collect();
        XySeries { name: name.to_owned(), style: Style::Line, hue, points }
    };
    let mut series = vec![
        line("measured", Hue::Measured, |shown| &shown.measured),
        line(words::GIVEN, Hue::Given, |shown| &shown.before),
    ];
    if words::is_changed(found) {
        series.push(line(words::changed(found), Hue::Extended, |shown| &shown.after));
    }
    XyPlot {
        title: "The newest record".to_owned(),
        x: Axis::new("time", "s"),
        y: Axis::new(found.channel.name(), words::unit(found.channel)),
        series,
        ..XyPlot::default()
    }
}
