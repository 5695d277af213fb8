//! What happened when: set-points, refusals, states, alarms, faults, lost steps, notes, later starts.

use super::set_points::FollowedSetPoint;
use super::table::Table;
use super::text;
use ::report::{Level, Marker};
use run_log::RunLogError;
use scope::CAPTURE_NOTE;
use signals::{ControllerState, FaultCode, HeldFlow, SetPointRefusal, alarm};
use supervisor::{advice, advice_on_alarm};

/// More set-points than this stand in their strip alone: lines through all plots would hide them.
const MOST_MARKED: usize = 40;
/// More events of a kind than this are not told one by one.
const MOST: usize = 1000;

/// An event in a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// The row.
    pub row: usize,
    /// What happened.
    pub label: String,
    /// What it means and what to do; empty where the label says all.
    pub advice: &'static str,
}

impl Event {
    fn new(row: usize, label: impl Into<String>) -> Self {
        Self { row, label: label.into(), advice: "" }
    }
}

/// All of a run's events.
#[derive(Debug, Default)]
pub struct Events {
    /// Set-points followed.
    pub set_points: Vec<FollowedSetPoint>,
    /// Set-points refused.
    pub refusals: Vec<Event>,
    /// Faults that the controller found.
    pub faults: Vec<Event>,
    /// Faults that the drive reported.
    pub drive_faults: Vec<Event>,
    /// Lost steps that the controller noticed.
    pub lost_steps: Vec<Event>,
    /// Changes of the controller's state.
    pub states: Vec<Event>,
    /// The rows in which it ceased to follow the reference.
    pub stops: Vec<usize>,
    /// Alarms raised.
    pub alarms: Vec<Event>,
    /// Where a flow that was to be held went out of reach, and came back.
    pub held_flow: Vec<Event>,
    /// What was noted meanwhile: an operator's marks, faults injected.
    pub notes: Vec<Event>,
    /// Runs after the first.
    pub runs: Vec<Event>,
    /// Whether those are later starts of the loop, not runs of a log.
    pub later_starts: bool,
}

/// Gathers a run's events.
///
/// # Errors
/// [`RunLogError`].
pub fn read(table: &Table, set_points: &[FollowedSetPoint]) -> Result<Events, RunLogError> {
    let runs = table.file.spans().skip(1);
    let run =
        |label: &str| if table.closed_loop { format!("started anew: {label}") } else { label.to_owned() };
    Ok(Events {
        set_points: set_points.iter().filter(|point| point.id != 0).cloned().collect(),
        refusals: refusals(table)?,
        faults: faults(table)?,
        drive_faults: codes(table, "drive_fault", |code| format!("drive: {code}"))?,
        lost_steps: lost_steps(table)?,
        states: states(table)?,
        stops: stops(table)?,
        alarms: alarms(table)?,
        held_flow: held_flow(table)?,
        notes: notes(table)?,
        runs: runs.map(|span| Event::new(span.rows.start, run(&span.name))).collect(),
        later_starts: table.closed_loop,
    })
}

impl Events {
    /// The events as marks through all plots.
    pub fn markers(&self, table: &Table) -> Vec<Marker> {
        let marker = |row: usize, label: String, level| Marker { time_s: table.at(row), label, level };
        let of = |events: &[Event], level| {
            events.iter().map(|event| marker(event.row, event.label.clone(), level)).collect::<Vec<_>>()
        };
        let mut markers = Vec::new();
        if self.set_points.len() <= MOST_MARKED {
            markers.extend(
                self.set_points.iter().map(|point| marker(point.row, point.label.clone(), Level::Neutral)),
            );
        }
        if self.later_starts || self.runs.len() <= MOST_MARKED {
            markers.extend(of(&self.runs, if self.later_starts { Level::Attention } else { Level::Neutral }));
        }
        if self.notes.len() <= MOST_MARKED {
            markers.extend(of(&self.notes, Level::Neutral));
        }
        markers.extend(of(&self.refusals, Level::Attention));
        markers.extend(of(&self.held_flow, Level::Attention));
        markers.extend(of(&self.lost_steps, Level::Attention));
        markers.extend(of(&self.drive_faults, Level::Fault));
        markers.extend(of(&self.faults, Level::Fault));
        markers
    }

    /// All events as a table, in the order of their times.
    pub fn table(&self, table: &Table) -> ::report::Table {
        let of = |what: &'static str, events: &[Event]| {
            events.iter().map(|event| (event.row, what, in_full(event))).collect::<Vec<_>>()
        };
        let points = self
            .set_points
            .iter()
            .map(|point| (point.row, "accepted", format!("set-point {}: {}", point.id, point.label)));
        let mut all: Vec<_> = points.collect();
        all.extend(of(if self.later_starts { "start" } else { "run" }, &self.runs));
        all.extend(of("state", &self.states));
        all.extend(of("alarm", &self.alarms));
        all.extend(of("flow", &self.held_flow));
        all.extend(of("note", &self.notes));
        all.extend(of("refused", &self.refusals));
        all.extend(of("lost steps", &self.lost_steps));
        all.extend(of("drive", &self.drive_faults));
        all.extend(of("fault", &self.faults));
        all.sort_by_key(|(row, _, _)| *row);
        let left_out = all.len().saturating_sub(MOST);
        let row = |(row, what, label): (usize, &str, String)| {
            vec![text::moment(table.at(row)), what.to_owned(), label]
        };
        let mut rows: Vec<_> = all.into_iter().take(MOST).map(row).collect();
        if left_out > 0 {
            rows.push(vec![
                String::new(),
                String::new(),
                format!("and {} more", text::grouped(left_out as u64)),
            ]);
        }
        let header = ["time", "what", "in words"].map(str::to_owned).to_vec();
        ::report::Table { header, rows }
    }
}

/// An event with what to do about it.
fn in_full(event: &Event) -> String {
    if event.advice.is_empty() { event.label.clone() } else { format!("{}: {}", event.label, event.advice) }
}

/// Changes of the state; the first is how it began. A fault has a row of its own.
fn states(table: &Table) -> Result<Vec<Event>, RunLogError> {
    let (changes, _) = table.changes("state", MOST)?;
    let state = |(row, code): (usize, f64)| {
        let state =
            ControllerState::from_code(code as u64).filter(|state| *state != ControllerState::Fault)?;
        Some(Event::new(row, state.name()))
    };
    Ok(changes.into_iter().skip(1).filter_map(state).collect())
}

fn stops(table: &Table) -> Result<Vec<usize>, RunLogError> {
    let (changes, _) = table.changes("state", MOST)?;
    let running = |code: f64| code == ControllerState::Running.code() as f64;
    let stop = |pair: &[(usize, f64)]| match pair {
        [(_, before), (row, now)] if running(*before) && !running(*now) => Some(*row),
        _ => None,
    };
    Ok(changes.windows(2).filter_map(stop).collect())
}

fn alarms(table: &Table) -> Result<Vec<Event>, RunLogError> {
    let (changes, _) = table.changes("alarms", MOST)?;
    let mut before = 0;
    let mut raised = Vec::new();
    for (row, flags) in changes {
        let now = flags as u64;
        let new = alarm::names(now & !before);
        raised.extend(new.map(|name| Event { advice: advice_on_alarm(name), ..Event::new(row, name) }));
        before = now;
    }
    Ok(raised)
}

/// Where it is held no longer, and where again; that it is held from its set-point on is no event.
fn held_flow(table: &Table) -> Result<Vec<Event>, RunLogError> {
    let (changes, _) = table.changes("held_flow", MOST)?;
    let codes = changes.into_iter().map(|(row, code)| (row, HeldFlow::from_code(code as u64)));
    let mut before = HeldFlow::None;
    let mut found = Vec::new();
    for (row, held) in codes {
        let Some(held) = held else { continue };
        let label = match held {
            HeldFlow::OutOfReach | HeldFlow::NoPressure => Some(format!("held flow: {held}")),
            HeldFlow::Held if before != HeldFlow::None => Some("held again".to_owned()),
            HeldFlow::Held | HeldFlow::None => None,
        };
        found.extend(label.map(|label| Event::new(row, label)));
        before = held;
    }
    Ok(found)
}

fn notes(table: &Table) -> Result<Vec<Event>, RunLogError> {
    // What a scope's capture is of is for the scope, which reads it back.
    let noted = table.file.notes()?.into_iter().filter(|note| !note.text.starts_with(CAPTURE_NOTE));
    Ok(noted.filter_map(|note| Some(Event::new(note.row?, note.text))).collect())
}

fn codes(
    table: &Table,
    column: &str,
    label: impl Fn(FaultCode) -> String,
) -> Result<Vec<Event>, RunLogError> {
    let (changes, _) = table.changes(column, MOST)?;
    let known = changes.into_iter().filter(|(_, code)| *code != 0.0);
    let event = |(row, code)| {
        FaultCode::from_code(code as u64)
            .map(|fault| Event { advice: advice(fault), ..Event::new(row, label(fault)) })
    };
    Ok(known.filter_map(event).collect())
}

/// Each fault in the row of the cycle in which it was found, which the status of that cycle may not tell yet.
fn faults(table: &Table) -> Result<Vec<Event>, RunLogError> {
    let mut faults = codes(table, "fault", |fault| fault.name().to_owned())?;
    let rows: Vec<usize> = faults.iter().map(|fault| fault.row).collect();
    let cycles = table.pick("fault_cycle", &rows)?;
    for (fault, cycle) in faults.iter_mut().zip(cycles) {
        let span = table.file.spans().find(|span| span.rows.contains(&fault.row));
        let found = span.and_then(|span| {
            let row = (cycle as u64).checked_sub(span.first_cycle?)? as usize + span.rows.start;
            (row <= fault.row).then_some(row)
        });
        fault.row = found.unwrap_or(fault.row);
    }
    Ok(faults)
}

fn refusals(table: &Table) -> Result<Vec<Event>, RunLogError> {
    let (changes, _) = table.changes("refused_set_point_id", MOST)?;
    let known: Vec<_> = changes.into_iter().filter(|(_, id)| *id != 0.0).collect();
    let rows: Vec<usize> = known.iter().map(|change| change.0).collect();
    let reasons = table.pick("set_point_refusal", &rows)?;
    let event = |((row, id), code): ((usize, f64), f64)| {
        let why = SetPointRefusal::from_code(code as u64).map_or("unknown reason", SetPointRefusal::name);
        Event::new(row, format!("set-point {id} refused: {why}"))
    };
    Ok(known.into_iter().zip(reasons).map(event).collect())
}

fn lost_steps(table: &Table) -> Result<Vec<Event>, RunLogError> {
    let (changes, _) = table.changes("lost_teeth_noticed", MOST)?;
    let rising = changes.windows(2).filter_map(|pair| match pair {
        [(_, before), (row, now)] if now > before => {
            Some(Event::new(*row, text::count((now - before) as u64, "lost step")))
        }
        _ => None,
    });
    Ok(rising.collect())
}
