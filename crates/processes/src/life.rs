//! The life of a process, the same for all of them: part, bus, ready, go, cycles, done, finish.

use crate::child::{Child, ChildError};
use crate::complain::complain;
use crate::disarm::DisarmDesk;
use crate::frame::{read_frame, write_frame};
use crate::part::{FromChild, Part, Task, ToChild};
use crate::wishes::{Wishes, listen};
use crate::{bridge, controller, plant, recorder, trajectory};
use realtime::Wanted;
use signal_bus::Bus;
use signals::Source;
use std::cell::RefCell;
use std::fs::File;
use std::io::{stdin, stdout};
use std::os::unix::process::parent_id;
use std::process::ExitCode;
use std::sync::Arc;

/// Runs the process `source` to its end: the whole `main` of its binary.
pub fn run(source: Source) -> ExitCode {
    match live(source) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Whoever reads stdout may be gone; stderr is there for that.
            let refused = matches!(error, ChildError::Link { .. } | ChildError::Drive { .. });
            let words = if refused { FromChild::Refused } else { FromChild::Failed };
            let _ = write_frame(stdout(), &words(error.to_string()));
            complain(format_args!("{source}: {error}"));
            ExitCode::FAILURE
        }
    }
}

fn live(source: Source) -> Result<(), ChildError> {
    let Some(part) = read_part(source)? else { return Ok(()) };
    let lock = File::open(&part.membership.lock).map_err(ChildError::Lock)?;
    lock.lock_shared().map_err(ChildError::Lock)?;
    if parent_id() != part.membership.supervisor {
        // It died before the lock was held: the place may be another supervisor's by now.
        return Ok(());
    }
    let bus = Bus::open(&part.membership.place, part.membership.generation)?;
    let wishes = Arc::new(Wishes::default());
    let orders = listen(&wishes).map_err(ChildError::Thread)?;
    let disarm_desk = part.disarm_socket.map(|path| DisarmDesk::open(&path)).transpose();
    let child = Child {
        source,
        bus,
        pace: part.pace,
        recorded: part.recorded,
        timeline: part.timeline,
        phase_ns: part.timing.phase_ns,
        early_ns: part.timing.early_ns,
        wishes,
        wanted: Wanted {
            priority: part.timing.priority,
            core: part.timing.core,
            lock_memory: source != Source::Recorder,
        },
        injections: part.injections,
        disarm_desk: disarm_desk.map_err(ChildError::DisarmSocket)?,
        orders,
        early: RefCell::default(),
    };
    let summary = match part.task {
        Task::Plant(part) => plant::run(&child, *part),
        Task::Bridge(part) => bridge::run(&child, *part),
        Task::Trajectory(part) => trajectory::run(&child, *part),
        Task::Controller(part) => controller::run(&child, &part),
        Task::Recorder(part) => recorder::run(&child, &part),
    }?;
    match summary {
        Some(summary) => child.finish(summary),
        None => Ok(()),
    }
}

/// The part; `None` where the supervisor ended before it sent one.
fn read_part(source: Source) -> Result<Option<Part>, ChildError> {
    match read_frame(stdin())? {
        None => Ok(None),
        Some(ToChild::Part(part)) if part.task.source() == source => Ok(Some(*part)),
        Some(ToChild::Part(part)) => {
            Err(ChildError::WrongPart { found: part.task.source(), expected: source })
        }
        Some(_) => Err(ChildError::OutOfOrder { found: "another order", expected: "a part" }),
    }
}
