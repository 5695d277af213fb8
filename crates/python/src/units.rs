//! Units that channels may be given in.

use crate::errors::refused_because;
use config::{Dimension, parse_quantity};
use log_data::Channel;
use pyo3::prelude::*;

/// Factors to N·m, which the configuration's units don't hold.
const TORQUE: [(&str, f64); 5] = [("N*m", 1.0), ("Nm", 1.0), ("N m", 1.0), ("mN*m", 1e-3), ("mNm", 1e-3)];

/// The factor from a unit to the channel's own: radians, newton metres, pascals, cubic metres per second, degrees Celsius, seconds.
#[pyfunction]
pub(crate) fn to_si(channel: &str, unit: &str) -> PyResult<f64> {
    let known = Channel::from_name(channel)
        .ok_or_else(|| refused_because(format!("found a unit of {channel}, which is no channel")))?;
    let dimension = match known {
        Channel::Time => Dimension::Time,
        Channel::Angle | Channel::AngleCommand => Dimension::Angle,
        Channel::PressureDrop => Dimension::Pressure,
        Channel::Flow => Dimension::Flow,
        Channel::OilTemperature => Dimension::Temperature,
        Channel::Torque => {
            let found = TORQUE.iter().find(|(name, _)| *name == unit).map(|(_, factor)| *factor);
            return found.ok_or_else(|| {
                refused_because(format!("{channel}: found the unit {unit:?}, expected N*m or mN*m"))
            });
        }
    };
    if known.unit() == unit {
        return Ok(1.0);
    }
    parse_quantity(&format!("1{unit}"), dimension)
        .map_err(|error| refused_because(format!("{channel}: unit {unit:?}: {error}")))
}
