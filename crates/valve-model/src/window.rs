//! The orifice's window: which part of its area the spool has uncovered, A/A_open, after which part x of its way from closed
//! to open.
//!
//! - `linear`: A/A_open = x, a slot along the circumference.
//! - `round`: A/A_open = (φ − sin φ·cos φ)/π with φ = acos(1 − 2x), a round hole that a straight edge uncovers: the area
//!   of a circle's segment.
//! - a table: points (x, A/A_open), linear in between; for any window that was drawn or measured.
//!
//! All rise strictly from (0, 0) to (1, 1), so that each has an inverse.

use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

use crate::ParamError;

/// How the window opens.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant, reason = "plain data: no heap in a step")]
pub enum Window {
    /// In proportion to the way.
    #[default]
    Linear,
    /// A round hole under a straight edge.
    Round,
    /// By a table.
    Table(WindowTable),
}

/// Points of a window between (0, 0) and (1, 1).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WindowTable {
    count: usize,
    points: [(f64, f64); Self::MAX_POINTS],
}

/// Steps of Newton's method, kept within a bracket, for the inverse of the round window: enough for any area.
const NEWTON_STEPS: usize = 60;

impl Window {
    /// A/A_open after the part `way` of the way; 0 before, 1 beyond.
    pub fn area(&self, way: f64) -> f64 {
        let way = way.clamp(0.0, 1.0);
        match self {
            Self::Linear => way,
            Self::Round => segment((1.0 - 2.0 * way).acos()),
            Self::Table(table) => interpolate(table.points().iter().copied(), way),
        }
    }

    /// The part of the way at which the window has opened to `area`; 0 below, 1 above.
    pub fn way(&self, area: f64) -> f64 {
        let area = area.clamp(0.0, 1.0);
        match self {
            Self::Linear => area,
            Self::Round => 0.5 * (1.0 - segment_angle(area).cos()),
            Self::Table(table) => interpolate(table.points().iter().map(|&(way, area)| (area, way)), area),
        }
    }
}

impl WindowTable {
    /// The most points that a table may have.
    pub const MAX_POINTS: usize = 16;

    /// A table of points (part of the way, part of the area).
    ///
    /// # Errors
    /// Fewer than two points or more than [`Self::MAX_POINTS`], a first one other than (0, 0), a last one other than
    /// (1, 1), or one that doesn't rise in both from the one before.
    pub fn new(points: &[(f64, f64)]) -> Result<Self, ParamError> {
        let refuse = |found: String, expected| Err(ParamError::new("window_table", found, expected));
        if !(2..=Self::MAX_POINTS).contains(&points.len()) {
            return refuse(format!("{} points", points.len()), "2 to 16 points [way, area]");
        }
        let ends = (points.first(), points.last());
        if ends != (Some(&(0.0, 0.0)), Some(&(1.0, 1.0))) {
            return refuse(format!("{ends:?}"), "points [way, area] from [0, 0] to [1, 1]");
        }
        let falls = points.windows(2).find(|pair| !matches!(pair, [a, b] if b.0 > a.0 && b.1 > a.1));
        if let Some(pair) = falls {
            return refuse(format!("{pair:?}"), "points [way, area] of which both rise strictly");
        }
        let mut table = Self { count: points.len(), points: [(1.0, 1.0); Self::MAX_POINTS] };
        table.points.iter_mut().zip(points).for_each(|(own, point)| *own = *point);
        Ok(table)
    }

    /// The points (part of the way, part of the area).
    pub fn points(&self) -> &[(f64, f64)] {
        self.points.get(..self.count).unwrap_or(&self.points)
    }
}

/// Area of a circle's segment of half-angle φ, as a part of the circle's.
fn segment(half_angle_rad: f64) -> f64 {
    (half_angle_rad - half_angle_rad.sin() * half_angle_rad.cos()) / PI
}

/// The half-angle φ of a segment: 2φ − sin 2φ = 2π·area, Newton's steps within a bracket since the slope is zero at the ends.
fn segment_angle(area: f64) -> f64 {
    let (mut low, mut high) = (0.0, TAU);
    // For small areas 2φ is near the cube root of 12π·area; from the other end alike.
    let near_end = |area: f64| (12.0 * PI * area).cbrt().min(PI);
    let mut twice = if area < 0.5 { near_end(area) } else { TAU - near_end(1.0 - area) };
    for _ in 0..NEWTON_STEPS {
        let excess = twice - twice.sin() - TAU * area;
        if excess > 0.0 {
            high = twice;
        } else {
            low = twice;
        }
        let newton = twice - excess / (1.0 - twice.cos());
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - twice).abs() <= f64::EPSILON * TAU {
            break;
        }
        twice = next;
    }
    0.5 * twice
}

/// Linear between points whose first numbers rise.
fn interpolate(mut points: impl Iterator<Item = (f64, f64)>, at: f64) -> f64 {
    let Some(mut before) = points.next() else { return f64::NAN };
    for point in points {
        if at <= point.0 {
            return before.1 + (point.1 - before.1) * (at - before.0) / (point.0 - before.0);
        }
        before = point;
    }
    before.1
}
