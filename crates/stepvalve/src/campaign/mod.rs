//! `stepvalve campaign`: thousands of runs of scenarios in which something is varied, as rows of one table and a page.

mod build;
mod conclude;
mod keep;
mod load;
mod merge;
mod page;
mod progress;
mod row_file;
mod shard;
mod work;

use crate::files::name;
use crate::say::say;
use ::campaign::Campaign;
use ::campaign::log::Head;
use anyhow::{Context, anyhow};
use keep::Kept;
pub use load::load;
use processes::complain;
use row_file::RowFile;
use shard::Shard;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use supervisor::{Failure, Interruption, Outcome};
use work::{Ended, Work};

/// What to run, and where to.
#[derive(clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    disable_help_subcommand = true
)]
pub struct Arguments {
    #[command(subcommand)]
    merge: Option<Command>,
    /// The plan: scenarios, what is varied in them, design, task (docs/campaign.md)
    #[arg(value_name = "PLAN.toml", required = true)]
    plan: Option<PathBuf>,
    /// Folder for rows.log, campaign.h5 and campaign.html
    #[arg(long, value_name = "DIR", required = true)]
    out: Option<PathBuf>,
    /// Runs at a time [default: one for each processor]
    #[arg(long, value_name = "N")]
    jobs: Option<NonZero<usize>>,
    /// Make only part I of N of the runs, from 1/N to N/N, on this machine; `campaign merge` makes one table of all
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Go on with the campaign in the folder: runs whose rows are there are not made again. Refused where plan, scenarios, models or
    /// the program's version changed meanwhile
    #[arg(long, conflicts_with = "force")]
    resume: bool,
    /// Record these runs as `simulate` does, in DIR/kept: `failed` (stopped by a fault, steps lost, or not to be simulated), or `worst=K`
    #[arg(long, value_name = "failed|worst=K", value_parser = keep::parse)]
    keep: Option<Kept>,
    /// Record only this run, counted from 0, as `simulate` does; its files go to DIR
    #[arg(long, value_name = "RUN", conflicts_with_all = ["jobs", "shard", "resume", "keep", "force"])]
    only: Option<u64>,
    /// Replace the campaign that is in the folder
    #[arg(long)]
    force: bool,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Make one table and page of the rows of several shards
    Merge(merge::Arguments),
}

/// Makes the runs that are not made yet, then table and page.
///
/// # Errors
/// [`Failure::Input`] where plan, scenarios or models are wrong, before anything is written; where the folder holds another campaign.
/// [`Failure::Failed`] where more runs fail than the plan allows, or writing does; the rows stay.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    if let Some(Command::Merge(arguments)) = &arguments.merge {
        return merge::run(arguments);
    }
    // clap demands both.
    let missing = || Failure::Input(anyhow!("found no plan or --out, expected both"));
    let plan = arguments.plan.as_deref().ok_or_else(missing)?;
    let out = arguments.out.as_deref().ok_or_else(missing)?;
    if arguments.shard.is_some() && arguments.keep.is_some() {
        return Err(Failure::Input(anyhow!(
            "--keep: found it with --shard, expected it with `campaign merge`: which runs are the worst is known there"
        )));
    }
    let campaign = load(plan)?;
    if let Some(run) = arguments.only {
        return keep::only(&campaign, run, out);
    }
    keep::refuse_kept(out, arguments.resume)?;
    let interruption = Interruption::watch()?;
    let head = Head::new(&campaign, &build::version()?);
    let mut rows = RowFile::open(out, (&head, campaign.runs()), arguments.resume, arguments.force)?;
    if rows.dropped_bytes > 0 {
        complain(format_args!(
            "note: {}: {} bytes are no whole row; their runs are made again",
            name(rows.path()),
            rows.dropped_bytes
        ));
    }
    let wanted: Vec<u64> =
        (0..campaign.runs()).filter(|run| arguments.shard.is_none_or(|shard| shard.has(*run))).collect();
    let work = Work {
        campaign: &campaign,
        wanted: &wanted,
        jobs: jobs(arguments.jobs),
        interruption: &interruption,
    };
    let ended = work.make(&mut rows)?;
    let made = wanted.iter().filter(|run| rows.rows().contains_key(run)).count();
    match ended {
        Ended::Interrupted => {
            say(format_args!("interrupted: {made} of {} runs are in {}", wanted.len(), name(rows.path())));
            say(format_args!("the same command with --resume goes on"));
            Ok(Outcome::Interrupted)
        }
        Ended::TooManyFailed { failed, last } => {
            Err(conclude::too_many(&campaign, failed, (last.0, &last.1), rows.path()))
        }
        Ended::All => finish(arguments, (&campaign, &head), rows, out, &interruption),
    }
}

fn finish(
    arguments: &Arguments,
    (campaign, head): (&Campaign, &Head),
    rows: RowFile,
    out: &Path,
    interruption: &Interruption,
) -> Result<Outcome, Failure> {
    rows.to_disk().with_context(|| name(rows.path()))?;
    if let Some(shard) = arguments.shard {
        say(format_args!("{}: all runs of shard {shard} are made", name(rows.path())));
        say("`stepvalve campaign merge DIR... --out DIR` makes table and page of all shards");
        return Ok(Outcome::Done);
    }
    let all: Vec<::campaign::Row> = rows.rows().values().cloned().collect();
    let kept = arguments.keep.map_or_else(Vec::new, |keep| keep.choose(&all));
    if !keep::keep(campaign, &kept, out, interruption)? {
        return Ok(Outcome::Interrupted);
    }
    conclude::conclude(campaign, &head.program_version, &all, out)?;
    conclude::refuse_all_failed(campaign, &all, out)?;
    Ok(Outcome::Done)
}

fn jobs(asked: Option<NonZero<usize>>) -> usize {
    asked.or_else(|| std::thread::available_parallelism().ok()).map_or(1, NonZero::get)
}
