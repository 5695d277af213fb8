//! A speed that lags behind the shaft's, in one stage or in two: τ1·dω1/dt = ω − ω1, τ2·dω2/dt = ω1 − ω2.

use serde::{Deserialize, Serialize};

/// The stages' rates; 0: no such stage.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Lag {
    per_first_s: f64,
    /// No less than the first, where it is there.
    per_second_s: f64,
}

/// What lags, rad/s; or how fast it changes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Lagging {
    /// Behind the first stage; without meaning where it is the only one.
    pub stage: f64,
    /// Behind the last stage.
    pub curve: f64,
}

impl Lag {
    /// A lag of `time_constant_s` in all, of which the second stage has the part `second_share`, 0 to 0.5.
    pub fn new(time_constant_s: f64, second_share: f64) -> Self {
        let per = |time_s: f64| if time_s > 0.0 { 1.0 / time_s } else { 0.0 };
        let second_s = time_constant_s * second_share;
        Self { per_first_s: per(time_constant_s - second_s), per_second_s: per(second_s) }
    }

    pub fn is_there(&self) -> bool {
        self.per_first_s > 0.0
    }

    fn is_double(&self) -> bool {
        self.per_second_s > 0.0
    }

    /// The rates behind a speed, rad/s².
    #[inline]
    pub fn rates(&self, speed: f64, at: Lagging) -> Lagging {
        if self.is_double() {
            let stage = (speed - at.stage) * self.per_first_s;
            return Lagging { stage, curve: (at.stage - at.curve) * self.per_second_s };
        }
        Lagging { stage: 0.0, curve: (speed - at.curve) * self.per_first_s }
    }

    /// Where it is after `dt_s` in which the speed went linearly from `start` to `end`: exact.
    pub fn after_ramp(&self, (start, end): (f64, f64), from: Lagging, dt_s: f64) -> Lagging {
        if !self.is_there() {
            return Lagging { stage: end, curve: end };
        }
        // After a while each trails a ramp by its rise in the time constants before it.
        let rise = (end - start) / (dt_s * self.per_first_s);
        let kept = (-dt_s * self.per_first_s).exp();
        let first = |lagging: f64| end - rise + (lagging - start + rise) * kept;
        if !self.is_double() {
            return Lagging { stage: end, curve: first(from.curve) };
        }
        let both = rise + (end - start) / (dt_s * self.per_second_s);
        let apart = dt_s * (self.per_second_s - self.per_first_s);
        let passed_on = dt_s * kept * if apart > 1e-8 { -(-apart).exp_m1() / apart } else { 1.0 };
        let curve = end - both
            + (from.curve - start + both) * (-dt_s * self.per_second_s).exp()
            + (from.stage - start + rise) * self.per_second_s * passed_on;
        Lagging { stage: first(from.stage), curve }
    }

    /// The stages' part of s·I − J, factored.
    #[inline]
    pub fn pivots(&self, shift: f64) -> Pivots {
        let (first, second) = (1.0 / (shift + self.per_first_s), 1.0 / (shift + self.per_second_s));
        Pivots { lag: *self, first, second }
    }
}

/// One over the pivots of the stages.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pivots {
    lag: Lag,
    first: f64,
    second: f64,
}

impl Pivots {
    /// What lags, solved, by the shaft's speed.
    #[inline]
    pub fn by_speed(&self) -> Lagging {
        let first = self.lag.per_first_s * self.first;
        let curve = if self.lag.is_double() { first * self.lag.per_second_s * self.second } else { first };
        Lagging { stage: first, curve }
    }

    /// What lags, solved for a right side, if the shaft stood still.
    #[inline]
    pub fn standing(&self, right: Lagging) -> Lagging {
        if self.lag.is_double() {
            let stage = right.stage * self.first;
            return Lagging { stage, curve: (right.curve + self.lag.per_second_s * stage) * self.second };
        }
        Lagging { stage: 0.0, curve: right.curve * self.first }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_ends_where_small_steps_lead() {
        for (time_constant_s, share) in [(0.02, 0.0), (0.02, 0.1), (0.02, 0.5), (1e-4, 0.3)] {
            let lag = Lag::new(time_constant_s, share);
            let begun = Lagging { stage: 0.7, curve: -0.4 };
            let (start, end, dt_s) = (1.0, 3.0, 5e-3);
            let exact = lag.after_ramp((start, end), begun, dt_s);
            // The middle rule, implicit by its own pivots: second order, stable for any stage.
            let (count, mut at) = (20_000, begun);
            let step_s = dt_s / f64::from(count);
            for k in 0..count {
                let speed = start + (end - start) * (f64::from(k) + 0.5) / f64::from(count);
                let pivots = lag.pivots(2.0 / step_s);
                let right = Lagging { stage: at.stage * 2.0 / step_s, curve: at.curve * 2.0 / step_s };
                let (standing, by_speed) = (pivots.standing(right), pivots.by_speed());
                let middle = Lagging {
                    stage: standing.stage + by_speed.stage * speed,
                    curve: standing.curve + by_speed.curve * speed,
                };
                at = Lagging { stage: 2.0 * middle.stage - at.stage, curve: 2.0 * middle.curve - at.curve };
            }
            let apart = (at.curve - exact.curve).abs();
            assert!(apart < 2e-6, "{share} of {time_constant_s} s: {at:?}, not {exact:?}");
        }
    }

    #[test]
    fn a_second_stage_that_is_too_short_to_tell_is_none() {
        let (double, single) = (Lag::new(0.02, 1e-9), Lag::new(0.02, 0.0));
        let [double, single] = [(double, -0.4), (single, 0.7)]
            .map(|(lag, curve)| lag.after_ramp((1.0, 3.0), Lagging { stage: 0.7, curve }, 5e-3));
        assert!((single.curve - double.curve).abs() < 1e-6, "{single:?}, not {double:?}");
    }

    #[test]
    fn rates_are_those_of_the_equations() {
        let at = Lagging { stage: 2.0, curve: 1.0 };
        assert_eq!(Lag::new(0.5, 0.0).rates(3.0, at).curve, 4.0);
        let double = Lag::new(0.5, 0.2).rates(3.0, at);
        assert!((double.stage - 2.5).abs() < 1e-12 && (double.curve - 10.0).abs() < 1e-12, "{double:?}");
        assert!(!Lag::new(0.0, 0.3).is_there());
    }
}
