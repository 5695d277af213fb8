//! Intervals: all values that an expression may have while its variables are anywhere in theirs.
//!
//! Rounding is not directed outwards: bounds are right to a few parts in 1e16.

use crate::function::{Binary, Unary};
use crate::number::Number;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// All numbers from `low` to `high`; NaN where there might be no value, or no finite one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The least number.
    pub low: f64,
    /// The greatest number.
    pub high: f64,
}

const NOWHERE: Interval = Interval { low: f64::NAN, high: f64::NAN };

impl Interval {
    /// From one number to another.
    pub fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    /// Whether it is sure to have a finite value.
    pub fn is_sound(&self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }

    fn holds(&self, number: f64) -> bool {
        self.low <= number && number <= self.high
    }

    /// Of a function that only rises.
    fn rising(self, of: impl Fn(f64) -> f64) -> Self {
        Self::new(of(self.low), of(self.high))
    }

    /// Around the values at all four corners.
    fn corners(self, other: Self, of: impl Fn(f64, f64) -> f64) -> Self {
        let at = [
            of(self.low, other.low),
            of(self.low, other.high),
            of(self.high, other.low),
            of(self.high, other.high),
        ];
        if at.iter().any(|value| value.is_nan()) {
            return NOWHERE;
        }
        let around = |all: Self, value: &f64| Self::new(all.low.min(*value), all.high.max(*value));
        at.iter().fold(Self::new(f64::INFINITY, f64::NEG_INFINITY), around)
    }

    /// Whether some `first` + k·`period` lies within.
    fn meets(&self, first: f64, period: f64) -> bool {
        ((self.low - first) / period).ceil() * period + first <= self.high
    }

    /// Of a function that swings between −1 at `low` + k·2π and 1 at `high` + k·2π.
    fn swing(self, of: impl Fn(f64) -> f64, low: f64, high: f64) -> Self {
        let ends = (of(self.low), of(self.high));
        let least = if self.meets(low, TAU) { -1.0 } else { ends.0.min(ends.1) };
        let most = if self.meets(high, TAU) { 1.0 } else { ends.0.max(ends.1) };
        Self::new(least, most)
    }

    fn absolute(self) -> Self {
        let (low, high) = (self.low.abs(), self.high.abs());
        Self::new(if self.holds(0.0) { 0.0 } else { low.min(high) }, low.max(high))
    }

    fn over(self, other: Self) -> Self {
        if other.holds(0.0) { NOWHERE } else { self.corners(other, |x, y| x / y) }
    }

    fn power(self, exponent: Self) -> Self {
        let of = |x: f64, y: f64| Binary::Power.of(x, y);
        let whole = exponent.low == exponent.high && exponent.low.fract() == 0.0;
        if exponent.low < 0.0 && self.holds(0.0) || self.low < 0.0 && !whole {
            return NOWHERE;
        }
        if whole && exponent.low % 2.0 == 0.0 {
            return self.absolute().corners(exponent, of);
        }
        self.corners(exponent, of)
    }
}

impl Number for Interval {
    fn constant(number: f64) -> Self {
        Self::new(number, number)
    }

    fn one(self, function: Unary) -> Self {
        let of = |x: f64| function.of(x);
        match function {
            // f64's own `min` would take the other bound for one that is none.
            _ if !self.is_sound() => NOWHERE,
            Unary::Negative => Self::new(-self.high, -self.low),
            Unary::Absolute => self.absolute(),
            Unary::Root | Unary::Exponential | Unary::ArcTangent | Unary::HyperbolicTangent | Unary::Sign => {
                self.rising(of)
            }
            Unary::ArcSine => self.rising(of),
            Unary::ArcCosine => Self::new(of(self.high), of(self.low)),
            Unary::Logarithm if self.low <= 0.0 => NOWHERE,
            Unary::Logarithm => self.rising(of),
            Unary::Sine => self.swing(of, -FRAC_PI_2, FRAC_PI_2),
            Unary::Cosine => self.swing(of, PI, 0.0),
            Unary::Tangent if self.meets(FRAC_PI_2, PI) => NOWHERE,
            Unary::Tangent => self.rising(of),
        }
    }

    fn two(self, other: Self, function: Binary) -> Self {
        match function {
            _ if !(self.is_sound() && other.is_sound()) => NOWHERE,
            Binary::Add => Self::new(self.low + other.low, self.high + other.high),
            Binary::Subtract => Self::new(self.low - other.high, self.high - other.low),
            Binary::Multiply => self.corners(other, |x, y| x * y),
            Binary::Divide => self.over(other),
            Binary::Power => self.power(other),
            Binary::Least => Self::new(self.low.min(other.low), self.high.min(other.high)),
            Binary::Greatest => Self::new(self.low.max(other.low), self.high.max(other.high)),
            Binary::ArcTangent2 => Self::new(-PI, PI),
            Binary::Hypotenuse => self.absolute().corners(other.absolute(), f64::hypot),
        }
    }
}
