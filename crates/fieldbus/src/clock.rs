//! Our cycle onto the bus's: a PI controller on the place of the frame in the SYNC0 cycle.
//!
//! Each reply tells the bus's time at which the frame passed the device. Its place after SYNC0, less where it is wanted, is the
//! error e. The correction c, what our deadlines are shifted by, changes each cycle by rate − K_p·e, and the rate by −K_i·e.
//! e is clamped: a process that woke late says nothing about the clocks. The change is clamped: deadlines never leap.

/// How the loop is set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockParams {
    /// The cycle, ns.
    pub period_ns: i64,
    /// Where the frame is wanted after SYNC0, ns.
    pub place_ns: i64,
}

/// Errors beyond this are taken as this, ns.
const CLAMP_NS: i64 = 20_000;
/// The largest change of the correction in a cycle, ns.
const SLEW_NS: f64 = 1_000.0;
/// Gains: a damping of 1.1 and a time constant of some 45 cycles.
const PROPORTIONAL: f64 = 0.05;
const INTEGRAL: f64 = 0.0005;

/// Follows the bus's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    params: ClockParams,
    /// The bus's time at one SYNC0, ns.
    sync0_ns: u64,
    correction_ns: f64,
    /// Change a cycle, ns.
    rate_ns: f64,
}

impl Clock {
    /// Begins with a correction, a rate per cycle, and a SYNC0 at `sync0_ns` of the bus's time.
    pub fn new(params: ClockParams, sync0_ns: u64, correction_ns: i64, rate_ns: f64) -> Self {
        Self {
            params,
            sync0_ns,
            correction_ns: correction_ns as f64,
            rate_ns: rate_ns.clamp(-SLEW_NS, SLEW_NS),
        }
    }

    /// Where a frame that passed the device at `system_time_ns` lies from where it is wanted, ns.
    pub fn error_ns(&self, system_time_ns: u64) -> i64 {
        let period = self.params.period_ns.max(1);
        let since = system_time_ns.wrapping_sub(self.sync0_ns).cast_signed();
        let place = (since - self.params.place_ns).rem_euclid(period);
        if place > period / 2 { place - period } else { place }
    }

    /// Takes a cycle's error in: the correction from now on, ns.
    pub fn follow(&mut self, error_ns: i64) -> i64 {
        let error = error_ns.clamp(-CLAMP_NS, CLAMP_NS) as f64;
        self.rate_ns = (self.rate_ns - INTEGRAL * error).clamp(-SLEW_NS, SLEW_NS);
        self.correction_ns += (self.rate_ns - PROPORTIONAL * error).clamp(-SLEW_NS, SLEW_NS);
        self.correction_ns()
    }

    /// A cycle without a reply: goes on at the last rate.
    pub fn coast(&mut self) -> i64 {
        self.correction_ns += self.rate_ns;
        self.correction_ns()
    }

    /// What our deadlines are shifted by, ns.
    pub fn correction_ns(&self) -> i64 {
        self.correction_ns.round() as i64
    }

    /// Change of the correction a cycle, ns.
    pub fn rate_ns(&self) -> f64 {
        self.rate_ns
    }
}

/// How much faster the bus's clock runs than ours, from pairs of our time and the bus's, both in ns: ns a ns, by least squares.
/// 0 where the pairs don't tell.
pub fn fit_rate(pairs: &[(u64, u64)]) -> f64 {
    let Some((ours_0, bus_0)) = pairs.first() else { return 0.0 };
    let point = |(ours, bus): &(u64, u64)| {
        let x = ours.wrapping_sub(*ours_0).cast_signed() as f64;
        (x, bus.wrapping_sub(*bus_0).cast_signed() as f64 - x)
    };
    let count = pairs.len() as f64;
    let (sum_x, sum_y) = pairs.iter().map(point).fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
    let (mean_x, mean_y) = (sum_x / count, sum_y / count);
    let (covariance, variance) = pairs.iter().map(point).fold((0.0, 0.0), |(a, b), (x, y)| {
        (a + (x - mean_x) * (y - mean_y), b + (x - mean_x) * (x - mean_x))
    });
    if variance > 0.0 { covariance / variance } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PARAMS: ClockParams = ClockParams { period_ns: 1_000_000, place_ns: 100_000 };

    /// A bus whose crystal is off, and frames that come late by a jitter: the errors after each cycle.
    fn run(drift_ppm: f64, phase_ns: f64, jitter_ns: f64, cycles: usize) -> Vec<i64> {
        let mut clock = Clock::new(PARAMS, 0, 0, 0.0);
        let mut noise = 12_345_u64;
        (0..cycles)
            .map(|cycle| {
                noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let late = (noise >> 40) as f64 / (1 << 24) as f64 * jitter_ns;
                let ours = cycle as f64 * 1e6 + 100_000.0 + clock.correction_ns() as f64 + late;
                let bus = (ours * (1.0 + drift_ppm * 1e-6) + phase_ns) as u64;
                let error = clock.error_ns(bus);
                clock.follow(error);
                error
            })
            .collect()
    }

    #[test]
    fn it_locks_within_three_seconds() {
        for drift in [-150.0, -100.0, 0.0, 100.0, 150.0] {
            let errors = run(drift, 40_000.0, 10_000.0, 6000);
            let worst = errors[3000..].iter().map(|error| error.abs()).max().unwrap();
            assert!(worst < 20_000, "{drift} ppm: {worst} ns");
        }
    }

    proptest! {
        #[test]
        fn deadlines_never_leap(errors in prop::collection::vec(any::<i64>(), 1..200)) {
            let mut clock = Clock::new(PARAMS, 0, 0, 0.0);
            let mut before = 0;
            for error in errors {
                let now = clock.follow(error);
                prop_assert!((now - before).abs() <= 1_001);
                before = now;
            }
        }

        #[test]
        fn an_error_is_at_most_half_a_period(time: u64, sync0: u64) {
            let clock = Clock::new(PARAMS, sync0, 0, 0.0);
            prop_assert!(clock.error_ns(time).abs() <= 500_000);
        }
    }

    #[test]
    fn a_rate_is_fitted() {
        let pairs: Vec<_> = (0..100_u64).map(|i| (i * 1_000_000, 5_000 + i * 1_000_100)).collect();
        assert!((fit_rate(&pairs) - 1e-4).abs() < 1e-9);
        assert_eq!(fit_rate(&[]), 0.0);
    }
}
