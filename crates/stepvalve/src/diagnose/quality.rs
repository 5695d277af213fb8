//! What is wrong with the log itself, beside what the model gets wrong.

use anyhow::Context;
use diagnosis::Diagnosis;
use log_quality::{Finding, Severity};
use report::{Block, Section, Table};

/// The section of the page.
pub fn section(found: &[Finding]) -> Section {
    let section = Section::new("The log itself");
    if found.is_empty() {
        return section.with(Block::Text("Nothing is wrong with it.".to_owned()));
    }
    let header = ["", "what", "what speaks for it", "what to do"].map(str::to_owned).to_vec();
    let row = |finding: &Finding| {
        let grave = if finding.severity == Severity::Mistake { "mistake" } else { "note" };
        let cells = [grave, finding.kind.name(), &finding.evidence, &finding.mend];
        cells.map(str::to_owned).to_vec()
    };
    let rows = found.iter().map(row).collect();
    section.with(Block::Table(Table { header, rows }))
}

/// What to mend in the log before anything that was found in it is believed.
pub fn mend_first(found: &[Finding]) -> Vec<String> {
    let mistakes = found.iter().filter(|finding| finding.severity == Severity::Mistake);
    mistakes.map(|of| format!("Mend the log first: {}. {}.", of.evidence, of.mend)).collect()
}

/// diagnosis.json, with `data_quality`.
pub fn json(diagnosis: &Diagnosis, found: &[Finding]) -> anyhow::Result<String> {
    let mut all = serde_json::to_value(diagnosis).context("diagnosis.json")?;
    if let Some(fields) = all.as_object_mut() {
        fields.insert("data_quality".to_owned(), serde_json::to_value(found).context("data_quality")?);
    }
    serde_json::to_string_pretty(&all).context("diagnosis.json")
}
