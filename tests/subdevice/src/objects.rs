//! The objects that a CiA 402 drive begins with (ETG.1000.6 and CiA 402-2).

use crate::dictionary::{Access, Dictionary};
use crate::settings::Settings;

/// All objects, in the drive's units: micro-steps.
pub(crate) fn cia402(settings: &Settings, units_per_revolution: u32) -> Dictionary {
    let mut all = Dictionary::default();
    identity(&mut all, settings, 0x0004_0192);
    synchronisation(&mut all, settings);
    mapping(&mut all);
    use Access::{Always, InPreOp, ReadOnly};
    let fixed: [(u16, u8, Access, &[u8]); 27] = [
        (0x603F, 0, ReadOnly, &[0; 2]),
        (0x6040, 0, Always, &[0; 2]),
        (0x6041, 0, ReadOnly, &[0; 2]),
        (0x605A, 0, Always, &[2, 0]),
        (0x605B, 0, Always, &[1, 0]),
        (0x605C, 0, Always, &[1, 0]),
        (0x605D, 0, Always, &[1, 0]),
        (0x605E, 0, Always, &[2, 0]),
        (0x6060, 0, Always, &[0]),
        (0x6061, 0, ReadOnly, &[0]),
        (0x6062, 0, ReadOnly, &[0; 4]),
        (0x6064, 0, ReadOnly, &[0; 4]),
        (0x6007, 0, Always, &[1, 0]),
        (0x6066, 0, Always, &[100, 0]),
        (0x607A, 0, Always, &[0; 4]),
        (0x607C, 0, Always, &[0; 4]),
        (0x6098, 0, Always, &[35]),
        (0x609A, 0, Always, &[0; 4]),
        (0x60B1, 0, Always, &[0; 4]),
        (0x60B2, 0, Always, &[0; 2]),
        (0x60C2, 0, ReadOnly, &[2]),
        (0x60C2, 1, InPreOp, &[1]),
        (0x60C2, 2, InPreOp, &[0xFD]),
        (0x60F4, 0, ReadOnly, &[0; 4]),
        (0x60FD, 0, ReadOnly, &[0; 4]),
        (0x10F1, 0, ReadOnly, &[2]),
        (0x10F1, 2, Always, &[4, 0]),
    ];
    for (index, sub, access, data) in fixed {
        all.add(index, sub, access, data);
    }
    let numbers: [(u16, u8, Access, u32); 13] = [
        (0x6065, 0, Always, u32::MAX),
        (0x6080, 0, Always, u32::MAX),
        (0x6085, 0, Always, 10_000_000),
        (0x607B, 1, Always, i32::MIN.cast_unsigned()),
        (0x607B, 2, Always, i32::MAX.cast_unsigned()),
        (0x607D, 1, Always, i32::MIN.cast_unsigned()),
        (0x607D, 2, Always, i32::MAX.cast_unsigned()),
        (0x608F, 1, Always, units_per_revolution),
        (0x608F, 2, Always, 1),
        (0x6091, 1, Always, 1),
        (0x6091, 2, Always, 1),
        // Homing, profile position, CSP, CSV, CST, and profile velocity.
        (0x6502, 0, ReadOnly, 0x03A5),
        (0x6099, 1, Always, 1000),
    ];
    for (index, sub, access, value) in numbers {
        all.add(index, sub, access, value.to_le_bytes());
    }
    for (index, count) in [(0x607B, 2), (0x607D, 2), (0x608F, 2), (0x6091, 2)] {
        all.add(index, 0, ReadOnly, [count]);
    }
    for (sub, value) in [(1, units_per_revolution), (2, 1)] {
        all.add(0x6092, sub, Always, value.to_le_bytes());
    }
    all.add(0x6092, 0, ReadOnly, [2]);
    all
}

/// Device type, names, identity.
pub(crate) fn identity(all: &mut Dictionary, settings: &Settings, device_type: u32) {
    let identity = &settings.identity;
    all.add(0x1000, 0, Access::ReadOnly, device_type.to_le_bytes());
    all.add(0x1008, 0, Access::ReadOnly, &identity.name);
    all.add(0x1009, 0, Access::ReadOnly, "1");
    // Longer than a mailbox: read in segments.
    all.add(0x100A, 0, Access::ReadOnly, "simulated firmware ".repeat(20));
    all.add(0x1018, 0, Access::ReadOnly, [4]);
    let numbers = [identity.vendor, identity.product, identity.revision, identity.serial];
    for (sub, value) in (1..).zip(numbers) {
        all.add(0x1018, sub, Access::ReadOnly, value.to_le_bytes());
    }
}

/// Sync managers and what they are synchronised to.
pub(crate) fn synchronisation(all: &mut Dictionary, settings: &Settings) {
    all.add(0x1C00, 0, Access::ReadOnly, [4]);
    for (sub, kind) in (1..).zip([1_u8, 2, 3, 4]) {
        all.add(0x1C00, sub, Access::ReadOnly, [kind]);
    }
    for index in [0x1C32, 0x1C33] {
        all.add(index, 0, Access::ReadOnly, [12]);
        // DC SYNC0.
        all.add(index, 1, Access::InPreOp, 2_u16.to_le_bytes());
        all.add(index, 2, Access::InPreOp, 1_000_000_u32.to_le_bytes());
        all.add(index, 4, Access::ReadOnly, 0x0007_u16.to_le_bytes());
        all.add(index, 5, Access::ReadOnly, settings.minimum_cycle_ns.to_le_bytes());
        all.add(index, 11, Access::ReadOnly, 0_u16.to_le_bytes());
    }
}

/// The default PDOs of a position drive.
fn mapping(all: &mut Dictionary) {
    let outputs = [(0x6040, 16), (0x607A, 32), (0x6060, 8), (0x60B1, 32)];
    let inputs = [(0x6041, 16), (0x6064, 32), (0x6061, 8), (0x603F, 16), (0x60FD, 32), (0x60F4, 32)];
    pdo(all, 0x1600, &outputs);
    pdo(all, 0x1A00, &inputs);
    assign(all, 0x1C12, 0x1600);
    assign(all, 0x1C13, 0x1A00);
}

fn pdo(all: &mut Dictionary, index: u16, entries: &[(u32, u32)]) {
    all.add(index, 0, Access::InPreOp, [entries.len() as u8]);
    for sub in 1..=8_u8 {
        let entry = entries.get(usize::from(sub) - 1).map_or(0, |(object, bits)| object << 16 | bits);
        all.add(index, sub, Access::InPreOp, entry.to_le_bytes());
    }
}

/// Assigns one PDO to a sync manager; three more places are there.
pub(crate) fn assign(all: &mut Dictionary, index: u16, pdo: u16) {
    all.add(index, 0, Access::InPreOp, [1]);
    for sub in 1..=4 {
        all.add(index, sub, Access::InPreOp, if sub == 1 { pdo } else { 0 }.to_le_bytes());
    }
}
