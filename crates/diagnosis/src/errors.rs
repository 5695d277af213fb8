//! How well the numbers of a fit are known: the jackknife over groups, so that what noise, runs and the model's misfit
//! have in common within a run counts once.
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use crate::fit::Fitted;
use crate::fit::sum;
use crate::gram::{Gram, invert};
use crate::loss::Loss;
use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Covariance of the free numbers, and the factor from standard error to the 95 % half width.
pub(crate) struct Spread {
    pub covariance: DMatrix<f64>,
    pub half_width: f64,
}

/// The spread of a fit's free numbers.
pub(crate) fn spread(fitted: &Fitted, loss: Loss) -> Option<Spread> {
    let groups = loss.weighted(&fitted.groups);
    let total = sum(&groups);
    let columns: Vec<usize> = (0..total.matrix.nrows() - 1).collect();
    let (a, b) = total.part(&columns);
    let white = invert(a.clone())?;
    let groups: Vec<&Gram> = groups.iter().filter(|group| group.count > 0.0).collect();
    let count = groups.len() as f64;
    let mut clustered = DMatrix::zeros(columns.len(), columns.len());
    for group in &groups {
        let (own_a, own_b) = group.part(&columns);
        let mut rest = &a - own_a;
        for i in 0..rest.nrows() {
            rest[(i, i)] += 1e-3 * a[(i, i)];
        }
        let change = invert(rest)? * (&b - own_b);
        clustered += &change * change.transpose();
    }
    clustered *= (count - 1.0) / count;
    // Never better than white noise allows.
    let mut covariance = clustered;
    for i in 0..covariance.nrows() {
        let least = white[(i, i)];
        if covariance[(i, i)] < least {
            covariance[(i, i)] = least;
        }
    }
    let freedom = (count - 1.0).max(1.0);
    let half_width = StudentsT::new(0.0, 1.0, freedom).map_or(1.96, |t| t.inverse_cdf(0.975));
    Some(Spread { covariance, half_width })
}
