//! Where the angle's zero comes from.

/// How the zero is known at the beginning, and how it is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Homing {
    /// Whether the run begins with a valve that is homed, and aligned to its encoder.
    pub begins_homed: bool,
    /// How to home; `None`: not at all.
    pub search: Option<HomingSearch>,
    /// Where the simulated valve has its marks.
    pub marks: HomingMarks,
}

impl Homing {
    /// A run that begins homed, of a valve that can't be homed.
    pub(crate) const BEGINS_HOMED: Self = Self {
        begins_homed: true,
        search: None,
        marks: HomingMarks {
            switch_angle_rad: None,
            index_angle_rad: None,
            low_stop_rad: None,
            high_stop_rad: None,
        },
    };
}

/// What is looked for, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HomingSearch {
    /// The mark.
    pub method: HomingMethod,
    /// Speed of the search, in rad/s; its sign is the direction.
    pub speed_rad_per_s: f64,
    /// Angle of the mark, in radians.
    pub angle_rad: f64,
    /// How far it is looked for, in radians.
    pub longest_rad: f64,
    /// The part of the rated current on the way to a hard stop.
    pub stop_current: f64,
    /// How far single rests of the alignment may lie from their mean, in radians.
    pub largest_spread_rad: f64,
}

/// What gives the zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HomingMethod {
    /// A switch.
    Switch,
    /// A hard stop, met at reduced current.
    Stop,
    /// The encoder's index.
    Index,
    /// An absolute encoder.
    Absolute,
}

/// The marks of the simulated valve; those that are not given don't exist.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HomingMarks {
    /// The switch is on from this angle on, in the direction of positive angles, in radians.
    pub switch_angle_rad: Option<f64>,
    /// The encoder's index, once a turn, in radians.
    pub index_angle_rad: Option<f64>,
    /// A hard stop below, in radians.
    pub low_stop_rad: Option<f64>,
    /// A hard stop above, in radians.
    pub high_stop_rad: Option<f64>,
}

impl HomingMarks {
    /// The one mark that a search with this method and speed meets at `angle_rad`; none for an absolute encoder.
    pub fn of(method: HomingMethod, angle_rad: f64, speed_rad_per_s: f64) -> Self {
        let at = |wanted: HomingMethod| (method == wanted).then_some(angle_rad);
        let stop = at(HomingMethod::Stop);
        Self {
            switch_angle_rad: at(HomingMethod::Switch),
            index_angle_rad: at(HomingMethod::Index),
            low_stop_rad: stop.filter(|_| speed_rad_per_s < 0.0),
            high_stop_rad: stop.filter(|_| speed_rad_per_s > 0.0),
        }
    }
}
