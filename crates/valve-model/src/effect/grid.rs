//! A table over one or two covariates: linear between its knots (bilinear with two), and linear on outside them.

use serde::{Deserialize, Serialize};

use super::covariate::Covariate;
use crate::ParamError;

const KNOTS: &str = "2 to 64 rising numbers, with a second covariate 2 to 16 for each";
const VALUES: &str = "a number for each knot, with a second covariate a list for each of the first's";

/// A table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    over: Vec<Covariate>,
    /// For each covariate.
    knots: Vec<Vec<f64>>,
    /// For each knot of the first covariate, those of the second's.
    values: Vec<Vec<f64>>,
}

/// Between which knots a number lies: the first of them, how far it is on the way to the next one, and their distance.
struct Between {
    first: usize,
    part: f64,
    distance: f64,
}

impl Grid {
    /// Knots of a table, at most, over one covariate, and over each of two.
    pub const MOST_KNOTS: [usize; 2] = [64, 16];

    /// A table. Over one covariate each entry of `values` is a list of one.
    ///
    /// # Errors
    /// `over`, `knots` or `values` with what is wrong with it.
    pub fn new(
        over: Vec<Covariate>,
        knots: Vec<Vec<f64>>,
        values: Vec<Vec<f64>>,
    ) -> Result<Self, ParamError> {
        let grid = Self { over, knots, values };
        grid.validate()?;
        Ok(grid)
    }

    /// What it is over, for each its knots.
    pub fn axes(&self) -> impl Iterator<Item = (Covariate, &[f64])> {
        self.over.iter().copied().zip(self.knots.iter().map(Vec::as_slice))
    }

    /// For each knot of the first covariate, the values at those of the second.
    pub fn values(&self) -> &[Vec<f64>] {
        &self.values
    }

    pub(crate) fn validate(&self) -> Result<(), ParamError> {
        let most = match self.over.as_slice() {
            [_] => 64,
            [first, second] if first != second => 16,
            other => {
                let found = format!("{} covariates", other.len());
                return Err(ParamError::new("over", found, "one covariate, or two different ones"));
            }
        };
        if self.knots.len() != self.over.len() {
            return Err(ParamError::new("knots", format!("{} lists", self.knots.len()), KNOTS));
        }
        for knots in &self.knots {
            let rising = knots.iter().zip(knots.iter().skip(1)).all(|(knot, next)| knot < next);
            if !(2..=most).contains(&knots.len()) || !rising || !knots.iter().all(|knot| knot.is_finite()) {
                let what = if rising { "" } else { ", not rising" };
                return Err(ParamError::new("knots", format!("{} numbers{what}", knots.len()), KNOTS));
            }
        }
        let count = |place: usize| self.knots.get(place).map_or(1, Vec::len);
        let fits = |row: &Vec<f64>| row.len() == count(1) && row.iter().all(|value| value.is_finite());
        if self.values.len() != count(0) || !self.values.iter().all(fits) {
            let found = format!("a list of {}", self.values.len());
            return Err(ParamError::new("values", found, VALUES));
        }
        Ok(())
    }

    pub(crate) fn is_over(&self, covariate: Covariate) -> bool {
        self.over.contains(&covariate)
    }

    /// The value, and its derivative by each covariate that it is over.
    pub(crate) fn at(&self, covariates: &[f64; Covariate::COUNT]) -> (f64, [Option<(Covariate, f64)>; 2]) {
        let between = |axis: usize| {
            let covariate = *self.over.get(axis)?;
            let x = covariates.get(covariate.place()).copied().unwrap_or(0.0);
            self.knots.get(axis).map(|knots| (covariate, Between::new(knots, x)))
        };
        let Some((first, along)) = between(0) else { return (0.0, [None; 2]) };
        let Some((second, across)) = between(1) else {
            let (low, high) = (self.value(along.first, 0), self.value(along.first + 1, 0));
            return (along.mix(low, high), [Some((first, (high - low) / along.distance)), None]);
        };
        let corner = |row: usize, column: usize| self.value(along.first + row, across.first + column);
        let (low, high) = (across.mix(corner(0, 0), corner(0, 1)), across.mix(corner(1, 0), corner(1, 1)));
        let change = along.mix(corner(0, 1) - corner(0, 0), corner(1, 1) - corner(1, 0));
        let slopes = [Some((first, (high - low) / along.distance)), Some((second, change / across.distance))];
        (along.mix(low, high), slopes)
    }

    fn value(&self, row: usize, column: usize) -> f64 {
        self.values.get(row).and_then(|row| row.get(column)).copied().unwrap_or(0.0)
    }
}

impl Between {
    fn new(knots: &[f64], x: f64) -> Self {
        let first = knots.partition_point(|knot| *knot <= x).clamp(1, knots.len().max(2) - 1) - 1;
        let at = |place: usize| knots.get(place).copied().unwrap_or(0.0);
        let distance = at(first + 1) - at(first);
        Self { first, part: (x - at(first)) / distance, distance }
    }

    fn mix(&self, low: f64, high: f64) -> f64 {
        low + self.part * (high - low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(grid: &Grid, speed: f64, angle: f64) -> (f64, Vec<f64>) {
        let mut covariates = [0.0; Covariate::COUNT];
        covariates[Covariate::Speed.place()] = speed;
        covariates[Covariate::Angle.place()] = angle;
        let (value, slopes) = grid.at(&covariates);
        (value, slopes.into_iter().flatten().map(|(_, slope)| slope).collect())
    }

    #[test]
    fn it_is_linear_between_its_knots_and_outside() {
        let values = [1.0, 2.0, 0.0].map(|value| vec![value]).to_vec();
        let grid = Grid::new(vec![Covariate::Speed], vec![vec![0.0, 1.0, 3.0]], values).unwrap();
        for (speed, value, slope) in
            [(0.5, 1.5, 1.0), (1.0, 2.0, -1.0), (2.0, 1.0, -1.0), (5.0, -2.0, -1.0), (-1.0, 0.0, 1.0)]
        {
            assert_eq!(at(&grid, speed, 9.0), (value, vec![slope]), "{speed}");
        }
    }

    #[test]
    fn over_two_covariates_it_is_bilinear() {
        let knots = vec![vec![0.0, 1.0], vec![0.0, 2.0]];
        let values = vec![vec![0.0, 2.0], vec![1.0, 7.0]];
        let grid = Grid::new(vec![Covariate::Speed, Covariate::Angle], knots, values).unwrap();
        // value = speed + angle + 2·speed·angle
        for (speed, angle) in [(0.25, 0.5), (2.0, 3.0), (-1.0, 0.0)] {
            let expected = (speed + angle + 2.0 * speed * angle, vec![1.0 + 2.0 * angle, 1.0 + 2.0 * speed]);
            assert_eq!(at(&grid, speed, angle), expected);
        }
    }

    #[test]
    fn what_is_no_table_is_refused() {
        let made = |over: &[Covariate], knots: &[&[f64]], values: &[&[f64]]| {
            let lists = |of: &[&[f64]]| of.iter().map(|list| list.to_vec()).collect();
            Grid::new(over.to_vec(), lists(knots), lists(values)).map_err(|error| error.key)
        };
        let speed = Covariate::Speed;
        let long: Vec<f64> = (0..65).map(f64::from).collect();
        assert_eq!(made(&[], &[], &[]), Err("over"));
        assert_eq!(made(&[speed, speed], &[], &[]), Err("over"));
        assert_eq!(made(&[speed], &[&[1.0, 0.0]], &[&[0.0], &[0.0]]), Err("knots"));
        assert_eq!(made(&[speed], &[&[0.0, 0.0]], &[&[0.0], &[0.0]]), Err("knots"));
        assert_eq!(made(&[speed], &[&[0.0]], &[&[0.0]]), Err("knots"));
        assert_eq!(made(&[speed], &[&long], &[]), Err("knots"));
        assert_eq!(made(&[speed], &[&[0.0, 1.0]], &[&[0.0]]), Err("values"));
        assert_eq!(made(&[speed, Covariate::Angle], &[&[0.0, 1.0], &long[..17]], &[]), Err("knots"));
    }
}
