//! A scenario in one thread: as fast as it goes, with the same record as the processes make.

use anyhow::Result;
use closed_loop::{CycleOutputs, InProcess, Metrics, Parts, Perfect, Wire};
use injection::{FaultyWire, Injection};
use recording::{Gap, INTERRUPTED, RecordInfo, Topic, Writer};
use signals::{Body, Header, Message, Source};
use std::path::Path;
use supervisor::Interruption;
use supervisor::Progress;

/// Counts one service's messages and seals them, as its publisher does.
struct Sealer<B: Body> {
    source: Source,
    next_sequence: u64,
    missed: u64,
    body: std::marker::PhantomData<B>,
}

impl<B: Body> Sealer<B> {
    fn new(source: Source) -> Self {
        Self { source, next_sequence: 0, missed: 0, body: std::marker::PhantomData }
    }

    /// Records a message; `None` for one that did not arrive, which leaves a gap that is declared with the next.
    fn write(&mut self, writer: &mut Writer, cycle: u64, time_ns: u64, body: Option<B>) -> Result<()> {
        let Some(body) = body else {
            self.next_sequence += 1;
            self.missed += 1;
            return Ok(());
        };
        if let (true, Some(topic)) = (self.missed > 0, Topic::of::<B>(self.source)) {
            let (missed, first_missing) = (self.missed, self.next_sequence - self.missed);
            writer.note_gap(&Gap { topic, generation: 0, first_missing, missed })?;
            self.missed = 0;
        }
        let header = Header::new::<B>(self.source, 0, self.next_sequence, cycle, time_ns);
        self.next_sequence += 1;
        Ok(writer.write(self.source, &Message::seal(header, body))?)
    }
}

/// What a run in one thread is to do.
pub struct Run<'a> {
    /// The roles.
    pub parts: &'a Parts,
    /// Faults to put into it.
    pub injections: &'a [Injection],
    /// Whether the user wants it to end.
    pub interruption: &'a Interruption,
}

impl Run<'_> {
    /// Runs the scenario and gathers its metrics, without a record; `false` where it was interrupted.
    pub fn measure(&self) -> (Metrics, bool) {
        if self.injections.is_empty() { measure(self, Perfect) } else { measure(self, self.faulty()) }
    }

    /// Runs the scenario and records it in a file; `false` where it was interrupted.
    ///
    /// # Errors
    /// Where the record can't be written.
    pub fn record(&self, info: &RecordInfo, segment: &Path) -> Result<bool> {
        let writer = Writer::create(segment, info)?;
        if self.injections.is_empty() {
            record(self, Perfect, writer)
        } else {
            record(self, self.faulty(), writer)
        }
    }

    fn faulty(&self) -> FaultyWire {
        FaultyWire::new(self.parts, self.injections)
    }
}

fn measure(run: &Run, wire: impl Wire) -> (Metrics, bool) {
    let mut metrics = Metrics::default();
    let progress = Progress::new(&run.parts.timeline);
    let mut cycles = InProcess::over(run.parts, wire);
    while let Some(outputs) = cycles.cycle() {
        metrics.note_cycle(&outputs);
        progress.at(outputs.cycle);
        if run.interruption.wanted() {
            return (metrics, false);
        }
    }
    (metrics, true)
}

fn record(run: &Run, wire: impl Wire, mut writer: Writer) -> Result<bool> {
    let parts = run.parts;
    let (mut feedback, mut truth) = (Sealer::new(Source::Plant), Sealer::new(Source::Plant));
    let mut reference = Sealer::new(Source::Trajectory);
    let (mut command, mut status) = (Sealer::new(Source::Controller), Sealer::new(Source::Controller));
    let progress = Progress::new(&parts.timeline);
    let mut complete = true;
    let mut cycles = InProcess::over(parts, wire);
    while let Some(CycleOutputs { cycle, plant, arrived, .. }) = cycles.cycle() {
        let time_ns = cycle * parts.timeline.period_ns;
        feedback.write(&mut writer, cycle, time_ns, arrived.feedback)?;
        truth.write(&mut writer, cycle, time_ns, plant.map(|plant| plant.truth))?;
        reference.write(&mut writer, cycle + 2, time_ns, arrived.reference)?;
        command.write(&mut writer, cycle + 1, time_ns, arrived.command)?;
        status.write(&mut writer, cycle, time_ns, arrived.status)?;
        progress.at(cycle);
        if run.interruption.wanted() {
            complete = false;
            writer.note(INTERRUPTED)?;
            break;
        }
    }
    writer.finish()?;
    Ok(complete)
}
