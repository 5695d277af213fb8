//! Faults on a running instance: those of a process's messages are told to it, those from outside are done here.

use crate::generation::Generation;
use crate::request::Answer;
use anyhow::Result;
use injection::{Fault, Injection};
use processes::ToChild;
use realtime::{Wanted, now_ns, obtain};
use rustix::process::{Pid, Signal, getpid, kill_process};
use signals::Source;
use std::time::Duration;

/// The priority of what takes a core from the loop: above all of the shipped scenarios.
const HOG_PRIORITY: u8 = 90;
/// No fault of an outside kind lasts longer.
const LONGEST: Duration = Duration::from_secs(60);

impl Generation<'_> {
    /// Injects a fault.
    pub fn inject(&mut self, injection: &Injection) -> Answer {
        if !self.allows_injection() {
            return Answer::refused("this instance was started without --allow-injection");
        }
        // A recorder that is gone keeps no note; the fault is injected all the same.
        let _ = self.tell(Source::Recorder, &ToChild::Mark(format!("injected: {injection}")));
        match self.carry_out_fault(injection) {
            Ok(()) => Answer::done(format!("injected: {injection}")),
            Err(error) => Answer::refused(format!("{error:#}")),
        }
    }

    fn carry_out_fault(&mut self, injection: &Injection) -> Result<()> {
        if let Some(source) = injection.fault.within() {
            return self.tell(source, &ToChild::Inject(injection.clone()));
        }
        match injection.fault {
            Fault::Kill { process: Source::Supervisor } => Ok(kill_process(getpid(), Signal::KILL)?),
            Fault::Kill { process } => self.child(process)?.signal(Signal::KILL),
            Fault::Pause { process, ms } => {
                let child = self.child(process)?;
                child.signal(Signal::STOP)?;
                let (pid, time) = (child.pid(), Duration::from_millis(ms).min(LONGEST));
                std::thread::spawn(move || go_on_after(pid, time));
                Ok(())
            }
            Fault::Hog { core, ms } => {
                std::thread::spawn(move || hog(core, Duration::from_millis(ms).min(LONGEST)));
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

fn go_on_after(pid: Pid, time: Duration) {
    std::thread::sleep(time);
    // One that was killed meanwhile needs it no more.
    let _ = kill_process(pid, Signal::CONT);
}

/// Takes a core under SCHED_FIFO. The kernel leaves 50 ms of each second to others.
fn hog(core: usize, time: Duration) {
    let _ = obtain(&Wanted { priority: Some(HOG_PRIORITY), core: Some(core), lock_memory: false });
    let end_ns = now_ns() + u64::try_from(time.as_nanos()).unwrap_or(0);
    while now_ns() < end_ns {
        std::hint::spin_loop();
    }
}
