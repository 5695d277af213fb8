//! The folder that a run is written to.

use crate::files::name;
use anyhow::{Context, anyhow};
use processes::{SegmentName, segments_in};
use recording::{RecordInfo, Texts};
use std::path::{Path, PathBuf};
use supervisor::{Failure, InstanceName};

/// Where a run's files go.
pub struct Output {
    folder: PathBuf,
}

/// What earlier starts of an instance left in its folder.
pub struct Earlier {
    /// The number of segments that can be read.
    segments: usize,
    /// What the last of them says of itself.
    last: RecordInfo,
}

impl Earlier {
    /// The start that its last segment is of.
    pub fn generation(&self) -> u64 {
        self.last.generation
    }

    /// What it means for a record of this scenario and these models that begins now.
    pub fn note(&self, folder: &Path, texts: &Texts) -> String {
        let segments =
            if self.segments == 1 { "1 segment".to_owned() } else { format!("{} segments", self.segments) };
        let what = if self.last.texts == *texts {
            "this start goes on behind them, as another run of the same record"
        } else {
            "its scenario or models were others: convert what belongs together, or give --out a new folder"
        };
        format!("{} holds {segments} of an earlier start: {what}", name(folder))
    }
}

impl Output {
    /// Makes the folder. One that holds a run already is left alone: nothing recorded is ever overwritten.
    ///
    /// # Errors
    /// [`Failure::Input`] where there is a run, or the folder can't be made.
    pub fn prepare(folder: &Path) -> Result<Self, Failure> {
        let output = Self::without_run(folder)?;
        std::fs::create_dir_all(folder).with_context(|| name(folder)).map_err(Failure::Input)?;
        Ok(output)
    }

    /// A folder that holds no run, and need not be there yet: the supervisor makes it once the instance's name is its own.
    ///
    /// # Errors
    /// [`Failure::Input`] where there is a run.
    pub fn without_run(folder: &Path) -> Result<Self, Failure> {
        let output = Self { folder: folder.to_owned() };
        let made = [output.run_h5(), output.run_html()];
        let taken = made.into_iter().chain(output.segments()).find(|path| path.exists());
        if let Some(path) = taken {
            return Err(Failure::Input(anyhow!("{} exists: give --out a folder without a run", name(&path))));
        }
        Ok(output)
    }

    /// The folder of an instance, which goes on where an earlier start of it ended, and what that left there.
    ///
    /// # Errors
    /// [`Failure::Input`] where it holds the record of another instance or of a simulation: the two would stand in each
    /// other's way, and be no record together.
    pub fn of_instance(folder: &Path, instance: &InstanceName) -> Result<(Self, Option<Earlier>), Failure> {
        let output = Self { folder: folder.to_owned() };
        let taken = |by: String| {
            Failure::Input(anyhow!("{} holds {by}: give --out a folder of its own", name(folder)))
        };
        if output.run_h5().exists() {
            return Err(taken("a simulation's run.h5".to_owned()));
        }
        // A segment that can't be read stands in nobody's way: the next one gets another number.
        let infos = output.segments().into_iter().filter_map(|path| recording::read_info(&path).ok());
        let mut infos: Vec<_> = infos.collect();
        if let Some(other) = infos.iter().find(|info| info.instance != instance.to_string()) {
            return Err(taken(format!("the record of the instance \"{}\"", other.instance)));
        }
        let segments = infos.len();
        Ok((output, infos.pop().map(|last| Earlier { segments, last })))
    }

    /// A folder that a run was written to.
    pub fn of_run(folder: &Path) -> Self {
        Self { folder: folder.to_owned() }
    }

    /// The run file.
    pub fn run_h5(&self) -> PathBuf {
        self.folder.join("run.h5")
    }

    /// The page with its plots.
    pub fn run_html(&self) -> PathBuf {
        self.folder.join("run.html")
    }

    /// The record's segments that exist, in order.
    pub fn segments(&self) -> Vec<PathBuf> {
        segments_in(&self.folder).iter().map(|name| name.path(&self.folder)).collect()
    }

    /// The folder itself.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The file of the first segment.
    pub fn first_segment(&self) -> PathBuf {
        SegmentName { number: 1, fault: false }.path(&self.folder)
    }
}
