//! The process data watchdog (ETG.1000.4, registers 0x0400 and 0x0420): counts up while no outputs come.

/// Without a setting: 25 MHz over 2500, 1000 times: 100 ms.
const DEFAULT_DIVIDER: u16 = 2498;
const DEFAULT_TIME: u16 = 1000;

/// The watchdog of the outputs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Watchdog {
    pub(crate) divider: u16,
    pub(crate) time: u16,
    fed_ns: Option<u64>,
}

impl Watchdog {
    pub(crate) fn new() -> Self {
        Self { divider: DEFAULT_DIVIDER, time: DEFAULT_TIME, fed_ns: None }
    }

    /// Outputs were written.
    pub(crate) fn feed(&mut self, now_ns: u64) {
        self.fed_ns = Some(now_ns);
    }

    pub(crate) fn stop(&mut self) {
        self.fed_ns = None;
    }

    /// How long outputs may be away; `None` where it is off.
    fn limit_ns(&self) -> Option<u64> {
        let unit_ns = (u64::from(self.divider) + 2) * 40;
        (self.time > 0).then(|| u64::from(self.time) * unit_ns)
    }

    /// Whether outputs have come, and not too long ago.
    pub(crate) fn alive(&self, now_ns: u64) -> bool {
        let passed = self.fed_ns.map(|fed| now_ns.saturating_sub(fed));
        match (passed, self.limit_ns()) {
            (None, _) => false,
            (Some(_), None) => true,
            (Some(passed), Some(limit)) => passed <= limit,
        }
    }

    /// When it runs out if nothing comes any more.
    pub(crate) fn deadline_ns(&self) -> Option<u64> {
        Some(self.fed_ns? + self.limit_ns()?)
    }
}
