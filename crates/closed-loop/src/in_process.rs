//! The whole loop in one thread, without clock or shared memory: for campaigns, tests and diagnosis.

use crate::{ControllerRole, GeneratorRole, Parts, PlantRole, PlantSample};
use signals::{ControlStatus, Reference, StepCommand};

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

/// The loop, cycle by cycle: an iterator over the run's messages.
pub struct InProcess {
    plant: PlantRole,
    generator: GeneratorRole,
    controller: ControllerRole,
    cycle: u64,
    last_cycle: u64,
    status: Option<ControlStatus>,
    command: Option<StepCommand>,
}

impl InProcess {
    /// The loop of a wired scenario, before its first cycle.
    pub fn new(parts: &Parts) -> Self {
        Self {
            plant: PlantRole::new(parts.plant.clone()),
            generator: GeneratorRole::new(parts.generator.clone()),
            controller: ControllerRole::new(&parts.controller),
            cycle: 0,
            last_cycle: parts.timeline.last_cycle,
            status: None,
            command: None,
        }
    }
}

impl Iterator for InProcess {
    type Item = CycleMessages;

    fn next(&mut self) -> Option<CycleMessages> {
        let cycle = self.cycle;
        if cycle > self.last_cycle {
            return None;
        }
        self.cycle += 1;
        let plant = self.plant.sample(cycle);
        let reference = self.generator.step(cycle, Some(&plant.feedback), self.status.as_ref(), None);
        let output = self.controller.step(cycle, Some(&plant.feedback), Some(&reference), None);
        // The command of this cycle was made in the one before.
        self.plant.advance(cycle, self.command.as_ref());
        self.command = Some(output.command);
        self.status = Some(output.status);
        Some(CycleMessages { cycle, plant, reference, command: output.command, status: output.status })
    }
}
