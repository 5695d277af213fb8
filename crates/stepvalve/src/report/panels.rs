//! Which signals the page shows, in which plots and units.

use super::figures::Figures;
use super::set_points::{FollowedSetPoint, flow_wanted};
use super::table::Table;
use ::report::{Line, Panel, Trace};
use anyhow::Result;
use run_log::RunLogError;

/// A following error below this is shown in thousandths of a degree.
const SMALL_ERROR_DEG: f64 = 0.5;

/// A column that may be on the page.
struct Signal {
    panel: &'static str,
    name: &'static str,
    column: &'static str,
    unit: &'static str,
    /// From SI to `unit`.
    factor: f64,
    /// Only while the controller follows: elsewhere it means nothing.
    running_only: bool,
    line: Line,
    /// Left out where the file has this other column.
    unless: Option<&'static str>,
}

/// Puts one value a row onto a time axis.
pub type Lay<'a> = dyn Fn(&mut dyn Iterator<Item = f64>) -> Result<Trace> + 'a;

const DEG: f64 = 180.0 / std::f64::consts::PI;

const fn signal(
    panel: &'static str,
    name: &'static str,
    column: &'static str,
    (unit, factor): (&'static str, f64),
) -> Signal {
    Signal { panel, name, column, unit, factor, running_only: false, line: Line::Normal, unless: None }
}

impl Signal {
    const fn running(mut self) -> Self {
        self.running_only = true;
        self
    }

    const fn line(mut self, line: Line) -> Self {
        self.line = line;
        self
    }

    const fn unless(mut self, column: &'static str) -> Self {
        self.unless = Some(column);
        self
    }
}

const TORQUE: (&str, f64) = ("N·m", 1.0);

const SIGNALS: &[Signal] = &[
    signal("Angle", "reference", "reference_angle", ("deg", DEG)).running().line(Line::Underlay),
    signal("Angle", "command", "angle_command", ("deg", DEG)).line(Line::Underlay).unless("reference_angle"),
    signal("Angle", "angle", "angle", ("deg", DEG)),
    signal("Following error", "measured", "following_error", ("deg", DEG)).running(),
    signal("Following error", "true", "true_following_error", ("deg", DEG)).running(),
    signal("Torque and friction", "friction, true", "friction_torque", TORQUE),
    signal("Torque and friction", "friction, estimated", "friction_estimate", TORQUE).running(),
    signal("Torque and friction", "torque wanted", "wanted_torque", TORQUE).running().line(Line::Dashed),
    signal("Torque and friction", "torque", "torque", TORQUE).unless("friction_torque"),
    signal("Torque reserve", "reserve", "torque_reserve", TORQUE).running(),
    signal("Torque reserve", "lead, electrical", "lead_angle", ("deg", DEG)).running().line(Line::Dashed),
    signal("Pulse rate", "pulse rate", "pulse_rate", ("kHz", 1e-3)),
    signal("Pressure and flow", "pressure drop", "pressure_drop", ("bar", 1e-5)),
    signal("Pressure and flow", "flow", "flow", ("L/min", 60e3)),
    signal("Drive's bus", "round trip", "bus_round_trip", ("µs", 1e-3)),
    signal("Drive's bus", "off the bus's clock", "bus_clock_error", ("µs", 1e-3)),
];

const FLOW_PANEL: &str = "Pressure and flow";

/// The unit in which a column is shown, and the factor to it from SI.
pub fn shown_as(column: &str) -> (&'static str, f64) {
    SIGNALS.iter().find(|signal| signal.column == column).map_or(("", 1.0), |of| (of.unit, of.factor))
}

/// The signals that this run has.
pub struct Plan<'a> {
    signals: Vec<&'static Signal>,
    set_points: &'a [FollowedSetPoint],
    flow_wanted: bool,
    temperature: bool,
    error_unit: (&'static str, f64),
}

/// Chooses the signals.
///
/// # Errors
/// [`RunLogError`].
pub fn plan<'a>(
    table: &Table,
    figures: &Figures,
    set_points: &'a [FollowedSetPoint],
) -> Result<Plan<'a>, RunLogError> {
    let has = |name: &str| table.file.has_column(name);
    let shown = |signal: &&Signal| has(signal.column) && !signal.unless.is_some_and(has);
    let peak_deg =
        [figures.error, figures.true_error].into_iter().flatten().fold(0.0, |most, e| e.peak.max(most)) * DEG;
    Ok(Plan {
        signals: SIGNALS.iter().filter(shown).collect(),
        set_points,
        flow_wanted: set_points.iter().any(|point| point.flow_m3_per_s.is_some()),
        temperature: varies(table, "oil_temperature")?,
        error_unit: if peak_deg < SMALL_ERROR_DEG { ("mdeg", DEG * 1e3) } else { ("deg", DEG) },
    })
}

impl Plan<'_> {
    /// How many signals they are.
    pub fn series(&self) -> usize {
        self.signals.len() + usize::from(self.flow_wanted) + usize::from(self.temperature)
    }

    /// Shows following errors in the larger of its unit and another plan's, so that they share an axis.
    pub fn share_unit(&mut self, other: &mut Self) {
        let coarser = if self.error_unit.1 < other.error_unit.1 { self.error_unit } else { other.error_unit };
        (self.error_unit, other.error_unit) = (coarser, coarser);
    }

    /// Reads them, one after the other; `lay` puts one value a row onto the page's time axis.
    ///
    /// # Errors
    /// Where the file can't be read.
    pub fn draw(&self, table: &Table, lay: &Lay<'_>) -> Result<Vec<Panel>> {
        let mut panels: Vec<Panel> = Vec::new();
        for signal in &self.signals {
            if panels.last().is_none_or(|panel| panel.title != signal.panel) {
                panels.push(Panel::new(signal.panel));
            }
            let (unit, factor) = match signal.panel {
                "Following error" => self.error_unit,
                _ => (signal.unit, signal.factor),
            };
            let (Some(panel), Some(trace)) =
                (panels.pop(), trace(table, lay, signal.column, factor, signal.running_only)?)
            else {
                continue;
            };
            panels.push(panel.with_line(signal.name, unit, trace, signal.line));
        }
        if self.flow_wanted {
            let wanted = flow_wanted(self.set_points, table.time_s.len()).map(|flow| flow * 60e3);
            let mut wanted =
                wanted.zip(&table.running).map(|(flow, running)| if *running { flow } else { f64::NAN });
            let trace = lay(&mut wanted)?;
            if let Some(panel) = panels.pop_if(|panel| panel.title == FLOW_PANEL) {
                panels.push(panel.with_line("flow wanted", "L/min", trace, Line::Dashed));
            }
        }
        if let (true, Some(trace)) = (self.temperature, trace(table, lay, "oil_temperature", 1.0, false)?) {
            panels.push(Panel::new("Oil temperature").with("oil temperature", "°C", trace));
        }
        Ok(panels)
    }
}

fn trace(
    table: &Table,
    lay: &Lay<'_>,
    column: &str,
    factor: f64,
    running_only: bool,
) -> Result<Option<Trace>> {
    let trace = table.file.column(column, |values| {
        let mut shown = values
            .zip(&table.running)
            .map(|(value, running)| if running_only && !running { f64::NAN } else { value * factor });
        lay(&mut shown)
    })?;
    trace.transpose()
}

fn varies(table: &Table, column: &str) -> Result<bool, RunLogError> {
    let varies = table.file.column(column, |values| {
        let mut values = values.filter(|value| !value.is_nan());
        let first = values.next();
        values.any(|value| Some(value) != first)
    })?;
    Ok(varies.unwrap_or(false))
}
