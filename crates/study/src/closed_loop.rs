//! What the extension is worth in the loop: the extended model as the valve, the given and the extended one in turn in
//! the controller.

use crate::extended;
use closed_loop::{Level, measure};
use config::{Compensation, parse_scenario};
use diagnosis::{ClosedLoopGain, Found};
use valve_model::Model;

/// The motion: a sine through both directions, whose reversals are what friction spoils.
const SCENARIO: &str = include_str!("../../../rt-config/scenarios/sine-1hz.toml");

/// The controller feeds forward all that its belief holds, effects too: those are what was found.
const LEVEL: Level = Level { feed_forward: Compensation::FullWithEffects, encoder: false };

/// The gain in following error; `None` where nothing was found, where the model is of no valve with a motor, so that no loop is
/// meant, or where the valve doesn't come through the motion.
pub fn gain(found: &Found, given: &Model) -> Option<ClosedLoopGain> {
    let is_valve = given.motor.is_some() && given.load.is_some() && given.orifice.is_some();
    if found.diagnosis.causes.is_empty() || !is_valve {
        return None;
    }
    let (pressure_pa, temperature_c) = (mean(found, true), mean(found, false));
    let mut text = SCENARIO.to_owned();
    if let Some(pressure_pa) = pressure_pa {
        text = text.replace("pressure_drop = \"2MPa\"", &format!("pressure_drop = {pressure_pa:?}"));
    }
    if let Some(celsius) = temperature_c {
        text = text.replace("\"40degC\"", &format!("\"{celsius:?}degC\""));
    }
    let scenario = parse_scenario(&text, "the sine of the closed loop").ok()?;
    let extended = extended::model(found);
    let following_error = |belief: &Model| {
        let outcome = measure(&scenario, &extended, belief, LEVEL).ok()?;
        (outcome.fault.is_none() && outcome.lost_teeth == 0 && outcome.cycles > 0).then_some(outcome.rms_rad)
    };
    let (before, after) = (following_error(given)?, following_error(&extended)?);
    Some(ClosedLoopGain {
        following_error_rms_before_rad: before,
        following_error_rms_after_rad: after,
        ratio: if before > 0.0 { after / before } else { 1.0 },
    })
}

/// Mean pressure drop, Pa, or oil temperature, °C, of the log.
fn mean(found: &Found, pressure: bool) -> Option<f64> {
    let channel = |shown: &diagnosis::Shown| {
        let values = if pressure { &shown.pressure_pa } else { &shown.temperature_c };
        (values.iter().sum::<f64>(), values.len() as f64)
    };
    let (sum, count) = found.shown.iter().map(channel).fold((0.0, 0.0), |(s, c), of| (s + of.0, c + of.1));
    (count > 0.0).then(|| sum / count)
}
