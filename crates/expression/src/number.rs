//! What a program may run on: numbers, and numbers with their derivatives.

use crate::function::{Binary, Unary};

/// Something that a program can calculate with.
pub trait Number: Copy {
    /// A number that is known.
    fn constant(number: f64) -> Self;
    /// A function of it.
    #[must_use]
    fn one(self, function: Unary) -> Self;
    /// A function of it and another.
    #[must_use]
    fn two(self, other: Self, function: Binary) -> Self;
}

impl Number for f64 {
    #[inline]
    fn constant(number: f64) -> Self {
        number
    }

    #[inline]
    fn one(self, function: Unary) -> Self {
        function.of(self)
    }

    #[inline]
    fn two(self, other: Self, function: Binary) -> Self {
        function.of(self, other)
    }
}

/// A number and its derivatives by `N` variables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    /// The number.
    pub value: f64,
    /// Its derivatives, 0 at a corner and where they aren't finite.
    pub slopes: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// The variable with this place among the derivatives; beyond them, a constant.
    #[inline]
    pub fn variable(value: f64, place: usize) -> Self {
        let mut slopes = [0.0; N];
        if let Some(own) = slopes.get_mut(place) {
            *own = 1.0;
        }
        Self { value, slopes }
    }
}

/// A derivative through a function: nothing where the argument doesn't change, however steep the function is.
#[inline]
fn through(steep: f64, slope: f64) -> f64 {
    let product = steep * slope;
    if slope == 0.0 || !product.is_finite() { 0.0 } else { product }
}

// Slopes go through loops: an array's `map` is not inlined, and costs as much as all else here.
impl<const N: usize> Number for Dual<N> {
    #[inline]
    fn constant(number: f64) -> Self {
        Self { value: number, slopes: [0.0; N] }
    }

    #[inline]
    fn one(self, function: Unary) -> Self {
        let value = function.of(self.value);
        let steep = function.slope(self.value, value);
        let mut slopes = self.slopes;
        for slope in &mut slopes {
            *slope = through(steep, *slope);
        }
        Self { value, slopes }
    }

    #[inline]
    fn two(self, other: Self, function: Binary) -> Self {
        let value = function.of(self.value, other.value);
        let (first, second) = function.slopes(self.value, other.value, value);
        let mut slopes = self.slopes;
        for (slope, more) in slopes.iter_mut().zip(other.slopes) {
            *slope = through(first, *slope) + through(second, more);
        }
        Self { value, slopes }
    }
}
