//! Colours with a meaning: what a page shows in several plots has one colour in all of them.

/// The colour of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Hue {
    /// By its place within its plot.
    #[default]
    ByPlace,
    /// What was measured.
    Measured,
    /// The model as it was given.
    Given,
    /// The model extended.
    Extended,
    /// What the measurement scatters by itself.
    Noise,
}

impl Hue {
    /// As scripts and the style sheet call it; `None` where the place decides.
    pub(crate) const fn name(self) -> Option<&'static str> {
        match self {
            Self::ByPlace => None,
            Self::Measured => Some("measured"),
            Self::Given => Some("given"),
            Self::Extended => Some("extended"),
            Self::Noise => Some("noise"),
        }
    }
}
