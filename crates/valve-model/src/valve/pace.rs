//! How long the next sub-step is: the fifth root of the last error, and of how it changed from one to the next
//! (Gustafsson's predictive control; Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.8).

/// No sub-step is shorter than this part of the cycle.
const SHORTEST: f64 = 1e-7;
/// The first sub-step of all, in parts of the cycle.
const FIRST: f64 = 0.05;
/// What is aimed at, in parts of the length that would just do.
const SAFETY: f64 = 0.87;
const SHRINK: f64 = 0.1;
const GROW: f64 = 5.0;
/// Errors below say nothing about the length.
const LEAST_ERROR: f64 = 1e-7;
/// The root of the last error counts as no less.
const LEAST_LAST_ROOT: f64 = 0.4;
/// An error as of a sub-step that can't be taken at all.
const HOPELESS: f64 = 1e3;

/// The sub-steps of a cycle so far.
pub(super) struct Pace {
    next_s: f64,
    shortest_s: f64,
    /// Length of the last sub-step accepted in this cycle, and the root of its error.
    accepted: Option<(f64, f64)>,
    rejected: bool,
}

impl Pace {
    /// Begins a cycle of `dt_s` with a sub-step of `next_s`; 0 where nothing is known of it.
    pub fn new(next_s: f64, dt_s: f64) -> Self {
        let next_s = if next_s > 0.0 { next_s } else { FIRST * dt_s };
        Self { next_s, shortest_s: SHORTEST * dt_s, accepted: None, rejected: false }
    }

    /// The next sub-step where `left_s` are left of the cycle.
    #[inline]
    pub fn step_s(&self, left_s: f64) -> f64 {
        if self.next_s >= left_s {
            left_s
        } else if 2.0 * self.next_s > left_s {
            // Two even pieces rather than a long and a short one.
            0.5 * left_s
        } else {
            self.next_s
        }
    }

    pub fn is_too_short(&self) -> bool {
        self.next_s < self.shortest_s
    }

    pub fn reject_hopeless(&mut self, step_s: f64) {
        self.reject(step_s, HOPELESS);
    }

    /// After a sub-step whose error (1 at the tolerance) is too large.
    pub fn reject(&mut self, step_s: f64, error: f64) {
        self.next_s = step_s * (SAFETY / root(error)).clamp(SHRINK, GROW);
        self.rejected = true;
    }

    /// After a sub-step that was taken; `cut_short` where its length was not chosen by its error.
    #[inline]
    pub fn accept(&mut self, step_s: f64, error: f64, cut_short: bool) {
        let root = root(error);
        let mut change = SAFETY / root;
        if !cut_short {
            if let Some((last_s, last_root)) = self.accepted {
                change *= (step_s * last_root / (last_s * root)).min(1.0);
            }
            self.accepted = Some((step_s, root.max(LEAST_LAST_ROOT)));
        }
        change = change.clamp(SHRINK, GROW);
        if self.rejected {
            change = change.min(1.0);
        }
        self.rejected = false;
        let wanted_s = step_s * change;
        // One that the end of the cycle or a turn cut short says nothing against a longer one.
        self.next_s = if step_s < self.next_s { wanted_s.max(self.next_s) } else { wanted_s };
    }

    /// After the rest of the cycle was left to the robust method.
    pub fn after_robust(&mut self) {
        self.next_s = self.next_s.max(1e5 * self.shortest_s);
    }

    /// The sub-step to begin the next cycle with.
    pub fn next_s(&self, dt_s: f64) -> f64 {
        self.next_s.min(dt_s)
    }
}

/// The fifth root of an error, -1 to +6 %: that of its exponent, the bits between read as a logarithm. A length need not
/// be known better, and a power costs as much as a stage.
#[inline]
fn root(error: f64) -> f64 {
    const ONE: u64 = 1.0_f64.to_bits();
    f64::from_bits(ONE / 5 * 4 + error.max(LEAST_ERROR).to_bits() / 5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_is_near_the_root() {
        for exponent in -60..=20 {
            let error = 10f64.powf(0.1 * f64::from(exponent));
            let ratio = root(error) / error.powf(0.2);
            assert!((0.98..1.07).contains(&ratio), "{ratio} at {error}");
        }
        assert_eq!(root(0.0), root(LEAST_ERROR));
    }
}
