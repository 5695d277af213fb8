//! A valve moved by orders in one thread, under the oracle's eyes.

use super::ground::{Ground, VARIANTS, limits};
use super::tally::{Outcome, Tally};
use crate::progress::Progress;
use anyhow::Context;
use closed_loop::{CycleMessages, Operated, PlantSample, Wanted, wire};
use config::Scenario;
use oracle::{Judge, Limits, Order, Wish};
use signals::{OperatorKind, OperatorResult, SetPointKind, validity};
use valve_model::Model;

/// No order takes longer, in cycles: homing beyond its longest way is a fault before.
const MOST_CYCLES: u64 = 100_000;
/// A zero further off than this, at rest, is wrong, rad: some of the encoder's noise, and what friction holds the rotor off its teeth.
const ZERO_RAD: f64 = 1e-3;

/// Makes many trials, each from a seed of its own.
///
/// # Errors
/// Where the shipped scenarios can't be used.
pub fn campaign(
    what: &'static str,
    (seed, trials): (u64, u64),
    tally: &mut Tally,
    trial: impl Fn(&Ground, u64) -> anyhow::Result<Outcome>,
) -> anyhow::Result<()> {
    let ground = VARIANTS.first().context("a variant")?.ground()?;
    let first = seed << 32;
    println!("{what}: seeds {first} to {}", first + trials.saturating_sub(1));
    let progress = Progress::new(trials as usize);
    for seed in first..first + trials {
        progress.next(what);
        tally.note(trial(&ground, seed)?);
    }
    Ok(())
}

/// The valve, and everything that its trial found.
pub struct Watched<'a> {
    valve: Operated,
    judge: Judge,
    limits: Limits,
    of: (&'a Scenario, &'a (Model, Model)),
    /// What must not be, in words.
    pub violations: Vec<String>,
}

impl<'a> Watched<'a> {
    /// A valve as the scenario begins it.
    ///
    /// # Errors
    /// Where the models don't fit the scenario.
    pub fn new(scenario: &'a Scenario, models: &'a (Model, Model)) -> anyhow::Result<Self> {
        let valve = Operated::new(wire(scenario, &models.0, &models.1)?);
        let limits = limits(scenario);
        Ok(Self { valve, judge: Judge::new(limits), limits, of: (scenario, models), violations: Vec::new() })
    }

    fn step(&mut self, wanted: Wanted) -> CycleMessages {
        let messages = self.valve.step(wanted);
        self.judge.truth(messages.cycle, &messages.plant.truth);
        self.judge.command(messages.cycle + 1, &messages.command);
        messages
    }

    /// So many cycles, at least one.
    pub fn run(&mut self, cycles: u64) -> CycleMessages {
        for _ in 1..cycles {
            self.step(Wanted::default());
        }
        self.step(Wanted::default())
    }

    /// Gives an order.
    pub fn order(&mut self, kind: OperatorKind) -> CycleMessages {
        let order = self.valve.next_order(kind);
        let cycle = self.valve.cycle();
        let wish = match kind {
            OperatorKind::Arm | OperatorKind::Home => Some((Wish::Move, order.valid_until_cycle)),
            OperatorKind::Disarm => Some((Wish::Stop, cycle)),
            _ => None,
        };
        if let Some((wish, until_cycle)) = wish {
            self.judge.order(Order { wish, from_cycle: cycle, until_cycle });
        }
        self.step(Wanted { order: Some(order), set_point: None })
    }

    /// Gives an order and waits for what comes of it.
    pub fn complete(&mut self, kind: OperatorKind) -> (OperatorResult, CycleMessages) {
        let mut last = self.order(kind);
        for _ in 0..MOST_CYCLES {
            match OperatorResult::from_code(last.status.operator_result) {
                Some(OperatorResult::Begun) | None => last = self.step(Wanted::default()),
                Some(result) => return (result, last),
            }
        }
        self.violations.push(format!("{kind} never ended"));
        (OperatorResult::Begun, last)
    }

    /// Sends the valve somewhere.
    pub fn set(&mut self, kind: SetPointKind, value: f64) -> CycleMessages {
        let set_point = self.valve.next_set_point(kind, value);
        self.step(Wanted { order: None, set_point: Some(set_point) })
    }

    /// Trajectory and controller die; after so many cycles the plant side ends too, and a next generation begins where it left the valve.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn die(&mut self, cycles: u64) -> anyhow::Result<PlantSample> {
        let mut left = self.step_alone();
        for _ in 1..cycles {
            left = self.step_alone();
        }
        self.end_generation();
        let (scenario, models) = self.of;
        let parts = wire(scenario, &models.0, &models.1)?;
        self.valve = Operated::new(parts.left_by(&left.feedback, &left.truth, scenario.encoder.absolute));
        self.judge = Judge::new(self.limits);
        Ok(left)
    }

    fn step_alone(&mut self) -> PlantSample {
        let cycle = self.valve.cycle();
        let plant = self.valve.step_alone();
        self.judge.truth(cycle, &plant.truth);
        plant
    }

    /// A valve at rest that says that it is homed says the true angle.
    pub fn check_zero(&mut self, plant: &PlantSample, when: &str) -> bool {
        let homed = plant.feedback.validity & validity::HOMED != 0;
        let off_rad = plant.feedback.angle_rad - plant.truth.angle_rad;
        if homed && off_rad.abs() > ZERO_RAD {
            self.violations.push(format!("{when}: homed, and the zero is {off_rad} rad off"));
        }
        homed
    }

    /// Notes what is not as it should be.
    pub fn expect(&mut self, is_so: bool, otherwise: impl FnOnce() -> String) {
        if !is_so {
            self.violations.push(otherwise());
        }
    }

    fn end_generation(&mut self) {
        let found = self.judge.verdict().findings;
        self.violations.extend(found.iter().take(3).map(|finding| format!("{finding:?}")));
    }

    /// Everything that was found.
    pub fn end(mut self) -> Vec<String> {
        self.end_generation();
        self.violations
    }
}
