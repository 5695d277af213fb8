//! The whole loop in one thread, without clock or shared memory: for campaigns, tests and diagnosis.

use crate::wire::{Perfect, Presence, Wire};
use crate::{ControllerRole, Parts, PlantRole, PlantSample, TrajectoryRole};
use signals::{ControlStatus, Feedback, Reference, Source, StepCommand};
use step_control::Output;

/// All messages of a cycle k.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CycleMessages {
    /// k.
    pub cycle: u64,
    /// Feedback k and PlantTruth k.
    pub plant: PlantSample,
    /// Reference k+2.
    pub reference: Reference,
    /// StepCommand k+1.
    pub command: StepCommand,
    /// ControlStatus k.
    pub status: ControlStatus,
}

/// What the processes made in a cycle k, each as far as it took part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CycleOutputs {
    /// k.
    pub cycle: u64,
    /// Feedback k and PlantTruth k; of a plant that is late too, since the valve goes on all the same.
    pub plant: Option<PlantSample>,
    /// Reference k+2.
    pub reference: Option<Reference>,
    /// StepCommand k+1 and ControlStatus k.
    pub controller: Option<Output>,
    /// What the plant received of StepCommand k.
    pub received: Option<StepCommand>,
    /// What arrives of this cycle's messages.
    pub arrived: Arrived,
}

/// What the wire delivers of a cycle's messages.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Arrived {
    /// Feedback k.
    pub feedback: Option<Feedback>,
    /// Reference k+2.
    pub reference: Option<Reference>,
    /// StepCommand k+1.
    pub command: Option<StepCommand>,
    /// ControlStatus k.
    pub status: Option<ControlStatus>,
}

/// The loop, cycle by cycle: an iterator over the run's messages.
///
/// ```
/// use closed_loop::{InProcess, wire};
///
/// let files = concat!(env!("CARGO_MANIFEST_DIR"), "/../../rt-config/scenarios/");
/// let read = |name: &str| std::fs::read_to_string(format!("{files}{name}")).unwrap();
/// let scenario = config::parse_scenario(&read("sine-1hz.toml"), "sine-1hz.toml").unwrap();
/// let truth = config::parse_model(&read(&scenario.truth), &scenario.truth).unwrap();
/// let belief = config::parse_model(&read(&scenario.belief), &scenario.belief).unwrap();
///
/// let parts = wire(&scenario, &truth, &belief).unwrap();
/// let errors_rad = InProcess::new(&parts).map(|cycle| cycle.status.following_error_rad.abs());
/// assert!(errors_rad.fold(0.0, f64::max) < 0.02);
/// ```
pub struct InProcess<W: Wire = Perfect> {
    plant: PlantRole,
    trajectory: TrajectoryRole,
    controller: ControllerRole,
    wire: W,
    cycle: u64,
    last_cycle: u64,
    // As they arrived.
    status: Option<ControlStatus>,
    command: Option<StepCommand>,
}

impl InProcess {
    /// The loop of a wired scenario, before its first cycle.
    pub fn new(parts: &Parts) -> Self {
        Self::over(parts, Perfect)
    }
}

impl<W: Wire> InProcess<W> {
    /// The same, its messages carried by `wire`.
    pub fn over(parts: &Parts, wire: W) -> Self {
        Self {
            plant: PlantRole::new(parts.plant.clone()),
            trajectory: TrajectoryRole::new(parts.trajectory.clone()),
            controller: ControllerRole::new(&parts.controller),
            wire,
            cycle: 0,
            last_cycle: parts.timeline.last_cycle,
            status: None,
            command: None,
        }
    }

    /// The next cycle; `None` behind the last.
    pub fn cycle(&mut self) -> Option<CycleOutputs> {
        let cycle = self.cycle;
        if cycle > self.last_cycle {
            return None;
        }
        self.cycle += 1;
        let runs = |wire: &W, source: Source| wire.presence(source, cycle) == Presence::Runs;
        let alive = self.wire.presence(Source::Plant, cycle) != Presence::Silent;
        let plant = alive.then(|| self.plant.sample(cycle));
        let sent = plant.filter(|_| runs(&self.wire, Source::Plant));
        let feedback = sent.and_then(|sample| self.wire.feedback(cycle, sample.feedback));
        let reference = runs(&self.wire, Source::Trajectory)
            .then(|| self.trajectory.step(cycle, feedback.as_ref(), self.status.as_ref(), None));
        let heard = reference.and_then(|reference| self.wire.reference(cycle, reference));
        let controller = runs(&self.wire, Source::Controller)
            .then(|| self.controller.step(cycle, feedback.as_ref(), heard.as_ref(), None));
        // This command was made in the cycle before; a late plant process reads it late, with the same result.
        let received = self.command.filter(|_| alive);
        if alive {
            self.plant.advance(cycle, received.as_ref());
        }
        self.command = controller.and_then(|output| self.wire.command(cycle, output.command));
        self.status = controller.and_then(|output| self.wire.status(cycle, output.status));
        let arrived = Arrived { feedback, reference: heard, command: self.command, status: self.status };
        Some(CycleOutputs { cycle, plant, reference, controller, received, arrived })
    }

    /// What carries the messages.
    pub fn wire(&self) -> &W {
        &self.wire
    }
}

impl Iterator for InProcess {
    type Item = CycleMessages;

    fn next(&mut self) -> Option<CycleMessages> {
        let CycleOutputs { cycle, plant, reference, controller, .. } = self.cycle()?;
        // Over a perfect wire all of them take part in every cycle.
        let (plant, reference, Output { command, status }) = (plant?, reference?, controller?);
        Some(CycleMessages { cycle, plant, reference, command, status })
    }
}
