//! The real drive of a scenario: its file read, and checked against the scenario and its models.

use crate::files;
use anyhow::anyhow;
use closed_loop::Parts;
use config::{Drive, Scenario};
use ethercat_link::BridgeParams;
use fieldbus::{AxisParams, DriveFile, JudgeParams};
use processes::BridgePart;
use std::f64::consts::TAU;
use std::path::Path;
use supervisor::Failure;

/// The frame goes out at this part of the cycle, per cent.
const PLACE_PERCENT: u64 = 10;
/// Its reply is awaited until this part, or the trajectory's phase where that is earlier.
const REPLY_PERCENT: u64 = 40;
/// A reply needs this part at least.
const SHORTEST_WAIT_PERCENT: u64 = 5;
/// Deviation from the bus's clock that is borne, per cent of the cycle, and for how many cycles.
const CLOCK_WINDOW_PERCENT: u64 = 20;
const CLOCK_CYCLES: u64 = 10;

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
    let params = params(file, scenario, parts).map_err(named)?;
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

fn params(file: DriveFile, scenario: &Scenario, parts: &Parts) -> Result<BridgeParams, String> {
    let period_ns = scenario.period_ns;
    let part = |percent: u64| period_ns * percent / 100;
    let reply_until_ns = part(REPLY_PERCENT).min(scenario.timing.trajectory.phase_ns);
    let earliest = part(PLACE_PERCENT + SHORTEST_WAIT_PERCENT);
    if reply_until_ns < earliest {
        return Err(format!(
            "timing.trajectory-generator.phase is {} us, expected at least {} us: the drive's frame goes out at {} us",
            scenario.timing.trajectory.phase_ns / 1000,
            earliest / 1000,
            part(PLACE_PERCENT) / 1000
        ));
    }
    let axis = AxisParams {
        drive: parts.plant.drive,
        profile: file.profile,
        direction: file.direction(),
        position_is_measured: file.position_is_measured,
        homing: file.homing,
        enable_cycles: file.enable_timeout_ns / period_ns,
        judge: JudgeParams {
            bus_lost_cycles: file.bus_lost_cycles,
            clock_window_ns: part(CLOCK_WINDOW_PERCENT).cast_signed(),
            clock_cycles: CLOCK_CYCLES,
        },
    };
    // A period is at most 10 ms.
    let short = |ns: u64| u32::try_from(ns).unwrap_or(u32::MAX);
    Ok(BridgeParams {
        file,
        axis,
        period_ns: short(period_ns),
        place_ns: short(part(PLACE_PERCENT)),
        reply_until_ns: short(reply_until_ns),
    })
}
