//! A run's summary: for people on stdout, for machines as JSON.

use crate::errand::Simulation;
use closed_loop::{Metrics, Spread};
use processes::ChildSummary;
use realtime::{Obtained, Percentiles};
use recording::{Damage, INTERRUPTED, Report};
use serde::Serialize;
use signals::alarm;
use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;
use supervisor::{ProcessEnding, advice};

/// One process's part of the summary.
#[derive(Debug, Clone, Serialize)]
pub struct ProcessSummary {
    /// The scheduling really obtained; `None` outside real time.
    pub scheduling: Option<Obtained>,
    /// What the process said at its end; `None` for one that died.
    #[serde(flatten)]
    pub counts: Option<ChildSummary>,
}

/// All of it.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// The scenario's name.
    pub title: String,
    /// `realtime`, `lockstep` or `in-process`.
    pub mode: String,
    /// Cycles of the plant.
    pub cycles: u64,
    /// Their length, s.
    pub period_s: f64,
    /// Time that the run took, s.
    pub wall_s: f64,
    /// Reference minus measured angle while running, rad.
    pub following_error_rad: Option<Spread>,
    /// Reference minus true angle while running, rad.
    pub true_following_error_rad: Option<Spread>,
    /// Highest pulse rate commanded, Hz.
    pub pulse_rate_peak_hz: f64,
    /// Lowest torque reserve while running, N·m.
    pub torque_reserve_min_nm: Option<f64>,
    /// Cycles in which a limit held the command back.
    pub limiting_cycles: u64,
    /// What the operator has to know and what stopped nothing.
    pub alarms: Vec<String>,
    /// Cycles in which a flow that was to be held was out of reach, or not known for want of a pressure drop.
    pub unheld_flow_cycles: u64,
    /// Commands that the drive did not have in time.
    pub missed_commands: u64,
    /// Tooth pitches lost, at the worst.
    pub lost_steps: u64,
    /// Why the valve was stopped.
    pub fault: Option<String>,
    /// The cycle in which that was found.
    pub fault_cycle: Option<u64>,
    /// What it means and what to do; empty without one.
    pub fault_advice: &'static str,
    /// Whether the user ended the run before its scenario did.
    pub interrupted: bool,
    /// Set-points refused, by id, and why.
    pub refused_set_points: BTreeMap<u64, String>,
    /// Messages recorded.
    pub recorded: u64,
    /// Messages published that are not in the record, each of them declared.
    pub declared_missing: u64,
    /// The record's flaws: damage, undeclared gaps, a disk that failed. Empty for a whole record.
    pub record_flaws: Vec<String>,
    /// How often the recorder was restarted.
    pub recorder_restarts: u32,
    /// What went wrong with the run itself.
    pub failure: Option<String>,
    /// Whether errors, limits, lost steps and faults are known: not those of processes that nobody recorded.
    pub measured: bool,
    /// Whether an encoder is fitted: without one nothing measures the following error.
    pub encoder: bool,
    /// By process.
    pub processes: BTreeMap<String, ProcessSummary>,
    /// The run file; none of an unrecorded run.
    pub run_h5: Option<PathBuf>,
    /// The page with its plots; none of an unrecorded run.
    pub run_html: Option<PathBuf>,
}

/// What each process had to say, for people and machines.
pub fn by_process(endings: &BTreeMap<String, ProcessEnding>) -> BTreeMap<String, ProcessSummary> {
    let summary = |ending: &ProcessEnding| ProcessSummary {
        scheduling: ending.scheduling.clone(),
        counts: ending.counts.clone(),
    };
    endings.iter().map(|(name, ending)| (name.clone(), summary(ending))).collect()
}

impl Summary {
    /// Of a simulation of which nothing is known yet.
    pub fn new(simulation: &Simulation) -> Self {
        Self {
            title: simulation.title.clone(),
            mode: simulation.mode.name().to_owned(),
            cycles: simulation.cycles,
            period_s: simulation.period_s,
            wall_s: 0.0,
            following_error_rad: None,
            true_following_error_rad: None,
            pulse_rate_peak_hz: 0.0,
            torque_reserve_min_nm: None,
            limiting_cycles: 0,
            alarms: Vec::new(),
            unheld_flow_cycles: 0,
            missed_commands: 0,
            lost_steps: 0,
            fault: None,
            fault_cycle: None,
            fault_advice: "",
            interrupted: false,
            refused_set_points: BTreeMap::new(),
            recorded: 0,
            declared_missing: 0,
            record_flaws: Vec::new(),
            recorder_restarts: 0,
            failure: None,
            measured: false,
            encoder: simulation.encoder,
            processes: BTreeMap::new(),
            run_h5: None,
            run_html: None,
        }
    }

    /// Takes over what the record says.
    pub fn take_record(&mut self, metrics: &Metrics, report: &Report) {
        self.take_metrics(metrics);
        self.recorded = report.recorded();
        self.declared_missing = report.missed();
        self.record_flaws.extend(flaws(report));
    }

    /// Takes over what the messages say.
    pub fn take_metrics(&mut self, metrics: &Metrics) {
        self.cycles = metrics.cycles;
        self.following_error_rad = metrics.measured_error();
        self.true_following_error_rad = metrics.true_error();
        self.pulse_rate_peak_hz = metrics.pulse_rate_peak_hz;
        self.torque_reserve_min_nm = metrics.torque_reserve_min_nm;
        self.limiting_cycles = metrics.limiting_cycles;
        self.alarms = alarm::names(metrics.alarms).map(str::to_owned).collect();
        self.unheld_flow_cycles = metrics.unheld_flow_cycles;
        self.missed_commands = metrics.missed_commands;
        self.lost_steps = metrics.lost_steps;
        let stopped_by = metrics.stopped_by();
        self.fault = stopped_by.map(|(fault, _)| fault.name().to_owned());
        self.fault_advice = stopped_by.map_or("", |(fault, _)| advice(fault));
        self.fault_cycle = stopped_by.map(|(_, cycle)| cycle);
        self.refused_set_points =
            metrics.refused.iter().map(|(id, why)| (*id, why.name().to_owned())).collect();
        self.measured = true;
    }

    fn overruns(&self) -> u64 {
        self.counts().map(|counts| counts.timing.overruns).sum()
    }

    fn skipped(&self) -> u64 {
        self.counts().map(|counts| counts.timing.skipped_cycles).sum()
    }

    /// Whether the scenario passed and the valve was never moved, though nothing stopped it.
    pub fn never_ran(&self) -> bool {
        let errors = [self.following_error_rad.is_some(), self.true_following_error_rad.is_some()];
        self.measured && !errors.contains(&true) && self.fault.is_none()
    }

    fn missed(&self) -> u64 {
        self.counts().map(|counts| counts.missed_samples).sum()
    }

    fn counts(&self) -> impl Iterator<Item = &ChildSummary> {
        self.processes.values().filter_map(|process| process.counts.as_ref())
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let simulated_s = self.cycles as f64 * self.period_s;
        writeln!(f, "scenario         {}, {}", self.title, self.mode)?;
        writeln!(
            f,
            "cycles           {} of {} us: {:.3} s in {:.3} s; overruns {}, skipped {}",
            self.cycles,
            (self.period_s * 1e6).round(),
            simulated_s,
            self.wall_s,
            self.overruns(),
            self.skipped()
        )?;
        if self.interrupted {
            writeln!(f, "ended            {INTERRUPTED}")?;
        }
        if !self.measured {
            writeln!(f, "following error  unknown, as are lost steps and faults: nothing was recorded")?;
            return timing_table(f, &self.processes);
        }
        error_line(f, "following error", self.true_following_error_rad, "true angle")?;
        // Without an encoder nothing is measured: the controller goes by its own commands.
        error_line(f, "", self.following_error_rad.filter(|_| self.encoder), "as measured")?;
        write!(f, "pulse rate       peak {:.1} kHz", self.pulse_rate_peak_hz / 1e3)?;
        if let Some(reserve) = self.torque_reserve_min_nm {
            write!(f, "; torque reserve by the belief at least {reserve:.2} N·m")?;
        }
        writeln!(f, "; held back by limits in {} cycles", self.limiting_cycles)?;
        for alarm in &self.alarms {
            writeln!(f, "alarm            {alarm}")?;
        }
        if self.unheld_flow_cycles > 0 {
            let unheld_s = self.unheld_flow_cycles as f64 * self.period_s;
            writeln!(
                f,
                "flow             out of reach, or not known for want of a pressure drop, for {unheld_s:.3} s"
            )?;
        }
        if self.missed_commands > 0 {
            writeln!(f, "missed commands  {}", self.missed_commands)?;
        }
        writeln!(f, "lost steps       {}", lost(self.lost_steps, self.encoder))?;
        if let (Some(fault), Some(cycle)) = (&self.fault, self.fault_cycle) {
            writeln!(f, "fault            {fault}, found in cycle {cycle}")?;
            writeln!(f, "                 {}", self.fault_advice)?;
        }
        for (id, why) in &self.refused_set_points {
            writeln!(f, "refused          set-point {id}: {why}")?;
        }
        writeln!(
            f,
            "samples          {} recorded, {} declared missing; {} missed by the loop and the recorder",
            self.recorded,
            self.declared_missing,
            self.missed()
        )?;
        if self.recorder_restarts > 0 {
            writeln!(f, "recorder         restarted {} times", self.recorder_restarts)?;
        }
        for flaw in &self.record_flaws {
            writeln!(f, "record           {flaw}")?;
        }
        timing_table(f, &self.processes)?;
        if let Some(failure) = &self.failure {
            writeln!(f, "failed           {failure}")?;
        }
        match (&self.run_h5, &self.run_html) {
            (Some(run), Some(page)) => {
                write!(f, "record           {}\nplots            {}", run.display(), page.display())
            }
            _ => write!(f, "record           none"),
        }
    }
}

/// What is wrong with the record. A segment that another follows was left open by a recorder that died: that it was not
/// finished is no flaw, its gap is declared.
/// What is damaged in a record, in words; of all segments but the last one only what was left out.
pub fn flaws(report: &Report) -> impl Iterator<Item = String> {
    let last = report.segments.len().saturating_sub(1);
    report.segments.iter().enumerate().flat_map(move |(index, segment)| {
        let left_open = |damage: &&Damage| matches!(damage, Damage::Unfinished { .. } | Damage::Cut { .. });
        let flaws = segment.damage.iter().filter(move |damage| index == last || !left_open(damage));
        flaws.map(|damage| format!("{}: {damage}", segment.path.display()))
    })
}

/// Lost steps in words: a rotor falls from tooth to tooth.
fn lost(teeth: u64, encoder: bool) -> String {
    let unnoticed = if encoder { "" } else { "; without an encoder nothing noticed it" };
    match teeth {
        0 => "none".to_owned(),
        1 => format!("1 tooth pitch, a period of the motor's current{unnoticed}"),
        more => format!("{more} tooth pitches, each a period of the motor's current{unnoticed}"),
    }
}

fn error_line(f: &mut fmt::Formatter<'_>, label: &str, error: Option<Spread>, of: &str) -> fmt::Result {
    let Some(Spread { rms, peak }) = error else { return Ok(()) };
    let degrees = |angle: f64| angle.to_degrees();
    writeln!(f, "{label:<16} RMS {:.5}°, peak {:.5}° ({of})", degrees(rms), degrees(peak))
}

fn timing_table(f: &mut fmt::Formatter<'_>, processes: &BTreeMap<String, ProcessSummary>) -> fmt::Result {
    let timed: Vec<_> = processes.iter().filter(|(_, process)| process.scheduling.is_some()).collect();
    if timed.is_empty() {
        return Ok(());
    }
    writeln!(
        f,
        "wake-up (us)           p50     p99   p99.9       max   execution p99   scheduling obtained"
    )?;
    for (name, process) in timed {
        let scheduling = process.scheduling.as_ref().map(describe).unwrap_or_default();
        match process.counts.as_ref().filter(|counts| counts.timing.cycles > 0) {
            Some(counts) => {
                let Percentiles { p50_ns, p99_ns, p999_ns, max_ns } = counts.timing.wake_up;
                let us = |ns: u64| ns as f64 / 1e3;
                writeln!(
                    f,
                    "  {name:<20} {:>5.1} {:>7.1} {:>7.1} {:>9.1} {:>15.1}   {scheduling}",
                    us(p50_ns),
                    us(p99_ns),
                    us(p999_ns),
                    us(max_ns),
                    us(counts.timing.execution.p99_ns)
                )?;
            }
            None => writeln!(f, "  {name:<20} {:>63}", scheduling)?,
        }
    }
    Ok(())
}

fn describe(obtained: &Obtained) -> String {
    let policy = obtained.priority.map_or_else(|| "normal".to_owned(), |priority| format!("FIFO {priority}"));
    let core = obtained.core.map_or_else(|| "any core".to_owned(), |core| format!("core {core}"));
    let memory = if obtained.memory_locked { ", memory locked" } else { "" };
    let degraded = if obtained.complete() { "" } else { " (DEGRADED)" };
    format!("{policy}, {core}{memory}{degraded}")
}
