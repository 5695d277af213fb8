//! The part of the report on laws without a name.

use diagnosis::{Found, Unnamed};
use report::{Block, Section, Table};
use study::unnamed::{as_well, could, goes};
use study::words;

/// The part of the report, where there are any.
pub fn section(found: &Found) -> Option<Section> {
    let laws = &found.diagnosis.unnamed;
    if laws.is_empty() {
        return None;
    }
    let row = |law: &Unnamed| {
        let (makes, look) = could(law);
        let does =
            [Some(words::with_capital(&goes(law))), as_well(law)].into_iter().flatten().collect::<Vec<_>>();
        vec![law.id.to_string(), does.join(". "), makes.to_owned(), look.to_owned()]
    };
    let header = ["in the extended model", "what it does", "what could make it", "how to look for it"];
    let table = Table { header: header.map(str::to_owned).to_vec(), rows: laws.iter().map(row).collect() };
    let what = "No cause of the list does this, or not in this form. The simplest law in the recorded quantities that leaves as little is in the extended \
                model, fitted through it, and judged on runs kept aside. It holds over the range that these runs cover, and says nothing \
                of why.";
    let section = Section::new("Beyond the list: laws without a name");
    Some(section.with(Block::Text(what.to_owned())).with(Block::Table(table)))
}
