//! When a capture begins and ends: a state machine that sees one signal, sample by sample.
//!
//! ```text
//!            enough past               condition                    window's end
//!  Filling ─────────────▶ Armed ─────────────────────▶ Capturing ─────────────────▶ HoldOff ──▶ Armed
//!     ▲                      │ auto: nothing for long ────▲                              │ single
//!     └──── arm, restart ────┴───────────────────────────────────────────────────── Stopped
//! ```
//! Everything is counted in cycles, so a window is exact to the sample whatever the clock does.

use serde::{Deserialize, Serialize};

/// What sets it off.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Condition {
    /// The signal passes a level, in the signal's unit.
    Edge {
        /// The level.
        level: f64,
        /// In which direction.
        slope: Slope,
        /// How far it must have been on the other side before, so that noise at the level is no edge.
        #[serde(default)]
        hysteresis: f64,
    },
    /// The signal is above the level, or below it: again and again as long as it is.
    Level {
        /// The level.
        level: f64,
        /// Above, or below.
        above: bool,
    },
    /// The signal comes into a window, or leaves it.
    Window {
        /// Its lower bound, included.
        low: f64,
        /// Its upper bound, included.
        high: f64,
        /// Comes in, or leaves.
        inside: bool,
    },
    /// The signal has another value than before: a state, an alarm, a set-point.
    Change,
    /// The signal is no longer zero: a fault.
    Raised,
}

/// Direction of an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Slope {
    /// Upwards.
    Rising,
    /// Downwards.
    Falling,
    /// Either.
    Either,
}

/// What follows a capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// The next one; without a trigger for a window's length, one is taken all the same.
    Auto,
    /// The next one.
    Normal,
    /// Nothing, until it is armed again.
    Single,
}

/// What to wait for, and what to keep of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// The signal, shown or not.
    pub signal: String,
    /// What sets it off.
    pub condition: Condition,
    /// What follows a capture.
    pub mode: Mode,
    /// Cycles before the trigger, or before the delay's end.
    pub pre_cycles: u64,
    /// Cycles behind it.
    pub post_cycles: u64,
    /// From the trigger to the window's zero, in cycles: nothing of the time between need be held.
    #[serde(default)]
    pub delay_cycles: u64,
    /// From one trigger to the next, in cycles, at least.
    #[serde(default)]
    pub hold_off_cycles: u64,
}

/// What can't be a trigger.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unusable {
    /// The window does not fit into what is held.
    #[error("{found} cycles before and behind the trigger; {most} are held (--history)")]
    TooLong {
        /// Cycles asked for.
        found: u64,
        /// Cycles held.
        most: u64,
    },
    /// Nothing would be kept.
    #[error("no cycle behind the trigger, expected at least 1")]
    NoPost,
    /// A level that nothing can be compared with, or bounds the wrong way round.
    #[error("{0}")]
    Level(&'static str),
}

impl Settings {
    /// Whether it can be waited for where so many cycles are held.
    ///
    /// # Errors
    /// [`Unusable`].
    pub fn check(&self, held_cycles: u64) -> Result<(), Unusable> {
        let found = self.pre_cycles.saturating_add(self.post_cycles);
        if found > held_cycles {
            return Err(Unusable::TooLong { found, most: held_cycles });
        }
        if self.post_cycles == 0 {
            return Err(Unusable::NoPost);
        }
        let levels = match self.condition {
            Condition::Edge { level, hysteresis, .. } => [level, hysteresis],
            Condition::Level { level, .. } => [level, 0.0],
            Condition::Window { low, high, .. } => [low, high],
            Condition::Change | Condition::Raised => [0.0, 0.0],
        };
        if !levels.iter().all(|level| level.is_finite()) {
            return Err(Unusable::Level("a level that is no number"));
        }
        match self.condition {
            Condition::Edge { hysteresis, .. } if hysteresis < 0.0 => {
                Err(Unusable::Level("a negative hysteresis"))
            }
            Condition::Window { low, high, .. } if low > high => {
                Err(Unusable::Level("the window's lower bound is above the upper one"))
            }
            _ => Ok(()),
        }
    }
}

/// What was captured, in cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Window {
    /// The trigger; `None` where none came and the capture was taken all the same.
    pub trigger: Option<u64>,
    /// What the time axis counts from: the trigger, or the end of its delay.
    pub zero: u64,
    /// The first cycle.
    pub from: u64,
    /// The last cycle, included.
    pub to: u64,
}

/// Where the machine is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(tag = "state", rename_all = "kebab-case")]
pub enum State {
    /// There are not yet as many cycles as are wanted before the trigger.
    Filling,
    /// Waits for the condition since this cycle.
    Armed {
        /// Since when.
        since: u64,
    },
    /// Was set off, and waits for the window's end.
    Capturing {
        /// What will be captured.
        #[serde(flatten)]
        window: Window,
    },
    /// Sees no trigger until this cycle.
    HoldOff {
        /// The first cycle that counts again.
        until: u64,
    },
    /// Waits to be armed.
    Stopped,
}

/// Waits for a trigger.
#[derive(Debug, Clone)]
pub struct Machine {
    settings: Settings,
    state: State,
    first_cycle: Option<u64>,
    previous: Option<f64>,
    /// Whether the signal was below the level, beyond the hysteresis, since the last edge.
    below: bool,
    /// The same above.
    above: bool,
}

impl Machine {
    /// Waits from the next sample on. `first_cycle`: since when the past is held, where it already is.
    pub fn new(settings: Settings, first_cycle: Option<u64>) -> Self {
        Self { settings, state: State::Filling, first_cycle, previous: None, below: false, above: false }
    }

    /// What it waits for.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Where it is.
    pub fn state(&self) -> State {
        self.state
    }

    /// Waits again, from whatever state.
    pub fn arm(&mut self) {
        self.state = State::Filling;
    }

    /// Takes the next sample as the trigger, unless a capture is under way.
    pub fn force(&mut self, cycle: u64) {
        if !matches!(self.state, State::Capturing { .. }) {
            self.state = State::Capturing { window: self.window(cycle, false) };
        }
    }

    /// The loop begins anew, with cycle 0. What was under way ends with `last_cycle`.
    pub fn restart(&mut self, last_cycle: u64) -> Option<Window> {
        let under_way = match self.state {
            State::Capturing { window } if window.from < last_cycle => {
                Some(Window { to: window.to.min(last_cycle), ..window })
            }
            _ => None,
        };
        (self.first_cycle, self.previous) = (None, None);
        (self.below, self.above) = (false, false);
        self.state = match (under_way, self.settings.mode) {
            (Some(_), Mode::Single) => State::Stopped,
            _ if self.state == State::Stopped => State::Stopped,
            _ => State::Filling,
        };
        under_way
    }

    /// Sees a sample; a window that is complete with it.
    pub fn step(&mut self, cycle: u64, value: f64) -> Option<Window> {
        let first = *self.first_cycle.get_or_insert(cycle);
        let met = self.meets(value);
        if let State::HoldOff { until } = self.state
            && cycle >= until
        {
            self.state = State::Filling;
        }
        // What is held may not reach back as far as the settings ask: then nothing may set it off yet.
        if self.state == State::Filling && cycle.saturating_sub(first) >= self.past_wanted() {
            self.state = State::Armed { since: cycle };
        }
        if let State::Armed { since } = self.state {
            let length = self.settings.pre_cycles + self.settings.post_cycles;
            let waited = self.settings.mode == Mode::Auto && cycle.saturating_sub(since) >= length;
            if met || waited {
                self.state = State::Capturing { window: self.window(cycle, met) };
            }
        }
        match self.state {
            State::Capturing { window } if cycle >= window.to => {
                let again = window.trigger.unwrap_or(window.zero) + self.settings.hold_off_cycles;
                self.state = match self.settings.mode {
                    Mode::Single => State::Stopped,
                    Mode::Auto | Mode::Normal => State::HoldOff { until: again.max(cycle + 1) },
                };
                Some(window)
            }
            _ => None,
        }
    }

    fn past_wanted(&self) -> u64 {
        self.settings.pre_cycles.saturating_sub(self.settings.delay_cycles)
    }

    fn window(&self, cycle: u64, triggered: bool) -> Window {
        let zero = cycle + if triggered { self.settings.delay_cycles } else { 0 };
        Window {
            trigger: triggered.then_some(cycle),
            zero,
            from: zero.saturating_sub(self.settings.pre_cycles),
            to: zero + self.settings.post_cycles,
        }
    }

    /// Whether this sample sets it off. Seen in every state, so that an edge during hold-off is no edge behind it.
    fn meets(&mut self, value: f64) -> bool {
        let before = self.previous.replace(value);
        match self.settings.condition {
            Condition::Edge { level, slope, hysteresis } => self.passes(value, level, slope, hysteresis),
            Condition::Level { level, above } => {
                if above {
                    value > level
                } else {
                    value < level
                }
            }
            Condition::Window { low, high, inside } => {
                let within = |value: f64| (low..=high).contains(&value);
                before.is_some_and(|before| within(before) != within(value) && within(value) == inside)
            }
            Condition::Change => before.is_some_and(|before| before.to_bits() != value.to_bits()),
            Condition::Raised => value != 0.0 && before.is_some_and(|before| before == 0.0),
        }
    }

    /// An edge counts from beyond the hysteresis on one side to the level itself.
    fn passes(&mut self, value: f64, level: f64, slope: Slope, hysteresis: f64) -> bool {
        let rising = self.below && value >= level;
        let falling = self.above && value <= level;
        self.below = !rising && (self.below || value < level - hysteresis);
        self.above = !falling && (self.above || value > level + hysteresis);
        match slope {
            Slope::Rising => rising,
            Slope::Falling => falling,
            Slope::Either => rising || falling,
        }
    }
}

#[cfg(test)]
mod tests;
