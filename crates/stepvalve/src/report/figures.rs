//! A run in a few numbers, and in one sentence.

use super::events::Events;
use super::table::Table;
use super::text;
use super::timing::ProcessTiming;
use anyhow::Result;
use recording::INTERRUPTED;
use run_log::{RunFile, RunLogError};

/// Kept sample by sample before and after a fault, s.
const AROUND_FAULT_S: (f64, f64) = (2.0, 1.0);
/// The same around the largest following error, s.
const AROUND_PEAK_S: f64 = 0.5;

/// RMS and largest magnitude of a quantity.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Spread {
    /// Root of the mean square.
    pub rms: f64,
    /// Largest magnitude.
    pub peak: f64,
    /// The row in which it was.
    pub peak_row: usize,
}

impl Spread {
    /// Of values with their rows, those that are missing left out; `None` where there is none.
    pub fn of(values: impl Iterator<Item = (usize, f64)>) -> Option<Self> {
        let mut spread = Self::default();
        let (mut squares, mut count) = (0.0, 0usize);
        for (row, value) in values.filter(|(_, value)| !value.is_nan()) {
            squares += value * value;
            count += 1;
            if value.abs() > spread.peak {
                (spread.peak, spread.peak_row) = (value.abs(), row);
            }
        }
        (count > 0).then(|| Self { rms: (squares / count as f64).sqrt(), ..spread })
    }
}

/// A run's numbers.
#[derive(Debug, Default)]
pub struct Figures {
    /// Rows in which the controller followed.
    running_rows: usize,
    /// Rows that are cycles or samples.
    pub rows: usize,
    runs: usize,
    length_s: f64,
    period_s: Option<f64>,
    closed_loop: bool,
    /// Reference less true angle, rad.
    pub true_error: Option<Spread>,
    /// Reference less measured angle, rad.
    pub error: Option<Spread>,
    reserve_min_nm: Option<f64>,
    /// Largest pulse rate, Hz.
    pulse_rate_peak_hz: Option<f64>,
    limited_rows: u64,
    /// Of the simulated rotor: what an encoder says may be wrong.
    lost_teeth: Option<u64>,
    timed: bool,
    overruns: u64,
    skipped: u64,
    missing: u64,
    first_fault: Option<usize>,
    /// Whether the user ended it before its scenario did.
    interrupted: bool,
    /// Largest following error from the first fault on, rad: how far the valve went on without the reference.
    after_fault_rad: Option<f64>,
}

impl Figures {
    /// Gathers them.
    ///
    /// # Errors
    /// [`RunLogError`].
    pub fn gather(table: &Table, timing: &[ProcessTiming], events: &Events) -> Result<Self, RunLogError> {
        let file = &table.file;
        let worst = |name, worse: fn(f64, f64) -> f64| {
            file.column(name, |values| values.filter(|value| !value.is_nan()).reduce(worse))
        };
        let largest = |a: f64, b: f64| a.abs().max(b.abs());
        let running = |(value, running): (f64, &bool)| running.then_some(value).filter(|v| !v.is_nan());
        let reserve = file.column("torque_reserve", |values| {
            values.zip(&table.running).filter_map(running).reduce(f64::min)
        })?;
        let limited = file.column("limiting", |values| {
            values.zip(&table.running).filter_map(running).filter(|flags| *flags > 0.0).count()
        })?;
        let faults = events.faults.iter().chain(&events.drive_faults);
        let first_fault = faults.map(|fault| fault.row).min();
        let (true_error, error) = (spread(table, "true_following_error")?, spread(table, "following_error")?);
        let name = if true_error.is_some() { "true_following_error" } else { "following_error" };
        let after_fault = file.column(name, |values| {
            let after = values.skip(first_fault?).filter(|value| !value.is_nan());
            after.map(f64::abs).reduce(f64::max)
        })?;
        Ok(Self {
            running_rows: table.running.iter().filter(|running| **running).count(),
            rows: file.spans().map(|span| span.rows.len()).sum(),
            runs: file.spans().count(),
            length_s: table.at(table.time_s.len().saturating_sub(1)) - table.at(0),
            period_s: file.number("period_s")?,
            closed_loop: table.closed_loop,
            true_error,
            error,
            reserve_min_nm: reserve.flatten(),
            pulse_rate_peak_hz: worst("pulse_rate", largest)?.flatten().map(f64::abs),
            limited_rows: limited.unwrap_or_default() as u64,
            lost_teeth: worst("lost_teeth", largest)?.flatten().map(|teeth| teeth.abs() as u64),
            timed: !timing.is_empty(),
            overruns: timing.iter().map(|process| process.overrun_count).sum(),
            skipped: timing.iter().map(|process| process.skipped_count).sum(),
            missing: file.number("messages_missed")?.map_or(0, |missed| missed as u64),
            first_fault,
            interrupted: file.notes()?.iter().any(|note| note.text == INTERRUPTED),
            after_fault_rad: after_fault.flatten(),
        })
    }

    /// The windows to keep sample by sample, the most important first.
    pub fn details(&self, table: &Table) -> Vec<(f64, f64)> {
        let fault = self.first_fault.map(|row| table.at(row));
        let peak = self.true_error.or(self.error).map(|spread| table.at(spread.peak_row));
        // A reduced signal would go on across the row between two runs.
        let between = table.file.spans().skip(1).map(|span| table.at(span.rows.start.saturating_sub(1)));
        let mut windows: Vec<_> = between.map(|at| (at, at)).collect();
        windows.extend(fault.map(|at| (at - AROUND_FAULT_S.0, at + AROUND_FAULT_S.1)));
        windows.extend(peak.map(|at| (at - AROUND_PEAK_S, at + AROUND_PEAK_S)));
        windows
    }

    /// What came out, in one sentence; in two, where the user ended it.
    pub fn headline(&self, table: &Table, events: &Events) -> String {
        let outcome = self.outcome(table, events);
        if self.interrupted { format!("Interrupted before its end. {outcome}") } else { outcome }
    }

    fn outcome(&self, table: &Table, events: &Events) -> String {
        if !self.closed_loop {
            let runs = text::count(self.runs as u64, "run");
            return format!("{runs}, {} samples over {}.", self.rows, text::duration(self.length_s));
        }
        let error = self.error_in_words();
        if let Some(row) = self.first_fault {
            let same = |fault: &&super::events::Event| fault.row == row;
            let fault = events.faults.iter().chain(&events.drive_faults).find(same);
            let what = fault.map_or("unknown", |fault| fault.label.as_str());
            let more = events.faults.len().max(events.drive_faults.len()).saturating_sub(1);
            let more = if more > 0 { format!(" ({more} more later)") } else { String::new() };
            let after = self
                .after_fault_rad
                .map_or(String::new(), |rad| format!(", {} at the most after the fault", text::degrees(rad)));
            return format!(
                "Stopped by a fault at {}: {what}{more}. {error}{after}.",
                text::moment(table.at(row))
            );
        }
        format!("{error}; {}.", self.incidents(events).join(", "))
    }

    fn error_in_words(&self) -> String {
        let Some(Spread { rms, peak, .. }) = self.true_error.or(self.error) else {
            return "The controller never ran".to_owned();
        };
        let while_running = match self.period_s {
            Some(period_s) => format!(" over {}", text::duration(self.running_rows as f64 * period_s)),
            None => String::new(),
        };
        let (rms, peak) = (text::degrees(rms), text::degrees(peak));
        format!("Following error {rms} RMS and {peak} at its peak{while_running}")
    }

    fn incidents(&self, events: &Events) -> Vec<String> {
        let mut incidents = vec!["no fault".to_owned()];
        if self.timed {
            incidents.push(text::count(self.skipped, "skipped cycle"));
        }
        incidents.extend(self.lost_teeth.filter(|lost| *lost > 0).map(|lost| text::count(lost, "lost step")));
        if let Some(short) = self.reserve_min_nm.filter(|reserve| *reserve < 0.0) {
            incidents.push(format!("torque short by up to {} N·m", text::number(-short)));
        }
        let some = [
            (events.refusals.len() as u64, "refused set-point"),
            (self.missing, "missing message"),
            (if events.later_starts { events.runs.len() as u64 } else { 0 }, "later start"),
        ];
        incidents.extend(some.iter().filter(|(n, _)| *n > 0).map(|(n, what)| text::count(*n, what)));
        incidents
    }

    /// The key figures, name and value.
    ///
    /// # Errors
    /// [`RunLogError`].
    pub fn facts(&self, table: &Table, events: &Events) -> Result<Vec<(String, String)>, RunLogError> {
        let file = &table.file;
        let mut facts: Vec<(&str, String)> = Vec::new();
        facts.extend(file.number("started_unix_ns")?.map(|started| ("Started", text::utc(started))));
        facts.extend(file.text("mode")?.map(|mode| ("Mode", mode)));
        facts.extend(file.text("instance")?.filter(|name| !name.is_empty()).map(|name| ("Instance", name)));
        facts.push(("Length", self.length()));
        facts.extend(errors("Following error, true", self.true_error));
        facts.extend(errors("Following error, measured", self.error));
        facts.extend(
            self.after_fault_rad
                .map(|rad| ("Furthest from the reference after the fault", text::degrees(rad) + " peak")),
        );
        facts.extend(
            self.reserve_min_nm
                .map(|least| ("Torque reserve by the belief, least", text::number(least) + " N·m")),
        );
        facts.extend(
            self.pulse_rate_peak_hz.map(|peak| ("Pulse rate, peak", text::number(peak / 1e3) + " kHz")),
        );
        if self.closed_loop {
            facts.push(("Held back by limits", text::count(self.limited_rows, "cycle")));
            facts.extend(self.lost_teeth.map(|lost| ("Lost steps, true", lost.to_string())));
            facts.push(("Faults", faults(events)));
            facts.push(("Set-points", set_points(events)));
        }
        if self.timed {
            facts.push((
                "Overruns",
                format!("{}, {} skipped", self.overruns, text::count(self.skipped, "cycle")),
            ));
        }
        facts.extend(record(file)?.map(|record| ("Record", record)));
        Ok(facts.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
    }

    fn length(&self) -> String {
        let ended = if self.interrupted { format!(", {INTERRUPTED}") } else { String::new() };
        match self.period_s {
            Some(period_s) => format!(
                "{}, {} cycles of {} ms{ended}",
                text::duration(self.rows as f64 * period_s),
                text::grouped(self.rows as u64),
                period_s * 1e3
            ),
            None => format!("{}, {} samples", text::duration(self.length_s), text::grouped(self.rows as u64)),
        }
    }
}

fn errors(name: &'static str, spread: Option<Spread>) -> Option<(&'static str, String)> {
    let Spread { rms, peak, .. } = spread?;
    Some((name, format!("{} RMS, {} peak", text::degrees(rms), text::degrees(peak))))
}

/// Those of the controller; the drive's own are most often why.
fn faults(events: &Events) -> String {
    match events.drive_faults.len() {
        0 => events.faults.len().to_string(),
        own => format!("{}; the drive reported {own}", events.faults.len()),
    }
}

fn set_points(events: &Events) -> String {
    match events.refusals.len() {
        0 => format!("{} accepted", events.set_points.len()),
        refused => format!("{} accepted, {refused} refused", events.set_points.len()),
    }
}

/// How many messages the record holds, and which it declares missing.
fn record(file: &RunFile) -> Result<Option<String>, RunLogError> {
    let Some(recorded) = file.number("messages_recorded")? else { return Ok(None) };
    let missing = file.missing()?;
    let missing: Vec<String> = missing
        .iter()
        .map(|gap| format!("{} of {} ({})", text::grouped(gap.missed), gap.topic, gap.origin))
        .collect();
    let missing =
        if missing.is_empty() { "none lost".to_owned() } else { format!("lost: {}", missing.join(", ")) };
    Ok(Some(format!("{} messages, {missing}", text::grouped(recorded as u64))))
}

fn spread(table: &Table, name: &str) -> Result<Option<Spread>, RunLogError> {
    let spread = table.file.column(name, |values| {
        let running = values.zip(&table.running).enumerate().filter(|(_, (_, running))| **running);
        Spread::of(running.map(|(row, (value, _))| (row, value)))
    })?;
    Ok(spread.flatten())
}
