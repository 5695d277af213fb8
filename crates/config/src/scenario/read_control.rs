//! `[compensation]`: how the controller works against friction, and what the encoder and the period allow.

use crate::bounds::Bounds;
use crate::reader::{Field, Section};
use crate::scenario::{Compensation, Control, Damping, Encoder};
use crate::units::Dimension;

/// Range of the observer's bandwidth, Hz: the controller's own.
pub const OBSERVER_BANDWIDTH_HZ: (f64, f64) = (0.1, 1000.0);
const BANDWIDTH: Bounds = Bounds::within(OBSERVER_BANDWIDTH_HZ.0, OBSERVER_BANDWIDTH_HZ.1);
const LIMIT: Bounds = Bounds::within(0.0, 1.0);
const DEFAULT_LIMIT: f64 = 0.5;

/// The longest period at which the observer can predict the resonance over its delay.
const LONGEST_DAMPING_PERIOD_NS: u64 = 1_000_000;

/// The fewest counts per turn with which damping is the default: fed back, the flicker between two counts of a coarser encoder moves the
/// valve more than damping keeps it still (docs/robustness.md).
const LEAST_DAMPING_COUNTS: u64 = 16_000;

/// The section, or what a scenario without it means: all that belief and encoder allow.
pub(super) fn read_compensation(
    root: &Section<'_>,
    encoder: &Encoder,
    period_ns: u64,
) -> (Compensation, Control) {
    let Some(section) = root.optional_section("compensation") else {
        return (Compensation::Full, usual(Compensation::Full, encoder, period_ns));
    };
    let [none, levels @ ..] = Compensation::NAMED;
    let level =
        section.find("level").and_then(|field| field.choice(none, &levels)).unwrap_or(Compensation::Full);
    let mut control = usual(level, encoder, period_ns);
    if let Some(field) = section.find("observer") {
        control.observer = field.boolean();
        if control.observer && !encoder.fitted {
            field.refuse("false: there is no encoder for an observer to look at");
        }
        control.damping = usual_damping(control.observer, encoder, period_ns);
    }
    if let Some(field) = section.find("damping") {
        control.damping = read_damping(&field, control.observer, period_ns);
    }
    control.observer_bandwidth_hz =
        section.optional_quantity("observer_bandwidth", Dimension::Frequency, BANDWIDTH);
    let limit = section.optional_quantity("observer_limit", Dimension::Ratio, LIMIT);
    control.observer_limit = limit.unwrap_or(DEFAULT_LIMIT);
    section.finish();
    (level, control)
}

fn read_damping(field: &Field<'_>, observer: bool, period_ns: u64) -> Damping {
    let ways = [("active", Damping::Active), ("shaping", Damping::Shaping)];
    let damping = field.choice(("none", Damping::None), &ways).unwrap_or(Damping::None);
    if damping == Damping::Active && !observer {
        field.refuse("\"none\" or \"shaping\": active damping needs an encoder and the observer");
    } else if damping == Damping::Active && period_ns > LONGEST_DAMPING_PERIOD_NS {
        let period = Dimension::Time.display(period_ns as f64 / 1e9);
        field.refuse(format!(
            "\"none\" or \"shaping\": at a period of {period} the command comes too late for the resonance, active \
             damping needs 1 ms or less"
        ));
    }
    damping
}

fn usual(level: Compensation, encoder: &Encoder, period_ns: u64) -> Control {
    let observer = encoder.fitted && level != Compensation::None;
    Control {
        observer,
        observer_bandwidth_hz: None,
        observer_limit: DEFAULT_LIMIT,
        damping: usual_damping(observer, encoder, period_ns),
    }
}

/// The damping of a scenario that names none: active where observer, encoder and period allow.
pub fn usual_damping(observer: bool, encoder: &Encoder, period_ns: u64) -> Damping {
    let sees = encoder.counts_per_turn >= LEAST_DAMPING_COUNTS;
    let damps = observer && sees && period_ns <= LONGEST_DAMPING_PERIOD_NS;
    if damps { Damping::Active } else { Damping::None }
}
