//! The real drive of a scenario: its file read, and checked against the scenario and its models.

use crate::files;
use anyhow::anyhow;
use closed_loop::Parts;
use config::{Drive, Scenario};
use ethercat_link::BridgeParams;
use fieldbus::DriveFile;
use processes::BridgePart;
use std::f64::consts::TAU;
use std::path::Path;
use supervisor::Failure;

/// What the bridge is told.
///
/// # Errors
/// [`Failure::Input`], where the drive file, or the scenario with it, makes no sense.
pub fn load(
    scenario_path: &Path,
    drive: &Drive,
    scenario: &Scenario,
    parts: &Parts,
) -> Result<BridgePart, Failure> {
    let path = files::beside(scenario_path, &drive.file);
    let file = config::parse_drive(&files::read(&path)?, &files::name(&path)).map_err(Failure::input)?;
    let named = |text: String| Failure::Input(anyhow!("{}: {text}", files::name(scenario_path)));
    agree(&file, scenario, parts).map_err(named)?;
    let wanted_ns = scenario.timing.trajectory.phase_ns;
    let params = BridgeParams::new(file, parts.plant.drive, scenario.period_ns, wanted_ns)
        .map_err(|error| named(format!("timing.trajectory-generator.phase is {error}")))?;
    Ok(BridgePart { interface: drive.interface.clone(), params })
}

/// What scenario, model and drive file say of the same thing.
fn agree(file: &DriveFile, scenario: &Scenario, parts: &Parts) -> Result<(), String> {
    file.validate().map_err(|error| error.to_string())?;
    let microsteps = (TAU / parts.plant.drive.microstep_angle_rad).round();
    if f64::from(file.units_per_rev) != microsteps {
        return Err(format!(
            "the drive counts {} units a revolution, expected {microsteps}, the model's micro-steps: set the drive to them",
            file.units_per_rev
        ));
    }
    if scenario.loop_delay_cycles != 2 {
        return Err(format!(
            "loop_delay_cycles is {}, expected 2: a frame carries the next cycle's command while it returns inputs",
            scenario.loop_delay_cycles
        ));
    }
    if scenario.encoder.fitted != file.position_is_measured {
        return Err(format!(
            "encoder.fitted is {}, expected {}: the drive file says position_is_measured = {}",
            scenario.encoder.fitted, file.position_is_measured, file.position_is_measured
        ));
    }
    Ok(())
}
