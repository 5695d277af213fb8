//! The faults of a drive's bus, and how they are drawn.

use super::SILENCE_CYCLES;
use injection::SplitSeed;

/// What goes wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Trouble {
    /// At the drive or on its cable: the line that its process knows, and how long it lasts, ms.
    Far { line: String, ms: u64 },
    /// The drive takes so many cycles from switched on to operation enabled.
    Enabling(u64),
    /// The bridge's interface is down for so long, ms.
    Link(u64),
    /// The bridge's process is stopped for so long, ms.
    Paused(u64),
    /// The bridge's process is killed.
    Killed,
}

/// A fault to try.
#[derive(Debug, Clone)]
pub(super) struct Fault {
    /// For the table.
    pub(super) kind: String,
    pub(super) trouble: Trouble,
    /// Whether the valve has to be stopped for it.
    pub(super) must_stop: bool,
    /// Cycles from the fault to the ramp's first, at most.
    pub(super) ramp_by: u64,
}

impl Fault {
    /// Whether it is tried on the way to current, not in motion.
    pub(super) fn while_arming(&self) -> bool {
        matches!(self.trouble, Trouble::Enabling(_))
    }
}

/// From an outage to the ramp, cycles: the drive's own watchdog, which waits one cycle more than the bridge; the frame that was
/// under way; the SYNC0 at which a ramp begins.
const OUTAGE: u64 = SILENCE_CYCLES + 3;
/// From a state of the drive's to the ramp: latched at SYNC0, told with the next frame, answered with the one after, obeyed at the
/// next SYNC0.
const TOLD: u64 = 4;
/// From a leap of the clock: ten cycles off it, and the same.
const OFF_THE_CLOCK: u64 = 10 + TOLD;

/// Draws one.
pub(super) fn draw(details: &mut SplitSeed) -> Fault {
    match details.whole(0, 14) {
        0..3 => line(details),
        3 => {
            for_ms(details, "cable out", |ms| Trouble::Far { line: format!("cable {}", ms * 1_000_000), ms })
        }
        4 => {
            let power = |ms: u64| Trouble::Far { line: format!("power {}", ms * 1_000_000), ms };
            // What had power again at once forgot its state all the same.
            Fault { must_stop: true, ..for_ms(details, "power off", power) }
        }
        5 => for_ms(details, "link down", Trouble::Link),
        6 => for_ms(details, "bridge stopped", Trouble::Paused),
        7 => Fault {
            kind: "bridge killed".to_owned(),
            trouble: Trouble::Killed,
            must_stop: true,
            ramp_by: OUTAGE,
        },
        8 => {
            let code = details.one(&[0x1A, 0x1B, 0x2C, 0x32], 0x1B);
            told("AL state falls back", format!("al-fall {code:#x}"))
        }
        9 => {
            let code = details.one(&[0x2310, 0x3220, 0x8611, 0x7500], 0x2310);
            told("fault of the drive", format!("drive-fault {code:#x}"))
        }
        10 => told("bit 12 missing", format!("no-following {}", details.whole(1, 50))),
        11 => told(
            "mode display not 8",
            format!("mode {} {}", details.one(&[0, 1, 6, 9], 6), details.whole(1, 20)),
        ),
        12 => {
            let jump = details.one(&[-450_000_i64, -300_000, 300_000, 450_000], 300_000);
            Fault { ramp_by: OFF_THE_CLOCK, ..told("clock leaps", format!("clock-jump {jump}")) }
        }
        _ => {
            let cycles = details.one(&[100, 500, 1_000_000], 100);
            let never = cycles == 1_000_000;
            Fault {
                kind: if never { "current never comes" } else { "current comes late" }.to_owned(),
                trouble: Trouble::Enabling(cycles),
                must_stop: never,
                ramp_by: 0,
            }
        }
    }
}

/// Frames that go wrong on their way.
fn line(details: &mut SplitSeed) -> Fault {
    let count = details.one(&[1, 2, 5, 15, 25], 1);
    let delay = details.one(&["delay 1000000", "delay 5000000", "delay 40000000"], "delay 1000000");
    let names = [
        ("requests dropped", "drop-request"),
        ("replies dropped", "drop-reply"),
        ("replies late", delay),
        ("replies twice", "duplicate"),
        ("replies out of order", "reorder"),
        ("replies cut", "truncate"),
        ("garbage for replies", "garbage"),
        ("foreign frames", "foreign"),
        ("working counter wrong", "working-counter"),
    ];
    let (kind, name) = details.one(&names, ("replies dropped", "drop-reply"));
    let harmless = matches!(name, "duplicate" | "foreign" | "reorder");
    Fault {
        kind: kind.to_owned(),
        trouble: Trouble::Far { line: format!("{name} {count}"), ms: count },
        must_stop: count > SILENCE_CYCLES && !harmless,
        ramp_by: OUTAGE,
    }
}

/// An outage of some length.
fn for_ms(details: &mut SplitSeed, kind: &str, trouble: impl Fn(u64) -> Trouble) -> Fault {
    let ms = details.one(&[1, 5, 100, 100, 1000], 100);
    Fault {
        kind: format!("{kind} for {ms} ms"),
        trouble: trouble(ms),
        must_stop: ms > 2 * SILENCE_CYCLES,
        ramp_by: OUTAGE,
    }
}

/// Something that the drive tells with its next reply.
fn told(kind: &str, line: String) -> Fault {
    Fault { kind: kind.to_owned(), trouble: Trouble::Far { line, ms: 0 }, must_stop: true, ramp_by: TOLD }
}
