//! The message of a cycle: there or not in real time, waited for in lockstep.

use crate::child::{Child, lockstep_core};
use crate::complain::complain;
use crate::part::Pace;
use crate::wishes::Wishes;
use signal_bus::{BusError, CycleReader, Found, Service};
use signals::Source;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Looks this often before the processor is given to somebody else: a partner on the other core may answer sooner,
const SPINS: u32 = 20;
/// one on the same core not at all as long as this process looks.
const SPINS_ON_ONE_CORE: u32 = 2;

/// In lockstep, who waits for so long says for what: a partner that is busy takes milliseconds.
const LONG_WAIT: Duration = Duration::from_secs(10);
/// The clock is looked at every so many times that the processor was given away.
const YIELDS: u32 = 1 << 14;

/// A reader that is paced like its process.
pub(crate) struct Inbox<B: Service> {
    reader: CycleReader<B>,
    pace: Pace,
    spins: u32,
    wishes: Arc<Wishes>,
    ended: bool,
    of: Source,
    by: Source,
}

impl<B: Service> Inbox<B> {
    pub(crate) fn open(child: &Child, source: Source) -> Result<Self, BusError> {
        let shares_core = child.lockstep_core().is_some() && lockstep_core(source) == child.lockstep_core();
        Ok(Self {
            reader: child.bus.cycle_reader(source)?,
            pace: child.pace,
            spins: if shares_core { SPINS_ON_ONE_CORE } else { SPINS },
            wishes: Arc::clone(&child.wishes),
            ended: false,
            of: source,
            by: child.source,
        })
    }

    /// The message of `cycle`. In lockstep waits for it, or for its sender's word that there is none.
    pub(crate) fn of_cycle(&mut self, cycle: u64) -> Option<B> {
        match self.pace {
            Pace::Realtime => self.reader.of_cycle(cycle).message(),
            Pace::Lockstep => {
                let found = self.wait_for(cycle, |reader| match reader.of_cycle(cycle) {
                    Found::NotYet => None,
                    found => Some(found),
                });
                self.ended = found.is_none();
                found.and_then(Found::message)
            }
        }
    }

    /// Awake before the cycle: takes in what is there already; the message of `cycle` where it is among it.
    pub(crate) fn make_ready(&mut self, cycle: u64) -> Option<&B> {
        self.reader.take_in(cycle);
        self.reader.at_hand(cycle)
    }

    /// Awake before the cycle: looks whether there is something, and leaves it there.
    pub(crate) fn touch(&self) {
        self.reader.touch();
    }

    /// Whether nothing more comes because the run is to end.
    pub(crate) fn ended(&self) -> bool {
        self.ended
    }

    /// The next message in order, if there is one now.
    pub(crate) fn in_order(&mut self) -> Option<B> {
        self.reader.in_order()
    }

    /// Waits in cycle `cycle` until the newest message fulfils `enough`, or the run is to end.
    pub(crate) fn wait_until(&mut self, cycle: u64, enough: impl Fn(&B) -> bool) {
        self.wait_for(cycle, |reader| reader.latest().filter(|message| enough(&message.body)));
    }

    /// Messages lost or refused.
    pub(crate) fn missed(&self) -> u64 {
        self.reader.missed()
    }

    fn wait_for<T>(
        &mut self,
        cycle: u64,
        mut look: impl FnMut(&mut CycleReader<B>) -> Option<T>,
    ) -> Option<T> {
        let (mut yields, mut begun) = (0_u32, None);
        loop {
            for _ in 0..self.spins {
                if let Some(found) = look(&mut self.reader) {
                    return Some(found);
                }
                std::hint::spin_loop();
            }
            if self.wishes.stop() {
                return None;
            }
            std::thread::yield_now();
            yields = yields.wrapping_add(1);
            if yields.is_multiple_of(YIELDS) && begun.get_or_insert_with(Instant::now).elapsed() > LONG_WAIT {
                self.complain_of_wait(cycle);
                begun = None;
            }
        }
    }

    /// Says who waits for what, with what was lost or refused: a run that stands still would say nothing.
    #[cold]
    fn complain_of_wait(&self, cycle: u64) {
        let seconds = LONG_WAIT.as_secs();
        let Self { by, of, reader, .. } = self;
        complain(format_args!(
            "{by} has waited for {seconds} s for the {} of cycle {cycle} from {of}; missed so far: {}, the last refused: {:?}",
            B::NAME,
            reader.missed(),
            reader.last_defect()
        ));
    }
}
