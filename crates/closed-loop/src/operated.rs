//! The loop in one thread as an operator has it: without a scenario's course, moved by orders and set-points.

use crate::{ControllerRole, CycleMessages, Parts, PlantRole, PlantSample, TrajectoryRole};
use signals::{OperatorCommand, OperatorKind, OperatorResult, SetPoint, SetPointKind};

/// Cycles in which an order of [`Operated::order`] may be obeyed.
const VALID_CYCLES: u64 = 10;

/// An order or a set-point on its way to the loop.
#[derive(Debug, Clone, Copy, Default)]
pub struct Wanted {
    /// For the controller.
    pub order: Option<OperatorCommand>,
    /// For the trajectory.
    pub set_point: Option<SetPoint>,
}

/// A valve that waits for orders.
pub struct Operated {
    plant: PlantRole,
    trajectory: TrajectoryRole,
    controller: ControllerRole,
    cycle: u64,
    orders: u64,
    set_points: u64,
    last: Option<CycleMessages>,
}

impl Operated {
    /// The same valve, without the scenario's course.
    pub fn new(parts: Parts) -> Self {
        let parts = parts.without_end();
        Self {
            controller: ControllerRole::new(&parts.controller),
            plant: PlantRole::new(parts.plant),
            trajectory: TrajectoryRole::new(parts.trajectory),
            cycle: 0,
            orders: 0,
            set_points: 0,
            last: None,
        }
    }

    /// The next cycle.
    pub fn cycle(&self) -> u64 {
        self.cycle
    }

    /// The messages of the last cycle; `None` before the first.
    pub fn last(&self) -> Option<&CycleMessages> {
        self.last.as_ref()
    }

    /// Makes one cycle.
    pub fn step(&mut self, wanted: Wanted) -> CycleMessages {
        let cycle = self.cycle;
        let (command, status) = (self.last.map(|last| last.command), self.last.map(|last| last.status));
        let plant = self.plant.sample(cycle);
        let feedback = Some(&plant.feedback);
        let reference = self.trajectory.step(cycle, feedback, status.as_ref(), wanted.set_point.as_ref());
        let output = self.controller.step(cycle, feedback, Some(&reference), wanted.order.as_ref());
        self.plant.advance(cycle, command.as_ref());
        self.cycle += 1;
        let (command, status) = (output.command, output.status);
        let messages = CycleMessages { cycle, plant, reference, command, status };
        self.last = Some(messages);
        messages
    }

    /// Makes so many cycles, at least one; the messages of the last.
    pub fn run(&mut self, cycles: u64) -> CycleMessages {
        for _ in 1..cycles {
            self.step(Wanted::default());
        }
        self.step(Wanted::default())
    }

    /// One cycle of the valve alone: trajectory and controller have died, nothing is commanded any more.
    pub fn step_alone(&mut self) -> PlantSample {
        let plant = self.plant.sample(self.cycle);
        self.plant.advance(self.cycle, None);
        self.cycle += 1;
        plant
    }

    /// The next order of this kind, valid for some cycles.
    pub fn next_order(&mut self, kind: OperatorKind) -> OperatorCommand {
        self.orders += 1;
        OperatorCommand {
            id: self.orders,
            valid_until_cycle: self.cycle + VALID_CYCLES,
            kind: kind.code(),
            ..OperatorCommand::default()
        }
    }

    /// Gives an order.
    pub fn order(&mut self, kind: OperatorKind) -> CycleMessages {
        let order = self.next_order(kind);
        self.step(Wanted { order: Some(order), set_point: None })
    }

    /// The next set-point of this kind.
    pub fn next_set_point(&mut self, kind: SetPointKind, value: f64) -> SetPoint {
        self.set_points += 1;
        SetPoint {
            id: self.set_points,
            valid_until_cycle: u64::MAX,
            kind: kind.code(),
            value,
            ..SetPoint::default()
        }
    }

    /// Gives a set-point.
    pub fn set(&mut self, kind: SetPointKind, value: f64) -> CycleMessages {
        let set_point = self.next_set_point(kind, value);
        self.step(Wanted { order: None, set_point: Some(set_point) })
    }

    /// Waits for the end of the order just given, for so many cycles at the most: what came of it, [`OperatorResult::Begun`] where it has
    /// not ended.
    pub fn end_of_order(&mut self, most_cycles: u64) -> OperatorResult {
        for _ in 0..most_cycles {
            let code = self.last.map_or(0, |last| last.status.operator_result);
            match OperatorResult::from_code(code) {
                Some(OperatorResult::Begun) | None => self.step(Wanted::default()),
                Some(result) => return result,
            };
        }
        OperatorResult::Begun
    }
}
