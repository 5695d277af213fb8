//! The live view: how late a page draws what was published, what the scope costs, and whether the loop notices it.

mod browser;
mod client;
mod instance;
mod turns;
mod usage;

use crate::output::{Results, Sheet, digits};
use crate::programs::Workplace;
use anyhow::{Context, Result};
use browser::Browser;
use instance::Instance;
use serde_json::{Value, json};
use std::thread::sleep;
use std::time::{Duration, Instant};
use turns::{show, take_turns, work_in_cycles};
use usage::Usage;

/// Ten signals of four messages.
const SIGNALS: [&str; 10] = [
    "reference.angle_rad",
    "reference.speed_rad_per_s",
    "feedback.angle_rad",
    "feedback.pulse_rate_hz",
    "feedback.pressure_drop_pa",
    "control_status.following_error_rad",
    "control_status.friction_estimate_nm",
    "control_status.torque_reserve_nm",
    "control_status.state",
    "step_command.position_unrounded",
];
/// Before anything is counted: the page compiles its scripts, the history fills.
const WARM_UP: Duration = Duration::from_secs(35);
/// How often memory is looked at.
const LOOK: Duration = Duration::from_secs(5);

/// How long.
#[derive(Debug, Clone, clap::Args)]
pub struct Arguments {
    /// How long a page is watched, in s
    #[arg(long, value_name = "SECONDS", default_value_t = 120, value_parser = clap::value_parser!(u64).range(10..=100_000))]
    seconds: u64,
    /// How long the loop runs with and without a scope, in s, each
    #[arg(long, value_name = "SECONDS", default_value_t = 20, value_parser = clap::value_parser!(u64).range(2..=10_000))]
    turn: u64,
    /// How often these turns are taken
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    rounds: u64,
}

/// Runs it.
///
/// # Errors
/// Where a program is missing or fails.
pub fn run(arguments: &Arguments, quick: bool) -> Result<Results> {
    let workplace = Workplace::new()?;
    let instance = Instance::start(&workplace)?;
    let seconds = if quick { 10 } else { arguments.seconds };
    let (page, page_data) = watch_page(&instance, seconds, quick)?;
    let (turn, rounds) = if quick { (3, 1) } else { (arguments.turn, arguments.rounds) };
    let taken = take_turns(&instance, Duration::from_secs(turn), rounds)?;
    let record = instance.record();
    let scheduling = instance.end()?;
    let (turns, turns_data) = show(&taken, &work_in_cycles(&record, &taken)?, turn);
    Ok(Results {
        command: "scope",
        quick,
        machine: realtime::machine_facts(),
        scheduling,
        sheets: vec![page, turns],
        data: json!({ "page": page_data, "turns": turns_data }),
    })
}

/// A page with ten signals in a browser.
fn watch_page(instance: &Instance<'_>, seconds: u64, quick: bool) -> Result<(Sheet, Value)> {
    let scope = instance.scope(&[])?;
    let mut browser = Browser::open(&scope.page)?;
    browser.evaluate(&format!("scope.picker.names = {}; scope.picker.choose(); 0", json!(SIGNALS)))?;
    sleep(if quick { Duration::from_secs(3) } else { WARM_UP });
    browser.evaluate("scope.latencies.length = 0; scope.measure(); 0")?;
    let before = Usage::of(scope.pid())?;
    let skipped_before = instance.counts()?.skipped;
    let begun = Instant::now();
    let mut most_kb = before.resident_kb;
    while begun.elapsed() < Duration::from_secs(seconds) {
        sleep(LOOK.min(Duration::from_secs(seconds)));
        most_kb = most_kb.max(Usage::of(scope.pid())?.resident_kb);
    }
    let after = Usage::of(scope.pid())?;
    let found = browser.evaluate("JSON.stringify(scope.measured())")?;
    let found: Value =
        serde_json::from_str(found.as_str().unwrap_or("{}")).context("what the page measured")?;
    let skipped = instance.counts()?.skipped - skipped_before;
    let cpu_percent = 100.0 * (after.cpu_s - before.cpu_s) / begun.elapsed().as_secs_f64();
    let growth_mb = (most_kb as f64 - before.resident_kb as f64) / 1024.0;
    let number = |key: &str| found.get(key).and_then(Value::as_f64).map_or("unknown".to_owned(), digits);
    let count = |key: &str| {
        found.get(key).and_then(Value::as_i64).map_or("unknown".to_owned(), |count| count.to_string())
    };
    let title = format!("a page with ten signals of a 1 kHz loop in headless Chromium, {seconds} s");
    let mut sheet = Sheet::new("scope-page", title, &["quantity", "measured", "bar"]);
    let mut row = |name: &str, measured: String, bar: &str| {
        sheet.row([name.to_owned(), measured, bar.to_owned()]);
    };
    row("published to drawn, median, ms", number("median_ms"), "20");
    row("the same, 99 %, ms", number("p99_ms"), "100");
    row("frames drawn", count("drawn"), "");
    row("rows received, over four messages", count("rows"), "");
    row("messages lost on the bus, counted", count("lost"), "");
    row("rows not sent to the page, counted", count("dropped"), "");
    row("cycles with neither row nor counted loss", count("unaccounted"), "those skipped");
    row("cycles that the loop's processes skipped", skipped.to_string(), "");
    row("scope's processor time, % of a core", digits(cpu_percent), "10");
    row("scope's resident memory, MB", digits(after.resident_kb as f64 / 1024.0), "");
    row("its largest growth meanwhile, MB", digits(growth_mb), "10");
    let data =
        json!({ "page": found, "cpu_percent": cpu_percent, "growth_mb": growth_mb, "skipped": skipped });
    Ok((sheet, data))
}
