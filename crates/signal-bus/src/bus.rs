//! One process's access to the services of its generation.

use crate::reader::{CycleReader, StreamReader};
use crate::services::{LOOP_DEPTH, MAX_OBSERVERS, MAX_READERS, OBSERVER_DEPTH, RECORDER_DEPTH};
use crate::{BusError, Place, Service, Writer};
use iceoryx2::prelude::{Node, NodeBuilder, ServiceName, SignalHandlingMode, ipc};
use iceoryx2::service::builder::publish_subscribe;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use signals::{
    BusStatus, ControlStatus, ControllerSnapshot, Expectation, Feedback, LoopTiming, Message,
    OperatorCommand, PlantTruth, RecorderProgress, Reference, SetPoint, Source, StepCommand,
};
use std::any::Any;
use std::time::Duration;

/// Processes of a generation, with the successor of a recorder that died, room for a second one, and observers.
const MAX_NODES: usize = 8 + MAX_OBSERVERS;

/// How long a port waits for the other side's half of a connection where there is no clock. iceoryx2 0.10 gives up after a
/// second, and does not try again until the list of ports changes: on a machine under load a reader then heard nothing
/// for the whole run. With a clock a second stays, since a reader that joins later is mapped within a cycle.
const CONNECTION_PATIENCE: Duration = Duration::from_secs(30);

/// The generation of a run without a clock.
const WITHOUT_CLOCK: u64 = 0;

type Builder<B> = publish_subscribe::Builder<Message<B>, (), ipc::Service>;
pub(crate) type Factory<B> = PortFactory<ipc::Service, Message<B>, ()>;

/// A node in a [`Place`]. Ports stay usable as long as it lives.
pub struct Bus {
    node: Node<ipc::Service>,
    generation: u64,
    // The supervisor holds the services open for its children.
    held: Vec<Box<dyn Any>>,
}

impl Bus {
    /// Creates every service of a generation. For the supervisor, before its children start.
    ///
    /// # Errors
    /// A place that can't be used, or that somebody else uses.
    pub fn create(place: &Place, generation: u64) -> Result<Self, BusError> {
        place.check_room()?;
        let mut bus = Self::open(place, generation)?;
        bus.hold::<Reference>(Source::Trajectory)?;
        bus.hold::<StepCommand>(Source::Controller)?;
        bus.hold::<ControlStatus>(Source::Controller)?;
        bus.hold::<ControllerSnapshot>(Source::Controller)?;
        bus.hold::<Feedback>(Source::Plant)?;
        bus.hold::<PlantTruth>(Source::Plant)?;
        bus.hold::<BusStatus>(Source::Plant)?;
        bus.hold::<SetPoint>(Source::Supervisor)?;
        bus.hold::<OperatorCommand>(Source::Supervisor)?;
        bus.hold::<RecorderProgress>(Source::Recorder)?;
        for source in [Source::Trajectory, Source::Controller, Source::Plant] {
            bus.hold::<LoopTiming>(source)?;
        }
        Ok(bus)
    }

    /// Joins a generation whose services exist.
    ///
    /// # Errors
    /// A place that can't be used.
    pub fn open(place: &Place, generation: u64) -> Result<Self, BusError> {
        iceoryx2::prelude::set_log_level(iceoryx2::prelude::LogLevel::Error);
        let mut config = place.config()?;
        if generation == WITHOUT_CLOCK {
            config.global.creation_timeout = CONNECTION_PATIENCE;
        }
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|error| BusError::Node { root: place.root.clone(), reason: format!("{error:?}") })?;
        place.close_to_others()?;
        Ok(Self { node, generation, held: Vec::new() })
    }

    /// Joins a generation from outside, to look only. It makes nothing for others: where the generation has ended it fails.
    ///
    /// # Errors
    /// A place that is gone or can't be used.
    pub fn observe(place: &Place, generation: u64) -> Result<Self, BusError> {
        if place.root.is_dir() {
            return Self::open(place, generation);
        }
        Err(BusError::Node { root: place.root.clone(), reason: "the generation has ended".to_owned() })
    }

    /// A writer of `B`, for its one publisher.
    ///
    /// # Errors
    /// Where the service is not there or has a publisher already.
    pub fn writer<B: Service>(&self, source: Source) -> Result<Writer<B>, BusError> {
        let publisher = self
            .service::<B>(source)?
            .publisher_builder()
            .max_loaned_samples(1)
            .override_sample_preallocation(|_| B::SAMPLES)
            .create()
            .map_err(|error| failure::<B>(source, error))?;
        Ok(Writer::new(publisher, source, self.generation))
    }

    /// A reader for a loop process, which wants the message of its cycle.
    ///
    /// # Errors
    /// Where the service is not there or has too many readers.
    pub fn cycle_reader<B: Service>(&self, source: Source) -> Result<CycleReader<B>, BusError> {
        Ok(CycleReader::new(self.stream(source, LOOP_DEPTH)?))
    }

    /// A reader that wants every message, deeply buffered.
    ///
    /// # Errors
    /// Where the service is not there or has too many readers.
    pub fn stream_reader<B: Service>(&self, source: Source) -> Result<StreamReader<B>, BusError> {
        self.stream(source, RECORDER_DEPTH)
    }

    /// A reader for a process that is no part of the generation and only looks. It makes no service: of a generation that
    /// has ended meanwhile nothing appears again.
    ///
    /// # Errors
    /// Where the service is not there or has too many readers.
    pub fn observer_reader<B: Service>(&self, source: Source) -> Result<StreamReader<B>, BusError> {
        let service = self.builder::<B>(source)?.open().map_err(|error| failure::<B>(source, error))?;
        // No history: what was published before is not an observer's, and delivering it would cost the publisher time.
        let subscriber = service
            .subscriber_builder()
            .buffer_size(OBSERVER_DEPTH)
            .history_request(0)
            .create()
            .map_err(|error| failure::<B>(source, error))?;
        Ok(StreamReader::new(subscriber, Expectation { source, generation: self.generation }))
    }

    /// The generation that this process belongs to.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    fn stream<B: Service>(&self, source: Source, depth: usize) -> Result<StreamReader<B>, BusError> {
        let subscriber = self
            .service::<B>(source)?
            .subscriber_builder()
            .buffer_size(depth)
            .history_request(1)
            .create()
            .map_err(|error| failure::<B>(source, error))?;
        Ok(StreamReader::new(subscriber, Expectation { source, generation: self.generation }))
    }

    fn hold<B: Service>(&mut self, source: Source) -> Result<(), BusError> {
        let service = self.service::<B>(source)?;
        self.held.push(Box::new(service));
        Ok(())
    }

    fn service<B: Service>(&self, source: Source) -> Result<Factory<B>, BusError> {
        self.builder::<B>(source)?.open_or_create().map_err(|error| failure::<B>(source, error))
    }

    fn builder<B: Service>(&self, source: Source) -> Result<Builder<B>, BusError> {
        let name = B::service_name(source);
        let name: ServiceName = name.as_str().try_into().map_err(|error| failure::<B>(source, error))?;
        Ok(self
            .node
            .service_builder(&name)
            .publish_subscribe::<Message<B>>()
            .max_publishers(1)
            .max_subscribers(MAX_READERS)
            .max_nodes(MAX_NODES)
            .subscriber_max_buffer_size(RECORDER_DEPTH)
            .subscriber_max_borrowed_samples(2)
            .history_size(1)
            .enable_safe_overflow(true))
    }
}

fn failure<B: Service>(source: Source, error: impl std::fmt::Debug) -> BusError {
    BusError::Service { service: B::service_name(source), reason: format!("{error:?}") }
}
