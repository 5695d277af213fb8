//! `bench predict`: an hour of 1 kHz data through `stepvalve predict`: time and memory, by quantity, contact and runs.

use crate::output::{Results, Sheet, digits};
use crate::programs::Workplace;
use crate::progress::Progress;
use crate::scenario::repository;
use crate::watched;
use anyhow::{Context, Result};
use log_data::{Log, Run};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, value};

/// One step of an encoder of 131,072 counts, rad.
const STEP_RAD: f64 = std::f64::consts::TAU / 131_072.0;

/// Table 1's bristles, with torques and viscosity at which the motor can turn.
const TABLE_1: [(&str, f64); 3] = [
    ("stribeck_velocity_rad_per_s", 0.001),
    ("bristle_stiffness_nm_per_rad", 1e5),
    ("bristle_damping_nm_s_per_rad", 316.277),
];

/// Predicts each kind of log with each model.
///
/// # Errors
/// Where the program is missing or refuses a log.
pub fn run(quick: bool) -> Result<Results> {
    let seconds = if quick { 60 } else { 3600 };
    let place = Workplace::new()?;
    let models = [("soft", soft()), ("Table 1", table_1(&place)?)];
    let progress = Progress::new(8);
    let title =
        format!("{seconds} s of 1 kHz data through `stepvalve predict`, reading and writing included");
    let header = ["predicted", "parameters", "runs", "time, s", "largest memory, MB", "log, MB"];
    let mut sheet = Sheet::new("predict", title, &header);
    let mut data = Vec::new();
    for with_torque in [true, false] {
        for runs in [60, 1] {
            let log = place.path(&format!("log-{with_torque}-{runs}.h5"));
            run_log::write_log(&log, &recording(runs, seconds / runs, with_torque))?;
            let log_mb = std::fs::metadata(&log)?.len() as f64 / 1e6;
            for (name, model) in &models {
                let quantity = if with_torque { "torque from motion" } else { "angle from command" };
                progress.next(format!("{quantity}, {name}, {runs} runs"));
                let (wall_s, memory_mb) = predict(&place, &log, model)?;
                let cells = [quantity.to_owned(), (*name).to_owned(), runs.to_string()];
                sheet.row(cells.into_iter().chain([wall_s, memory_mb, log_mb].map(digits)));
                data.push(json!({
                    "quantity": quantity, "parameters": name, "runs": runs, "wall_s": wall_s, "memory_mb": memory_mb,
                    "log_mb": log_mb,
                }));
            }
        }
    }
    Ok(Results {
        command: "predict",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "the normal scheduler".to_owned(),
        sheets: vec![sheet],
        data: Value::Array(data),
    })
}

/// Runs the command; its time in s and its largest resident memory in MB.
fn predict(place: &Workplace, log: &Path, model: &Path) -> Result<(f64, f64)> {
    let out = place.path("predicted.h5");
    let mut command = place.stepvalve()?;
    command.arg("predict").arg("--log").arg(log).arg("--model").arg(model).arg("--out").arg(&out);
    let taken = watched::run(&mut command)?;
    std::fs::remove_file(&out)?;
    Ok((taken.wall_s, taken.memory_mb))
}

fn soft() -> PathBuf {
    repository().join("rt-config/models/rig.toml")
}

fn table_1(place: &Workplace) -> Result<PathBuf> {
    let mut model: DocumentMut = std::fs::read_to_string(soft())?.parse()?;
    let friction = model.get_mut("friction").context("[friction]")?;
    for (key, number) in TABLE_1 {
        *friction.get_mut(key).with_context(|| key.to_owned())? = value(number);
    }
    let path = place.path("table-1.toml");
    std::fs::write(&path, model.to_string())?;
    Ok(path)
}

/// A log of sines with reversals, each run somewhat quicker than the one before.
fn recording(runs: usize, seconds: usize, with_torque: bool) -> Log {
    let runs = (0..runs).map(|index| {
        let time_s: Vec<f64> =
            (0..seconds * 1000).map(|k| (index * (seconds + 1)) as f64 + 1e-3 * k as f64).collect();
        let turning = 3.0 + 0.1 * index as f64;
        let wanted = |t: &f64| 0.2 * (turning * t).sin() + 0.02 * (9.7 * turning * t).sin();
        let angle_rad: Vec<f64> = time_s.iter().map(|t| (wanted(t) / STEP_RAD).round() * STEP_RAD).collect();
        let torque_nm = with_torque.then(|| vec![0.0; time_s.len()]);
        let angle_command_rad = (!with_torque).then(|| time_s.iter().map(wanted).collect());
        let (name, kind) = (format!("run-{index:02}"), "sines".to_owned());
        Run { name, kind, time_s, angle_rad, torque_nm, angle_command_rad, ..Run::default() }
    });
    Log { title: "bench".to_owned(), runs: runs.collect(), ..Log::default() }
}
