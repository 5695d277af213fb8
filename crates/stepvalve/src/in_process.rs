//! A scenario in one thread: as fast as it goes, with the same record as the processes make.

use crate::signals::Interruption;
use crate::supervisor::Progress;
use anyhow::Result;
use closed_loop::{InProcess, Parts};
use recording::{RecordInfo, Writer};
use signals::{Body, Header, Message, Source};
use std::path::PathBuf;

/// Counts one service's messages and seals them, as its publisher does.
struct Sealer<B: Body> {
    source: Source,
    next_sequence: u64,
    body: std::marker::PhantomData<B>,
}

impl<B: Body> Sealer<B> {
    fn new(source: Source) -> Self {
        Self { source, next_sequence: 0, body: std::marker::PhantomData }
    }

    fn write(&mut self, writer: &mut Option<Writer>, cycle: u64, time_ns: u64, body: B) -> Result<()> {
        let Some(writer) = writer else { return Ok(()) };
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
    interruption: &Interruption,
) -> Result<bool> {
    let mut writer = record.map(|(info, segment)| Writer::create(&segment, &info)).transpose()?;
    let (mut feedback, mut truth) = (Sealer::new(Source::Plant), Sealer::new(Source::Plant));
    let mut reference = Sealer::new(Source::Trajectory);
    let (mut command, mut status) = (Sealer::new(Source::Controller), Sealer::new(Source::Controller));
    let progress = Progress::new(&parts.timeline);
    let mut complete = true;
    for messages in InProcess::new(parts) {
        let cycle = messages.cycle;
        let time_ns = cycle * parts.timeline.period_ns;
        feedback.write(&mut writer, cycle, time_ns, messages.plant.feedback)?;
        truth.write(&mut writer, cycle, time_ns, messages.plant.truth)?;
        reference.write(&mut writer, cycle + 2, time_ns, messages.reference)?;
        command.write(&mut writer, cycle + 1, time_ns, messages.command)?;
        status.write(&mut writer, cycle, time_ns, messages.status)?;
        progress.at(cycle);
        if interruption.wanted() {
            complete = false;
            break;
        }
    }
    writer.map(Writer::finish).transpose()?;
    Ok(complete)
}
