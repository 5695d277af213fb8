//! A mission from its first generation to its end.

use crate::control::serve;
use crate::exit::{DiedAtStart, Failure};
use crate::generation::{Generation, Left, Setup};
use crate::instance::Instance;
use crate::interruption::Interruption;
use crate::journal::{At, EventKind, Journal};
use crate::mission::{Ending, Mission};
use crate::news::Channel;
use crate::notify;
use anyhow::{Context, Result};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// A generation is started anew so often,
const MAX_RESTARTS: usize = 3;
/// within this time.
const RESTART_WINDOW: Duration = Duration::from_secs(600);

/// Processes of a generation at its start.
const PROCESSES: u32 = 4;

/// Carries a mission out. Once this returns, nothing is left of the instance but its record.
///
/// # Errors
/// [`Failure::Input`] for a bad name or one that is taken; [`Failure::Failed`] where the first generation could not be
/// started. What goes wrong later is in [`Ending::failure`].
pub fn supervise(mission: &Mission) -> Result<Ending, Failure> {
    let interruption = Interruption::watch()?;
    let instance = Instance::acquire(&mission.name)?;
    std::fs::create_dir_all(&mission.folder)
        .with_context(|| mission.folder.display().to_string())
        .map_err(Failure::Input)?;
    let channel = Channel::new();
    let name = mission.name.to_string();
    let journal = if mission.stays { Journal::open(&name, &mission.folder) } else { Journal::none(&name) };
    let setup = Setup {
        mission,
        journal: &journal,
        instance: &instance,
        generation: mission.info.generation,
        interruption: &interruption,
        left: Left::default(),
    };
    let mut ending = if mission.stays {
        serve(instance.folder(), channel.sender())?;
        stay(setup, &channel)?
    } else {
        once(&setup, &channel)?
    };
    ending.terminated = interruption.terminated();
    Ok(ending)
}

/// Runs one generation to its end.
fn once(setup: &Setup, channel: &Channel) -> Result<Ending> {
    let mut generation = Generation::start(setup, channel, 0)?;
    while generation.goes_on() {
        generation.look_around();
    }
    Ok(generation.end().0)
}

/// Keeps an instance alive until the user ends it, or its processes die too often.
fn stay(mut setup: Setup, channel: &Channel) -> Result<Ending> {
    let mut deaths = VecDeque::new();
    let mut started = 0;
    loop {
        let (ending, left) = generation(&setup, channel, &mut started)?;
        setup.left = Left { valve: left.valve.or(setup.left.valve), angle_doubt: left.angle_doubt };
        // What a killed process left in shared memory goes now, not at the instance's end.
        setup.instance.wipe_generation(setup.generation)?;
        let Some(failure) = ending.failure.clone() else { return Ok(ending) };
        let at = At { generation: setup.generation, cycle: 0 };
        setup.journal.note(at, EventKind::Process, &failure);
        deaths.push_back(Instant::now());
        deaths.retain(|death: &Instant| death.elapsed() < RESTART_WINDOW);
        let minutes = RESTART_WINDOW.as_secs() / 60;
        if ending.interrupted || deaths.len() > MAX_RESTARTS {
            let why = format!("{failure}; {} starts in {minutes} min", deaths.len());
            let told =
                format!("{why}: not started again; once the cause is found, `stepvalve run` starts it");
            setup.journal.note(at, EventKind::End, &told);
            return Ok(Ending { failure: Some(why), ..ending });
        }
        let nth = deaths.len();
        let again = format!("starting again, disarmed: restart {nth} of {MAX_RESTARTS} in {minutes} min");
        setup.journal.note(at, EventKind::Process, &again);
        setup.generation += 1;
    }
}

/// One generation of those that follow each other; `started` counts the processes of all of them.
fn generation(setup: &Setup, channel: &Channel, started: &mut u32) -> Result<(Ending, Left)> {
    let mut generation = match Generation::start(setup, channel, *started) {
        Ok(generation) => generation,
        Err(error) if error.is::<DiedAtStart>() => {
            // Whatever was started then, nobody's last words may be taken for its successor's.
            *started += PROCESSES;
            let failure = Some(format!("{error:#}"));
            let ending = Ending { generations: setup.starts(), failure, ..Ending::default() };
            return Ok((ending, Left { valve: None, ..setup.left }));
        }
        Err(error) => return Err(error),
    };
    notify::ready(setup.generation);
    let name = &setup.mission.name;
    generation.note(
        EventKind::Ready,
        format!("ready, disarmed; arm with: stepvalve arm --instance {name}; Ctrl-C ends it"),
    );
    while generation.goes_on() {
        generation.look_around();
        generation.answer_waiting();
    }
    *started = generation.started();
    if !generation.failed() {
        notify::stopping();
        generation.note(EventKind::End, "told to end");
    }
    Ok(generation.end())
}
