//! The cycles of a loop process, paced by the clock or by its partners, with the timing that it kept.

use crate::child::{Child, ChildError};
use crate::faults::ProcessFaults;
use crate::part::{ChildSummary, Pace, ToChild};
use injection::Injection;
use realtime::{
    CyclicTimer, LoopStats, PageFaults, Wake, allocations_of_this_thread, now_ns, page_faults_of_this_thread,
};
use signal_bus::Writer;
use signals::{LoopTiming, Scheduling, Source};

/// Warm cycles in which page faults and allocations are still allowed: every path has been taken once by then.
const WARM_UP_CYCLES: u64 = 50;

/// One cycle's clock: stamps messages, and measures the cycle's parts in real time.
pub(crate) struct Stamp {
    lockstep_ns: Option<u64>,
    deadline_ns: u64,
    last_ns: u64,
    read_ns: u64,
    step_ns: u64,
    write_ns: u64,
}

impl Stamp {
    fn lockstep(cycle_ns: u64) -> Self {
        Self {
            lockstep_ns: Some(cycle_ns),
            deadline_ns: cycle_ns,
            last_ns: 0,
            read_ns: 0,
            step_ns: 0,
            write_ns: 0,
        }
    }

    fn realtime(wake: &Wake) -> Self {
        Self {
            lockstep_ns: None,
            deadline_ns: wake.deadline_ns,
            last_ns: wake.woke_ns,
            read_ns: 0,
            step_ns: 0,
            write_ns: 0,
        }
    }

    /// The time to stamp a message with, ns: now, or in lockstep the cycle's.
    pub(crate) fn now(&self) -> u64 {
        self.lockstep_ns.unwrap_or_else(now_ns)
    }

    /// When the cycle should have begun for this process, ns.
    pub(crate) fn deadline_ns(&self) -> u64 {
        self.deadline_ns
    }

    /// Everything since the last mark was reading.
    pub(crate) fn has_read(&mut self) {
        self.read_ns += self.since_last();
    }

    /// Everything since the last mark was computing.
    pub(crate) fn has_stepped(&mut self) {
        self.step_ns += self.since_last();
    }

    /// Everything since the last mark was writing.
    pub(crate) fn has_written(&mut self) {
        self.write_ns += self.since_last();
    }

    fn since_last(&mut self) -> u64 {
        if self.lockstep_ns.is_some() {
            return 0;
        }
        let now = now_ns();
        let passed = now.saturating_sub(self.last_ns);
        self.last_ns = now;
        passed
    }
}

/// Why a process takes no part in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Absence {
    /// It is still busy with an earlier one.
    Late,
    /// It is taken for dead.
    Dead,
}

/// The work of a loop process.
pub(crate) trait Cyclic {
    /// Its name on the bus.
    const SOURCE: Source;
    /// Awake before the deadline of `cycle`: takes in what is there, and touches what the cycle will need. Nothing that others could
    /// notice, and nothing that the cycle would not do or have without it.
    fn make_ready(&mut self, _cycle: u64) {}
    /// Does cycle `cycle`, after `skipped` that were passed over.
    fn cycle(&mut self, cycle: u64, skipped: u64, stamp: &mut Stamp);
    /// Where there is no clock: takes no part in a cycle. It still keeps pace with its partners, whose messages it leaves
    /// unread, and says that it has none.
    fn pass_over(&mut self, cycle: u64, time_ns: u64, why: Absence);
    /// Lets a fault befall its messages.
    fn inject(&mut self, injection: &Injection);
    /// Messages lost or refused on the way to it.
    fn missed(&self) -> u64;
    /// Messages published and those of them that could not be sent.
    fn published(&self) -> (u64, u64);
    /// Maps the readers that are there.
    fn connect(&self);
    /// Shift of the deadlines, ns, from the newest Feedback: keeps the loop in phase with the drive's distributed
    /// clock.
    fn phase_correction_ns(&self) -> i64 {
        0
    }
    /// Whether its cycles are what they are to be from now on: a bridge's only once the bus operates.
    fn is_warm(&self) -> bool {
        true
    }
    /// After the last cycle.
    fn leave(&mut self) {}
    /// Whether it may end: the plant only once the valve stands.
    fn may_end(&self) -> bool {
        true
    }
}

/// Runs all cycles; `None` where the supervisor wanted no start.
pub(crate) fn run<C: Cyclic>(child: &Child, mut work: C) -> Result<Option<ChildSummary>, ChildError> {
    let mut timing = child.bus.writer::<LoopTiming>(C::SOURCE)?;
    let mut stats =
        LoopStats::new(child.timeline.period_ns).map_err(|error| ChildError::Histogram(error.to_string()))?;
    let Some(epoch_ns) = child.ready()? else { return Ok(None) };
    work.connect();
    timing.connect();
    let steady = match child.pace {
        Pace::Realtime => realtime_cycles(child, &mut work, &mut timing, &mut stats, epoch_ns),
        Pace::Lockstep => lockstep_cycles(child, &mut work),
    };
    work.leave();
    let (published, unsent) = work.published();
    let mut summary = ChildSummary {
        timing: stats.summary(),
        missed_samples: work.missed(),
        published: published + timing.published(),
        unsent: unsent + timing.failures(),
        ..ChildSummary::default()
    };
    steady.add_to(&mut summary);
    Ok(Some(summary))
}

fn lockstep_cycles<C: Cyclic>(child: &Child, work: &mut C) -> Steady {
    let mut steady = Steady::default();
    let mut faults = planned(child, work);
    let (mut cycle, mut over) = (0, 0);
    while (cycle <= child.timeline.last_cycle || !work.may_end()) && !child.wishes.stop() {
        steady.note(cycle, work.is_warm(), || work.published().0);
        let time_ns = cycle * child.timeline.period_ns;
        over = if over > 0 { over } else { faults.overrun(cycle) };
        if faults.silent(cycle) {
            if cycle > child.timeline.last_cycle {
                break;
            }
            work.pass_over(cycle, time_ns, Absence::Dead);
        } else if over > 0 {
            over -= 1;
            work.pass_over(cycle, time_ns, Absence::Late);
        } else {
            work.cycle(cycle, 0, &mut Stamp::lockstep(time_ns));
        }
        cycle += 1;
    }
    steady.end(cycle, work.published().0);
    steady
}

fn realtime_cycles<C: Cyclic>(
    child: &Child,
    work: &mut C,
    timing: &mut Writer<LoopTiming>,
    stats: &mut LoopStats,
    epoch_ns: u64,
) -> Steady {
    let priority = if child.wanted.priority.is_some() { realtime::current_fifo_priority() } else { None };
    let mut steady = Steady::default();
    let mut faults = planned(child, work);
    let timer = CyclicTimer::new(epoch_ns, child.timeline.period_ns, child.phase_ns);
    let mut timer = timer.early(child.early_ns);
    let mut correction_ns = 0;
    loop {
        let wake = timer.wait_ready(|cycle| work.make_ready(cycle));
        stats.woke(&wake);
        if child.injections.is_some() {
            suffer(child, work, &mut faults, &wake);
        }
        steady.note(wake.cycle, work.is_warm(), || work.published().0 + timing.published());
        let mut stamp = Stamp::realtime(&wake);
        work.cycle(wake.cycle, wake.skipped, &mut stamp);
        // Before the message that tells it: so the last cycle's overrun is in the record too.
        stats.finished(&wake, stamp.last_ns);
        timing.write(wake.cycle, stamp.last_ns, loop_timing(&wake, &stamp, stats, work.missed(), priority));
        // The correction of Feedback k applies from cycle k+2 in every process: all have received it by the end of
        // cycle k.
        timer.steer(std::mem::replace(&mut correction_ns, work.phase_correction_ns()));
        let over = wake.cycle >= child.timeline.last_cycle || child.wishes.stop();
        if over && work.may_end() {
            steady.end(wake.cycle + 1, work.published().0 + timing.published());
            return steady;
        }
    }
}

/// The faults that were planned before the start.
fn planned<C: Cyclic>(child: &Child, work: &mut C) -> ProcessFaults {
    let mut faults = ProcessFaults::default();
    for injection in child.injections.iter().flatten() {
        faults.add(C::SOURCE, injection);
        work.inject(injection);
    }
    faults
}

/// Takes in faults that came since, and lets those of the whole process happen.
fn suffer<C: Cyclic>(child: &Child, work: &mut C, faults: &mut ProcessFaults, wake: &Wake) {
    while let Some(order) = child.order() {
        if let ToChild::Inject(injection) = order {
            faults.add(C::SOURCE, &injection);
            work.inject(&injection);
        }
    }
    let period_ns = child.timeline.period_ns;
    let overrun = faults.overrun(wake.cycle);
    if overrun > 0 {
        // As a computation would that does not come to an end: the core stays busy.
        while now_ns() < wake.deadline_ns + overrun * period_ns {
            std::hint::spin_loop();
        }
    }
    // A scenario ends for a process that says nothing, too.
    let left = child.timeline.last_cycle.saturating_sub(wake.cycle).saturating_add(1);
    let ends_ns = wake.deadline_ns.saturating_add(left.saturating_mul(period_ns));
    while faults.silent(wake.cycle) && !child.wishes.stop() && now_ns() < ends_ns {
        std::thread::sleep(std::time::Duration::from_nanos(period_ns));
    }
}

fn loop_timing(
    wake: &Wake,
    stamp: &Stamp,
    stats: &LoopStats,
    missed: u64,
    priority: Option<u8>,
) -> LoopTiming {
    let scheduling = if priority.is_some() { Scheduling::Fifo } else { Scheduling::Other };
    LoopTiming {
        deadline_ns: wake.deadline_ns,
        wake_up_latency_ns: wake.latency_ns(),
        read_ns: stamp.read_ns,
        step_ns: stamp.step_ns,
        write_ns: stamp.write_ns,
        overruns: stats.overruns(),
        skipped_cycles: stats.skipped_cycles(),
        missed_samples: missed,
        scheduling: scheduling.code(),
        priority: u64::from(priority.unwrap_or(0)),
    }
}

/// Page faults and allocations after warm-up. Two calls of getrusage enclose the steady cycles.
#[derive(Default)]
struct Steady {
    warm_cycles: u64,
    start: Option<(u64, u64, u64, PageFaults)>,
    cycles: u64,
    published: u64,
    allocations: u64,
    page_faults: PageFaults,
}

impl Steady {
    fn note(&mut self, cycle: u64, is_warm: bool, published: impl Fn() -> u64) {
        if self.start.is_none() && self.warm_cycles >= WARM_UP_CYCLES {
            self.start =
                Some((cycle, published(), allocations_of_this_thread(), page_faults_of_this_thread()));
        }
        self.warm_cycles = if is_warm { self.warm_cycles + 1 } else { 0 };
    }

    fn end(&mut self, next_cycle: u64, published: u64) {
        if let Some((cycle, published_before, allocations, faults)) = self.start {
            self.page_faults = page_faults_of_this_thread().since(faults);
            self.allocations = allocations_of_this_thread() - allocations;
            self.cycles = next_cycle - cycle;
            self.published = published - published_before;
        }
    }

    fn add_to(&self, summary: &mut ChildSummary) {
        summary.steady_cycles = self.cycles;
        summary.steady_published = self.published;
        summary.steady_allocations = self.allocations;
        summary.steady_page_faults = self.page_faults;
    }
}
