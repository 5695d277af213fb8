//! The set-points that were followed, in words and as the flow wanted.

use super::table::Table;
use super::text;
use config::{FlowPressure, ScheduledSetPoint, SetPoint, parse_scenario};
use run_log::{RunFile, RunLogError};
use signals::SetPointKind;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// More changes of the set-point than this are not told one by one.
const MOST: usize = 20_000;

/// A set-point and the row from which on it was followed.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowedSetPoint {
    /// Its id; 0 before the first.
    pub id: u64,
    /// The row.
    pub row: usize,
    /// What it asks for, in words.
    pub label: String,
    /// The flow that it asks for, m³/s, if it is one of flow and the file tells.
    pub flow_m3_per_s: Option<f64>,
}

/// What was asked for, as the record of the set-points or the scenario says.
#[derive(Debug, Clone, Copy)]
struct Wish {
    kind: SetPointKind,
    value: f64,
    frequency_hz: f64,
    pressure_drop_pa: Option<f64>,
    /// Speed given as a rate of micro-steps, Hz.
    pulse_rate: bool,
}

/// The set-points in the order in which they were followed.
///
/// # Errors
/// [`RunLogError`].
pub fn read(table: &Table) -> Result<Vec<FollowedSetPoint>, RunLogError> {
    let (changes, _) = table.changes("set_point_id", MOST)?;
    let rows: Vec<usize> = changes.iter().map(|change| change.0).collect();
    let kinds = table.pick("set_point_kind", &rows)?;
    let targets = table.pick("reference_target_angle", &rows)?;
    let (scheduled, recorded) = (scheduled(&table.file)?, recorded(&table.file)?);
    // Every start counts its set-points from 1.
    let generation = |row| {
        let span = table.file.spans().find(|span| span.rows.contains(&row));
        span.and_then(|span| span.generation).unwrap_or_default()
    };
    let what = kinds.into_iter().zip(targets);
    let set_points = changes.into_iter().zip(what).map(|((row, id), (kind, target_rad))| {
        let id = id as u64;
        let kind = SetPointKind::from_code(kind as u64).unwrap_or(SetPointKind::Hold);
        let wish = recorded.get(&(generation(row), id)).or_else(|| scheduled.get(&id)).copied();
        let wish = wish.filter(|wish| wish.kind == kind);
        let label = wish.map_or_else(|| by_target(kind, target_rad), label);
        let flow = wish.filter(|wish| wish.kind == SetPointKind::Flow).map(|wish| wish.value);
        FollowedSetPoint { id, row, label, flow_m3_per_s: flow }
    });
    Ok(set_points.collect())
}

/// The flow wanted in each row: m³/s, NaN where no flow is.
pub fn flow_wanted(set_points: &[FollowedSetPoint], rows: usize) -> impl Iterator<Item = f64> {
    let ends = set_points.iter().skip(1).map(|next| next.row).chain([rows]);
    let first = set_points.first().map_or(rows, |first| first.row);
    let spans = set_points.iter().zip(ends).flat_map(|(point, end)| {
        std::iter::repeat_n(point.flow_m3_per_s.unwrap_or(f64::NAN), end.saturating_sub(point.row))
    });
    std::iter::repeat_n(f64::NAN, first).chain(spans)
}

fn label(wish: Wish) -> String {
    let Wish { kind, value, frequency_hz, pressure_drop_pa, pulse_rate } = wish;
    match kind {
        SetPointKind::Hold => "hold".to_owned(),
        SetPointKind::Angle => text::degrees(value),
        SetPointKind::Opening => format!("opening {} %", text::number(100.0 * value)),
        SetPointKind::Flow => {
            let at = pressure_drop_pa.map_or(String::new(), |p| format!(" at {} bar", text::number(p / 1e5)));
            format!("{} L/min{at}", text::number(value * 60e3))
        }
        SetPointKind::Speed if pulse_rate => format!("{} kHz", text::number(value / 1e3)),
        SetPointKind::Speed => {
            format!("{} rpm ({} rad/s)", text::number(value * 60.0 / TAU), text::number(value))
        }
        SetPointKind::Sine => {
            format!("sine ±{}, {} Hz", text::degrees(value), text::number(frequency_hz))
        }
    }
}

fn by_target(kind: SetPointKind, target_rad: f64) -> String {
    match kind {
        SetPointKind::Hold | SetPointKind::Speed | SetPointKind::Sine => kind.name().to_owned(),
        SetPointKind::Angle => text::degrees(target_rad),
        SetPointKind::Opening | SetPointKind::Flow => format!("{kind} ({})", text::degrees(target_rad)),
    }
}

/// The scenario's set-points by their ids, which count from 1; none where its text can't be read.
fn scheduled(file: &RunFile) -> Result<BTreeMap<u64, Wish>, RunLogError> {
    let texts = file.texts()?;
    let text = texts.iter().find(|(name, _)| name == "scenario").map(|(_, text)| text.as_str());
    let scenario = text.and_then(|text| parse_scenario(text, "scenario").ok());
    let points = scenario.map(|scenario| scenario.set_points).unwrap_or_default();
    Ok((1..).zip(points.iter().map(of_scenario)).collect())
}

fn of_scenario(point: &ScheduledSetPoint) -> Wish {
    let of = |kind, value| Wish { kind, value, frequency_hz: 0.0, pressure_drop_pa: None, pulse_rate: false };
    match point.set_point {
        SetPoint::Angle { angle_rad } => of(SetPointKind::Angle, angle_rad),
        SetPoint::Opening { opening } => of(SetPointKind::Opening, opening),
        SetPoint::Flow { flow_m3_per_s, pressure_drop } => Wish {
            pressure_drop_pa: match pressure_drop {
                FlowPressure::Measured => None,
                FlowPressure::Given(pressure_pa) => Some(pressure_pa),
            },
            ..of(SetPointKind::Flow, flow_m3_per_s)
        },
        SetPoint::Speed { speed_rad_per_s } => of(SetPointKind::Speed, speed_rad_per_s),
        SetPoint::PulseRate { pulse_rate_hz } => {
            Wish { pulse_rate: true, ..of(SetPointKind::Speed, pulse_rate_hz) }
        }
        SetPoint::Sine { amplitude_rad, frequency_hz } => {
            Wish { frequency_hz, ..of(SetPointKind::Sine, amplitude_rad) }
        }
        SetPoint::Hold => of(SetPointKind::Hold, 0.0),
    }
}

/// The set-points that the record holds as messages, by the start that they are of and their ids.
fn recorded(file: &RunFile) -> Result<BTreeMap<(u64, u64), Wish>, RunLogError> {
    let column = |name| {
        let values =
            file.table_column("messages/set_point", name, |values| values.take(MOST).collect::<Vec<f64>>());
        Ok::<_, RunLogError>(values?.unwrap_or_default())
    };
    let (generations, ids) = (column("generation")?, column("id")?);
    let (kinds, values) = (column("kind")?, column("value")?);
    let (frequencies, pressures, given) =
        (column("frequency_hz")?, column("pressure_drop_pa")?, column("pressure_given")?);
    let what = kinds.into_iter().zip(values).zip(frequencies).zip(pressures.into_iter().zip(given));
    let of = generations.into_iter().zip(ids);
    let wishes =
        of.zip(what).filter_map(|((generation, id), (((kind, value), frequency_hz), (p, given)))| {
            let kind = SetPointKind::from_code(kind as u64)?;
            let pressure_drop_pa = (given == 1.0).then_some(p);
            Some((
                (generation as u64, id as u64),
                Wish { kind, value, frequency_hz, pressure_drop_pa, pulse_rate: false },
            ))
        });
    Ok(wishes.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flow_wanted_holds_from_its_row_on() {
        let point = |row, flow| FollowedSetPoint { id: 1, row, label: String::new(), flow_m3_per_s: flow };
        let found: Vec<f64> =
            flow_wanted(&[point(1, Some(2.0)), point(3, None), point(4, Some(1.0))], 6).collect();
        assert_eq!(found.len(), 6);
        assert!(found[0].is_nan() && found[3].is_nan());
        assert_eq!([found[1], found[2], found[4], found[5]], [2.0, 2.0, 1.0, 1.0]);
        assert_eq!(flow_wanted(&[], 3).count(), 3);
    }
}
