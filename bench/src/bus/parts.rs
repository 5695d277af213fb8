//! What our side of a round trip takes by itself, in one thread and hot caches: stamps, seals, checks.

use super::{BACK_WORDS, THERE_WORDS};
use crate::output::{Sheet, digits};
use anyhow::{Result, ensure};
use realtime::now_ns;
use serde_json::{Value, json};
use signals::{Expectation, Feedback, Header, Message, Source, StepCommand, check};
use std::hint::black_box;

const GENERATION: u64 = 1;

/// Each part `times` over.
///
/// # Errors
/// Where a sealed message fails its own check.
pub fn run(times: u64) -> Result<(Sheet, Value)> {
    let command = Header::new::<StepCommand>(Source::Controller, GENERATION, 1, 1, now_ns());
    let feedback = Header::new::<Feedback>(Source::Plant, GENERATION, 1, 1, now_ns());
    let from = |source| Expectation { source, generation: GENERATION };
    let sealed_command = Message::seal(command, StepCommand::default());
    let sealed_feedback = Message::seal(feedback, Feedback::default());
    let good = check(&sealed_command, &from(Source::Controller)).is_ok()
        && check(&sealed_feedback, &from(Source::Plant)).is_ok();
    ensure!(good, "a message that was sealed fails its own check");
    let parts = [
        ("two time stamps".to_owned(), 2.0 * each_ns(times, now_ns)),
        (
            format!("seal {} and {} bytes", THERE_WORDS * 8, BACK_WORDS * 8),
            each_ns(times, || Message::seal(black_box(command), black_box(StepCommand::default())))
                + each_ns(times, || Message::seal(black_box(feedback), black_box(Feedback::default()))),
        ),
        (
            "check both".to_owned(),
            each_ns(times, || check(black_box(&sealed_command), &from(Source::Controller)))
                + each_ns(times, || check(black_box(&sealed_feedback), &from(Source::Plant))),
        ),
    ];
    let title = "What a round trip over the loop's bus takes beyond iceoryx2 in one thread, caches hot, µs";
    let mut sheet = Sheet::new("bus-parts", title.to_owned(), &["part", "µs"]);
    for (name, ns) in &parts {
        sheet.row([name.clone(), digits(ns / 1e3)]);
    }
    let sum: f64 = parts.iter().map(|(_, ns)| ns).sum();
    sheet.row(["together".to_owned(), digits(sum / 1e3)]);
    Ok((sheet, json!(parts.iter().map(|(name, ns)| json!({"part": name, "ns": ns})).collect::<Vec<_>>())))
}

/// The mean time of one call, ns.
fn each_ns<T>(times: u64, mut call: impl FnMut() -> T) -> f64 {
    let begun = now_ns();
    for _ in 0..times {
        black_box(call());
    }
    (now_ns() - begun) as f64 / times as f64
}
