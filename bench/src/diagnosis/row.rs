//! A campaign with what was found in it: a line of the file from which the tables are made.

use super::Family;
use super::cases::{Case, Class};
use anyhow::{Context, Result, bail};
use hidden_effect_rig::{Finding, Interval, LogKind, Outcome, Truth};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// What another method named, and what that is worth.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Other {
    /// The causes.
    pub named: BTreeSet<String>,
    /// Held against the truth as a diagnosis is.
    pub outcome: Outcome,
}

/// All that the tables need of one campaign.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Row {
    /// What tells the campaign from all others.
    pub key: String,
    /// CRC-32C of the program that was asked.
    pub program: u32,
    /// What the measurement was like.
    pub family: Family,
    /// What it was to show.
    pub class: Class,
    /// Its seed.
    pub seed: u64,
    /// Its channels.
    pub log: LogKind,
    /// The effects hidden.
    pub hidden: Vec<String>,
    /// What is true, as far as it is known.
    pub truth: Value,
    /// The verdict.
    pub verdict: String,
    /// Causes named.
    pub named: BTreeSet<String>,
    /// Groups that can't be told apart.
    pub groups: Vec<BTreeSet<String>>,
    /// What that is worth.
    pub outcome: Outcome,
    /// A stepwise regression on the same data; torque logs alone.
    pub regression: Option<Other>,
    /// Forward regression with orthogonal least squares.
    pub frols: Option<Other>,
    /// Intervals of parameters whose form rig and product share.
    pub intervals: Vec<Interval>,
    /// Intervals of the others, the best fit to noise-free data standing for the truth.
    pub best_fits: Vec<Interval>,
    /// Held-out RMS after extension, over the rig's noise; where causes can't be told apart, with what fitted best.
    pub rms_over_noise: Option<f64>,
    /// Samples of the log.
    pub samples: usize,
    /// Time for the diagnosis, s.
    pub wall_s: f64,
}

impl Row {
    /// A row of what was found, without numbers beyond the names.
    pub fn new(
        key: String,
        (family, class): (Family, Class),
        program: u32,
        truth: &Truth,
        finding: &Finding,
        outcome: Outcome,
    ) -> Self {
        Self {
            key,
            program,
            family,
            class,
            seed: truth.seed,
            log: truth.log,
            hidden: truth.effects.iter().map(|effect| effect.id.clone()).collect(),
            truth: truth.json(),
            verdict: finding.verdict.clone(),
            named: finding.named.clone(),
            groups: finding.groups.clone(),
            outcome,
            regression: None,
            frols: None,
            intervals: Vec::new(),
            best_fits: Vec::new(),
            rms_over_noise: None,
            samples: 0,
            wall_s: 0.0,
        }
    }

    /// What is not as it should be is said at once: it is what one looks at next.
    pub fn report(&self) {
        if self.outcome != Outcome::Right {
            eprintln!(
                "{:?}: {}: {} in {:.1} s: named {:?}, groups {:?}",
                self.outcome, self.key, self.verdict, self.wall_s, self.named, self.groups,
            );
        }
    }
}

/// The file of rows, one a line, which a later call may go on with.
pub struct Rows {
    path: PathBuf,
    file: File,
}

impl Rows {
    /// Opens the file; with `resume` what is in it of the cases wanted is given back.
    ///
    /// # Errors
    /// Where the system refuses, and where rows are another program's.
    pub fn open(path: PathBuf, resume: bool, cases: &[Case], program: u32) -> Result<(Self, Vec<Row>)> {
        let context = || path.display().to_string();
        let mut rows = Vec::new();
        if resume && path.exists() {
            let wanted: BTreeSet<String> = cases.iter().map(Case::key).collect();
            rows = read(&path)?;
            if let Some(row) = rows.iter().find(|row| row.program != program) {
                bail!(
                    "{}: {:?} was asked of program {:08x}, expected {program:08x} as it is now: move the file away, or leave out --resume",
                    path.display(),
                    row.key,
                    row.program
                );
            }
            rows.retain(|row| wanted.contains(&row.key));
        } else {
            File::create(&path).with_context(context)?;
        }
        let file = OpenOptions::new().append(true).open(&path).with_context(context)?;
        Ok((Self { path, file }, rows))
    }

    /// Appends a row.
    ///
    /// # Errors
    /// Where the system refuses.
    pub fn add(&mut self, row: &Row) -> Result<()> {
        let line = serde_json::to_string(row)? + "\n";
        self.file.write_all(line.as_bytes()).with_context(|| self.path.display().to_string())
    }
}

/// All rows of a file; a last line cut short by a kill is taken off it.
fn read(path: &Path) -> Result<Vec<Row>> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let whole = text.rfind('\n').map_or(0, |end| end + 1);
    let text = text.get(..whole).unwrap_or_default();
    OpenOptions::new().write(true).open(path)?.set_len(whole as u64)?;
    let parse = |(index, line): (usize, &str)| {
        serde_json::from_str(line).with_context(|| format!("{}, line {}", path.display(), index + 1))
    };
    text.lines().enumerate().map(parse).collect()
}
