//! What was predicted already, by model, stretch and start: a search asks for every other prediction more than once.

use crate::log::initial_state::InitialState;
use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use valve_model::{Model, ParamError};

/// Predicted values that are kept, of all models together: 32 MB.
const MOST_VALUES: usize = 4_000_000;
/// Models that are kept: of a short log many would be, and each that is asked for is compared with all of them. A step of a fit asks for
/// some twenty, a round of candidates for some hundred.
const MOST_MODELS: usize = 256;

/// A stretch of the log that is predicted in one go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Stretch {
    /// A run, by its place in the log.
    Run(usize),
    /// A piece, by its run and first row.
    Piece(usize, usize),
}

/// A prediction: stretch, and the initial state's shift and side as bits.
pub(crate) type Key = (Stretch, u64, Option<u64>);

/// The key of a stretch's prediction from a start.
pub(crate) fn key(stretch: Stretch, start: InitialState) -> Key {
    (stretch, start.shift.to_bits(), start.side.map(f64::to_bits))
}

/// The predictions of one model.
#[derive(Debug, Default)]
pub(crate) struct Predictions {
    found: Mutex<BTreeMap<Key, Arc<OnceLock<Vec<f64>>>>>,
    values: AtomicUsize,
}

impl Predictions {
    /// The values of a prediction, or these rows of it, simulated if they aren't there yet. Who asks meanwhile waits.
    pub fn get(
        &self,
        key: Key,
        rows: Option<&Range<usize>>,
        simulate: impl FnOnce() -> Vec<f64>,
    ) -> Vec<f64> {
        let own = Arc::clone(locked(&self.found).entry(key).or_default());
        let all = own.get_or_init(|| {
            let values = simulate();
            self.values.fetch_add(values.len(), Ordering::Relaxed);
            values
        });
        rows.map_or(Some(all.as_slice()), |rows| all.get(rows.clone())).unwrap_or_default().to_vec()
    }
}

/// A model prepared to predict, and what it predicted; `P` is what a prediction needs of it.
#[derive(Debug)]
pub(crate) struct Prepared<P> {
    model: Model,
    pub params: P,
    pub predictions: Predictions,
}

/// The models that were prepared lately, the latest last.
#[derive(Debug)]
pub(crate) struct Models<P> {
    lately: Mutex<VecDeque<Arc<Prepared<P>>>>,
}

impl<P> Default for Models<P> {
    fn default() -> Self {
        Self { lately: Mutex::default() }
    }
}

impl<P> Models<P> {
    /// A model as it was prepared before, or as `prepare` does. The models that were not asked for the longest are forgotten once there are
    /// more than [`MOST_MODELS`], or all predictions together are more than [`MOST_VALUES`].
    pub fn prepared(
        &self,
        model: &Model,
        prepare: impl FnOnce() -> Result<P, ParamError>,
    ) -> Result<Arc<Prepared<P>>, ParamError> {
        let mut lately = locked(&self.lately);
        let found = lately.iter().rposition(|of| of.model == *model);
        let prepared = match found.and_then(|place| lately.remove(place)) {
            Some(prepared) => prepared,
            None => {
                let (model, predictions) = (model.clone(), Predictions::default());
                Arc::new(Prepared { model, params: prepare()?, predictions })
            }
        };
        lately.push_back(Arc::clone(&prepared));
        let values = |of: &Arc<Prepared<P>>| of.predictions.values.load(Ordering::Relaxed);
        let mut kept: usize = lately.iter().map(values).sum();
        while lately.len() > MOST_MODELS || kept > MOST_VALUES && lately.len() > 1 {
            kept -= lately.pop_front().as_ref().map_or(0, values);
        }
        Ok(prepared)
    }
}

/// A lock whatever became of who held it: what it guards is never left half-made.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::fixtures;
    use crate::log::campaign::Campaign;
    use crate::workers::OneAfterTheOther;
    use log_data::{Log, Run};
    use valve_model::{FrictionParams, LuGreParams};

    fn model(coulomb_nm: f64) -> Model {
        let law =
            LuGreParams { coulomb_torque_nm: coulomb_nm, static_torque_nm: 2.0, ..LuGreParams::BENCH_RIG };
        Model { friction: FrictionParams::LuGre(law), ..fixtures::model(Vec::new()) }
    }

    #[test]
    fn what_is_asked_for_again_is_simulated_once() {
        let predictions = Predictions::default();
        let start = InitialState::at(0.1);
        let keys = [
            key(Stretch::Piece(0, 0), start),
            key(Stretch::Piece(0, 400), start),
            key(Stretch::Run(0), start),
            key(Stretch::Piece(0, 0), start.shifted(0.2)),
            key(Stretch::Piece(0, 0), InitialState { side: Some(0.0), ..start }),
        ];
        let simulated = AtomicUsize::new(0);
        for round in 0..2 {
            for (index, key) in keys.into_iter().enumerate() {
                let values = predictions.get(key, None, || {
                    simulated.fetch_add(1, Ordering::Relaxed);
                    vec![index as f64]
                });
                assert_eq!(values, [index as f64], "round {round}");
            }
        }
        assert_eq!(simulated.into_inner(), keys.len());
    }

    #[test]
    fn models_asked_for_the_longest_ago_are_forgotten_first() {
        let models = Models::default();
        let prepared = |coulomb_nm: f64| models.prepared(&model(coulomb_nm), || Ok(())).unwrap();
        let fill = |of: &Prepared<()>, values: usize| {
            of.predictions
                .get(key(Stretch::Run(values), InitialState::default()), None, || vec![0.0; values]);
        };
        let (one, two) = (prepared(1.0), prepared(1.1));
        fill(&one, MOST_VALUES / 2);
        fill(&two, MOST_VALUES / 2);
        assert!(Arc::ptr_eq(&one, &prepared(1.0)), "no more than may be kept: both are");
        let three = prepared(1.2);
        fill(&three, 1);
        prepared(1.2);
        assert!(Arc::ptr_eq(&one, &prepared(1.0)) && !Arc::ptr_eq(&two, &prepared(1.1)));
    }

    #[test]
    fn no_more_models_are_kept_than_can_be_looked_through() {
        let models = Models::default();
        let prepared =
            |number: usize| models.prepared(&model(1.0 + 1e-3 * number as f64), || Ok(())).unwrap();
        let (first, second) = (prepared(0), prepared(1));
        (2..MOST_MODELS).for_each(|number| drop(prepared(number)));
        assert!(Arc::ptr_eq(&first, &prepared(0)), "as many as may be kept: all are");
        prepared(MOST_MODELS);
        assert_eq!(locked(&models.lately).len(), MOST_MODELS);
        assert!(Arc::ptr_eq(&first, &prepared(0)), "asked for lately");
        assert!(!Arc::ptr_eq(&second, &prepared(1)), "asked for the longest ago");
    }

    #[test]
    fn rows_of_what_is_kept_are_those_of_the_whole() {
        let predictions = Predictions::default();
        let run = key(Stretch::Run(0), InitialState::default());
        let rows = |rows: Range<usize>| predictions.get(run, Some(&rows), || vec![0.0, 1.0, 2.0, 3.0]);
        assert_eq!(rows(1..3), [1.0, 2.0]);
        assert_eq!(rows(3..4), [3.0]);
        assert!(rows(3..5).is_empty(), "beyond its end");
    }

    /// Swings whose angle is read with an error of 50 µrad.
    fn swings(number: u32) -> Run {
        let time_s: Vec<f64> = (0..400).map(|k| 5.0 * f64::from(number) + 1e-3 * f64::from(k)).collect();
        let mut random = number + 1;
        let mut read = |angle_rad: f64| {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            angle_rad + 1e-4 * (f64::from(random >> 8) / f64::from(1 << 24) - 0.5)
        };
        let angle_rad = time_s.iter().map(|time_s| read(0.3 * (9.0 * time_s).sin())).collect();
        Run {
            name: format!("{number}"),
            torque_nm: Some(vec![0.0; time_s.len()]),
            time_s,
            angle_rad,
            ..Run::default()
        }
    }

    #[test]
    fn a_motion_measured_again_is_predicted_anew() {
        let log = Log { runs: (0..8).map(swings).collect(), ..Log::default() };
        let campaign = Campaign::new(&log, &model(1.0), 0, &OneAfterTheOther).unwrap();
        let ready = campaign.ready(&model(1.0)).unwrap();
        let piece = campaign.pieces.first().unwrap();
        let start = InitialState::at(0.1);
        let measured = piece.predict(&ready, start);
        let again = piece.again(1);
        assert_ne!(measured, again.predict(&ready, start));
        assert_ne!(again.predict(&ready, start), piece.again(2).predict(&ready, start));
        assert_eq!(measured, piece.predict(&ready, start));
    }
}
