//! Runs recorded as `simulate` records them: those that `--keep` names, or `--only` one.

use super::row_file::ROWS;
use crate::files::name;
use crate::in_process::Run;
use crate::loaded;
use crate::output::Output;
use crate::record_info::{Mode, record_info};
use crate::{report, simulate};
use ::campaign::{Campaign, Row};
use anyhow::{Context, anyhow};
use config::{Editable, Setting};
use processes::complain;
use std::path::{Path, PathBuf};
use supervisor::{Failure, Interruption, Outcome};

/// The folder of runs that are kept.
const KEPT: &str = "kept";
const SCENARIO: &str = "scenario.toml";

/// Which runs are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kept {
    /// Those that a fault stopped, that lost steps, or that could not be simulated.
    Failed,
    /// So many, the worst first.
    Worst(usize),
}

/// `failed` or `worst=K`.
pub fn parse(text: &str) -> Result<Kept, String> {
    let worst = || text.strip_prefix("worst=")?.parse().ok().filter(|count| *count > 0).map(Kept::Worst);
    let kept = if text == "failed" { Some(Kept::Failed) } else { worst() };
    kept.ok_or_else(|| format!("found {text:?}, expected failed, or worst=K with a number such as worst=10"))
}

impl Kept {
    /// The runs to keep.
    pub fn choose(self, rows: &[Row]) -> Vec<u64> {
        match self {
            Self::Failed => rows.iter().filter(|row| row.is_bad()).map(|row| row.run).collect(),
            Self::Worst(count) => worst(rows.iter(), count).iter().map(|row| row.run).collect(),
        }
    }
}

/// So many rows, the worst first; of equals the one with the lower number.
pub fn worst<'r>(rows: impl Iterator<Item = &'r Row>, count: usize) -> Vec<&'r Row> {
    let mut sorted: Vec<&Row> = rows.collect();
    sorted.sort_by(|a, b| {
        let ((class, error), (other_class, other_error)) = (a.badness(), b.badness());
        other_class.cmp(&class).then(other_error.total_cmp(&error)).then(a.run.cmp(&b.run))
    });
    sorted.truncate(count);
    sorted
}

/// Refuses to begin anew where runs are kept: a run's files are never overwritten, and those of another campaign are none of this one.
///
/// # Errors
/// [`Failure::Input`].
pub fn refuse_kept(folder: &Path, goes_on: bool) -> Result<(), Failure> {
    let kept = folder.join(KEPT);
    let goes_on = goes_on && folder.join(ROWS).exists();
    if !goes_on && kept.exists() {
        return Err(Failure::Input(anyhow!(
            "{} holds recorded runs, which are never overwritten: remove it, or give --out another folder",
            name(&kept)
        )));
    }
    Ok(())
}

/// Records runs in folders of their own; `false` where the user wanted an end. Those that are there already are left alone.
///
/// # Errors
/// Where writing fails.
pub fn keep(
    campaign: &Campaign,
    runs: &[u64],
    folder: &Path,
    interruption: &Interruption,
) -> Result<bool, Failure> {
    for run in runs {
        let place = folder.join(KEPT).join(format!("run-{run:05}"));
        if place.exists() {
            continue;
        }
        // A folder of this name is always whole.
        let partial = folder.join(KEPT).join(format!(".run-{run:05}.partial"));
        if partial.exists() {
            std::fs::remove_dir_all(&partial).with_context(|| name(&partial))?;
        }
        let output = Output::prepare(&partial)?;
        let scenario = write_texts(campaign, *run, &partial)?;
        match record(&scenario, &output, interruption) {
            Ok(true) => {}
            Ok(false) => return Ok(false),
            // Its texts are kept: what is wrong with them is the row's reason.
            Err(Failure::Input(_)) => complain(format_args!(
                "note: run {run} can't be simulated: its texts alone are in {}",
                name(&place)
            )),
            Err(failed) => return Err(failed),
        }
        std::fs::rename(&partial, &place).with_context(|| name(&place))?;
    }
    Ok(true)
}

/// Records one run and tells of it as `simulate` does.
///
/// # Errors
/// As `simulate`; [`Failure::Input`] where there is no such run.
pub fn only(campaign: &Campaign, run: u64, folder: &Path) -> Result<Outcome, Failure> {
    if run >= campaign.runs() {
        let last = campaign.runs().saturating_sub(1);
        return Err(Failure::Input(anyhow!("--only: found run {run}, expected one from 0 to {last}")));
    }
    let output = Output::prepare(folder)?;
    let scenario = write_texts(campaign, run, folder)?;
    let loaded = loaded::load(&scenario).map_err(|failure| match failure {
        // Nothing is recorded; the texts stay, since that is where the error is to be looked for.
        Failure::Input(error) => Failure::Input(error.context(format!("run {run} can't be simulated"))),
        other => other,
    })?;
    simulate::in_one_thread(&loaded, &output)
}

/// Writes the run's texts; the scenario's path.
fn write_texts(campaign: &Campaign, run: u64, folder: &Path) -> Result<PathBuf, Failure> {
    let texts = campaign.texts(run).context("no such run")?;
    let file = |file: &str| Setting::Word(file.to_owned());
    let (truth, belief) = (file("truth.toml"), file("belief.toml"));
    let scenario = Editable::new(&texts.scenario.text)
        .and_then(|text| text.with([("truth", &truth), ("belief", &belief)]))
        .context("the scenario's text")?;
    for (file, text) in
        [(SCENARIO, &scenario), ("truth.toml", &texts.truth.text), ("belief.toml", &texts.belief.text)]
    {
        let path = folder.join(file);
        whole_file::write(&path, text).with_context(|| name(&path))?;
    }
    Ok(folder.join(SCENARIO))
}

fn record(scenario: &Path, output: &Output, interruption: &Interruption) -> Result<bool, Failure> {
    let loaded = loaded::load(scenario)?;
    let info = record_info(&loaded, Mode::InProcess, "in-process");
    let run = Run { parts: &loaded.parts, injections: &[], interruption };
    if !run.record(&info, &output.first_segment())? {
        return Ok(false);
    }
    run_log::convert(&output.segments(), &output.run_h5()).map_err(anyhow::Error::from)?;
    report::write(&output.run_h5(), &output.run_html())?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn which_runs_are_kept() {
        assert_eq!(parse("failed"), Ok(Kept::Failed));
        assert_eq!(parse("worst=10"), Ok(Kept::Worst(10)));
        for bad in ["", "worst", "worst=", "worst=0", "worst=-1", "best=1"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
