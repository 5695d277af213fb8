//! A pulse-train terminal in the manner of Beckhoff's EL2522: continuous position, PDO 0x160B with the target 0x7000:12 as
//! i32, the counter in 0x6020:11; the driver behind it takes pulse and direction.
//!
//! Made from the terminal's published description alone; nobody has compared it with one.

use crate::dictionary::{Access, Dictionary};
use crate::motion::Valve;
use crate::objects::{assign, identity, synchronisation};
use crate::settings::Settings;

/// Objects of the terminal.
pub(crate) fn objects(settings: &Settings) -> Dictionary {
    let mut all = Dictionary::default();
    identity(&mut all, settings, 0x0000_1389);
    synchronisation(&mut all, settings);
    all.add(0x7000, 0x11, Access::Always, [0; 2]);
    all.add(0x7000, 0x12, Access::Always, [0; 4]);
    all.add(0x6000, 0x01, Access::ReadOnly, [0; 2]);
    all.add(0x6020, 0x11, Access::ReadOnly, [0; 4]);
    let pdos: [(u16, &[u32]); 2] =
        [(0x160B, &[0x7000_1110, 0x7000_1220]), (0x1A0B, &[0x6000_0110, 0x6020_1120])];
    for (index, entries) in pdos {
        all.add(index, 0, Access::ReadOnly, [entries.len() as u8]);
        for (sub, entry) in (1..).zip(entries) {
            all.add(index, sub, Access::ReadOnly, entry.to_le_bytes());
        }
    }
    assign(&mut all, 0x1C12, 0x160B);
    assign(&mut all, 0x1C13, 0x1A0B);
    all
}

/// The counter, and the driver that its pulses feed.
#[derive(Debug, Clone)]
pub(crate) struct PulseTrain {
    start: i64,
    demand: i64,
    /// What is added to a position to give what the bus carries.
    zero: i64,
}

impl PulseTrain {
    pub(crate) fn new(settings: &Settings, valve: &Valve) -> Self {
        let demand = valve.microsteps();
        Self { start: demand, demand, zero: settings.zero_offset }
    }

    pub(crate) fn motion(&self) -> (i64, i64) {
        (self.start, self.demand)
    }

    /// SYNC0: pulses to the target within the cycle that begins, while bit 0 of the control says go.
    pub(crate) fn sync(&mut self, objects: &mut Dictionary, fresh: bool) {
        let counter = self.demand + self.zero;
        self.start = self.demand;
        let go = objects.unsigned(0x7000, 0x11) & 1 != 0;
        if go && fresh {
            let target = objects.value(0x7000, 0x12) as i32;
            self.demand += i64::from(target.wrapping_sub(counter as i32));
        }
        objects.set(0x6020, 0x11, counter);
        // Ready; and going.
        objects.set(0x6000, 0x01, 1 | i64::from(go) << 1);
    }

    /// The bus went away: no pulses.
    pub(crate) fn bus_lost(&mut self, objects: &mut Dictionary) {
        objects.set(0x7000, 0x11, 0);
        self.start = self.demand;
    }
}
