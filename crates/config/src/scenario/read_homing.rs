//! `[homing]`: whether the zero is known at the beginning, and how it is found.

use crate::bounds::{ANGLE, Bounds};
use crate::reader::Section;
use crate::scenario::{Encoder, Homing, HomingMarks, HomingMethod, HomingSearch};
use crate::units::Dimension;

const SPEED: Bounds = Bounds::either_sign(100.0);
const WAY: Bounds = Bounds::positive(1e3);
const SPREAD: Bounds = Bounds::positive(0.1);
const CURRENT: Bounds = Bounds::within(0.05, 1.0);

/// Just over a turn: an index or a switch on a spool that turns is met within it.
const DEFAULT_WAY_RAD: f64 = 6.6;
/// A third of what the loss of one step of 0.72° would show.
const DEFAULT_SPREAD_RAD: f64 = 4e-3;
const DEFAULT_STOP_CURRENT: f64 = 0.7;

/// The section, or what a scenario without it means: a run that begins homed.
pub(super) fn read_homing(root: &Section<'_>, encoder: &Encoder) -> Homing {
    let Some(section) = root.optional_section("homing") else { return Homing::BEGINS_HOMED };
    let begins_homed = section.find("begins_homed").is_none_or(|field| field.boolean());
    let search = read_search(&section, encoder);
    let marks = section.optional_section("simulated").map_or(Homing::BEGINS_HOMED.marks, read_marks);
    section.finish();
    Homing { begins_homed, search, marks }
}

fn read_search(section: &Section<'_>, encoder: &Encoder) -> Option<HomingSearch> {
    let angle_rad = section.optional_quantity("angle", Dimension::Angle, ANGLE).unwrap_or(0.0);
    let speed = section.find("speed");
    let speed_rad_per_s = speed.as_ref().map_or(-0.2, |field| field.quantity(Dimension::Speed, SPEED));
    if let Some(field) = speed
        && speed_rad_per_s == 0.0
    {
        field.refuse("a speed; its sign says in which direction the mark is");
    }
    let optional = |key, dimension, bounds, default: f64| {
        section.optional_quantity(key, dimension, bounds).unwrap_or(default)
    };
    let longest_rad = optional("longest", Dimension::Angle, WAY, DEFAULT_WAY_RAD);
    let stop_current = optional("stop_current", Dimension::Ratio, CURRENT, DEFAULT_STOP_CURRENT);
    let largest_spread_rad = optional("largest_spread", Dimension::Angle, SPREAD, DEFAULT_SPREAD_RAD);
    let field = section.find("method")?;
    let others =
        [("stop", HomingMethod::Stop), ("index", HomingMethod::Index), ("absolute", HomingMethod::Absolute)];
    let method = field.choice(("switch", HomingMethod::Switch), &others)?;
    if method != HomingMethod::Switch && !encoder.fitted {
        field.refuse("\"switch\": the others need an encoder");
    }
    if method == HomingMethod::Absolute && !encoder.absolute {
        field.refuse("another method, or absolute = true in [encoder]");
    }
    Some(HomingSearch { method, speed_rad_per_s, angle_rad, longest_rad, stop_current, largest_spread_rad })
}

fn read_marks(section: Section<'_>) -> HomingMarks {
    let angle = |key| section.optional_quantity(key, Dimension::Angle, ANGLE);
    let marks = HomingMarks {
        switch_angle_rad: angle("switch"),
        index_angle_rad: angle("index"),
        low_stop_rad: angle("low_stop"),
        high_stop_rad: angle("high_stop"),
    };
    section.finish();
    marks
}
