//! The payloads of a record by cycle, and the first cycle in which a message came too late for the process that wanted it.

use recording::{AnyMessage, read_record};
use signals::{Body, Header, Source};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// From the time that a message is stamped with until every reader can see it, ns, at the most.
const ON_THE_WAY_NS: u64 = 20_000;

/// The bits of each loop message, by cycle.
#[derive(Debug, Default)]
pub struct Payloads {
    /// References by n.
    pub reference: BTreeMap<u64, Vec<u64>>,
    /// StepCommands by n.
    pub command: BTreeMap<u64, Vec<u64>>,
    /// Feedbacks by k.
    pub feedback: BTreeMap<u64, Vec<u64>>,
    /// The first cycle in which a message was not there in time; the end of the run if there is none. In real time only.
    pub first_late_cycle: u64,
    /// All of them.
    pub late_cycles: BTreeSet<u64>,
}

/// When messages were sent, and when processes woke, by cycle, in ns.
#[derive(Default)]
struct Times {
    reference: BTreeMap<u64, u64>,
    command: BTreeMap<u64, u64>,
    feedback: BTreeMap<u64, u64>,
    status: BTreeMap<u64, u64>,
    woke: BTreeMap<(Source, u64), u64>,
}

/// Reads a record.
///
/// # Panics
/// Where it can't be read.
pub fn payloads(record: &Path) -> Payloads {
    let mut payloads = Payloads::default();
    let mut times = Times::default();
    read_record(&[record], |message| match message {
        AnyMessage::Reference(m) => note(&m.header, &m.body, &mut payloads.reference, &mut times.reference),
        AnyMessage::StepCommand(m) => note(&m.header, &m.body, &mut payloads.command, &mut times.command),
        AnyMessage::Feedback(m) => note(&m.header, &m.body, &mut payloads.feedback, &mut times.feedback),
        AnyMessage::ControlStatus(m) => _ = times.status.insert(m.header.cycle, m.header.monotonic_ns),
        AnyMessage::LoopTiming(source, m) => {
            let woke_ns = m.body.deadline_ns + m.body.wake_up_latency_ns;
            times.woke.insert((*source, m.header.cycle), woke_ns);
        }
        _ => {}
    })
    .unwrap();
    let end = payloads.feedback.keys().next_back().map_or(0, |last| last + 1);
    payloads.late_cycles = (0..end).filter(|cycle| times.late(*cycle)).collect();
    payloads.first_late_cycle = payloads.late_cycles.first().copied().unwrap_or(end);
    payloads
}

fn note<B: Body>(
    header: &Header,
    body: &B,
    words: &mut BTreeMap<u64, Vec<u64>>,
    times: &mut BTreeMap<u64, u64>,
) {
    let mut bits = Vec::new();
    body.each_word(|word| bits.push(word));
    words.insert(header.cycle, bits);
    times.insert(header.cycle, header.monotonic_ns);
}

impl Times {
    /// Whether a process did without a message that belongs to this cycle.
    fn late(&self, cycle: u64) -> bool {
        let in_time = |sent: Option<&u64>, reader: Source| match (sent, self.woke.get(&(reader, cycle))) {
            (Some(sent_ns), Some(woke_ns)) => sent_ns + ON_THE_WAY_NS < *woke_ns,
            _ => false,
        };
        let from_before = cycle == 0
            || in_time(self.status.get(&(cycle - 1)), Source::Trajectory)
                && in_time(self.command.get(&cycle), Source::Plant);
        !(from_before
            && in_time(self.feedback.get(&cycle), Source::Trajectory)
            && in_time(self.feedback.get(&cycle), Source::Controller)
            && in_time(self.reference.get(&(cycle + 2)), Source::Controller))
    }
}
