//! `stepvalve diagnose`: measured runs against a model; what it gets wrong, why, and what that is worth.

mod closed_loop;
mod extended;
mod leftover;
mod page;
mod quality;
mod threads;
mod words;

use crate::files::{self, name};
use crate::inspect;
use crate::say::say;
use crate::strangers;
use anyhow::{Context, anyhow};
use diagnosis::{Diagnosis, Event, Options, Verdict, diagnose};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::{Path, PathBuf};
use std::time::Duration;
use supervisor::{Failure, Outcome};
use threads::Threads;
use whole_file::Partial;

/// What to hold against what.
#[derive(clap::Args)]
pub struct Arguments {
    /// Measured runs (valve-log): torque against angle, or angle against angle_command
    #[arg(long, value_name = "LOG.h5")]
    log: PathBuf,
    /// The model
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// The folder for diagnosis.json, model-extended.toml and report.html
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Decides which runs are held out: the same seed, the same answer
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The measurement's noise where it is known (a filtered log shows less), RMS in N·m of a torque, rad of an angle;
    /// without, it is estimated from the log
    #[arg(long, value_name = "RMS", value_parser = noise)]
    noise: Option<f64>,
    /// How well the model's numbers are known, as a standard deviation in parts of each (of the torque's zero in parts of the
    /// Coulomb torque); corrections up to twice that are no cause. 0: exactly
    #[arg(long, value_name = "PART", default_value_t = 0.03, value_parser = tolerance)]
    tolerance: f64,
}

fn tolerance(text: &str) -> Result<f64, String> {
    let refused = || format!("found `{text}`, expected a number from 0 to 0.25");
    text.parse().ok().filter(|part: &f64| (0.0..=0.25).contains(part)).ok_or_else(refused)
}

fn noise(text: &str) -> Result<f64, String> {
    let refused = || format!("found `{text}`, expected a number above zero");
    text.parse().ok().filter(|noise: &f64| noise.is_normal() && *noise > 0.0).ok_or_else(refused)
}

/// Diagnoses, and writes all three files when all is done.
///
/// # Errors
/// [`Failure::Input`] where the log or the model can't be used, naming run and row, or files exist;
/// [`Failure::Failed`] where writing fails.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let files = Files::new(&arguments.out)?;
    let (model_file, log_file) = (name(&arguments.model), name(&arguments.log));
    let model = config::parse_model(&files::read(&arguments.model)?, &model_file).map_err(Failure::input)?;
    let mut log = strangers::log(&arguments.log)?;
    log.runs.iter_mut().for_each(|run| {
        log_data::cut_to_energised(run);
        run.extra = Vec::new();
    });
    let quality = log_quality::inspect(&log, Some(&model));
    inspect::show(&quality);
    let progress = progress();
    let options = Options { seed: arguments.seed, noise: arguments.noise, tolerance: arguments.tolerance };
    let found = diagnose(&log, &model, &options, &Threads::new(), &mut |event| show(&progress, event));
    progress.finish_and_clear();
    let mut found = found.with_context(|| log_file.clone()).map_err(Failure::Input)?;
    found.diagnosis.gain.closed_loop = closed_loop::gain(&found, &model);
    let headline = words::headline(&found);
    let extended = extended::text(&found, &model, &log_file, &model_file);
    let page = page::page(&found, &quality, &log, (&log_file, &model_file));
    let json = quality::json(&found.diagnosis, &quality)?;
    files.write(&[("diagnosis.json", &json), ("model-extended.toml", &extended), ("report.html", &page)])?;
    summary(&found.diagnosis, &headline, &arguments.out);
    Ok(Outcome::Done)
}

fn progress() -> ProgressBar {
    let progress = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
        progress.set_style(style);
    }
    progress.enable_steady_tick(Duration::from_millis(200));
    progress
}

fn show(progress: &ProgressBar, event: Event<'_>) {
    match event {
        Event::Noise { rms, noise } => {
            progress.suspend(|| say(format_args!("error of the model: RMS {rms:.4e}; noise {noise:.4e}")));
        }
        Event::Ranking(ranking) => progress.suspend(|| {
            say("first ranking, by what each cause alone would cut the error (in parts of the noise):");
            for (id, gain) in ranking.iter().take(5).filter(|(_, gain)| *gain > 0.0) {
                say(format_args!("  {gain:8.3}  {id}"));
            }
        }),
        Event::Step(step) => progress.set_message(step),
    }
}

fn summary(diagnosis: &Diagnosis, headline: &str, out: &Path) {
    say(format_args!("{}: {headline}", diagnosis.verdict.name()));
    for cause in &diagnosis.causes {
        say(format_args!("  {}: {}", cause.id, words::numbers(&cause.parameters)));
    }
    for group in &diagnosis.ambiguous {
        let names: Vec<&str> = group.ids.iter().map(|id| id.name()).collect();
        say(format_args!("  can't be told apart: {}", names.join(", ")));
        if let Some(best) = &group.best {
            say(format_args!("  fitted best: {}: {}", best.id, words::numbers(&best.parameters)));
        }
    }
    for number in &diagnosis.within_tolerance {
        say(format_args!("  within tolerance: {}", words::corrected(number)));
    }
    for seen in diagnosis.nuisances.iter().chain(&diagnosis.observations) {
        say(format_args!("  seen: {seen}"));
    }
    if diagnosis.verdict != Verdict::NoDiscrepancy {
        say(format_args!("next: {}", diagnosis.next_experiment));
    }
    say(format_args!("{}, with model-extended.toml and diagnosis.json", name(&out.join("report.html"))));
}

/// The folder for the results.
struct Files {
    folder: PathBuf,
}

impl Files {
    /// Refuses a folder that holds a diagnosis.
    fn new(folder: &Path) -> Result<Self, Failure> {
        for file in ["diagnosis.json", "model-extended.toml", "report.html"] {
            let path = folder.join(file);
            if path.exists() {
                return Err(Failure::Input(anyhow!("{} exists: give --out another folder", name(&path))));
            }
        }
        Ok(Self { folder: folder.to_owned() })
    }

    /// All files under other names first: they appear when all are whole.
    fn write(&self, files: &[(&str, &str)]) -> anyhow::Result<()> {
        std::fs::create_dir_all(&self.folder).with_context(|| name(&self.folder))?;
        let mut written = Vec::new();
        for (file, text) in files {
            let path = self.folder.join(file);
            let partial = Partial::beside(&path).with_context(|| name(&path))?;
            std::fs::write(partial.path(), text).with_context(|| name(&path))?;
            written.push((partial, path));
        }
        for (partial, path) in written {
            partial.appear().with_context(|| name(&path))?;
        }
        Ok(())
    }
}
