//! The loop's own bus: a StepCommand there, a Feedback back, as the processes write and read them.

use super::{Carrier, other_side, place};
use crate::programs::Workplace;
use crate::timing::Times;
use anyhow::{Result, ensure};
use realtime::now_ns;
use signal_bus::{Bus, Place};
use signals::{Feedback, Source, StepCommand};
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// How long the other side may take to answer the first time.
const PATIENCE: Duration = Duration::from_secs(10);
const GENERATION: u64 = 1;

pub(super) fn run(folder: &Workplace, trips: u64, times: &mut Times) -> Result<()> {
    let place = place(&folder.path("ours"));
    let result = trip_all(&place, trips, times);
    place.wipe()?;
    result
}

fn trip_all(place: &Place, trips: u64, times: &mut Times) -> Result<()> {
    let bus = Bus::create(place, GENERATION)?;
    let mut there = bus.writer::<StepCommand>(Source::Controller)?;
    let mut back = bus.cycle_reader::<Feedback>(Source::Plant)?;
    let mut echo = other_side(Carrier::Ours, &place.root, Stdio::null(), Stdio::null())?;
    let begun = Instant::now();
    // Cycle 0 goes out until the other side is there to hear it.
    while back.latest().is_none() {
        ensure!(begun.elapsed() < PATIENCE, "the other side did not answer");
        there.write(0, now_ns(), StepCommand::default());
        std::thread::sleep(Duration::from_millis(5));
    }
    for trip in 1..=trips {
        let begun = now_ns();
        let command = StepCommand { follow: 1, follow_id: 1, ..StepCommand::default() };
        there.write(trip, now_ns(), command);
        while back.of_cycle(trip).message().is_none() {
            std::hint::spin_loop();
        }
        times.add(now_ns() - begun);
    }
    // One that asks to follow no more is the end.
    there.write(trips + 1, now_ns(), StepCommand::default());
    echo.wait()?;
    Ok(())
}

pub(super) fn echo(root: &Path) -> Result<()> {
    let bus = Bus::open(&place(root), GENERATION)?;
    let mut there = bus.cycle_reader::<StepCommand>(Source::Controller)?;
    let mut back = bus.writer::<Feedback>(Source::Plant)?;
    back.connect();
    while there.latest().is_none() {
        std::hint::spin_loop();
    }
    back.write(0, now_ns(), Feedback::default());
    let mut trip = 1;
    loop {
        // `latest` would swallow a message that comes between two looks.
        let Some(command) = there.of_cycle(trip).message() else {
            std::hint::spin_loop();
            continue;
        };
        if command.follow == 0 {
            return Ok(());
        }
        back.write(trip, now_ns(), Feedback::default());
        trip += 1;
    }
}
