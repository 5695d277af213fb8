//! Motions of a running valve that its operator has agreed to, and their record.

use crate::diagnose::logs;
use crate::files::{self, name};
use crate::loaded::load_texts;
use crate::operator::{Which, find};
use crate::say::say;
use anyhow::{Context, anyhow};
use config::{Scenario, ScheduledSetPoint, SetPoint, parse_model};
use log_data::{Log, Run};
use processes::segments_in;
use recording::RecordInfo;
use signals::SetPointKind;
use std::io::{BufRead, stdin};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};
use supervisor::{Failure, Interruption, Request, Status, ask, ask_status, whereabouts};
use valve_model::Model;

/// How long an order may take.
const PATIENCE: Duration = Duration::from_secs(1);
/// How often the valve is looked at while it moves.
const LOOK: Duration = Duration::from_millis(100);
/// A motion that doesn't end is not waited for any longer than this beyond its time.
const LATE: Duration = Duration::from_secs(10);
/// The record is read so long after the last motion: the recorder hands it over within milliseconds.
const WRITTEN: Duration = Duration::from_millis(500);

/// What came of motions.
pub enum Agreed {
    /// They were made, or those of them that were agreed to.
    Made,
    /// None was agreed to.
    Declined,
    /// The operator ended them.
    Interrupted,
}

/// A running instance.
pub struct LiveValve {
    socket: PathBuf,
    record: PathBuf,
    info: RecordInfo,
    scenario: Scenario,
    belief: Model,
}

/// A motion and the way back from it.
type Motion<'a> = &'a [ScheduledSetPoint];

impl LiveValve {
    /// The instance that is meant, with what its record says of it.
    ///
    /// # Errors
    /// [`Failure::Input`] where none runs, or it keeps no record.
    pub fn find(which: &Which) -> Result<Self, Failure> {
        let socket = find(which)?;
        let folder = socket.parent().unwrap_or(Path::new("/"));
        let record = whereabouts(folder).map_err(Failure::Input)?.record;
        let segments = files::segments(std::slice::from_ref(&record))?;
        let last = segments.last().ok_or_else(|| Failure::Input(anyhow!("{}: no record", name(&record))))?;
        let info = recording::read_info(last).map_err(Failure::input)?;
        let loaded = load_texts(&info.texts)?;
        let belief = parse_model(&info.texts.belief, "the record's belief").map_err(Failure::input)?;
        if !loaded.scenario.encoder.fitted {
            return Err(Failure::Input(anyhow!(
                "the instance has no encoder, and the command alone says nothing of friction"
            )));
        }
        Ok(Self { socket, record, info, scenario: loaded.scenario, belief })
    }

    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    pub fn belief(&self) -> &Model {
        &self.belief
    }

    /// Writes the scenario and its models as the instance was started with; the scenario's path.
    ///
    /// # Errors
    /// Where the system refuses.
    pub fn write_files(&self, folder: &Path) -> Result<PathBuf, Failure> {
        let texts = &self.info.texts;
        let mut table: toml::Table = toml::from_str(&texts.scenario).context("the record's scenario")?;
        for (key, file) in [("truth", "truth.toml"), ("belief", "belief.toml")] {
            table.insert(key.to_owned(), toml::Value::String(file.to_owned()));
        }
        // What is planned is simulated.
        table.remove("drive");
        let scenario = toml::to_string(&table).context("the record's scenario")?;
        let path = folder.join("scenario.toml");
        let files = [
            (path.clone(), &scenario),
            (folder.join("truth.toml"), &texts.truth),
            (folder.join("belief.toml"), &texts.belief),
        ];
        for (path, text) in files {
            whole_file::write(&path, text).with_context(|| name(&path))?;
        }
        Ok(path)
    }

    /// Asks the operator for each motion, makes it, and writes the record of all of them as a valve-log.
    ///
    /// # Errors
    /// [`Failure::Failed`] where the valve is not armed, refuses, or stops.
    pub fn make(&self, set_points: &[ScheduledSetPoint], path: &Path) -> Result<Agreed, Failure> {
        let interruption = Interruption::watch()?;
        self.running()?;
        let begun = SystemTime::now();
        let motions = motions(set_points, self.scenario.initial_angle_rad);
        let mut first = None;
        for (place, motion) in motions.iter().enumerate() {
            say(format_args!("motion {} of {}: {}", place + 1, motions.len(), in_words(motion)));
            if !is_agreed()? {
                break;
            }
            first.get_or_insert_with(Instant::now);
            if !self.follow(motion, &interruption)? {
                ask(&self.socket, &Request::Hold, PATIENCE)?;
                return Ok(Agreed::Interrupted);
            }
        }
        self.keep(first, begun, path)
    }

    /// Writes the record from the first motion on, if there was one.
    fn keep(&self, first: Option<Instant>, begun: SystemTime, path: &Path) -> Result<Agreed, Failure> {
        let Some(first) = first else { return Ok(Agreed::Declined) };
        std::thread::sleep(WRITTEN);
        let log = self.recorded(first.elapsed(), begun)?;
        run_log::write_log(path, &log).with_context(|| name(path)).map_err(Failure::Failed)?;
        Ok(Agreed::Made)
    }

    /// The status of a valve that follows set-points; else a refusal.
    fn running(&self) -> Result<Status, Failure> {
        let status = ask_status(&self.socket, PATIENCE)?;
        if status.state == "running" {
            return Ok(status);
        }
        let fault = if status.fault == "none" { String::new() } else { format!(" ({})", status.fault) };
        Err(Failure::Failed(anyhow!(
            "the valve is {}{fault}, expected it to be running: stepvalve arm",
            status.state
        )))
    }

    /// Makes one motion; `false` where the operator interrupts it.
    fn follow(&self, motion: Motion<'_>, interruption: &Interruption) -> Result<bool, Failure> {
        let begun = Instant::now();
        let start_s = motion.first().map_or(0.0, |first| first.time_s);
        for of in motion {
            let due = Duration::from_secs_f64((of.time_s - start_s).max(0.0));
            while begun.elapsed() < due {
                if interruption.wanted() {
                    return Ok(false);
                }
                self.running()?;
                std::thread::sleep(LOOK.min(due.saturating_sub(begun.elapsed())));
            }
            let answer = ask(&self.socket, &order(&of.set_point)?, PATIENCE)?;
            if !answer.done {
                return Err(Failure::Failed(anyhow!("refused: {}", answer.text)));
            }
        }
        let ordered = Instant::now();
        loop {
            std::thread::sleep(LOOK);
            if interruption.wanted() {
                return Ok(false);
            }
            if !self.running()?.moving {
                return Ok(true);
            }
            if ordered.elapsed() > LATE {
                return Err(Failure::Failed(anyhow!("the valve still moves {LATE:?} after its last order")));
            }
        }
    }

    /// The record of the last so long: what lies between the motions too, while the operator thinks.
    fn recorded(&self, last: Duration, since: SystemTime) -> Result<Log, Failure> {
        let folder = tempfile::tempdir().context("a folder for the run file").map_err(Failure::Failed)?;
        let is_new = |path: &PathBuf| {
            path.metadata().and_then(|of| of.modified()).is_ok_and(|modified| modified >= since)
        };
        let segments: Vec<PathBuf> = segments_in(&self.record)
            .into_iter()
            .filter(|segment| !segment.fault)
            .map(|segment| segment.path(&self.record))
            .filter(is_new)
            .collect();
        let file = folder.path().join("live.h5");
        run_log::convert(&segments, &file).context("the instance's record").map_err(Failure::Failed)?;
        let mut log = logs::read(&[file], &[])?;
        let end_s = log.runs.iter().map(Run::end_s).fold(0.0, f64::max);
        log.runs.retain(|run| run.end_s() == end_s);
        for run in &mut log.runs {
            let from_s = end_s - last.as_secs_f64();
            let first = run.time_s.partition_point(|time_s| *time_s < from_s);
            run.keep_rows(first..run.len());
        }
        Ok(log)
    }
}

/// A motion ends where the valve is back, or holds.
fn motions(set_points: &[ScheduledSetPoint], home_rad: f64) -> Vec<Motion<'_>> {
    let is_back = |of: &ScheduledSetPoint| match of.set_point {
        SetPoint::Angle { angle_rad } => angle_rad == home_rad,
        SetPoint::Hold => true,
        _ => false,
    };
    set_points.split_inclusive(is_back).collect()
}

fn in_words(motion: Motion<'_>) -> String {
    let each = motion.iter().map(|of| match of.set_point {
        SetPoint::Angle { angle_rad } => format!("to {:.3}°", angle_rad.to_degrees()),
        SetPoint::Speed { speed_rad_per_s } => format!("turn at {speed_rad_per_s:.3} rad/s"),
        _ => "hold".to_owned(),
    });
    let span_s = motion.first().zip(motion.last()).map_or(0.0, |(first, last)| last.time_s - first.time_s);
    format!("{}; {span_s:.1} s", each.collect::<Vec<_>>().join(", "))
}

fn is_agreed() -> Result<bool, Failure> {
    say("  make it? y or n");
    let mut line = String::new();
    stdin().lock().read_line(&mut line).context("the answer").map_err(Failure::Failed)?;
    Ok(matches!(line.trim(), "y" | "yes"))
}

fn order(set_point: &SetPoint) -> Result<Request, Failure> {
    let set = |kind, value| Request::Set { kind, value, pressure_drop_pa: None };
    match *set_point {
        SetPoint::Angle { angle_rad } => Ok(set(SetPointKind::Angle, angle_rad)),
        SetPoint::Speed { speed_rad_per_s } => Ok(set(SetPointKind::Speed, speed_rad_per_s)),
        SetPoint::Hold => Ok(Request::Hold),
        _ => {
            Err(Failure::Input(anyhow!("only angles, speeds and hold can be ordered of a running instance")))
        }
    }
}
