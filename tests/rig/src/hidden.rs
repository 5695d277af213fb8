//! What a campaign hides, and what its plan leaves out.

use crate::effect::{Effect, Listed};
use crate::log_kind::LogKind;

/// Residual over noise of a strong effect, over the runs where it acts.
pub const STRONG: f64 = 5.0;
/// The same of a weak one.
pub const WEAK: f64 = 2.0;

/// What measurements are like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    /// A model whose numbers are exact, an encoder that hardly adds to the noise, white noise, every channel.
    Exact,
    /// Instruments, models, motions and records as they are in the field, at random.
    Real,
}

/// What a plan leaves out, so that twins can't be told apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Gap {
    /// One pressure for all runs.
    OnePressure,
    /// Constant speeds far above the Stribeck velocity, at one pressure and one temperature, begun on the move.
    SlidingOnly,
    /// Nothing fast enough for inertia to show.
    NoShake,
    /// Sines of one frequency, on the move.
    OneFrequency,
    /// One pressure, and the oil warms up from run to run.
    Trend,
    /// One way, without reversals, at one pressure.
    OneWay,
    /// Only slow changes of speed.
    Gentle,
    /// Sliding at constant speeds both ways; nothing within the bristles or near the resonance.
    NoPresliding,
}

impl Gap {
    const ALL: [Self; 8] = [
        Self::OnePressure,
        Self::SlidingOnly,
        Self::NoShake,
        Self::OneFrequency,
        Self::Trend,
        Self::OneWay,
        Self::Gentle,
        Self::NoPresliding,
    ];

    /// Its name on a command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::OnePressure => "one-pressure",
            Self::SlidingOnly => "sliding-only",
            Self::NoShake => "no-shake",
            Self::OneFrequency => "one-frequency",
            Self::Trend => "trend",
            Self::OneWay => "one-way",
            Self::Gentle => "gentle",
            Self::NoPresliding => "no-presliding",
        }
    }
}

/// A gap by its name on a command line.
pub fn gap_from_name(name: &str) -> Option<Gap> {
    Gap::ALL.into_iter().find(|gap| gap.name() == name)
}

/// What to hide.
#[derive(Debug, Clone, PartialEq)]
pub struct Hidden {
    /// What the measurement is like.
    pub family: Family,
    /// The log's kind.
    pub log: LogKind,
    /// The effects' names; of section "outside the list" too.
    pub effects: Vec<String>,
    /// Residual over noise, each effect by itself, over the runs where it acts.
    pub strength: f64,
    /// What the plan leaves out.
    pub without: Option<Gap>,
    /// Samples of the campaign, about.
    pub samples: usize,
    /// Neither noise nor encoder steps: for the best fit of another form.
    pub noise_free: bool,
}

impl Hidden {
    /// Nothing hidden, in a campaign of about 60,000 samples.
    pub fn none(log: LogKind) -> Self {
        Self {
            family: Family::Exact,
            log,
            effects: Vec::new(),
            strength: STRONG,
            without: None,
            samples: 60_000,
            noise_free: false,
        }
    }

    /// The same with effects.
    pub fn with(log: LogKind, effects: &[&str], strength: f64) -> Self {
        let effects = effects.iter().map(|id| (*id).to_owned()).collect();
        Self { effects, strength, ..Self::none(log) }
    }

    /// The effects that the names stand for.
    pub(crate) fn effects(&self) -> Vec<Effect> {
        let known = |name: &String| {
            Effect::from_name(name).unwrap_or_else(|| panic!("the rig knows no effect {name:?}"))
        };
        self.effects.iter().map(known).collect()
    }

    /// Whether some of it is on no list of causes.
    pub(crate) fn is_outside(&self) -> bool {
        self.effects().iter().any(|effect| effect.listed() == Listed::Nowhere)
    }
}

/// Effects that no list of causes has.
pub const OUTSIDE: &[&str] = &[
    Effect::OutsideSquareDrag.name(),
    Effect::OutsideHum.name(),
    Effect::OutsideGear.name(),
    Effect::OutsideWander.name(),
    Effect::OutsidePlay.name(),
];

/// Laws that no list of causes has, drawn among several forms.
pub const LAWS: &[&str] = &[
    Effect::OutsideLaw.name(),
    Effect::OutsidePressureLaw.name(),
    Effect::OutsideWarmthLaw.name(),
    Effect::OutsideWarmPressureLaw.name(),
];

/// The effects that can be hidden in a log of this kind.
pub fn effects_of(log: LogKind) -> Vec<&'static str> {
    let listed = Effect::ALL.iter().filter(|effect| effect.is_listed_for(log));
    listed.map(|effect| effect.name()).collect()
}

/// Near-twins: what is hidden, what it looks like, and the gap of the plan without which they can be told apart.
pub fn twins(log: LogKind) -> Vec<(&'static str, &'static [&'static str], Gap)> {
    match log {
        LogKind::Torque => vec![
            ("direction-asymmetry", &["torque-offset"], Gap::SlidingOnly),
            ("torque-offset", &["direction-asymmetry"], Gap::SlidingOnly),
            ("coupling-compliance", &["bristle-stiffness"], Gap::NoShake),
            ("bristle-stiffness", &["coupling-compliance"], Gap::NoShake),
            ("flow-torque", &["position-torque"], Gap::OnePressure),
            ("position-torque", &["flow-torque"], Gap::OnePressure),
            ("pressure-torque", &["torque-offset"], Gap::OnePressure),
            ("pressure-dependent-friction", &["coulomb-level"], Gap::OnePressure),
            ("dwell-stiction", &["hydraulic-lock"], Gap::OnePressure),
            ("hydraulic-lock", &["dwell-stiction"], Gap::OnePressure),
            ("wear-drift", &["temperature-dependent-friction"], Gap::Trend),
            ("load-inertia", &["friction-lag", "sensor-delay"], Gap::OneFrequency),
        ],
        LogKind::Angle => vec![
            ("encoder-eccentricity", &["position-torque", "flow-torque"], Gap::OneWay),
            ("position-torque", &["encoder-eccentricity", "flow-torque"], Gap::OneWay),
            ("viscous-level", &["sensor-delay"], Gap::Gentle),
            ("coulomb-level", &["backlash", "holding-torque-level"], Gap::NoPresliding),
            ("backlash", &["coulomb-level", "holding-torque-level"], Gap::NoPresliding),
        ],
    }
}
