//! States, limits, flags and gaps as rows above the plots.

use super::events::Events;
use super::table::Table;
use super::timing::ProcessTiming;
use ::report::{Interval, Level, Strip};
use fieldbus::{DriveState, al_state_name};
use run_log::RunLogError;
use signals::{BusPhase, ControllerState, FaultCode, alarm, limiting, validity};

/// A column of each message of the cycle: where it is NaN, the message is missing.
const MESSAGES: [(&str, &str); 6] = [
    ("reference_angle", "Reference"),
    ("position_microsteps", "StepCommand"),
    ("measured_angle", "Feedback"),
    ("state", "ControlStatus"),
    ("true_angle", "PlantTruth"),
    ("bus_phase", "BusStatus"),
];

/// Flags that call for attention, by the names of their bits.
fn attention(flags: u64, names: &[(u64, &'static str)]) -> Option<(String, Level)> {
    let set = names.iter().filter(|(bit, _)| flags & bit != 0);
    all(set.map(|(bit, name)| (*bit, *name, Level::Attention)))
}

/// What the drive and the sensors say that is out of the ordinary.
const DRIVE: [(u64, &str, Level); 3] = [
    (validity::STOPPED_ITSELF, "stopped by itself", Level::Fault),
    (validity::COMMAND_MISSED, "command missed", Level::Attention),
    (validity::LIMITED, "limited", Level::Attention),
];
/// Flags that should be set.
const DRIVE_NEEDS: [(u64, &str, Level); 2] = [
    (validity::HOMED, "not homed", Level::Attention),
    (validity::ENERGISED, "not energised", Level::Neutral),
];

/// The strips that have anything to tell.
///
/// # Errors
/// [`RunLogError`].
pub fn read(table: &Table, events: &Events, timing: &[ProcessTiming]) -> Result<Vec<Strip>, RunLogError> {
    let mut strips = Vec::new();
    strips.extend(coded(table, "state", "state", state)?);
    strips.extend(coded(table, "fault", "fault", fault)?);
    strips.push(set_points(table, events));
    strips.extend(coded(table, "limit", "limiting", |flags| attention(flags, &limiting::NAMES))?);
    strips.extend(coded(table, "alarm", "alarms", |flags| attention(flags, &alarm::NAMES))?);
    strips.extend(pace(table)?);
    strips.extend(drive_flags(table)?);
    strips.extend(coded(table, "drive fault", "drive_fault", fault)?);
    strips.extend(coded(table, "drive's bus", "bus_phase", bus_phase)?);
    strips.extend(coded(table, "AL state", "bus_al_status", al_state)?);
    strips.extend(coded(table, "drive state", "bus_drive_status", drive_state)?);
    strips.extend(lost_frames(table)?);
    strips.push(missing(table)?);
    strips.push(overruns(table, timing));
    strips.retain(|strip| !strip.intervals.is_empty());
    Ok(strips)
}

fn coded(
    table: &Table,
    name: &str,
    column: &str,
    meaning: impl Fn(u64) -> Option<(String, Level)>,
) -> Result<Option<Strip>, RunLogError> {
    table.file.column(column, |codes| Strip::from_codes(name, &table.time_s, table.held(codes), meaning))
}

/// The drive's flags; but for a run's first two rows: the first StepCommand is that of its second cycle.
fn drive_flags(table: &Table) -> Result<Option<Strip>, RunLogError> {
    let first =
        |row: usize| table.file.spans().any(|span| (span.rows.start..span.rows.start + 2).contains(&row));
    table.file.column("validity", |flags| {
        let flags = flags.enumerate().map(|(row, flags)| if first(row) { f64::NAN } else { flags });
        Strip::from_codes("drive", &table.time_s, table.held(flags), drive)
    })
}

fn state(code: u64) -> Option<(String, Level)> {
    let state = ControllerState::from_code(code)?;
    let level = match state {
        ControllerState::Disarmed => Level::Neutral,
        ControllerState::Running => Level::Normal,
        ControllerState::QuickStop | ControllerState::Arming | ControllerState::Homing => Level::Attention,
        ControllerState::Fault => Level::Fault,
    };
    Some((state.name().to_owned(), level))
}

fn fault(code: u64) -> Option<(String, Level)> {
    let fault = FaultCode::from_code(code).filter(|fault| *fault != FaultCode::None)?;
    Some((fault.name().to_owned(), Level::Fault))
}

fn bus_phase(code: u64) -> Option<(String, Level)> {
    let phase = BusPhase::from_code(code)?;
    let level = if phase == BusPhase::Operate { Level::Normal } else { Level::Attention };
    Some((phase.name().to_owned(), level))
}

fn al_state(status: u64) -> Option<(String, Level)> {
    /// OP without an error.
    const GOOD: u64 = 0x08;
    let level = if status == GOOD { Level::Normal } else { Level::Attention };
    Some((al_state_name(u16::try_from(status).ok()?).to_owned(), level))
}

fn drive_state(status: u64) -> Option<(String, Level)> {
    let state = DriveState::of(u16::try_from(status).ok()?);
    let level = match state {
        DriveState::OperationEnabled => Level::Normal,
        DriveState::QuickStopActive => Level::Attention,
        state if state.faulty() => Level::Fault,
        _ => Level::Neutral,
    };
    Some((state.name().to_owned(), level))
}

/// The cycles whose frames had no good reply.
fn lost_frames(table: &Table) -> Result<Option<Strip>, RunLogError> {
    let mut before = f64::NAN;
    table.file.column("bus_lost_frames", |counts| {
        let lost = table.held(counts).map(|count| {
            let rose = count > std::mem::replace(&mut before, count);
            if rose { 1.0 } else { f64::NAN }
        });
        Strip::from_codes("frames", &table.time_s, lost, |_| Some(("lost".to_owned(), Level::Attention)))
    })
}

fn drive(flags: u64) -> Option<(String, Level)> {
    let wanting = DRIVE_NEEDS.into_iter().filter(|(bit, ..)| flags & bit == 0);
    all(DRIVE.into_iter().filter(|(bit, ..)| flags & bit != 0).chain(wanting))
}

fn named(flags: u64, names: &[(u64, &str, Level)]) -> Option<(String, Level)> {
    all(names.iter().copied().filter(|(bit, ..)| flags & bit != 0))
}

fn all<'a>(set: impl Iterator<Item = (u64, &'a str, Level)>) -> Option<(String, Level)> {
    set.fold(None, |all: Option<(String, Level)>, (_, name, level)| {
        Some(
            all.map_or((name.to_owned(), level), |(names, most)| {
                (format!("{names}, {name}"), most.max(level))
            }),
        )
    })
}

/// Where the trajectory's time runs slower because torque is short, in steps of a tenth.
fn pace(table: &Table) -> Result<Option<Strip>, RunLogError> {
    table.file.column("reference_time_scale", |scales| {
        let tenths =
            table.held(scales).map(|scale| if scale < 1.0 { (scale * 10.0).floor() } else { f64::NAN });
        Strip::from_codes("pace", &table.time_s, tenths, |tenth| {
            Some((format!("{} to {} %", 10 * tenth, 10 * tenth + 10), Level::Attention))
        })
    })
}

/// The set-points for as long as the controller followed them.
fn set_points(table: &Table, events: &Events) -> Strip {
    let ends =
        events.set_points.iter().skip(1).map(|next| next.row).chain([table.time_s.len().saturating_sub(1)]);
    let intervals = events.set_points.iter().zip(ends).map(|(point, end)| Interval {
        from_s: table.at(point.row),
        to_s: table.at(events
            .stops
            .iter()
            .copied()
            .find(|stop| *stop > point.row)
            .map_or(end, |stop| end.min(stop))),
        label: point.label.clone(),
        level: Level::Neutral,
    });
    Strip { name: "set-point".to_owned(), intervals: intervals.collect() }
}

/// The cycles of which messages are missing: lost on the way to the record, or never sent.
fn missing(table: &Table) -> Result<Strip, RunLogError> {
    let mut missing = vec![0u8; table.time_s.len()];
    for (bit, (column, _)) in MESSAGES.iter().enumerate() {
        let gaps = table.file.column(column, |values| gaps(table, values))?;
        for row in gaps.into_iter().flatten().flatten() {
            if let Some(flags) = missing.get_mut(row) {
                *flags |= 1 << bit;
            }
        }
    }
    Ok(Strip::from_codes("gaps", &table.time_s, missing.into_iter().map(f64::from), |flags| {
        let names: Vec<(u64, &str, Level)> =
            (0..).zip(MESSAGES).map(|(bit, (_, name))| (1 << bit, name, Level::Attention)).collect();
        named(flags, &names)
    }))
}

/// The rows without a value between a run's first value and its last: those before and after were never due.
fn gaps(table: &Table, values: &mut dyn Iterator<Item = f64>) -> Vec<std::ops::Range<usize>> {
    let mut gaps = Vec::new();
    let mut last: Option<usize> = None;
    let starts: Vec<usize> = table.file.spans().map(|span| span.rows.start).collect();
    let mut starts = starts.into_iter().peekable();
    for (row, value) in values.enumerate() {
        if starts.next_if_eq(&row).is_some() {
            last = None;
        }
        if !value.is_nan() {
            gaps.extend(last.map(|last| last + 1..row).filter(|gap| !gap.is_empty()));
            last = Some(row);
        }
    }
    gaps
}

fn overruns(table: &Table, timing: &[ProcessTiming]) -> Strip {
    let mut intervals: Vec<Interval> = Vec::new();
    for process in timing {
        intervals.extend(process.overruns.iter().map(|&row| Interval {
            from_s: table.at(row),
            to_s: table.at((row + 1).min(table.time_s.len().saturating_sub(1))),
            label: process.name.clone(),
            level: Level::Attention,
        }));
    }
    intervals.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    Strip { name: "overrun".to_owned(), intervals }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_named_and_the_most_serious_decides() {
        let flags = validity::STOPPED_ITSELF | validity::LIMITED | validity::HOMED;
        let found = drive(flags).unwrap();
        assert_eq!(found, ("stopped by itself, limited, not energised".to_owned(), Level::Fault));
        assert_eq!(drive(validity::HOMED | validity::ENERGISED), None);
        assert_eq!(attention(0, &limiting::NAMES), None);
    }
}
