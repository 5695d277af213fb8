//! All services of the bus, read message by message.

use super::disk::Disk;
use super::flight::Flight;
use recording::{Gap, Topic};
use signal_bus::{Bus, BusError, Service, StreamReader};
use signals::{
    BusStatus, ControlStatus, ControllerSnapshot, Feedback, Header, LoopTiming, Message, OperatorCommand,
    PlantTruth, Reference, SetPoint, Source, StepCommand,
};

/// A service of any message.
trait Drain {
    /// Hands everything that is there to the disk; the number of messages.
    fn drain(&mut self, disk: &mut Disk) -> u64;
    fn missed(&self) -> u64;
}

struct Stream<B: Service> {
    reader: StreamReader<B>,
    source: Source,
    published: Published,
}

/// In which cycle a message was published.
#[derive(Clone, Copy)]
enum Published {
    /// So many cycles before the one that it is of.
    Ahead(u64),
    /// Now: what the supervisor sends is of no cycle.
    Now,
}

/// Reference k is published in cycle k - 2.
const REFERENCE: Published = Published::Ahead(2);
/// StepCommand k is published in cycle k - 1.
const COMMAND: Published = Published::Ahead(1);

impl<B: Service> Stream<B> {
    /// Hands every message that is there to the disk, and shows it to `look`; the number of messages.
    fn each(&mut self, disk: &mut Disk, mut look: impl FnMut(&Message<B>)) -> u64 {
        let mut count = 0;
        while let Some((message, lost)) = self.reader.receive() {
            if let (true, Some(topic)) = (lost > 0, Topic::of::<B>(self.source)) {
                let Header { generation, sequence, .. } = message.header;
                disk.declare(&Gap { topic, generation, first_missing: sequence - lost, missed: lost });
            }
            let published_in = match self.published {
                Published::Ahead(cycles) => Some(message.header.cycle.saturating_sub(cycles)),
                Published::Now => None,
            };
            disk.write(self.source, &message, published_in);
            look(&message);
            count += 1;
        }
        count
    }

    fn published(self, published: Published) -> Self {
        Self { published, ..self }
    }

    fn missed(&self) -> u64 {
        self.reader.missed()
    }
}

impl<B: Service> Drain for Stream<B> {
    fn drain(&mut self, disk: &mut Disk) -> u64 {
        self.each(disk, |_| {})
    }

    fn missed(&self) -> u64 {
        Stream::missed(self)
    }
}

/// What a round brought.
pub(crate) struct News {
    /// Messages.
    pub(crate) count: u64,
    /// Whether the controller reported a fault that was not there before.
    pub(crate) fault: bool,
}

/// The readers of all services.
pub(crate) struct Streams {
    feedback: Stream<Feedback>,
    status: Stream<ControlStatus>,
    snapshots: Stream<ControllerSnapshot>,
    timing: Vec<Stream<LoopTiming>>,
    others: Vec<Box<dyn Drain>>,
    feedback_cycle: u64,
    fault: u64,
}

impl Streams {
    /// Opens all; `first` where the recorder is there before the first message.
    pub(crate) fn open(bus: &Bus, first: bool) -> Result<Self, BusError> {
        let timed = [Source::Trajectory, Source::Controller, Source::Plant];
        Ok(Self {
            feedback: stream(bus, Source::Plant, first)?,
            status: stream(bus, Source::Controller, first)?,
            snapshots: stream(bus, Source::Controller, first)?,
            timing: timed.into_iter().map(|source| stream(bus, source, first)).collect::<Result<_, _>>()?,
            others: vec![
                Box::new(stream::<Reference>(bus, Source::Trajectory, first)?.published(REFERENCE)),
                Box::new(stream::<StepCommand>(bus, Source::Controller, first)?.published(COMMAND)),
                Box::new(stream::<PlantTruth>(bus, Source::Plant, first)?),
                Box::new(stream::<BusStatus>(bus, Source::Plant, first)?),
                Box::new(stream::<SetPoint>(bus, Source::Supervisor, first)?.published(Published::Now)),
                Box::new(
                    stream::<OperatorCommand>(bus, Source::Supervisor, first)?.published(Published::Now),
                ),
            ],
            feedback_cycle: 0,
            fault: 0,
        })
    }

    /// Hands everything that is there to the disk, and the timing to the flight recorder.
    pub(crate) fn drain(&mut self, disk: &mut Disk, flight: &mut Flight) -> News {
        let mut newest = self.feedback_cycle;
        let mut count = self.feedback.each(disk, |message| newest = message.header.cycle);
        self.feedback_cycle = newest;
        let (mut last, mut new_fault) = (self.fault, false);
        count += self.status.each(disk, |message| {
            new_fault |= message.body.fault != 0 && last == 0;
            last = message.body.fault;
        });
        self.fault = last;
        let mut taken = None;
        count += self.snapshots.each(disk, |message| taken = Some(message.body.taken_before_cycle));
        if let Some(cycle) = taken {
            disk.state_was_taken(cycle);
        }
        for stream in &mut self.timing {
            let source = stream.source;
            count += stream.each(disk, |message| flight.note(source, message));
        }
        count += self.others.iter_mut().map(|stream| stream.drain(disk)).sum::<u64>();
        News { count, fault: new_fault }
    }

    pub(crate) fn feedback_cycle(&self) -> u64 {
        self.feedback_cycle
    }

    pub(crate) fn missed(&self) -> u64 {
        self.feedback.missed()
            + self.status.missed()
            + self.snapshots.missed()
            + self.timing.iter().map(Stream::missed).sum::<u64>()
            + self.others.iter().map(|stream| stream.missed()).sum::<u64>()
    }
}

fn stream<B: Service>(bus: &Bus, source: Source, first: bool) -> Result<Stream<B>, BusError> {
    let mut reader = bus.stream_reader::<B>(source)?;
    if first {
        reader.expect_from_start();
    }
    Ok(Stream { reader, source, published: Published::Ahead(0) })
}
