//! Reads the bus of a generation without being part of it.
//!
//! A publisher notices a new reader in the cycle in which it sends next, and maps the reader's memory there. So readers are opened
//! and closed one at a time, cycles apart: no cycle of the loop pays for two.

use crate::block::Block;
use crate::history::Lost;
use recording::{Gap, Topic};
use signal_bus::{Bus, BusError, Service, StreamReader};
use signals::{
    BusStatus, ControlStatus, ControllerSnapshot, Feedback, LoopTiming, OperatorCommand, PlantTruth,
    Reference, SetPoint, StepCommand,
};
use std::time::{Duration, Instant};
use supervisor::Whereabouts;

/// From one reader to the next: many cycles.
const APART: Duration = Duration::from_millis(20);

/// What is read, in the order in which it is opened: what most want to see first.
const READ: [Topic; 12] = [
    Topic::Feedback,
    Topic::ControlStatus,
    Topic::Reference,
    Topic::StepCommand,
    Topic::PlantTruth,
    Topic::PlantTiming,
    Topic::ControllerTiming,
    Topic::TrajectoryTiming,
    Topic::SetPoint,
    Topic::OperatorCommand,
    Topic::ControllerSnapshot,
    Topic::BusStatus,
];

/// A reader of any message.
trait Tap {
    fn drain(&mut self, came: &mut Block, lost: &mut Vec<Lost>);
}

struct Reader<B: Service> {
    topic: Topic,
    reader: StreamReader<B>,
}

impl<B: Service> Tap for Reader<B> {
    fn drain(&mut self, came: &mut Block, lost: &mut Vec<Lost>) {
        while let Some((message, missing)) = self.reader.receive() {
            let header = message.header;
            if missing > 0 {
                let first_missing = header.sequence.saturating_sub(missing);
                let gap =
                    Gap { topic: self.topic, generation: header.generation, first_missing, missed: missing };
                lost.push(Lost { gap, before_cycle: header.cycle });
            }
            came.push(self.topic, header.cycle, |bytes| message.append_bytes(bytes));
        }
    }
}

/// The readers of one generation. Dropped, it takes as long as opening them took.
pub(crate) struct Observer {
    // Before the bus, whose node they belong to.
    readers: Vec<Box<dyn Tap>>,
    pending: std::slice::Iter<'static, Topic>,
    last_opened: Option<Instant>,
    at: Whereabouts,
    /// Whether the generation still runs, so that closing a reader is noticed by its publisher.
    pub(crate) running: bool,
    bus: Bus,
}

impl Observer {
    /// Joins a generation.
    ///
    /// # Errors
    /// Where it is gone, or has observers enough.
    pub(crate) fn join(at: Whereabouts) -> Result<Self, BusError> {
        let bus = Bus::observe(&at.place, at.generation)?;
        Ok(Self { readers: Vec::new(), pending: READ.iter(), last_opened: None, at, running: true, bus })
    }

    /// What it reads.
    pub(crate) fn at(&self) -> &Whereabouts {
        &self.at
    }

    /// Opens the next reader when its time has come, and takes everything that is there.
    ///
    /// # Errors
    /// Where a reader can't be opened.
    pub(crate) fn drain(&mut self, came: &mut Block, lost: &mut Vec<Lost>) -> Result<(), BusError> {
        if self.last_opened.is_none_or(|last| last.elapsed() >= APART)
            && let Some(topic) = self.pending.next()
        {
            self.readers.push(open(&self.bus, *topic)?);
            self.last_opened = Some(Instant::now());
        }
        self.readers.iter_mut().for_each(|reader| reader.drain(came, lost));
        Ok(())
    }
}

impl Drop for Observer {
    fn drop(&mut self) {
        while self.readers.pop().is_some() {
            if self.running {
                std::thread::sleep(APART);
            }
        }
    }
}

fn open(bus: &Bus, topic: Topic) -> Result<Box<dyn Tap>, BusError> {
    Ok(match topic {
        Topic::Feedback => reader::<Feedback>(bus, topic)?,
        Topic::ControlStatus => reader::<ControlStatus>(bus, topic)?,
        Topic::Reference => reader::<Reference>(bus, topic)?,
        Topic::StepCommand => reader::<StepCommand>(bus, topic)?,
        Topic::PlantTruth => reader::<PlantTruth>(bus, topic)?,
        Topic::SetPoint => reader::<SetPoint>(bus, topic)?,
        Topic::OperatorCommand => reader::<OperatorCommand>(bus, topic)?,
        Topic::ControllerSnapshot => reader::<ControllerSnapshot>(bus, topic)?,
        Topic::BusStatus => reader::<BusStatus>(bus, topic)?,
        Topic::RecorderProgress => reader::<signals::RecorderProgress>(bus, topic)?,
        Topic::PlantTiming | Topic::ControllerTiming | Topic::TrajectoryTiming => {
            reader::<LoopTiming>(bus, topic)?
        }
    })
}

fn reader<B: Service>(bus: &Bus, topic: Topic) -> Result<Box<dyn Tap>, BusError> {
    Ok(Box::new(Reader { topic, reader: bus.observer_reader::<B>(topic.source())? }))
}
