//! The distributed clock of a device (ETG.1000.4, clause 6.2): its own crystal, the offset that the main device writes, SYNC0.

/// A crystal that runs off by so many parts per billion, and the SYNC0 pulses made from it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Clock {
    power_on_ns: u64,
    start_ns: i128,
    drift_ppb: i64,
    /// 0x0920: what is added to the local time to give the system time.
    pub(crate) offset_ns: i64,
    /// System time of the next SYNC0; `None` where it is not active.
    next_sync0_ns: Option<i128>,
    period_ns: u32,
}

impl Clock {
    pub(crate) fn new(power_on_ns: u64, start_ns: u64, drift_ppb: i64) -> Self {
        Self {
            power_on_ns,
            start_ns: i128::from(start_ns),
            drift_ppb,
            offset_ns: 0,
            next_sync0_ns: None,
            period_ns: 0,
        }
    }

    /// The device's own time at `now_ns` of the test's clock.
    pub(crate) fn local_ns(&self, now_ns: u64) -> i128 {
        let passed = i128::from(now_ns) - i128::from(self.power_on_ns);
        self.start_ns + passed + passed * i128::from(self.drift_ppb) / 1_000_000_000
    }

    /// The bus's time.
    pub(crate) fn system_ns(&self, now_ns: u64) -> i128 {
        self.local_ns(now_ns) + i128::from(self.offset_ns)
    }

    /// The test's time at a system time, rounded up.
    fn host_ns(&self, system_ns: i128) -> u64 {
        let passed = (system_ns - i128::from(self.offset_ns) - self.start_ns) * 1_000_000_000
            / (1_000_000_000 + i128::from(self.drift_ppb));
        u64::try_from(i128::from(self.power_on_ns) + passed + 1).unwrap_or(0)
    }

    /// Another drift from now on, the time unbroken.
    pub(crate) fn set_drift(&mut self, now_ns: u64, drift_ppb: i64) {
        self.start_ns = self.local_ns(now_ns);
        self.power_on_ns = now_ns;
        self.drift_ppb = drift_ppb;
    }

    /// The clock leaps, and SYNC0 with it.
    pub(crate) fn jump(&mut self, by_ns: i64) {
        self.start_ns += i128::from(by_ns);
    }

    /// Begins SYNC0 at the first pulse from `start_ns` on that is still to come.
    pub(crate) fn activate(&mut self, now_ns: u64, start_ns: u64, period_ns: u32) {
        let (start, period) = (i128::from(start_ns), i128::from(period_ns.max(1)));
        let late = (self.system_ns(now_ns) - start).max(0);
        self.next_sync0_ns = Some(start + (late + period - 1) / period * period);
        self.period_ns = period_ns.max(1);
    }

    pub(crate) fn deactivate(&mut self) {
        self.next_sync0_ns = None;
    }

    pub(crate) fn sync0_active(&self) -> bool {
        self.next_sync0_ns.is_some()
    }

    pub(crate) fn period_ns(&self) -> u32 {
        self.period_ns
    }

    /// When the next SYNC0 is due, on the test's clock.
    pub(crate) fn next_sync0_host_ns(&self) -> Option<u64> {
        self.next_sync0_ns.map(|next| self.host_ns(next))
    }

    /// Takes the next SYNC0 if it is due: its system time.
    pub(crate) fn take_sync0(&mut self, now_ns: u64) -> Option<i128> {
        let next = self.next_sync0_ns?;
        if self.system_ns(now_ns) < next {
            return None;
        }
        self.next_sync0_ns = Some(next + i128::from(self.period_ns));
        Some(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sync0_follows_the_crystal() {
        let mut clock = Clock::new(0, 7, 100_000);
        clock.offset_ns = 1_000;
        clock.activate(0, 1_000_000, 1_000_000);
        let mut pulses = Vec::new();
        for now in (0..=20_000_000).step_by(1_000) {
            while clock.take_sync0(now).is_some() {
                pulses.push(now);
            }
        }
        // At +100 ppm a pulse comes 100 ns early each ms.
        assert_eq!(pulses.len(), 20);
        assert!(pulses.last().unwrap().abs_diff(19_998_000) <= 2_000, "{pulses:?}");
    }
}
