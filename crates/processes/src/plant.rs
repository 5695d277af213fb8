//! plant-simulator: Feedback and PlantTruth out at the cycle's beginning, then the StepCommand in and the valve on.

use crate::child::{Child, ChildError};
use crate::inbox::Inbox;
use crate::outbox::Outbox;
use crate::paced::{self, Absence, Cyclic, Stamp};
use crate::part::{ChildSummary, Pace};
use closed_loop::{PlantPart, PlantRole};
use injection::Injection;
use signal_bus::Writer;
use signals::{Feedback, PlantTruth, RecorderProgress, Source, StepCommand, validity};

/// In lockstep the plant waits when the recorder is this many cycles behind: half of the recorder's buffer.
const RECORDER_LAG_CYCLES: u64 = 2048;

/// In lockstep the recorder's progress is looked at every so many cycles.
const PROGRESS_CYCLES: u64 = 256;

struct Plant {
    role: PlantRole,
    pace: Pace,
    last_cycle: u64,
    feedback: Outbox<Feedback>,
    recorded: bool,
    truth: Writer<PlantTruth>,
    commands: Inbox<StepCommand>,
    recorder: Inbox<RecorderProgress>,
    silent_lockstep: bool,
    // STANDSTILL in the last Feedback; the process ends only after one that has it.
    standstill_told: bool,
}

pub(crate) fn run(child: &Child, part: PlantPart) -> Result<Option<ChildSummary>, ChildError> {
    let counts_per_turn = part.encoder.as_ref().map(|encoder| encoder.counts_per_turn);
    let plant = Plant {
        role: PlantRole::new(part),
        pace: child.pace,
        last_cycle: child.timeline.last_cycle,
        feedback: Outbox::open(child, Source::Plant)?.with_encoder(counts_per_turn),
        recorded: child.recorded,
        truth: child.bus.writer(Source::Plant)?,
        commands: Inbox::open(child, Source::Controller)?,
        recorder: Inbox::open(child, Source::Recorder)?,
        silent_lockstep: false,
        standstill_told: true,
    };
    paced::run(child, plant)
}

impl Plant {
    /// StepCommand n; nobody makes one for cycle 0.
    fn command(&mut self, cycle: u64) -> Option<StepCommand> {
        // In lockstep the controller ends with the last cycle, however long the valve still moves.
        if cycle == 0 || self.pace == Pace::Lockstep && cycle > self.last_cycle.saturating_add(1) {
            return None;
        }
        let command = self.commands.of_cycle(cycle);
        self.silent_lockstep = self.commands.ended();
        command
    }

    fn wait_for_recorder(&mut self, cycle: u64) {
        if self.pace == Pace::Lockstep
            && self.recorded
            && cycle >= RECORDER_LAG_CYCLES
            && cycle.is_multiple_of(PROGRESS_CYCLES)
        {
            self.recorder.wait_until(cycle, |progress| progress.feedback_cycle + RECORDER_LAG_CYCLES > cycle);
        }
    }
}

impl Cyclic for Plant {
    const SOURCE: Source = Source::Plant;

    fn make_ready(&mut self, cycle: u64) {
        self.feedback.make_ready();
        self.truth.make_ready();
        // Made for this cycle in the one before.
        self.role.rehearse(cycle, self.commands.make_ready(cycle));
    }

    fn cycle(&mut self, cycle: u64, skipped: u64, stamp: &mut Stamp) {
        for missed_cycle in cycle - skipped..cycle {
            // The valve went on meanwhile, and its pulses count.
            self.truth.write(missed_cycle, stamp.now(), self.role.sample(missed_cycle).truth);
            let command = self.command(missed_cycle);
            self.role.advance(missed_cycle, command.as_ref());
        }
        self.wait_for_recorder(cycle);
        let sample = self.role.sample(cycle);
        stamp.has_stepped();
        self.feedback.write(cycle, cycle, stamp.now(), sample.feedback);
        self.truth.write(cycle, stamp.now(), sample.truth);
        self.standstill_told = sample.feedback.validity & validity::STANDSTILL != 0;
        stamp.has_written();
        let command = self.command(cycle);
        stamp.has_read();
        self.role.advance(cycle, command.as_ref());
        stamp.has_stepped();
    }

    fn pass_over(&mut self, cycle: u64, time_ns: u64, why: Absence) {
        self.feedback.pass_over(cycle, time_ns);
        if why == Absence::Late {
            self.truth.write(cycle, time_ns, self.role.sample(cycle).truth);
        }
        let command = self.command(cycle);
        if why == Absence::Late {
            self.role.advance(cycle, command.as_ref());
        }
    }

    fn inject(&mut self, injection: &Injection) {
        self.feedback.inject(injection);
    }

    fn missed(&self) -> u64 {
        self.commands.missed()
    }

    fn published(&self) -> (u64, u64) {
        (self.feedback.published() + self.truth.published(), self.feedback.failures() + self.truth.failures())
    }

    fn connect(&self) {
        self.feedback.connect();
        self.truth.connect();
    }

    fn may_end(&self) -> bool {
        self.standstill_told && self.role.at_standstill() || self.silent_lockstep
    }
}
