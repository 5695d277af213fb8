//! `stepvalve replay`: the controller once more, on what it saw, compared bit for bit with what it said.

use crate::files::name;
use crate::loaded::load_texts;
use crate::say::say;
use anyhow::{Result, anyhow, bail};
use closed_loop::ControllerRole;
use processes::{ORDER_ID_STEP, complain, straight_disarm};
use recording::{AnyMessage, read_record};
use signals::{Body, ControlStatus, Feedback, OperatorCommand, Reference, StepCommand};
use std::collections::BTreeMap;
use std::path::PathBuf;
use supervisor::{Failure, Outcome};

/// What to replay.
#[derive(clap::Args)]
pub struct Arguments {
    /// The record's segments, in order
    #[arg(value_name = "run.mcap", required = true)]
    segments: Vec<PathBuf>,
}

/// What the controller saw and said, by cycle.
#[derive(Default)]
struct Seen {
    feedback: BTreeMap<u64, Feedback>,
    reference: BTreeMap<u64, Reference>,
    orders: BTreeMap<u64, OperatorCommand>,
    status: BTreeMap<u64, ControlStatus>,
    commands: BTreeMap<u64, StepCommand>,
}

/// Replays the record.
///
/// # Errors
/// [`Failure::Input`] where it is no record; [`Failure::Failed`] where the commands differ or can't be recomputed.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let mut seen = Seen::default();
    let report = read_record(&arguments.segments, |message| seen.note(message)).map_err(Failure::input)?;
    let this_version = env!("CARGO_PKG_VERSION");
    if report.info.program_version != this_version {
        complain(format_args!(
            "note: recorded by version {}, replayed by {this_version}",
            report.info.program_version
        ));
    }
    let loaded = load_texts(&report.info.texts)?;
    let replayed = seen.replay(ControllerRole::new(&loaded.parts.controller))?;
    let names: Vec<_> = arguments.segments.iter().map(|path| name(path)).collect();
    say(format_args!(
        "{}: {replayed} StepCommands recomputed, all bit for bit as recorded",
        names.join(", ")
    ));
    Ok(Outcome::Done)
}

impl Seen {
    fn note(&mut self, message: &AnyMessage) {
        match message {
            AnyMessage::Feedback(m) => _ = self.feedback.insert(m.header.cycle, m.body),
            AnyMessage::Reference(m) => _ = self.reference.insert(m.header.cycle, m.body),
            AnyMessage::ControlStatus(m) => _ = self.status.insert(m.header.cycle, m.body),
            AnyMessage::StepCommand(m) => _ = self.commands.insert(m.header.cycle, m.body),
            AnyMessage::OperatorCommand(m) => _ = self.orders.insert(m.body.id, m.body),
            _ => {}
        }
    }

    /// The number of commands recomputed. ControlStatus k says which inputs the controller had in cycle k.
    fn replay(&self, mut controller: ControllerRole) -> Result<u64> {
        let mut order_id = 0;
        let mut expected_cycle = None;
        let mut count = 0;
        for (&cycle, status) in &self.status {
            if expected_cycle.is_some_and(|expected| expected != cycle) {
                self.check_skipped(cycle)?;
            }
            expected_cycle = Some(cycle + 1);
            let feedback = input(&self.feedback, cycle, status.feedback_silent_cycles == 0, "Feedback")?;
            let reference =
                input(&self.reference, cycle + 2, status.reference_silent_cycles == 0, "Reference")?;
            let order = self.order(status.operator_id, status.operator_id != order_id)?;
            order_id = status.operator_id;
            let output = controller.step(cycle, feedback, reference, order.as_ref());
            compare("ControlStatus", cycle, &output.status, Some(status))?;
            compare("StepCommand", cycle + 1, &output.command, self.commands.get(&(cycle + 1)))?;
            count += 1;
        }
        if count == 0 {
            bail!("the record holds no ControlStatus: nothing to replay");
        }
        Ok(count)
    }

    /// The order of a cycle. One that came straight to the controller was on no bus; its id says what it was.
    fn order(&self, id: u64, had: bool) -> Result<Option<OperatorCommand>> {
        if had && !id.is_multiple_of(ORDER_ID_STEP) {
            return Ok(Some(straight_disarm(id)));
        }
        Ok(input(&self.orders, id, had, "OperatorCommand")?.copied())
    }

    /// A cycle that the controller itself skipped has no command either; one that it ran but that was not recorded
    /// leaves its state unknown.
    fn check_skipped(&self, next: u64) -> Result<()> {
        match self.commands.range(..=next).next_back() {
            Some((&cycle, _)) if cycle == next => {
                bail!(
                    "ControlStatus {} is missing in the record: what the controller did from there on can't be recomputed",
                    next - 1
                )
            }
            _ => Ok(()),
        }
    }
}

fn input<'a, B>(all: &'a BTreeMap<u64, B>, key: u64, had: bool, what: &str) -> Result<Option<&'a B>> {
    match (had, all.get(&key)) {
        (false, _) => Ok(None),
        (true, Some(body)) => Ok(Some(body)),
        (true, None) => Err(anyhow!("{what} {key}, which the controller had, is missing in the record")),
    }
}

fn compare<B: Body>(what: &str, cycle: u64, recomputed: &B, recorded: Option<&B>) -> Result<()> {
    let Some(recorded) = recorded else { bail!("{what} {cycle} is missing in the record") };
    let mut words = Vec::new();
    recorded.each_word(|word| words.push(word));
    let mut fields = B::FIELDS.iter().zip(words);
    let mut difference = None;
    recomputed.each_word(|word| {
        if let Some((field, recorded)) = fields.next()
            && recorded != word
        {
            difference.get_or_insert((field.name, recorded, word));
        }
    });
    match difference {
        None => Ok(()),
        Some((field, recorded, recomputed)) => {
            bail!("{what} {cycle}: {field} is {recomputed:#018x}, recorded {recorded:#018x}")
        }
    }
}
