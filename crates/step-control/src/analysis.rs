//! Analysis of the loop that a controller's settings make, for whoever sets it up.

use crate::observer::margins::{Loop, Margins};
use crate::observer::shaft::ShaftFactors;
use crate::params::Params;

impl Params {
    /// The loop of encoder, observer and motor at a frequency (Hz): gain and phase (rad) of the loop transfer L. `None`
    /// without an observer, or where L has a pole.
    pub fn loop_response(&self, shaft: ShaftFactors, frequency_hz: f64) -> Option<(f64, f64)> {
        let transfer = self.observed_loop(shaft)?.at(frequency_hz)?;
        Some((transfer.norm(), transfer.arg()))
    }

    /// How far that loop is from instability. Margins mean nothing where [`Params::loop_is_stable`] is false.
    pub fn margins(&self, shaft: ShaftFactors) -> Option<Margins> {
        self.observed_loop(shaft)?.margins()
    }

    /// Whether that loop is stable; `None` without an observer.
    pub fn loop_is_stable(&self, shaft: ShaftFactors) -> Option<bool> {
        Some(self.observed_loop(shaft)?.spectral_radius() < 1.0)
    }

    fn observed_loop(&self, factors: ShaftFactors) -> Option<Loop<'_>> {
        let observer = self.observer.as_ref()?;
        Some(Loop {
            observer,
            shaft: self.shaft().times(factors),
            age_cycles: self.age_cycles(&observer.settings),
        })
    }
}
