//! Simulates a scenario in this process, faster than real time and without shared memory, and prints it as CSV:
//! `cargo run --release --package closed-loop --example simulate_scenario -- rt-config/scenarios/sine-1hz.toml`
//!
//! This is the way to run the loop from a program of your own: read the texts, let `config` check them, `wire` them into
//! the parts of the loop, and take one `CycleMessages` for each cycle.

use closed_loop::{InProcess, wire};
use config::{check_against_models, parse_model, parse_scenario};
use std::error::Error;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Every so many cycles a row is printed.
const CYCLES_PER_ROW: u64 = 10;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: simulate_scenario SCENARIO.toml")?;
    let (path, folder) = (Path::new(&path), Path::new(&path).parent().unwrap_or(Path::new("")));

    // The crates read no files: texts and names are given to them. All errors of a file come at once.
    let text = read(path)?;
    let scenario = parse_scenario(&text, &path.display().to_string())?;
    let model = |name: &str| -> Result<_, Box<dyn Error>> {
        let path = folder.join(name);
        Ok(parse_model(&read(&path)?, &path.display().to_string())?)
    };
    // The plant moves by the truth; the controller knows the belief alone.
    let (truth, belief) = (model(&scenario.truth)?, model(&scenario.belief)?);
    check_against_models(&scenario, &truth, &belief, &text, &path.display().to_string())?;
    let parts = wire(&scenario, &truth, &belief)?;

    let mut out = BufWriter::new(std::io::stdout().lock());
    writeln!(out, "time_s,angle_rad,true_angle_rad,following_error_rad,friction_torque_nm")?;
    let mut largest_error_rad = 0.0_f64;
    for messages in InProcess::new(&parts) {
        let (feedback, truth, status) = (messages.plant.feedback, messages.plant.truth, messages.status);
        largest_error_rad = largest_error_rad.max(status.following_error_rad.abs());
        if messages.cycle % CYCLES_PER_ROW == 0 {
            let (time_s, error_rad) =
                (parts.timeline.scenario_time_s(messages.cycle), status.following_error_rad);
            let (angle_rad, true_rad, friction_nm) =
                (feedback.angle_rad, truth.angle_rad, truth.friction_torque_nm);
            writeln!(out, "{time_s:.3},{angle_rad:.6},{true_rad:.6},{error_rad:.6},{friction_nm:.4}")?;
        }
    }
    out.flush()?;
    eprintln!("{}: largest following error {largest_error_rad:.6} rad", scenario.name);
    Ok(())
}

fn read(path: &Path) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
}
