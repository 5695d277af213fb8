//! A bus client: prints the Feedback of a running instance, ten lines a second, until the instance ends.
//! `cargo run --release --package supervisor --example print_feedback -- INSTANCE`
//!
//! It only reads, from a buffer of its own, and never waits for the loop nor the loop for it. A reader that falls behind
//! loses the oldest messages and counts them. Every service has room for a few readers beside the loop's own; as this
//! program is one of them, run it as the instance's user.

use signal_bus::{Bus, CycleReader};
use signals::{Feedback, Source, validity};
use std::error::Error;
use std::time::Duration;
use supervisor::{InstanceName, Whereabouts, base_path, instance_folder, whereabouts};

/// Between two lines.
const INTERVAL: Duration = Duration::from_millis(100);

fn main() -> Result<(), Box<dyn Error>> {
    let name: InstanceName = std::env::args().nth(1).ok_or("usage: print_feedback INSTANCE")?.parse()?;
    let folder = instance_folder(&base_path(), &name);
    // A restart makes a new generation, with services of its own: then the client attaches again.
    while let Ok(place) = whereabouts(&folder) {
        print_generation(&place, || whereabouts(&folder).is_ok_and(|now| now == place))?;
    }
    println!("{name}: not running");
    Ok(())
}

/// Prints what one generation's plant side says, as long as it is there.
fn print_generation(place: &Whereabouts, is_there: impl Fn() -> bool) -> Result<(), Box<dyn Error>> {
    let bus = Bus::open(&place.place, place.generation)?;
    let mut feedback: CycleReader<Feedback> = bus.cycle_reader(Source::Plant)?;
    let mut last_cycle = None;
    while is_there() {
        // The newest message that passed its check: schema, CRC, sender, generation, range of each field.
        if let Some(message) = feedback.latest().filter(|message| Some(message.header.cycle) != last_cycle) {
            last_cycle = Some(message.header.cycle);
            println!("{}", line(message.header.cycle, &message.body));
        }
        std::thread::sleep(INTERVAL);
    }
    Ok(())
}

fn line(cycle: u64, feedback: &Feedback) -> String {
    let Feedback { angle_rad, accepted_microsteps, pulse_rate_hz, .. } = feedback;
    let angle_from = if feedback.validity & validity::ENCODER != 0 { "encoder" } else { "command" };
    let stopped = if feedback.validity & validity::STOPPED_ITSELF != 0 { ", stopped by itself" } else { "" };
    format!(
        "cycle {cycle}: angle {angle_rad:.5} rad ({angle_from}), command {accepted_microsteps} micro-steps, \
         {pulse_rate_hz:.0} Hz{stopped}"
    )
}
