//! The controller's state as messages, so that a record can be replayed from its middle.

use signals::ControllerSnapshot;

/// Bytes that a state may have.
const MOST_BYTES: usize = 8192;

/// Time between two snapshots, s.
const EVERY_S: f64 = 1.0;

/// Cycles of `period_s` seconds between two snapshots, where the controller leaves none out.
pub fn snapshot_every_cycles(period_s: f64) -> u64 {
    (EVERY_S / period_s).ceil().max(1.0) as u64
}

/// The controller's state before a cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// The cycle.
    pub before_cycle: u64,
    pub(crate) state: step_control::State,
}

/// A state on its way out, a part in each cycle; no heap.
#[derive(Debug, Clone)]
pub struct SnapshotSender {
    every_cycles: u64,
    bytes: [u8; MOST_BYTES],
    length: usize,
    taken_before_cycle: u64,
    next_part: usize,
}

impl SnapshotSender {
    /// One that has nothing to send yet.
    pub fn new(period_s: f64) -> Self {
        Self {
            every_cycles: snapshot_every_cycles(period_s),
            bytes: [0; MOST_BYTES],
            length: 0,
            taken_before_cycle: 0,
            next_part: 0,
        }
    }

    /// The part to send in cycle `cycle`, before which `state` holds; `None` where the last snapshot has gone out and the next
    /// is not due. The first is due at once.
    pub fn next(&mut self, cycle: u64, state: &step_control::State) -> Option<ControllerSnapshot> {
        let due = self.length == 0 || cycle >= self.taken_before_cycle.saturating_add(self.every_cycles);
        let sent = self.next_part * ControllerSnapshot::PART_BYTES >= self.length;
        if sent && due {
            // A state that does not fit is never sent: a test would miss it.
            self.length = postcard::to_slice(state, &mut self.bytes).map_or(0, |bytes| bytes.len());
            self.taken_before_cycle = cycle;
            self.next_part = 0;
        }
        let parts = self.bytes.get(..self.length)?.chunks(ControllerSnapshot::PART_BYTES);
        let content = parts.into_iter().nth(self.next_part)?;
        let part = self.next_part as u64;
        self.next_part += 1;
        Some(ControllerSnapshot::of(self.taken_before_cycle, self.length as u64, part, content))
    }
}

/// Puts the parts of a snapshot together again.
#[derive(Debug, Clone, Default)]
pub struct SnapshotReader {
    taken_before_cycle: u64,
    bytes: Vec<u8>,
}

impl SnapshotReader {
    /// Takes in the next part: the whole snapshot once it is complete. Parts that don't continue the ones before
    /// are dropped.
    ///
    /// # Errors
    /// Bytes that are no state, as another version of the program writes them.
    pub fn take(&mut self, part: &ControllerSnapshot) -> Result<Option<Snapshot>, postcard::Error> {
        let begins = part.part == 0;
        if begins {
            self.bytes.clear();
            self.taken_before_cycle = part.taken_before_cycle;
        }
        let place = part.part as usize * ControllerSnapshot::PART_BYTES;
        if part.taken_before_cycle != self.taken_before_cycle || self.bytes.len() != place {
            return Ok(None);
        }
        self.bytes.extend_from_slice(&part.content());
        if (self.bytes.len() as u64) < part.bytes {
            return Ok(None);
        }
        self.bytes.truncate(part.bytes as usize);
        let before_cycle = self.taken_before_cycle;
        postcard::from_bytes(&self.bytes).map(|state| Some(Snapshot { before_cycle, state }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_arrives_part_by_part_as_it_was() {
        let state = step_control::State::new(12_345);
        let (mut sender, mut reader) = (SnapshotSender::new(1e-3), SnapshotReader::default());
        let mut arrived = Vec::new();
        for cycle in 7..1100 {
            if let Some(part) = sender.next(cycle, &state) {
                arrived.extend(reader.take(&part).unwrap());
            }
        }
        assert_eq!(arrived, [7, 1007].map(|before_cycle| Snapshot { before_cycle, state }));
    }

    #[test]
    fn a_snapshot_with_a_lost_part_is_dropped() {
        let state = step_control::State::new(1);
        let (mut sender, mut reader) = (SnapshotSender::new(1e-3), SnapshotReader::default());
        let arrived = (0..900).filter_map(|cycle| sender.next(cycle, &state)).skip(1);
        assert!(arrived.map(|part| reader.take(&part).unwrap()).all(|state| state.is_none()));
    }
}
