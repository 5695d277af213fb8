//! The record of a running instance, judged: every start by the oracle, every trial by what follows it.

use super::ground::Ground;
use super::recorded_orders::RecordedOrders;
use super::tally::{Outcome, Tally};
use anyhow::Result;
use oracle::{Judge, Unsafe};
use recording::{AnyMessage, read_record};
use signals::{ControlStatus, ControllerState, FaultCode, StepCommand, validity};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A trial, as far as it is known without the record.
pub struct Done {
    /// Kind of fault.
    pub kind: String,
    /// Its text.
    pub text: String,
    /// When it was asked for, CLOCK_MONOTONIC.
    pub at_ns: u64,
    /// The start that it befell.
    pub generation: u64,
    /// What was wrong, so far.
    pub violations: Vec<String>,
}

/// One start of the processes, from the record.
struct Start {
    judge: Judge,
    orders: RecordedOrders,
    /// Sequence number and cycle of the newest command and reference.
    command: Option<(u64, u64)>,
    /// The newest PlantTruth.
    truth: Option<u64>,
    /// Pulses of each cycle.
    pulses: BTreeMap<u64, u64>,
    feedbacks: Vec<u64>,
    /// Cycles in which the drive began to stop by itself, with the last command to follow before.
    stops: Vec<(u64, u64)>,
    stopped: bool,
    /// Sequence number of the newest ControlStatus, and the cycles of silence that it told of.
    silent: Option<(u64, u64)>,
    /// Cycles in which the controller began a quick stop for silence, and how many of its own cycles that had lasted then.
    quick_stops: Vec<(u64, u64)>,
    /// Cycles in which it found a fault of any kind.
    faults: Vec<u64>,
    running: bool,
}

/// Judges everything, and counts the trials.
///
/// # Errors
/// Where the record can't be read.
pub fn judge(
    ground: &Ground,
    folder: &Path,
    trials: Vec<Done>,
    ending: Vec<String>,
    tally: &mut Tally,
) -> Result<()> {
    let starts = read(ground, folder)?;
    let count = trials.len();
    let mut findings: BTreeMap<u64, Vec<Unsafe>> = BTreeMap::new();
    for (generation, start) in &starts {
        findings.insert(*generation, start.judge.verdict().findings);
    }
    for (number, trial) in trials.iter().enumerate() {
        let next = trials.get(number + 1).filter(|next| next.generation == trial.generation);
        let mut outcome = Outcome {
            fault: trial.kind.clone(),
            exact: trial.text.clone(),
            violations: trial.violations.clone(),
            ..Outcome::default()
        };
        if let Some(start) = starts.get(&trial.generation) {
            let from = cycle_of(ground, start, trial.at_ns);
            let to = next.map_or(u64::MAX, |next| cycle_of(ground, start, next.at_ns));
            follow(ground, start, from, to, &mut outcome);
            let found = findings.entry(trial.generation).or_default();
            found.retain(|finding| {
                let here = (from..to).contains(&cycle(finding));
                if here {
                    outcome.violations.push(format!("{finding:?}"));
                }
                !here
            });
        }
        if number + 1 == count {
            outcome.violations.extend(ending.clone());
            outcome.violations.extend(findings.values().flatten().map(|finding| format!("{finding:?}")));
        }
        tally.note(outcome);
    }
    Ok(())
}

/// What the oracle finds in the record of an instance, in words.
///
/// # Errors
/// Where the record can't be read.
pub fn judge_orders(ground: &Ground, folder: &Path) -> Result<Vec<String>> {
    let starts = read(ground, folder)?;
    let findings = starts.values().flat_map(|start| start.judge.verdict().findings);
    Ok(findings.map(|finding| format!("{finding:?}")).collect())
}

fn cycle(finding: &Unsafe) -> u64 {
    match finding {
        Unsafe::Rate { cycle, .. }
        | Unsafe::Acceleration { cycle, .. }
        | Unsafe::Time { cycle }
        | Unsafe::BeforeArming { cycle }
        | Unsafe::WithoutOrder { cycle }
        | Unsafe::AfterDisarm { cycle, .. }
        | Unsafe::AfterDeadline { cycle, .. } => *cycle,
    }
}

fn cycle_of(ground: &Ground, start: &Start, at_ns: u64) -> u64 {
    at_ns.saturating_sub(start.orders.epoch_ns()) / ground.parts.timeline.period_ns
}

/// How the valve was stopped between two cycles, if it was.
fn follow(ground: &Ground, start: &Start, from: u64, to: u64, outcome: &mut Outcome) {
    let silence = ground.limits.silence_cycles;
    let within = |cycle: &u64| (from.saturating_sub(2)..to).contains(cycle);
    // The drive's own stop: counted from the last command that it was to follow.
    if let Some((cycle, last)) = start.stops.iter().find(|(cycle, _)| within(cycle)) {
        outcome.stopped = true;
        // A plant that slept through its own stop says so later; its pulses are logged all the same.
        if start.feedbacks.contains(&(cycle - 1)) {
            outcome.reaction = Some((cycle - last, silence + 1));
        }
        let most = (ground.limits.max_pulse_rate_hz * ground.limits.period_s) as u64;
        let size = start.pulses.get(last).copied().unwrap_or(most);
        let moving = (1..).take_while(|n| start.pulses.get(&(last + n)).is_some_and(|pulses| *pulses > 0));
        outcome.standstill = Some((moving.count() as u64, silence + ground.limits.ramp_cycles(size) + 1));
    }
    outcome.stopped |= start.faults.iter().any(within);
    // The controller's: as it has counted the cycles without a message of the partner that fell silent.
    if let Some((cycle, silent)) = start.quick_stops.iter().find(|(cycle, _)| within(cycle))
        && outcome.reaction.is_none()
    {
        outcome.exact.push_str(&format!(", quick stop seen in cycle {cycle}"));
        outcome.reaction = Some((silent + 1, silence + 1));
    }
}

fn read(ground: &Ground, folder: &Path) -> Result<BTreeMap<u64, Start>> {
    let mut segments: Vec<PathBuf> = std::fs::read_dir(folder)?.flatten().map(|entry| entry.path()).collect();
    segments.retain(|path| path.extension().is_some_and(|extension| extension == "mcap"));
    segments.sort();
    let mut starts: BTreeMap<u64, Start> = BTreeMap::new();
    read_record(&segments, |message| {
        let start = starts.entry(message.header().generation).or_insert_with(|| Start::new(ground));
        start.take(message);
    })?;
    for start in starts.values_mut() {
        start.orders.put_into(&mut start.judge);
    }
    Ok(starts)
}

impl Start {
    fn new(ground: &Ground) -> Self {
        Self {
            judge: Judge::new(ground.limits),
            orders: RecordedOrders::new(ground.parts.timeline.period_ns),
            command: None,
            truth: None,
            pulses: BTreeMap::new(),
            feedbacks: Vec::new(),
            stops: Vec::new(),
            stopped: false,
            silent: None,
            quick_stops: Vec::new(),
            faults: Vec::new(),
            running: false,
        }
    }

    fn take(&mut self, message: &AnyMessage) {
        self.orders.note(message);
        let (cycle, sequence) = (message.header().cycle, message.header().sequence);
        match message {
            AnyMessage::PlantTruth(m) => {
                // Every cycle has one: where they lack, the recorder was away, and may have missed commands too.
                if let Some(last) = self.truth.replace(cycle)
                    && cycle > last + 1
                {
                    self.judge.commands_unknown(last..cycle);
                }
                self.judge.truth(cycle, &m.body);
                self.pulses.insert(cycle.saturating_sub(1), m.body.pulses.unsigned_abs());
            }
            AnyMessage::StepCommand(m) => self.command(cycle, sequence, &m.body),
            AnyMessage::Feedback(m) => {
                self.feedbacks.push(cycle);
                let stopped = m.body.validity & validity::STOPPED_ITSELF != 0;
                if stopped && !self.stopped {
                    // The drive's own word on the last command that it took.
                    self.stops.push((cycle, m.body.command_cycle));
                }
                self.stopped = stopped;
            }
            AnyMessage::ControlStatus(m) => {
                let running = m.body.state == ControllerState::Running.code();
                let silence = [FaultCode::FeedbackSilent.code(), FaultCode::ReferenceSilent.code()];
                if self.running && !running && silence.contains(&m.body.fault) {
                    let after = cycle.saturating_sub(m.body.fault_cycle);
                    let silent = silent_cycles(&m.body).saturating_sub(after);
                    self.quick_stops.push((cycle, self.own_silent_cycles(sequence, silent)));
                }
                self.silent = Some((sequence, silent_cycles(&m.body)));
                if self.running && !running && m.body.fault != 0 {
                    self.faults.push(cycle);
                }
                self.running = running;
            }
            _ => {}
        }
    }

    /// How long a silence had lasted when it was found, in cycles that the controller ran: those that it slept through itself, by a stall of the
    /// machine, say nothing of how soon it reacts.
    fn own_silent_cycles(&self, sequence: u64, silent: u64) -> u64 {
        match self.silent {
            Some((before, known)) if before + 1 == sequence => silent.min(known + 1),
            _ => silent,
        }
    }

    fn command(&mut self, cycle: u64, sequence: u64, body: &StepCommand) {
        if let Some((last_sequence, last_cycle)) = self.command
            && sequence > last_sequence + 1
        {
            // Lost on the way to the recorder, or to everybody: the drive may have had them.
            self.judge.commands_unknown(last_cycle + 1..cycle);
        }
        self.command = Some((sequence, cycle));
        self.judge.command(cycle, body);
    }
}

fn silent_cycles(status: &ControlStatus) -> u64 {
    status.feedback_silent_cycles.max(status.reference_silent_cycles)
}
