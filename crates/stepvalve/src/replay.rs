//! `stepvalve replay`: the controller once more, on what it saw, compared bit for bit with what it said.

use crate::files::{name, segments};
use crate::loaded::load_texts;
use crate::say::say;
use crate::summary::flaws;
use anyhow::{Result, anyhow, bail};
use closed_loop::{ControllerPart, ControllerRole, Snapshot, SnapshotReader};
use processes::{ORDER_ID_STEP, complain, straight_disarm};
use recording::{AnyMessage, read_record};
use signals::{Body, ControlStatus, Feedback, OperatorCommand, Reference, StepCommand};
use std::collections::BTreeMap;
use std::path::PathBuf;
use supervisor::{Failure, Outcome};

/// What to replay.
#[derive(clap::Args)]
pub struct Arguments {
    /// The folder of a run, or the record's segments in order
    #[arg(value_name = "run.mcap", required = true)]
    segments: Vec<PathBuf>,
}

/// What the controller of a generation saw and said, by cycle.
#[derive(Default)]
struct Seen {
    feedback: BTreeMap<u64, Feedback>,
    reference: BTreeMap<u64, Reference>,
    orders: BTreeMap<u64, OperatorCommand>,
    status: BTreeMap<u64, ControlStatus>,
    commands: BTreeMap<u64, StepCommand>,
    /// Its state before a cycle, and what is there of the next one.
    snapshots: BTreeMap<u64, Snapshot>,
    reader: SnapshotReader,
}

/// What became of the StepCommands.
#[derive(Default)]
struct Count {
    recomputed: u64,
    /// Those before the first state, and behind a gap until the next one.
    out_of_reach: u64,
}

/// Replays the record.
///
/// # Errors
/// [`Failure::Input`] where it is no record; [`Failure::Failed`] where the commands differ or none can be recomputed.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let segments = segments(&arguments.segments)?;
    let mut generations: BTreeMap<u64, Seen> = BTreeMap::new();
    let mut damaged = None;
    let report = read_record(&segments, |message| {
        let seen = generations.entry(message.header().generation).or_default();
        if let Err(error) = seen.note(message) {
            damaged.get_or_insert(error);
        }
    })
    .map_err(Failure::input)?;
    for flaw in flaws(&report) {
        complain(format_args!(
            "note: {flaw}; what is missing is not replayed, and what follows it may differ"
        ));
    }
    let this_version = env!("CARGO_PKG_VERSION");
    if report.info.program_version != this_version {
        complain(format_args!(
            "note: recorded by version {}, replayed by {this_version}",
            report.info.program_version
        ));
    }
    if let Some(error) = damaged {
        return Err(
            anyhow!("a snapshot of the controller can't be read, as of another version: {error}").into()
        );
    }
    let parts = load_texts(&report.info.texts)?.parts;
    let parts = if report.info.operated { parts.without_end() } else { parts };
    let mut count = Count::default();
    for seen in generations.values() {
        seen.replay(&parts.controller, &mut count)?;
    }
    let Count { recomputed, out_of_reach } = count;
    if recomputed == 0 {
        return Err(anyhow!("the record holds nothing that could be replayed: neither the controller's start nor a snapshot of it with what followed").into());
    }
    let names: Vec<_> = segments.iter().map(|path| name(path)).collect();
    let rest = match out_of_reach {
        0 => String::new(),
        some => format!("; {some} more lie before the first snapshot of the controller, or behind a gap"),
    };
    say(format_args!(
        "{}: {recomputed} StepCommands recomputed, all bit for bit as recorded{rest}",
        names.join(", ")
    ));
    Ok(Outcome::Done)
}

impl Seen {
    fn note(&mut self, message: &AnyMessage) -> Result<(), postcard::Error> {
        match message {
            AnyMessage::Feedback(m) => _ = self.feedback.insert(m.header.cycle, m.body),
            AnyMessage::Reference(m) => _ = self.reference.insert(m.header.cycle, m.body),
            AnyMessage::ControlStatus(m) => _ = self.status.insert(m.header.cycle, m.body),
            AnyMessage::StepCommand(m) => _ = self.commands.insert(m.header.cycle, m.body),
            AnyMessage::OperatorCommand(m) => _ = self.orders.insert(m.body.id, m.body),
            AnyMessage::ControllerSnapshot(m) => {
                let whole = self.reader.take(&m.body)?;
                self.snapshots.extend(whole.map(|snapshot| (snapshot.before_cycle, snapshot)));
            }
            _ => {}
        }
        Ok(())
    }

    /// Recomputes all commands that can be. ControlStatus k says which inputs the controller had in cycle k.
    fn replay(&self, part: &ControllerPart, count: &mut Count) -> Result<()> {
        let mut controller: Option<ControllerRole> = None;
        let mut expected_cycle = None;
        for (&cycle, status) in &self.status {
            if expected_cycle.is_some_and(|expected| expected != cycle) && self.ran_before(cycle) {
                controller = None;
            }
            expected_cycle = Some(cycle + 1);
            controller = match (controller.take(), self.snapshots.get(&cycle)) {
                (Some(controller), _) => Some(controller),
                (None, Some(snapshot)) => Some(ControllerRole::resumed(part, snapshot)),
                // Without processes there are no snapshots, and no need of them.
                (None, None) if cycle == 0 && self.snapshots.is_empty() => Some(ControllerRole::new(part)),
                (None, None) => None,
            };
            let Some(running) = &mut controller else {
                count.out_of_reach += 1;
                continue;
            };
            match self.inputs(cycle, status, running.operator_id()) {
                Some((feedback, reference, order)) => {
                    let output = running.step(cycle, feedback, reference, order.as_ref());
                    compare("ControlStatus", cycle, &output.status, status)?;
                    if let Some(recorded) = self.commands.get(&(cycle + 1)) {
                        compare("StepCommand", cycle + 1, &output.command, recorded)?;
                        count.recomputed += 1;
                    }
                }
                None => {
                    controller = None;
                    count.out_of_reach += 1;
                }
            }
        }
        Ok(())
    }

    /// What the controller had in a cycle; `None` where the record lacks some of it.
    fn inputs(&self, cycle: u64, status: &ControlStatus, order_id: u64) -> Option<Inputs<'_>> {
        let feedback = input(&self.feedback, cycle, status.feedback_silent_cycles == 0)?;
        let reference = input(&self.reference, cycle + 2, status.reference_silent_cycles == 0)?;
        let had_order = status.operator_id != order_id;
        // One that came straight to the controller was on no bus; its id says what it was.
        let order = if had_order && !status.operator_id.is_multiple_of(ORDER_ID_STEP) {
            Some(straight_disarm(status.operator_id))
        } else {
            input(&self.orders, status.operator_id, had_order)?.copied()
        };
        Some((feedback, reference, order))
    }

    /// Whether the controller ran in the cycle before, though its ControlStatus is not in the record. A cycle that it
    /// skipped has no command either.
    fn ran_before(&self, cycle: u64) -> bool {
        self.commands.contains_key(&cycle)
    }
}

/// Feedback, Reference and an order.
type Inputs<'a> = (Option<&'a Feedback>, Option<&'a Reference>, Option<OperatorCommand>);

/// A message that the controller had or had not; `None` where it had one that the record lacks.
fn input<B>(all: &BTreeMap<u64, B>, key: u64, had: bool) -> Option<Option<&B>> {
    if had { all.get(&key).map(Some) } else { Some(None) }
}

fn compare<B: Body>(what: &str, cycle: u64, recomputed: &B, recorded: &B) -> Result<()> {
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
