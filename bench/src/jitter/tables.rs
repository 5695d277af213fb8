//! The tables and numbers of `bench jitter`.

use super::measure::{EARLY, Measured, Process, chain_ns};
use super::witness::Seen;
use crate::output::{Sheet, digits, us};
use crate::programs::LOOP;
use serde_json::{Value, json};

/// A stall that a 1 kHz loop feels, ns.
const LONG_STALL_NS: u64 = 100_000;

/// Wake-up latency beside cyclictest's.
pub fn wake_up(all: &[Measured]) -> Sheet {
    let title = "Wake-up latency, µs, the loop (stepvalve) beside cyclictest on the same core with the same \
                 priorities and offsets, in turns; ratio: stepvalve / cyclictest; band: cyclictest's own turns apart; \
                 a wake-up of cyclictest later than 500 µs counts as its thread's latest";
    let header = [
        "load, period, process",
        "p50",
        "p99",
        "p99.9",
        "max",
        "cyclictest p50",
        "p99",
        "p99.9",
        "max",
        "ratio p50",
        "band",
        "ratio p99",
        "band",
    ];
    let mut sheet = Sheet::new("jitter-wake-up", title, &header);
    for measured in all {
        for (index, (name, ours)) in LOOP.iter().zip(&measured.ours).enumerate() {
            let mut row = vec![format!("{}, {}", label(measured), name)];
            row.extend(ours.wake_up.percentiles_ns().map(us));
            match measured.peer_thread(index) {
                Some(peer) => {
                    row.extend(peer.percentiles_ns().map(us));
                    for part in [0.5, 0.99] {
                        let ratio =
                            ours.wake_up.quantile_ns(part) as f64 / peer.quantile_ns(part).max(1) as f64;
                        row.push(format!("{ratio:.2}"));
                        row.push(
                            measured.band(index, part).map_or("–".to_owned(), |band| format!("{band:.2}")),
                        );
                    }
                }
                None => row.extend(["not installed"].into_iter().chain(["–"; 7]).map(str::to_owned)),
            }
            sheet.row(row);
        }
    }
    sheet
}

/// Execution time, missed cycles, allocations and faults.
pub fn execution(all: &[Measured]) -> Sheet {
    let title = "Execution time of each process, µs, and missed cycles (work past the next deadline, or passed over). \
                 \"All three\" is the sum of their quantiles. Allocations: one each message is iceoryx2's own.";
    let header = [
        "load, period, process",
        "p50",
        "p99",
        "p99.9",
        "max",
        "cycles",
        "missed",
        "missed, %",
        "allocations a message",
        "page faults",
    ];
    let mut sheet = Sheet::new("jitter-execution", title, &header);
    for measured in all {
        for (name, ours) in LOOP.iter().zip(&measured.ours) {
            let mut row = vec![format!("{}, {}", label(measured), name)];
            row.extend(ours.execution.percentiles_ns().map(us));
            row.extend([ours.cycles.to_string(), ours.missed.to_string()]);
            row.push(format!("{:.3}", ours.missed_share() * 100.0));
            row.push(digits(ours.allocations as f64 / ours.published.max(1) as f64));
            row.push(ours.page_faults.to_string());
            sheet.row(row);
        }
        let mut row = vec![format!("{}, all three", label(measured))];
        row.extend([0.5, 0.99, 0.999, 1.0].map(|part| us(chain_ns(&measured.ours, part))));
        row.extend(["", "", "", "", ""].map(str::to_owned));
        sheet.row(row);
    }
    sheet
}

/// What it is worth to wake early.
pub fn early(all: &[Measured]) -> Sheet {
    let title = format!(
        "The loop asleep to its deadlines, and awake a {EARLY}th of the period before them (`early` in `[timing]`), in turns: wake-up \
         after the deadline, the worst of the three processes, and execution, the sum of the three; µs"
    );
    let header = [
        "load, period",
        "wake-up p50, asleep",
        "early",
        "p99, asleep",
        "early",
        "p99.9, asleep",
        "early",
        "execution p50, asleep",
        "early",
        "p99, asleep",
        "early",
    ];
    let mut sheet = Sheet::new("jitter-early", title, &header);
    for measured in all {
        let worst = |processes: &[Process], part: f64| {
            processes.iter().map(|process| process.wake_up.quantile_ns(part)).max().unwrap_or(0)
        };
        let mut row = vec![label(measured)];
        for part in [0.5, 0.99, 0.999] {
            row.extend([&measured.ours, &measured.early].map(|processes| us(worst(processes, part))));
        }
        for part in [0.5, 0.99] {
            row.extend([&measured.ours, &measured.early].map(|processes| us(chain_ns(processes, part))));
        }
        sheet.row(row);
    }
    sheet
}

/// What the witness of lowest priority saw on the loop's core.
pub fn stalls(all: &[Measured]) -> Sheet {
    let title = "The core standing still while a witness of lowest priority had it (what ran there is subtracted), and \
                 the time that the hypervisor says it stole. A stall beside both is the machine's, not the loop's.";
    let header = [
        "load, period, beside",
        "witness had the core, %",
        "stalls over 100 µs",
        "a minute of its time",
        "longest, µs",
        "stolen, ms",
    ];
    let mut sheet = Sheet::new("jitter-stalls", title, &header);
    for measured in all {
        for (name, seen) in [("the loop", &measured.beside_ours), ("cyclictest", &measured.beside_peer)] {
            if seen.wall_ns == 0 {
                continue;
            }
            let long = seen.stalls.count_over(LONG_STALL_NS);
            let minutes = seen.on_core_ns as f64 / 60e9;
            sheet.row([
                format!("{}, {name}", label(measured)),
                digits(seen.share() * 100.0),
                long.to_string(),
                digits(long as f64 / minutes),
                us(seen.stalls.max_ns()),
                seen.steal_ns.map_or("unknown".to_owned(), |ns| (ns / 1_000_000).to_string()),
            ]);
        }
    }
    sheet
}

/// For machines.
pub fn data(all: &[Measured]) -> Value {
    all.iter().map(one).collect()
}

fn one(measured: &Measured) -> Value {
    let processes: serde_json::Map<_, _> = LOOP
        .iter()
        .zip(&measured.ours)
        .enumerate()
        .map(|(index, (name, ours))| {
            let value = json!({
                "wake_up": ours.wake_up.json(), "execution": ours.execution.json(), "cycles": ours.cycles,
                "missed": ours.missed, "missed_share": ours.missed_share(), "steady_published": ours.published,
                "steady_allocations": ours.allocations, "steady_page_faults": ours.page_faults,
                "cyclictest": measured.peer_thread(index).map(|times| times.json()),
                "cyclictest_band": {"p50": measured.band(index, 0.5), "p99": measured.band(index, 0.99)},
            });
            ((*name).to_owned(), value)
        })
        .collect();
    let early: serde_json::Map<_, _> = LOOP
        .iter()
        .zip(&measured.early)
        .map(|(name, of)| {
            let value = json!({
                "wake_up": of.wake_up.json(), "execution": of.execution.json(), "cycles": of.cycles, "missed": of.missed,
            });
            ((*name).to_owned(), value)
        })
        .collect();
    json!({
        "load": measured.load, "period_ns": measured.period_ns, "scheduling": measured.scheduling,
        "processes": processes,
        "chain_p50_ns": chain_ns(&measured.ours, 0.5), "chain_p99_ns": chain_ns(&measured.ours, 0.99),
        "early": {
            "early_ns": measured.period_ns / EARLY, "processes": early,
            "chain_p50_ns": chain_ns(&measured.early, 0.5), "chain_p99_ns": chain_ns(&measured.early, 0.99),
        },
        "witness": {"loop": seen(&measured.beside_ours), "cyclictest": seen(&measured.beside_peer)},
    })
}

fn seen(seen: &Seen) -> Value {
    json!({
        "wall_ns": seen.wall_ns, "on_core_ns": seen.on_core_ns, "steal_ns": seen.steal_ns,
        "stalls": seen.stalls.json(),
    })
}

/// Load and period in words.
pub fn label(measured: &Measured) -> String {
    let experimental = if measured.period_ns < 250_000 { " (experimental)" } else { "" };
    format!("{}, {} µs{experimental}", measured.load, measured.period_ns / 1000)
}
