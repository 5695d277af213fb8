//! The part of the report on what is wrong with the log itself.

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
