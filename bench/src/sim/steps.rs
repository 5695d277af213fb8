//! What a cycle costs in each role: every step timed by itself.

use crate::output::{Sheet, digits};
use crate::scenario::Variant;
use anyhow::{Result, anyhow};
use closed_loop::{ControllerRole, PlantRole, TrajectoryRole};
use hdrhistogram::Histogram;
use realtime::now_ns;
use serde_json::{Value, json};

/// Times so many cycles. What reading the clock costs is measured first and stands in the table by itself.
///
/// # Errors
/// Where the scenario is refused.
pub fn run(cycles: u64) -> Result<(Sheet, Value)> {
    let parts = Variant::of_1khz(cycles).parts()?;
    let mut plant = PlantRole::new(parts.plant.clone());
    let mut trajectory = TrajectoryRole::new(parts.trajectory.clone());
    let mut controller = ControllerRole::new(&parts.controller);
    let mut times = [histogram()?, histogram()?, histogram()?, histogram()?, histogram()?];
    let (mut command, mut status) = (None, None);
    for cycle in 0..=parts.timeline.last_cycle {
        let begun = now_ns();
        let nothing = now_ns();
        let sample = plant.sample(cycle);
        let generating = now_ns();
        let reference = trajectory.step(cycle, Some(&sample.feedback), status.as_ref(), None);
        let controlling = now_ns();
        let output = controller.step(cycle, Some(&sample.feedback), Some(&reference), None);
        let moving = now_ns();
        plant.advance(cycle, command.as_ref());
        let end = now_ns();
        command = Some(output.command);
        status = Some(output.status);
        let clock_ns = nothing - begun;
        let plant_ns = (generating - nothing) + (end - moving);
        let spent = [clock_ns, controlling - generating, moving - controlling, plant_ns, end - nothing];
        times.iter_mut().zip(spent).for_each(|(histogram, ns)| histogram.saturating_record(ns));
    }
    Ok(table(&times, parts.timeline.last_cycle + 1))
}

fn table(times: &[Histogram<u64>; 5], cycles: u64) -> (Sheet, Value) {
    let names = [
        "reading the clock (in every line below)",
        "trajectory generator",
        "step controller",
        "plant simulator",
        "all three",
    ];
    let header = ["step", "median, ns", "mean, ns", "99 %", "99.9 %", "largest, ns"];
    let title =
        format!("What {cycles} cycles cost, each step timed; the largest are interruptions by the machine");
    let mut sheet = Sheet::new("sim-steps", title, &header);
    let mut data = serde_json::Map::new();
    for (name, histogram) in names.into_iter().zip(times) {
        let [median, p99, p999] = [0.5, 0.99, 0.999].map(|part| histogram.value_at_quantile(part));
        let numbers = [median as f64, histogram.mean(), p99 as f64, p999 as f64, histogram.max() as f64];
        sheet.row([name.to_owned()].into_iter().chain(numbers.map(digits)));
        let [median, mean, p99, p999, max] = numbers;
        data.insert(
            name.to_owned(),
            json!({"p50_ns": median, "mean_ns": mean, "p99_ns": p99, "p999_ns": p999, "max_ns": max}),
        );
    }
    (sheet, Value::Object(data))
}

fn histogram() -> Result<Histogram<u64>> {
    Histogram::new_with_bounds(1, 100_000_000_000, 3).map_err(|error| anyhow!("histogram: {error}"))
}
