//! Operators' orders as a record holds them, for the oracle.

use oracle::{Judge, Order, Wish};
use recording::AnyMessage;
use signals::{OperatorCommand, OperatorKind, Source};

/// Orders of one start of the processes.
#[derive(Debug, Clone)]
pub struct RecordedOrders {
    period_ns: u64,
    /// Time of cycle 0, ns.
    epoch_ns: u64,
    /// When each was given, and what it says.
    given: Vec<(u64, OperatorCommand)>,
    last_sequence: Option<u64>,
    lost: bool,
}

impl RecordedOrders {
    /// None yet, of a loop with this period.
    pub fn new(period_ns: u64) -> Self {
        Self { period_ns, epoch_ns: u64::MAX, given: Vec::new(), last_sequence: None, lost: false }
    }

    /// Takes note of a message, whatever it is.
    pub fn note(&mut self, message: &AnyMessage) {
        match message {
            AnyMessage::LoopTiming(Source::Plant, m) => {
                let since_ns = m.header.cycle * self.period_ns;
                self.epoch_ns = self.epoch_ns.min(m.body.deadline_ns.saturating_sub(since_ns));
            }
            AnyMessage::OperatorCommand(m) => {
                let next = self.last_sequence.map_or(0, |last| last + 1);
                self.lost |= m.header.sequence != next;
                self.last_sequence = Some(m.header.sequence);
                self.given.push((m.header.monotonic_ns, m.body));
            }
            _ => {}
        }
    }

    /// Time of cycle 0, on CLOCK_MONOTONIC, ns.
    pub fn epoch_ns(&self) -> u64 {
        self.epoch_ns
    }

    /// Hands the orders to the oracle. Where one is missing in the record, it is told so.
    pub fn put_into(&self, judge: &mut Judge) {
        if self.lost {
            judge.orders_unknown();
        }
        for (time_ns, order) in &self.given {
            let wish = match OperatorKind::from_code(order.kind) {
                Some(OperatorKind::Arm | OperatorKind::Home) => Wish::Move,
                Some(OperatorKind::Disarm) => Wish::Stop,
                _ => continue,
            };
            let from_cycle = time_ns.saturating_sub(self.epoch_ns) / self.period_ns;
            judge.order(Order { wish, from_cycle, until_cycle: order.valid_until_cycle });
        }
    }
}
