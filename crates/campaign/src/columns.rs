//! Rows as columns: what the table holds, and which of it is a metric.

use crate::plan::Campaign;
use crate::row::{Diagnosed, MotionMetrics, Row};
use config::Setting;

/// A column of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name: a metric's, or the path of what was varied.
    pub name: String,
    /// Its unit; "1" for a number without one, empty where the file's key says it.
    pub unit: String,
    /// A value a row.
    pub values: Values,
}

/// A column's values.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers; NaN where one is not known.
    Numbers(Vec<f64>),
    /// Counts.
    Counts(Vec<u64>),
    /// Texts; empty where there is none.
    Texts(Vec<String>),
}

/// A number that says how good a run was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// RMS of reference minus true angle.
    ErrorRms,
    /// Its largest magnitude.
    ErrorPeak,
    /// RMS of reference minus measured angle.
    MeasuredErrorRms,
    /// Its largest magnitude.
    MeasuredErrorPeak,
    /// Reference minus true angle at the end.
    FinalError,
    /// Lowest torque reserve.
    TorqueReserve,
    /// Highest pulse rate.
    PulseRate,
    /// Cycles in which a limit held the command back.
    LimitingCycles,
    /// Tooth pitches lost.
    LostSteps,
}

impl Metric {
    /// All of them, in the table's order.
    pub const ALL: [Self; 9] = [
        Self::ErrorRms,
        Self::ErrorPeak,
        Self::MeasuredErrorRms,
        Self::MeasuredErrorPeak,
        Self::FinalError,
        Self::TorqueReserve,
        Self::PulseRate,
        Self::LimitingCycles,
        Self::LostSteps,
    ];

    /// Its column.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ErrorRms => "following_error_rms",
            Self::ErrorPeak => "following_error_peak",
            Self::MeasuredErrorRms => "measured_following_error_rms",
            Self::MeasuredErrorPeak => "measured_following_error_peak",
            Self::FinalError => "final_error",
            Self::TorqueReserve => "torque_reserve_min",
            Self::PulseRate => "pulse_rate_peak",
            Self::LimitingCycles => "limiting_cycles",
            Self::LostSteps => "lost_steps",
        }
    }

    /// Its unit.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::TorqueReserve => "N*m",
            Self::PulseRate => "Hz",
            Self::LimitingCycles | Self::LostSteps => "1",
            _ => "rad",
        }
    }

    /// In words.
    pub const fn label(self) -> &'static str {
        match self {
            Self::ErrorRms => "following error, RMS",
            Self::ErrorPeak => "following error, peak",
            Self::MeasuredErrorRms => "following error as measured, RMS",
            Self::MeasuredErrorPeak => "following error as measured, peak",
            Self::FinalError => "error at the end",
            Self::TorqueReserve => "torque reserve, lowest",
            Self::PulseRate => "pulse rate, highest",
            Self::LimitingCycles => "cycles held back by limits",
            Self::LostSteps => "lost steps",
        }
    }

    /// Its value in a row; NaN where it is not known.
    pub fn of(self, row: &Row) -> f64 {
        let Some(motion) = &row.motion else { return f64::NAN };
        match self {
            Self::ErrorRms => motion.error_rms_rad,
            Self::ErrorPeak => motion.error_peak_rad,
            Self::MeasuredErrorRms => motion.measured_error_rms_rad,
            Self::MeasuredErrorPeak => motion.measured_error_peak_rad,
            Self::FinalError => motion.final_error_rad,
            Self::TorqueReserve => motion.torque_reserve_min_nm,
            Self::PulseRate => motion.pulse_rate_peak_hz,
            Self::LimitingCycles => motion.limiting_cycles as f64,
            Self::LostSteps => motion.lost_steps as f64,
        }
    }
}

/// The columns of all rows, which are in the order of their runs.
pub fn columns(campaign: &Campaign, rows: &[Row]) -> Vec<Column> {
    let mut columns = vec![
        counts("run", rows, |row| row.run),
        texts("scenario", rows, |row| campaign.scenario(row.run).to_owned()),
    ];
    let settings: Vec<Vec<Setting>> = rows.iter().map(|row| campaign.settings(row.run)).collect();
    for (index, vary) in campaign.plan().vary.iter().enumerate() {
        let own: Vec<&Setting> = settings.iter().filter_map(|of| of.get(index)).collect();
        columns.push(varied(&vary.path.text, vary.is_factor, &own));
    }
    let failure = |row: &Row| row.failure.clone();
    columns.push(texts("outcome", rows, |row| {
        failure(row).map_or("done", |failure| failure.stage.name()).to_owned()
    }));
    columns
        .push(texts("reason", rows, |row| failure(row).map_or_else(String::new, |failure| failure.reason)));
    if campaign.plan().task.measures() {
        columns.extend(of_motion(rows));
    }
    if campaign.plan().task.diagnoses() {
        columns.extend(of_diagnosis(rows));
    }
    columns
}

fn varied(path: &str, is_factor: bool, settings: &[&Setting]) -> Column {
    let plain = |setting: &&Setting| match setting {
        Setting::Number { number, unit } => Some((*number, unit.clone())),
        _ => None,
    };
    let numbers: Option<Vec<(f64, String)>> = settings.iter().map(plain).collect();
    let unit = numbers.as_ref().and_then(|all| all.first()).map(|(_, unit)| unit.clone()).unwrap_or_default();
    let numbers = numbers.filter(|all| all.iter().all(|(_, other)| *other == unit));
    let (unit, values) = match numbers {
        Some(all) => (unit, Values::Numbers(all.into_iter().map(|(number, _)| number).collect())),
        None => (String::new(), Values::Texts(settings.iter().map(|setting| setting.shown()).collect())),
    };
    let unit = if is_factor { "1".to_owned() } else { unit };
    Column { name: path.to_owned(), unit, values }
}

fn of_motion(rows: &[Row]) -> Vec<Column> {
    let motion = |row: &Row, of: fn(&MotionMetrics) -> u64| row.motion.as_ref().map_or(0, of);
    let mut columns: Vec<Column> = Metric::ALL
        .into_iter()
        .map(|metric| Column {
            name: metric.name().to_owned(),
            unit: metric.unit().to_owned(),
            values: Values::Numbers(rows.iter().map(|row| metric.of(row)).collect()),
        })
        .collect();
    columns.push(texts("fault", rows, |row| {
        row.motion.as_ref().map_or("", MotionMetrics::fault_name).to_owned()
    }));
    columns.push(counts("fault_cycle", rows, |row| motion(row, |motion| motion.fault_cycle)));
    columns.push(counts("alarms", rows, |row| motion(row, |motion| motion.alarms)));
    columns
}

fn of_diagnosis(rows: &[Row]) -> Vec<Column> {
    let text = |row: &Row, of: fn(&Diagnosed) -> String| row.diagnosed.as_ref().map_or_else(String::new, of);
    let number = |name: &str, unit: &str, of: fn(&Diagnosed) -> f64| Column {
        name: name.to_owned(),
        unit: unit.to_owned(),
        values: Values::Numbers(rows.iter().map(|row| row.diagnosed.as_ref().map_or(f64::NAN, of)).collect()),
    };
    vec![
        texts("verdict", rows, |row| text(row, |found| found.verdict.clone())),
        texts("causes", rows, |row| text(row, |found| found.causes.join(", "))),
        texts("ambiguous", rows, |row| {
            text(row, |found| {
                found.ambiguous.iter().map(|group| group.join(" or ")).collect::<Vec<_>>().join("; ")
            })
        }),
        number("residual_rms", "rad", |found| found.residual_rms_rad),
        number("gain_ratio", "1", |found| found.gain_ratio),
    ]
}

fn counts(name: &str, rows: &[Row], of: impl Fn(&Row) -> u64) -> Column {
    Column {
        name: name.to_owned(),
        unit: "1".to_owned(),
        values: Values::Counts(rows.iter().map(of).collect()),
    }
}

fn texts(name: &str, rows: &[Row], of: impl Fn(&Row) -> String) -> Column {
    Column {
        name: name.to_owned(),
        unit: String::new(),
        values: Values::Texts(rows.iter().map(of).collect()),
    }
}
