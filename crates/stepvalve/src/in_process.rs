//! A scenario in one thread: as fast as it goes, with the same record as the processes make.

use crate::signals::Interruption;
use crate::supervisor::Progress;
use anyhow::Result;
use closed_loop::{CycleOutputs, InProcess, Parts, Perfect, Wire};
use injection::{FaultyWire, Injection};
use recording::{Gap, RecordInfo, Topic, Writer};
use signals::{Body, Header, Message, Source};
use std::path::PathBuf;

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
    fn write(
        &mut self,
        writer: &mut Option<Writer>,
        cycle: u64,
        time_ns: u64,
        body: Option<B>,
    ) -> Result<()> {
        let Some(writer) = writer else { return Ok(()) };
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

/// Runs the scenario, and records it in a file if one is given; `false` where it was interrupted.
///
/// # Errors
/// Where the record can't be written.
pub fn run(
    parts: &Parts,
    record: Option<(RecordInfo, PathBuf)>,
    injections: &[Injection],
    interruption: &Interruption,
) -> Result<bool> {
    if injections.is_empty() {
        return over(parts, Perfect, record, interruption);
    }
    over(parts, FaultyWire::new(parts.timeline.period_ns, injections), record, interruption)
}

fn over(
    parts: &Parts,
    wire: impl Wire,
    record: Option<(RecordInfo, PathBuf)>,
    interruption: &Interruption,
) -> Result<bool> {
    let mut writer = record.map(|(info, segment)| Writer::create(&segment, &info)).transpose()?;
    let (mut feedback, mut truth) = (Sealer::new(Source::Plant), Sealer::new(Source::Plant));
    let mut reference = Sealer::new(Source::Trajectory);
    let (mut command, mut status) = (Sealer::new(Source::Controller), Sealer::new(Source::Controller));
    let progress = Progress::new(&parts.timeline);
    let mut complete = true;
    let mut run = InProcess::over(parts, wire);
    while let Some(CycleOutputs { cycle, plant, arrived, .. }) = run.cycle() {
        let time_ns = cycle * parts.timeline.period_ns;
        feedback.write(&mut writer, cycle, time_ns, arrived.feedback)?;
        truth.write(&mut writer, cycle, time_ns, plant.map(|plant| plant.truth))?;
        reference.write(&mut writer, cycle + 2, time_ns, arrived.reference)?;
        command.write(&mut writer, cycle + 1, time_ns, arrived.command)?;
        status.write(&mut writer, cycle, time_ns, arrived.status)?;
        progress.at(cycle);
        if interruption.wanted() {
            complete = false;
            break;
        }
    }
    writer.map(Writer::finish).transpose()?;
    Ok(complete)
}
