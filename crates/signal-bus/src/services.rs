//! The services: who publishes each, how deep its readers' buffers are, how many may read.

use signals::{
    Body, BusStatus, ControlStatus, ControllerSnapshot, Feedback, LoopTiming, OperatorCommand, PlantTruth,
    RecorderProgress, Reference, SetPoint, Source, StepCommand,
};

/// Messages of one service that the recorder may fall behind before it loses some: 4 s at 1 kHz.
pub const RECORDER_DEPTH: usize = 4096;

/// Messages that a loop process may fall behind. It wants the one of its cycle; the few more bridge a stall of
/// either side without losing the message that fits.
pub(crate) const LOOP_DEPTH: usize = 8;

/// Messages that an observer may fall behind: 1 s at 1 kHz. It looks every few milliseconds.
pub(crate) const OBSERVER_DEPTH: usize = 1024;

/// Observers that may look at the same time. One that was killed counts until the next one comes.
pub(crate) const MAX_OBSERVERS: usize = 2;

/// Readers of a service: three loop processes, supervisor, recorder, the successor of a recorder that died, observers.
pub(crate) const MAX_READERS: usize = 6 + MAX_OBSERVERS;

/// A message that has a service.
pub trait Service: Body {
    /// Its publisher; `None` where each process publishes its own.
    const OWNER: Option<Source>;

    /// The service's name for a publisher.
    fn service_name(source: Source) -> String {
        match Self::OWNER {
            Some(_) => format!("stepvalve/{}", Self::TOPIC),
            None => format!("stepvalve/{}/{source}", Self::TOPIC),
        }
    }

    /// Messages kept in shared memory: what all readers' buffers hold at the most, twice the recorder's (a dead
    /// one's is freed when its successor starts), the observers', and a few in flight.
    const SAMPLES: usize =
        2 * RECORDER_DEPTH + MAX_OBSERVERS * OBSERVER_DEPTH + MAX_READERS * (LOOP_DEPTH + 2) + 4;
}

macro_rules! services {
    ($($body:ty: $owner:expr;)*) => { $( impl Service for $body { const OWNER: Option<Source> = $owner; } )* };
}

services! {
    Reference: Some(Source::Trajectory);
    StepCommand: Some(Source::Controller);
    ControlStatus: Some(Source::Controller);
    ControllerSnapshot: Some(Source::Controller);
    Feedback: Some(Source::Plant);
    PlantTruth: Some(Source::Plant);
    BusStatus: Some(Source::Plant);
    LoopTiming: None;
    SetPoint: Some(Source::Supervisor);
    OperatorCommand: Some(Source::Supervisor);
    RecorderProgress: Some(Source::Recorder);
}
