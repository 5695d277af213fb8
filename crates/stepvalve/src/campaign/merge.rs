//! `stepvalve campaign merge`: rows of several shards become one campaign.

use super::conclude;
use super::keep::{self, Kept};
use super::row_file::{self, ROWS, RowFile};
use crate::files::name;
use ::campaign::log::Head;
use ::campaign::{Campaign, Row};
use anyhow::{Context, anyhow};
use processes::complain;
use std::collections::BTreeMap;
use std::path::PathBuf;
use supervisor::{Failure, Interruption, Outcome};

/// So many missing runs are named.
const NAMED: usize = 5;

/// Which, and where to.
#[derive(clap::Args)]
pub struct Arguments {
    /// Folders of shards
    #[arg(value_name = "DIR", required = true)]
    shards: Vec<PathBuf>,
    /// Folder for the whole campaign: rows.log, campaign.h5 and campaign.html
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Record these runs as `simulate` does, in DIR/kept: `failed` or `worst=K`
    #[arg(long, value_name = "failed|worst=K", value_parser = keep::parse)]
    keep: Option<Kept>,
    /// Replace the campaign that is in the folder
    #[arg(long)]
    force: bool,
}

/// Puts the rows together; all runs must be among them.
///
/// # Errors
/// [`Failure::Input`] where shards are of different campaigns, rows are missing, or two shards have different rows of one run.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let out = &arguments.out;
    // However they are spelled.
    let place = |path: &PathBuf| std::fs::canonicalize(path).unwrap_or_else(|_| path.clone());
    if arguments.shards.iter().any(|shard| place(shard) == place(out)) {
        return Err(Failure::Input(anyhow!(
            "{}: found it among the shards, too; expected another folder",
            name(out)
        )));
    }
    if !arguments.force {
        row_file::refuse_taken(out)?;
    }
    keep::refuse_kept(out, false)?;
    let (head, campaign, rows) = gather(&arguments.shards)?;
    let interruption = Interruption::watch()?;
    let mut file = RowFile::open(out, (&head, campaign.runs()), false, arguments.force)?;
    for row in rows.into_values() {
        file.add(row)?;
    }
    file.to_disk().with_context(|| name(file.path()))?;
    let all: Vec<Row> = file.rows().values().cloned().collect();
    conclude::refuse_failures(&campaign, &all, file.path())?;
    let kept = arguments.keep.map_or_else(Vec::new, |keep| keep.choose(&all));
    if !keep::keep(&campaign, &kept, out, &interruption)? {
        return Ok(Outcome::Interrupted);
    }
    conclude::conclude(&campaign, &head.program_version, &all, out)?;
    conclude::refuse_all_failed(&campaign, &all, out)?;
    Ok(Outcome::Done)
}

fn gather(shards: &[PathBuf]) -> Result<(Head, Campaign, BTreeMap<u64, Row>), Failure> {
    let mut head: Option<Head> = None;
    let mut rows: BTreeMap<u64, Row> = BTreeMap::new();
    for shard in shards {
        let path = shard.join(ROWS);
        let (contents, length) = row_file::read(&path)?;
        let no_row = length - contents.whole_bytes + contents.damaged_bytes;
        if no_row > 0 {
            complain(format_args!("note: {}: {no_row} bytes are no whole row", name(&path)));
        }
        match &head {
            None => head = Some(contents.head),
            Some(first) => {
                let differences = first.differences(&contents.head);
                if !differences.is_empty() {
                    let differences = differences.join("; ");
                    return Err(Failure::Input(anyhow!(
                        "{}: found rows of another campaign ({differences}), expected the first shard's",
                        name(&path)
                    )));
                }
            }
        }
        for (run, row) in contents.rows {
            // As bytes: what is not known is NaN, which equals nothing.
            let same = |other: &Row| ::campaign::log::row(other).ok() == ::campaign::log::row(&row).ok();
            if rows.get(&run).is_some_and(|other| !same(other)) {
                return Err(Failure::Input(anyhow!(
                    "{}: found another row of run {run} than in a shard before, expected the same",
                    name(&path)
                )));
            }
            rows.insert(run, row);
        }
    }
    let head = head.context("no shard").map_err(Failure::Input)?;
    let campaign = head.campaign().map_err(Failure::input)?;
    rows.retain(|run, _| *run < campaign.runs());
    let missing: Vec<u64> = (0..campaign.runs()).filter(|run| !rows.contains_key(run)).collect();
    if !missing.is_empty() {
        let named: Vec<String> = missing.iter().take(NAMED).map(u64::to_string).collect();
        let more = if missing.len() > NAMED { ", …" } else { "" };
        return Err(Failure::Input(anyhow!(
            "found {} of {} runs, expected all: runs {}{more} are missing; `stepvalve campaign … --shard … --resume` makes them",
            rows.len(),
            campaign.runs(),
            named.join(", ")
        )));
    }
    Ok((head, campaign, rows))
}
