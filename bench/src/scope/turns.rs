//! The loop with and without a scope beside it, in turns of one run.

use super::SIGNALS;
use super::client::Client;
use super::instance::{Counts, Instance, Scope};
use crate::output::{Sheet, digits};
use anyhow::{Context, Result};
use log_data::quantile;
use recording::{AnyMessage, read_record};
use serde_json::{Value, json};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// What the loop is beside in a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Beside {
    Nothing,
    Client,
    StoppedClient,
    StoppedScope,
}

impl Beside {
    const ALL: [Self; 4] = [Self::Nothing, Self::Client, Self::StoppedClient, Self::StoppedScope];

    fn name(self) -> &'static str {
        match self {
            Self::Nothing => "no scope",
            Self::Client => "a scope and a client that reads",
            Self::StoppedClient => "a scope and a client that does not read",
            Self::StoppedScope => "a scope that was stopped (SIGSTOP)",
        }
    }
}

/// A turn: when it was, by the clock of the loop's deadlines, and what the loop counted in it.
pub(super) struct Turn {
    beside: Beside,
    at_ns: Range<u64>,
    counts: Counts,
}

/// Takes them. Coming and going of the scope is part of its turns.
///
/// # Errors
/// Where a program fails.
pub(super) fn take_turns(instance: &Instance<'_>, length: Duration, rounds: u64) -> Result<Vec<Turn>> {
    let mut turns = Vec::new();
    for round in 0..rounds as usize {
        let mut order = Beside::ALL;
        // Another order each time: none is always behind the same neighbour.
        order.rotate_left(round % Beside::ALL.len());
        for beside in order {
            let begin_ns = realtime::now_ns();
            let counts = take_turn(instance, beside, length)?;
            turns.push(Turn { beside, at_ns: begin_ns..realtime::now_ns(), counts });
        }
    }
    Ok(turns)
}

fn take_turn(instance: &Instance<'_>, beside: Beside, length: Duration) -> Result<Counts> {
    let before = instance.counts()?;
    let begun = Instant::now();
    let watched: Option<(Scope, Client)> = match beside {
        Beside::Nothing => None,
        _ => {
            let scope = instance.scope(&[])?;
            let client = Client::connect(&scope.page, &SIGNALS, !matches!(beside, Beside::StoppedClient))?;
            Some((scope, client))
        }
    };
    if let (Beside::StoppedScope, Some((scope, _))) = (beside, &watched) {
        sleep(length / 4);
        scope.stop()?;
    }
    sleep(length.saturating_sub(begun.elapsed()));
    if let Some((scope, client)) = watched {
        scope.go_on()?;
        drop(scope);
        client.end();
    }
    Ok(instance.counts()?.since(&before))
}

/// The times that the loop's processes spent in their cycles, sleep and waking left out, as the record has them: ascending, in ns, for each
/// of [`Beside::ALL`].
///
/// # Errors
/// Where the record can't be read.
pub(super) fn work_in_cycles(record: &Path, turns: &[Turn]) -> Result<Vec<Vec<u64>>> {
    let mut work = vec![Vec::new(); Beside::ALL.len()];
    let report = read_record(&segments(record)?, |message| {
        let AnyMessage::LoopTiming(_, message) = message else { return };
        let timing = &message.body;
        let Some(turn) = turns.iter().find(|turn| turn.at_ns.contains(&timing.deadline_ns)) else { return };
        if let Some(work) = work.get_mut(turn.beside as usize) {
            work.push(timing.read_ns + timing.step_ns + timing.write_ns);
        }
    });
    report.context("the record")?;
    work.iter_mut().for_each(|work| work.sort_unstable());
    Ok(work)
}

fn segments(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
    let mut found = entries.collect::<Result<Vec<_>>>()?;
    found.retain(|path| path.extension().is_some_and(|kind| kind == "mcap"));
    found.sort();
    Ok(found)
}

/// The table.
pub(super) fn show(turns: &[Turn], work: &[Vec<u64>], length: u64) -> (Sheet, Value) {
    let rounds = turns.len() / Beside::ALL.len();
    let title = format!("the loop's three processes, {rounds} turns of {length} s each");
    let header = [
        "the loop is beside",
        "overruns, by turn",
        "cycles skipped, by turn",
        "messages missed in the loop",
        "work in a cycle, median, µs",
        "99.9 %",
        "longest",
    ];
    let mut sheet = Sheet::new("scope-turns", title, &header);
    let mut data = Vec::new();
    for (beside, work) in Beside::ALL.into_iter().zip(work) {
        let mine: Vec<_> =
            turns.iter().filter(|turn| turn.beside == beside).map(|turn| turn.counts).collect();
        let each = |part: fn(&Counts) -> u64| mine.iter().map(part).collect::<Vec<_>>();
        let (overruns, skipped, missed) =
            (each(|one| one.overruns), each(|one| one.skipped), each(|one| one.missed));
        let work_us = [0.5, 0.999, 1.0].map(|share| quantile_us(work, share));
        let mut cells = vec![
            beside.name().to_owned(),
            by_turn(&overruns),
            by_turn(&skipped),
            missed.iter().sum::<u64>().to_string(),
        ];
        cells.extend(work_us.map(|us| us.map_or("unknown".to_owned(), digits)));
        sheet.row(cells);
        data.push(json!({
            "beside": beside.name(), "overruns": overruns, "skipped": skipped, "missed": missed,
            "cycles": work.len(), "work_us": work_us,
        }));
    }
    (sheet, Value::Array(data))
}

fn by_turn(counts: &[u64]) -> String {
    let each: Vec<_> = counts.iter().map(u64::to_string).collect();
    format!("{} ({})", counts.iter().sum::<u64>(), each.join(" "))
}

/// A quantile of what is ascending, in µs.
fn quantile_us(ascending: &[u64], share: f64) -> Option<f64> {
    quantile(ascending, share).map(|ns| ns as f64 / 1e3)
}
