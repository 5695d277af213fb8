//! What a campaign's plan says: which scenarios, what is varied in them and how, and what is done with each run.

mod read;

use crate::edit::Setting;
use crate::error::ConfigError;
pub(crate) use read::asked;
pub use read::parse_plan;

/// A validated plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The plan's name, for titles.
    pub name: String,
    /// The scenarios' files, as written: relative to the plan's file. At least one, none twice.
    pub scenarios: Vec<Named>,
    /// What is done with each run.
    pub task: Task,
    /// How many runs may fail.
    pub failure_limit: FailureLimit,
    /// Which points are tried.
    pub design: Design,
    /// What is varied; none of it: the scenarios as they are.
    pub vary: Vec<Vary>,
}

/// A text with its place in the plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Named {
    /// The text.
    pub text: String,
    /// Its key in the plan, such as `vary[0].path`.
    pub key: String,
    /// Its line, from 1.
    pub line: usize,
    /// Its column, from 1.
    pub column: usize,
}

impl Named {
    /// An error at its place in the plan `file`.
    #[must_use]
    pub fn refuse(&self, file: &str, found: impl Into<String>, expected: impl Into<String>) -> ConfigError {
        ConfigError {
            file: file.to_owned(),
            line: self.line,
            column: self.column,
            key: self.key.clone(),
            found: found.into(),
            expected: expected.into(),
        }
    }
}

/// What is done with each run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// Simulated in closed loop and measured.
    Simulate,
    /// Simulated, and its record diagnosed with the belief.
    Diagnose,
    /// Measured and diagnosed.
    Both,
}

impl Task {
    /// Whether the motion's metrics are wanted.
    #[must_use]
    pub const fn measures(self) -> bool {
        matches!(self, Self::Simulate | Self::Both)
    }

    /// Whether a diagnosis is wanted.
    #[must_use]
    pub const fn diagnoses(self) -> bool {
        matches!(self, Self::Diagnose | Self::Both)
    }
}

/// How many runs may fail before the campaign is given up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FailureLimit {
    /// So many.
    Count(u64),
    /// This share of all runs, 0 to 1.
    Share(f64),
}

/// Which points of what is varied are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Design {
    /// How they are chosen.
    pub kind: DesignKind,
    /// How many, for each scenario; `None` for a grid, whose levels say it.
    pub runs: Option<u64>,
    /// Seed of all draws.
    pub seed: u64,
}

/// How points are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DesignKind {
    /// All combinations of all levels.
    Grid,
    /// Each quantity in as many equal steps as there are runs, every step once.
    LatinHypercube,
    /// A Sobol sequence, scrambled by the seed.
    Sobol,
    /// Independent draws.
    Random,
}

/// One quantity that is varied.
#[derive(Debug, Clone, PartialEq)]
pub struct Vary {
    /// The whole path as written, such as `truth.friction.coulomb_torque_nm`.
    pub path: Named,
    /// The text that it is in.
    pub target: Target,
    /// The path within that text.
    pub key: String,
    /// Whether the values are factors of what the file has, in place of values.
    pub is_factor: bool,
    /// Its values.
    pub how: How,
    /// How many levels a grid has of a range; `None` of listed values and in other designs.
    pub levels: Option<u64>,
}

/// The text that a path begins in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// The simulated plant's model.
    Truth,
    /// The controller's model.
    Belief,
    /// The scenario.
    Scenario,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Truth, Self::Belief, Self::Scenario];

    /// As paths begin.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Truth => "truth",
            Self::Belief => "belief",
            Self::Scenario => "scenario",
        }
    }
}

/// The values that a quantity takes.
#[derive(Debug, Clone, PartialEq)]
pub enum How {
    /// Each of these alike.
    Values(Vec<Setting>),
    /// Anything between, uniformly.
    Range {
        /// From here.
        from: f64,
        /// To here; both included.
        to: f64,
        /// The unit of both.
        unit: String,
    },
    /// Anything between, uniformly in its logarithm.
    Log {
        /// From here, above zero.
        from: f64,
        /// To here; both included.
        to: f64,
        /// The unit of both.
        unit: String,
    },
    /// Normally distributed.
    Normal {
        /// About this.
        mean: f64,
        /// With this standard deviation.
        sd: f64,
        /// The unit of both.
        unit: String,
    },
}

/// Whether two texts of TOML say the same, comments, spaces and the order of keys aside, and these keys of the top.
#[must_use]
pub fn says_the_same(one: &str, other: &str, but: &[&str]) -> bool {
    let read = |text: &str| -> Option<toml::Table> {
        let mut table: toml::Table = text.parse().ok()?;
        but.iter().for_each(|key| drop(table.remove(*key)));
        Some(table)
    };
    read(one).is_some_and(|one| read(other) == Some(one))
}
