//! A position of 32 bits that wraps, as a count that doesn't: right while it moves less than half the range between two readings.

/// A position that is followed round its wraps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counter {
    count: i64,
    wire: i32,
}

impl Counter {
    /// Begins where the wire says `wire`, and counts that as `count`.
    pub fn begin(wire: i32, count: i64) -> Self {
        Self { count, wire }
    }

    /// Takes a reading: the nearer way round.
    pub fn follow(&mut self, wire: i32) -> i64 {
        self.count += i64::from(wire.wrapping_sub(self.wire));
        self.wire = wire;
        self.count
    }

    /// The count at the last reading.
    pub fn count(&self) -> i64 {
        self.count
    }

    /// What the wire says at a count.
    pub fn to_wire(&self, count: i64) -> i32 {
        let way = count.wrapping_sub(self.count);
        // The wire's 32 bits are the count's lowest ones, apart from where it began.
        self.wire.wrapping_add(way as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_walk_round_the_wraps_is_followed(
            wire: i32,
            start in -1_i64 << 50..1 << 50,
            ways in prop::collection::vec(-0x4000_0000_i64..0x4000_0000, 1..50),
        ) {
            let mut counter = Counter::begin(wire, start);
            let mut count = start;
            for way in ways {
                count += way;
                prop_assert_eq!(counter.follow(counter.to_wire(count)), count);
            }
        }
    }

    #[test]
    fn both_wraps_while_turning() {
        for direction in [1_i64, -1] {
            let edge = if direction > 0 { i32::MAX } else { i32::MIN };
            let mut counter = Counter::begin(edge, 0);
            let wires: Vec<i32> =
                (1..=3).map(|step| edge.wrapping_add((step * 600 * direction) as i32)).collect();
            let counts: Vec<i64> = wires.iter().map(|wire| counter.follow(*wire)).collect();
            assert_eq!(counts, [600 * direction, 1200 * direction, 1800 * direction]);
        }
    }
}
