//! The channels of a record: one for each message, and one LoopTiming for each loop process.

use signals::{
    Body, BusStatus, ControlStatus, ControllerSnapshot, Feedback, Field, Header, LoopTiming, OperatorCommand,
    PlantTruth, RecorderProgress, Reference, SetPoint, Source, StepCommand,
};

/// A channel that carries messages of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Topic {
    /// Reference n.
    Reference,
    /// StepCommand n.
    StepCommand,
    /// Feedback k.
    Feedback,
    /// ControlStatus k.
    ControlStatus,
    /// The controller's state, part by part.
    ControllerSnapshot,
    /// PlantTruth k.
    PlantTruth,
    /// BusStatus k, where a real drive is.
    BusStatus,
    /// Set-points as the supervisor publishes them.
    SetPoint,
    /// Operator commands as the supervisor publishes them.
    OperatorCommand,
    /// The recorder's own progress.
    RecorderProgress,
    /// How the trajectory generator kept its cycles.
    TrajectoryTiming,
    /// How the step controller kept its cycles.
    ControllerTiming,
    /// How the plant simulator, or the valve bridge, kept its cycles.
    PlantTiming,
}

impl Topic {
    /// All of them, in the order of their channels.
    pub const ALL: &'static [Self] = &[
        Self::Reference,
        Self::StepCommand,
        Self::Feedback,
        Self::ControlStatus,
        Self::ControllerSnapshot,
        Self::PlantTruth,
        Self::BusStatus,
        Self::SetPoint,
        Self::OperatorCommand,
        Self::RecorderProgress,
        Self::TrajectoryTiming,
        Self::ControllerTiming,
        Self::PlantTiming,
    ];

    /// The channel's name in the file.
    pub const fn path(self) -> &'static str {
        match self {
            Self::Reference => "/reference",
            Self::StepCommand => "/step_command",
            Self::Feedback => "/feedback",
            Self::ControlStatus => "/control_status",
            Self::ControllerSnapshot => "/controller_snapshot",
            Self::PlantTruth => "/plant_truth",
            Self::BusStatus => "/bus_status",
            Self::SetPoint => "/set_point",
            Self::OperatorCommand => "/operator_command",
            Self::RecorderProgress => "/recorder_progress",
            Self::TrajectoryTiming => "/loop_timing/trajectory_generator",
            Self::ControllerTiming => "/loop_timing/step_controller",
            Self::PlantTiming => "/loop_timing/plant_simulator",
        }
    }

    /// The topic with this channel name.
    pub fn from_path(path: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|topic| topic.path() == path)
    }

    /// The process that publishes on it.
    pub const fn source(self) -> Source {
        match self {
            Self::Reference | Self::TrajectoryTiming => Source::Trajectory,
            Self::StepCommand | Self::ControlStatus | Self::ControllerSnapshot | Self::ControllerTiming => {
                Source::Controller
            }
            Self::Feedback | Self::PlantTruth | Self::BusStatus | Self::PlantTiming => Source::Plant,
            Self::SetPoint | Self::OperatorCommand => Source::Supervisor,
            Self::RecorderProgress => Source::Recorder,
        }
    }

    /// The topic that a source's messages of type `B` belong to; `None` where that source publishes no such.
    pub fn of<B: Body>(source: Source) -> Option<Self> {
        let mut topics = Self::ALL.iter().copied();
        topics.find(|topic| topic.schema_hash() == B::SCHEMA_HASH && topic.source() == source)
    }

    /// The fields of its messages behind the header, in the order of their bytes.
    pub const fn body_fields(self) -> &'static [Field] {
        match self {
            Self::Reference => Reference::FIELDS,
            Self::StepCommand => StepCommand::FIELDS,
            Self::Feedback => Feedback::FIELDS,
            Self::ControlStatus => ControlStatus::FIELDS,
            Self::ControllerSnapshot => ControllerSnapshot::FIELDS,
            Self::PlantTruth => PlantTruth::FIELDS,
            Self::BusStatus => BusStatus::FIELDS,
            Self::SetPoint => SetPoint::FIELDS,
            Self::OperatorCommand => OperatorCommand::FIELDS,
            Self::RecorderProgress => RecorderProgress::FIELDS,
            Self::TrajectoryTiming | Self::ControllerTiming | Self::PlantTiming => LoopTiming::FIELDS,
        }
    }

    /// The schema hash of its messages.
    pub(crate) const fn schema_hash(self) -> u64 {
        match self {
            Self::Reference => Reference::SCHEMA_HASH,
            Self::StepCommand => StepCommand::SCHEMA_HASH,
            Self::Feedback => Feedback::SCHEMA_HASH,
            Self::ControlStatus => ControlStatus::SCHEMA_HASH,
            Self::ControllerSnapshot => ControllerSnapshot::SCHEMA_HASH,
            Self::PlantTruth => PlantTruth::SCHEMA_HASH,
            Self::BusStatus => BusStatus::SCHEMA_HASH,
            Self::SetPoint => SetPoint::SCHEMA_HASH,
            Self::OperatorCommand => OperatorCommand::SCHEMA_HASH,
            Self::RecorderProgress => RecorderProgress::SCHEMA_HASH,
            Self::TrajectoryTiming | Self::ControllerTiming | Self::PlantTiming => LoopTiming::SCHEMA_HASH,
        }
    }
}

/// Bytes of a record that a message takes beside its words: CDR's header, MCAP's record and its index entry.
const AROUND_A_MESSAGE: usize = 4 + 31 + 16;

/// Bytes of a record that a cycle in real time takes before chunks are compressed, with a drive on a bus or without.
pub fn bytes_per_cycle(drive: bool) -> u64 {
    let every_cycle = |topic: &&Topic| match topic {
        Topic::SetPoint | Topic::OperatorCommand | Topic::RecorderProgress => false,
        Topic::BusStatus => drive,
        // Some cycles of each second.
        Topic::ControllerSnapshot => false,
        _ => true,
    };
    let bytes = |topic: &Topic| 8 * (Header::FIELDS.len() + topic.body_fields().len()) + AROUND_A_MESSAGE;
    Topic::ALL.iter().filter(every_cycle).map(bytes).sum::<usize>() as u64
}

impl core::fmt::Display for Topic {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.path())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_message_has_one_channel_and_back() {
        for topic in Topic::ALL {
            assert_eq!(Topic::from_path(topic.path()), Some(*topic));
        }
        assert_eq!(Topic::of::<Feedback>(Source::Plant), Some(Topic::Feedback));
        assert_eq!(Topic::of::<Feedback>(Source::Controller), None);
        assert_eq!(Topic::of::<LoopTiming>(Source::Controller), Some(Topic::ControllerTiming));
        assert_eq!(Topic::of::<LoopTiming>(Source::Supervisor), None);
    }
}
