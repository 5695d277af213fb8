//! `[timing.*]`: when in the cycle each process runs, where, and how urgently.

use crate::bounds::Bounds;
use crate::reader::{Field, Section};
use crate::scenario::{TaskTiming, Timing};
use crate::units::Dimension;

/// A process's section and the default of its phase, in hundredths of the period.
struct Task(&'static str, u64);

const PLANT: Task = Task("plant-simulator", 0);
const TRAJECTORY: Task = Task("trajectory-generator", 15);
const CONTROLLER: Task = Task("step-controller", 40);
const RECORDER: Task = Task("run-recorder", 0);

const PHASE: Bounds = Bounds::within(0.0, 1e-2);
const MOST_CORES: u64 = 1024;
/// The processes with deadlines may spin for this part of a period each: with three of them on one core the kernel's limit for real-time
/// work (95 % of a second) is far away.
const MOST_EARLY: u64 = 8;

/// Reads `[timing]`; what is not there gets the defaults. `period_ns` is 0 if it was refused.
pub(super) fn read_timing(root: &Section<'_>, period_ns: u64) -> Timing {
    let section = root.optional_section("timing");
    let task = |task: &Task| read_task(section.as_ref(), task, period_ns);
    let ((plant, plant_phase), (trajectory, trajectory_phase)) = (task(&PLANT), task(&TRAJECTORY));
    let ((controller, controller_phase), (recorder, _)) = (task(&CONTROLLER), task(&RECORDER));
    let early = section.as_ref().and_then(|section| section.find("early"));
    let early_ns = early.map_or(0, |field| read_early_ns(&field, period_ns));
    if let Some(section) = section {
        if period_ns > 0 {
            let in_order =
                [(plant, plant_phase), (trajectory, trajectory_phase), (controller, controller_phase)];
            refuse_wrong_order(&section, &in_order);
        }
        section.finish();
    }
    Timing { early_ns, plant, trajectory, controller, recorder }
}

fn read_task<'a>(
    timing: Option<&Section<'a>>,
    task: &Task,
    period_ns: u64,
) -> (TaskTiming, Option<Field<'a>>) {
    let default_phase_ns = period_ns * task.1 / 100;
    let Some(section) = timing.and_then(|timing| timing.optional_section(task.0)) else {
        return (TaskTiming { phase_ns: default_phase_ns, core: None, priority: None }, None);
    };
    let phase = section.find("phase");
    let core = section.find("core").map(|field| field.integer(0..=MOST_CORES - 1));
    let priority = section.find("priority").map(|field| field.integer(1..=99));
    let timing = TaskTiming {
        phase_ns: phase.as_ref().map_or(default_phase_ns, |field| read_phase_ns(field, period_ns)),
        core: core.and_then(|core| usize::try_from(core).ok()),
        priority: priority.and_then(|priority| u8::try_from(priority).ok()),
    };
    section.finish();
    (timing, phase)
}

fn read_phase_ns(field: &Field<'_>, period_ns: u64) -> u64 {
    let phase_s = field.quantity(Dimension::Time, PHASE);
    let phase_ns = (phase_s * 1e9).round() as u64;
    if period_ns > 0 && phase_ns >= period_ns {
        field.refuse(format!("a time below the period, {}", Dimension::Time.display(period_ns as f64 / 1e9)));
        return 0;
    }
    phase_ns
}

fn read_early_ns(field: &Field<'_>, period_ns: u64) -> u64 {
    let early_ns = (field.quantity(Dimension::Time, PHASE) * 1e9).round() as u64;
    let most_ns = period_ns / MOST_EARLY;
    if period_ns > 0 && early_ns > most_ns {
        let most = Dimension::Time.display(most_ns as f64 / 1e9);
        field.refuse(format!("at most an eighth of the period, {most}"));
        return 0;
    }
    early_ns
}

/// In a cycle the plant comes first, then the trajectory, then the controller.
fn refuse_wrong_order(section: &Section<'_>, in_order: &[(TaskTiming, Option<Field<'_>>)]) {
    for pair in in_order.windows(2) {
        let [(before, before_field), (after, after_field)] = pair else { continue };
        if after.phase_ns > before.phase_ns {
            continue;
        }
        let expected = "phases that increase from plant-simulator to trajectory-generator to step-controller";
        match after_field.as_ref().or(before_field.as_ref()) {
            Some(field) => field.refuse(expected),
            None => section.refuse("phases out of order", expected),
        }
    }
}
