//! Faults on the loop in one thread: fast, and the same for the same seed.

use super::ground::{Ground, VARIANTS};
use super::tally::{Outcome, Tally};
use crate::progress::Progress;
use anyhow::Result;
use closed_loop::{CycleOutputs, InProcess};
use injection::{Damage, Fault, FaultyWire, Injection, SplitSeed, Stream, draw};
use oracle::{Judge, Order, Verdict, Wish};
use signals::{ControllerState, Source, validity};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Names of the faults that mean something without a clock.
pub const FAULTS: [&str; 13] = [
    "drop",
    "duplicate",
    "delay",
    "replay",
    "field",
    "flip-bits",
    "wrong-schema",
    "wrong-generation",
    "wrong-source",
    "frozen-encoder",
    "encoder-jump",
    "overrun",
    "silence",
];

/// One trial, by its seed.
pub struct Trial {
    /// Which of the variants.
    pub variant: usize,
    /// Name of the fault.
    pub name: &'static str,
    /// What is injected.
    pub injection: Injection,
}

impl Trial {
    /// Draws one: in full motion, or one time in five in the first 30 cycles.
    pub fn draw(seed: u64) -> Self {
        let mut details = SplitSeed::new(seed);
        let name = details.one(&FAULTS, "drop");
        let variant = details.whole(0, VARIANTS.len() as u64) as usize;
        let early = details.whole(0, 5) == 0;
        let at = if early { details.whole(1, 30) } else { details.whole(60, 240) };
        let injection = draw(name, at, &mut details)
            .unwrap_or(Injection { at, fault: Fault::Silence { process: Source::Controller } });
        Self { variant, name, injection }
    }
}

/// What a run showed, whatever made its messages.
#[derive(Debug, Clone, Default)]
pub struct Seen {
    /// The oracle's word.
    pub verdict: Verdict,
    /// The first cycle, from the fault's on, in which the drive ramps down.
    pub ramp: Option<u64>,
    /// Whether the controller, once in Fault, ran again.
    pub rearmed: bool,
    /// Where it ended.
    pub last_state: Option<u64>,
}

/// Runs many trials.
///
/// # Errors
/// Where the shipped scenarios can't be used.
pub fn campaign(seed: u64, trials: u64, tally: &mut Tally) -> Result<()> {
    let grounds = VARIANTS.iter().map(super::ground::Variant::ground).collect::<Result<Vec<_>>>()?;
    println!("in one thread: seeds {} to {}", seed << 32, (seed << 32) + trials - 1);
    let progress = Progress::new(trials as usize);
    for number in 0..trials {
        let seed = (seed << 32) + number;
        let trial = Trial::draw(seed);
        progress.next(trial.name);
        let Some(ground) = grounds.get(trial.variant) else { continue };
        let exact = format!("seed {seed}, {}: {}", ground.name, trial.injection);
        // A panic is a finding like any other.
        let seen = catch_unwind(AssertUnwindSafe(|| observe(ground, &trial.injection)));
        tally.note(match seen {
            Ok(seen) => outcome(ground, &trial, exact, &seen),
            Err(_) => Outcome {
                fault: trial.name.to_owned(),
                exact,
                violations: vec!["panic".to_owned()],
                ..Outcome::default()
            },
        });
    }
    Ok(())
}

/// Runs one to its end.
fn observe(ground: &Ground, injection: &Injection) -> Seen {
    let wire = FaultyWire::new(&ground.parts, std::slice::from_ref(injection));
    let mut run = InProcess::over(&ground.parts, wire);
    let mut watch = Watch::new(ground, injection.at);
    while let Some(outputs) = run.cycle() {
        watch.cycle(&outputs);
    }
    watch.end()
}

/// Follows a run.
pub struct Watch {
    judge: Judge,
    seen: Seen,
    at: u64,
    delay: u64,
    faulted: bool,
}

impl Watch {
    /// Of a run whose fault comes in cycle `at`.
    pub fn new(ground: &Ground, at: u64) -> Self {
        let mut judge = Judge::new(ground.limits);
        let timeline = &ground.parts.timeline;
        for (wish, cycle) in [(Wish::Move, timeline.arm_cycle), (Wish::Stop, timeline.disarm_cycle)] {
            judge.order(Order { wish, from_cycle: cycle, until_cycle: cycle });
        }
        Self { judge, seen: Seen::default(), at, delay: ground.limits.command_delay_cycles, faulted: false }
    }

    fn cycle(&mut self, outputs: &CycleOutputs) {
        let cycle = outputs.cycle;
        if let Some(plant) = &outputs.plant {
            self.judge.truth(cycle, &plant.truth);
            self.flags(cycle, plant.feedback.validity);
        }
        if let Some(command) = &outputs.received {
            self.judge.command(cycle, command);
        }
        if let Some(output) = &outputs.controller {
            self.state(cycle, output.status.state);
        }
    }

    /// What Feedback k says of the drive.
    pub fn flags(&mut self, cycle: u64, flags: u64) {
        if cycle >= self.at && flags & validity::STOPPED_ITSELF != 0 {
            self.ramps(cycle);
        }
    }

    /// What ControlStatus k says; a stop is commanded for the next cycle.
    pub fn state(&mut self, cycle: u64, state: u64) {
        let stopping = [ControllerState::QuickStop.code(), ControllerState::Fault.code()].contains(&state);
        if cycle >= self.at && stopping {
            self.ramps(cycle + 1 + self.delay);
        }
        self.seen.rearmed |= self.faulted && state == ControllerState::Running.code();
        self.faulted |= state == ControllerState::Fault.code();
        self.seen.last_state = Some(state);
    }

    fn ramps(&mut self, cycle: u64) {
        self.seen.ramp = Some(self.seen.ramp.unwrap_or(cycle).min(cycle));
    }

    /// For messages that come from a record.
    pub fn judge(&mut self) -> &mut Judge {
        &mut self.judge
    }

    /// All of it.
    pub fn end(mut self) -> Seen {
        self.seen.verdict = self.judge.verdict();
        self.seen
    }
}

/// Holds what was seen against what is promised for the fault.
pub fn outcome(ground: &Ground, trial: &Trial, exact: String, seen: &Seen) -> Outcome {
    let at = trial.injection.at;
    let disarm = ground.parts.timeline.disarm_cycle;
    // A stop that the scenario's own end brings is none for the fault.
    let ramp = seen.ramp.filter(|ramp| *ramp < disarm);
    let mut violations: Vec<_> = seen.verdict.findings.iter().take(3).map(|f| format!("{f:?}")).collect();
    if seen.rearmed {
        violations.push("ran again without a reset".to_owned());
    }
    let bound = stop_bound(ground, &trial.injection);
    let in_motion = at >= 60 && at + bound.unwrap_or(0) < disarm;
    if bound.is_some() && in_motion && ramp.is_none() && seen.last_state.is_some() {
        violations.push("the valve was not stopped".to_owned());
    }
    let last = seen.verdict.last_moving_cycle.filter(|last| ramp.is_some() && *last < disarm);
    let timed = bound.filter(|_| in_motion);
    let most = (ground.limits.max_pulse_rate_hz * ground.limits.period_s) as u64;
    Outcome {
        fault: trial.name.to_owned(),
        exact,
        stopped: ramp.is_some(),
        reaction: timed.and_then(|bound| ramp.map(|ramp| (ramp - at, bound))),
        standstill: timed.and_then(|bound| {
            last.map(|last| (last.saturating_sub(at), bound + ground.limits.ramp_cycles(most)))
        }),
        violations,
    }
}

/// Cycles from a fault to the ramp that it must bring, at the most; `None` for one that need not stop the valve.
fn stop_bound(ground: &Ground, injection: &Injection) -> Option<u64> {
    let limits = &ground.limits;
    let silence = limits.silence_cycles;
    let noticed = silence + 1 + limits.command_delay_cycles;
    match &injection.fault {
        Fault::Silence { process: Source::Plant } => None,
        Fault::Silence { .. } => Some(noticed),
        Fault::Overrun { cycles, .. } => (*cycles > silence).then_some(noticed + cycles),
        Fault::Message { stream, damage, count } => {
            let lost = *count > silence && *stream != Stream::ControlStatus;
            let refused = matches!(
                damage,
                Damage::Drop
                    | Damage::Delay
                    | Damage::Replay { .. }
                    | Damage::Flip { .. }
                    | Damage::WrongSchema
                    | Damage::WrongGeneration
                    | Damage::WrongSource
            );
            match damage {
                Damage::EncoderJump { by_rad } if by_rad.abs() > 2.0 * ground.following_error_rad => {
                    Some(1 + limits.command_delay_cycles + 1)
                }
                _ if refused && lost => Some(noticed),
                _ => None,
            }
        }
        _ => None,
    }
}
