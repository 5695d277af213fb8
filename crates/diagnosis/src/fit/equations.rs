//! The residual of every piece and its sensitivities at one hypothesis, as normal equations.
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use crate::DiagnosisError;
use crate::extend::hypothesis::{Free, Hypothesis};
use crate::fit::kept::Kept;
use crate::fit::law_column::LawColumn;
use crate::log::campaign::Campaign;
use crate::log::initial_state::InitialState;
use crate::log::piece::Piece;
use crate::log::ready::Ready;
use crate::numerics::gram::Gram;
use crate::numerics::loss::Loss;
use crate::workers::{Workers, map};
use log_data::AngleZero;
use nalgebra::{Cholesky, DMatrix, DVector};
use valve_model::{EffectId, Model};

/// Nuisance parameters: they differ from run to run, and are not reported as causes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Nuisances {
    /// Standard deviation of the torque's zero from run to run, N·m; 0 if it doesn't vary.
    pub zero_nm: f64,
    /// True if each run has a zero of its own angle.
    pub angle_zero: bool,
}

impl Nuisances {
    /// Those of a log of which no more is known than it says: an angle's own zeros where it has them.
    pub fn of(campaign: &Campaign) -> Self {
        Self { zero_nm: 0.0, angle_zero: campaign.angle_zero == Some(AngleZero::PerRun) }
    }

    /// 1/variance of the prior of a run's zero; 0 where an angle's may be anything.
    pub fn zero_ridge(self) -> f64 {
        if self.angle_zero { 0.0 } else { 1.0 / (self.zero_nm * self.zero_nm) }
    }
}

/// A torque added to the others independent of friction: its sensitivity needs no simulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Additive {
    Constant,
    Pressure,
    /// Order; sine instead of cosine; times the pressure.
    Harmonic(usize, bool, bool),
}

/// A sensitivity.
pub(crate) enum Column {
    /// (prediction of this − prediction)/size
    Simulated(Ready, f64),
    Direct(Additive),
    /// Kept sensitivities, by their place in [`Setting::kept`].
    Kept(usize),
    Law(Box<LawColumn>),
}

/// A piece's equations.
pub(crate) struct PieceEquations {
    pub gram: Gram,
    /// The nuisances as a function of the other columns: change = last column − others·β.
    pub nuisances: DMatrix<f64>,
}

/// A point of the fit: a hypothesis, and the start of each piece.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Point {
    pub hypothesis: Hypothesis,
    /// By piece.
    pub starts: Vec<InitialState>,
}

impl Point {
    /// The initial state of a piece.
    pub fn start(&self, piece: usize) -> InitialState {
        self.starts.get(piece).copied().unwrap_or_default()
    }
}

/// What all evaluations share.
#[derive(Clone, Copy)]
pub(crate) struct Setting<'a> {
    pub campaign: &'a Campaign,
    pub given: &'a Model,
    pub nuisances: Nuisances,
    pub workers: &'a dyn Workers,
    /// Sensitivities to corrections that are used in place of exact ones.
    pub kept: Option<&'a Kept>,
}

impl<'a> Setting<'a> {
    pub fn new(
        campaign: &'a Campaign,
        given: &'a Model,
        nuisances: Nuisances,
        workers: &'a dyn Workers,
    ) -> Self {
        Self { campaign, given, nuisances, workers, kept: None }
    }

    /// The sensitivities to the corrections at a point, to be kept during the fits that follow. Only for torque logs with
    /// bristles, where simulations are the cost of a search. `None` for others: a torque without bristles is cheap, and an
    /// angle may slip elsewhere.
    pub fn sensitivities(&self, point: &Point) -> Result<Option<Kept>, DiagnosisError> {
        let campaign = self.campaign;
        if !campaign.kind.smooth || campaign.facts.stiffness.is_none() {
            return Ok(None);
        }
        let exact = Setting { kept: None, ..*self };
        let (mut ids, mut columns) = (Vec::new(), Vec::new());
        for (index, of) in point.hypothesis.corrections.iter().enumerate() {
            let column = exact.own_column(&point.hypothesis, Free::Correction(index))?;
            if let Column::Simulated(moved, size) = column {
                ids.push(of.id);
                columns.push((moved, size));
            }
        }
        let ready = self.ready(&point.hypothesis)?;
        let by_piece = map(self.workers, campaign.pieces.len(), |index| {
            let piece = campaign.pieces.get(index).filter(|piece| piece.is_fitted());
            let Some(piece) = piece else { return Vec::new() };
            let start = point.start(index);
            let base = piece.predict(&ready, start);
            let of =
                |(moved, size): &(Ready, f64)| sensitivity(piece, &base, (moved, *size), start).collect();
            columns.iter().map(of).collect()
        });
        Ok(Some(Kept { ids, by_piece }))
    }

    /// The columns of the hypothesis' free numbers.
    pub fn own_columns(&self, hypothesis: &Hypothesis) -> Result<Vec<Column>, DiagnosisError> {
        hypothesis.free().into_iter().map(|free| self.own_column(hypothesis, free)).collect()
    }

    /// The column of one number, free or not.
    pub fn own_column(&self, hypothesis: &Hypothesis, free: Free) -> Result<Column, DiagnosisError> {
        if free == Free::Zero {
            return Ok(Column::Direct(Additive::Constant));
        }
        if let Free::Correction(index) = free
            && let Some(of) = hypothesis.corrections.get(index)
            && let Some(place) = self.kept.and_then(|kept| kept.place(of.id))
        {
            return Ok(Column::Kept(place));
        }
        if let Free::Number(member, number) = free
            && let Some(of) = hypothesis.members.get(member)
            && let Some(additive) = self.additive(hypothesis, of.candidate.id, number)
        {
            return Ok(Column::Direct(additive));
        }
        let size = hypothesis.step(free);
        let mut moved = hypothesis.clone();
        moved.set(free, hypothesis.get(free) + size);
        let size = moved.get(free) - hypothesis.get(free);
        Ok(Column::Simulated(self.ready(&moved)?, size))
    }

    /// Whether a torque beside friction changes what is measured by itself alone.
    pub fn adds_torques(&self, hypothesis: &Hypothesis) -> bool {
        let between = EffectId::CouplingCompliance;
        let given = || self.given.effects.iter().any(|effect| effect.id() == between);
        self.campaign.kind.smooth && !hypothesis.has(between) && !given()
    }

    /// An effect's number whose sensitivity is known without simulation.
    pub fn additive(&self, hypothesis: &Hypothesis, id: EffectId, number: usize) -> Option<Additive> {
        if !self.adds_torques(hypothesis) {
            return None;
        }
        let harmonic = |times_pressure| Additive::Harmonic(number / 2 + 1, number % 2 == 1, times_pressure);
        match id {
            EffectId::TorqueOffset => Some(Additive::Constant),
            EffectId::PressureTorque => Some(Additive::Pressure),
            EffectId::PositionTorque => Some(harmonic(false)),
            EffectId::FlowTorque => Some(harmonic(true)),
            EffectId::CoulombLevel
            | EffectId::StaticLevel
            | EffectId::ViscousLevel
            | EffectId::StribeckVelocity
            | EffectId::BristleStiffness
            | EffectId::BristleDamping
            | EffectId::RotorInertia
            | EffectId::MotorDamping
            | EffectId::LoadInertia
            | EffectId::HoldingTorqueLevel
            | EffectId::TorqueGain
            | EffectId::PressureDependentFriction
            | EffectId::TemperatureDependentViscosity
            | EffectId::TemperatureDependentFriction
            | EffectId::AngleDependentFriction
            | EffectId::DirectionAsymmetry
            | EffectId::DwellStiction
            | EffectId::HydraulicLock
            | EffectId::FrictionLag
            | EffectId::PreslidingHysteresis
            | EffectId::WearDrift
            | EffectId::CouplingCompliance
            | EffectId::DetentTorque
            | EffectId::MicrostepError
            | EffectId::Backlash
            | EffectId::MissedSteps
            | EffectId::SensorDelay
            | EffectId::EncoderEccentricity
            | EffectId::Custom(_) => None,
        }
    }

    /// True if nothing more is to be tried: the caller's time or the number of simulated samples is used up.
    pub fn is_over(&self) -> bool {
        self.workers.is_over() || self.campaign.is_worn_out()
    }

    /// How groups of samples count in a fit.
    pub fn loss(&self) -> Loss {
        self.campaign.kind.loss
    }

    pub fn ready(&self, hypothesis: &Hypothesis) -> Result<Ready, DiagnosisError> {
        let model = hypothesis.model(self.given).map_err(|source| self.campaign.refused(source))?;
        self.campaign.ready(&model)
    }

    /// The equations of the pieces that `wanted` selects, in the pieces' order; `None` for the others.
    pub fn equations(
        &self,
        point: &Point,
        columns: &[Column],
        wanted: impl Fn(&Piece) -> bool + Sync,
    ) -> Result<Vec<Option<PieceEquations>>, DiagnosisError> {
        self.equations_as_seen(point, columns, wanted, |_| None)
    }

    /// As [`Self::equations`], with the pieces replaced where `seen` gives another one.
    pub fn equations_as_seen(
        &self,
        point: &Point,
        columns: &[Column],
        wanted: impl Fn(&Piece) -> bool + Sync,
        seen: impl Fn(&Piece) -> Option<Piece> + Sync,
    ) -> Result<Vec<Option<PieceEquations>>, DiagnosisError> {
        let ready = self.ready(&point.hypothesis)?;
        let moved = columns.iter().filter_map(|column| match column {
            Column::Simulated(moved, _) => Some(moved),
            Column::Direct(_) | Column::Kept(_) | Column::Law(_) => None,
        });
        self.predict_courses(point, &std::iter::once(&ready).chain(moved).collect::<Vec<_>>());
        let job = |index: usize| {
            let piece = self.campaign.pieces.get(index).filter(|piece| wanted(piece))?;
            let start = point.start(index);
            let zero = point.hypothesis.zero_rad.unwrap_or(0.0);
            let other = seen(piece);
            let seen = other.as_ref().unwrap_or(piece);
            Some(self.piece_equations((index, seen), &ready, start, zero, columns))
        };
        Ok(map(self.workers, self.campaign.pieces.len(), job))
    }

    /// Predicts the runs that are cut, in parallel and beforehand: otherwise the pieces of a run would wait for each other.
    fn predict_courses(&self, point: &Point, models: &[&Ready]) {
        let pieces = self.campaign.pieces.iter().enumerate();
        let seconds: Vec<usize> = pieces
            .filter(|(index, piece)| {
                let before = index.checked_sub(1).and_then(|before| self.campaign.pieces.get(before));
                piece.follows() && before.is_some_and(|before| !before.follows())
            })
            .map(|(index, _)| index)
            .collect();
        if seconds.is_empty() {
            return;
        }
        map(self.workers, models.len() * seconds.len(), |job| {
            let (model, second) = (models.get(job / seconds.len())?, seconds.get(job % seconds.len())?);
            self.campaign.pieces.get(*second).map(|piece| piece.predict(model, point.start(*second)).len())
        });
    }

    fn piece_equations(
        &self,
        (place, piece): (usize, &Piece),
        ready: &Ready,
        start: InitialState,
        zero: f64,
        columns: &[Column],
    ) -> PieceEquations {
        let (shifts, ridges) = self.piece_nuisances(piece, ready);
        let offset = shifts.len();
        let width = offset + columns.len() + 1;
        let mut x = DMatrix::zeros(piece.len(), width);
        let base = piece.predict(ready, start);
        let mut put = |column: usize, values: &mut dyn Iterator<Item = f64>| {
            let target = x.column_iter_mut().nth(column);
            if let Some(mut target) = target {
                for ((slot, value), weight) in target.iter_mut().zip(values).zip(&piece.weights) {
                    // A value that isn't finite counts as one of zero weight.
                    *slot = if *weight > 0.0 && value.is_finite() { value * weight } else { 0.0 };
                }
            }
        };
        for (index, shift) in shifts.iter().enumerate() {
            match shift {
                None => put(index, &mut std::iter::repeat_n(1.0, piece.len())),
                Some(size) => {
                    let size = if start.shift > 0.0 { -size } else { *size };
                    let moved = piece.predict(ready, start.shifted(start.shift + size));
                    put(index, &mut moved.iter().zip(&base).map(|(moved, base)| (moved - base) / size));
                }
            }
        }
        for (index, column) in columns.iter().enumerate() {
            match column {
                Column::Simulated(moved, size) => {
                    put(offset + index, &mut sensitivity(piece, &base, (moved, *size), start));
                }
                Column::Kept(kept) => {
                    let values = self.kept.map_or(&[][..], |all| all.of(place, *kept));
                    put(offset + index, &mut values.iter().copied());
                }
                Column::Law(law) => {
                    let mut values = law.values(piece);
                    match law.on.and_then(|on| Some(self.kept?.of(place, on))) {
                        None => values = ready.as_measured(&piece.driven, values),
                        Some(on) => values.iter_mut().zip(on).for_each(|(value, on)| *value *= on),
                    }
                    put(offset + index, &mut values.into_iter());
                }
                // The transducer's offset is added after its scale, and a delay doesn't change a constant.
                Column::Direct(Additive::Constant) => {
                    put(offset + index, &mut std::iter::repeat_n(1.0, piece.len()));
                }
                Column::Direct(additive) => {
                    let values = ready.as_measured(&piece.driven, direct(*additive, piece).collect());
                    put(offset + index, &mut values.into_iter());
                }
            }
        }
        put(width - 1, &mut piece.measured.iter().zip(&base).map(|(measured, base)| measured - base - zero));
        finish(&x, &ridges, piece)
    }

    /// The nuisances of a piece: a shift of the start, `Some(step)`, and a constant, `None`; and their priors' 1/variance.
    fn piece_nuisances(&self, piece: &Piece, ready: &Ready) -> (Vec<Option<f64>>, Vec<f64>) {
        let (mut shifts, mut ridges) = (Vec::new(), Vec::new());
        let bound = piece.start_bound(ready);
        if bound > 0.0 {
            shifts.push(Some(piece.start_step(ready)));
            ridges.push(1.0 / (bound * bound));
        }
        if self.nuisances.zero_nm > 0.0 {
            shifts.push(None);
            ridges.push(1.0 / (self.nuisances.zero_nm * self.nuisances.zero_nm));
        }
        if self.nuisances.angle_zero {
            shifts.push(None);
            ridges.push(0.0);
        }
        (shifts, ridges)
    }
}

/// The sensitivity of a piece's prediction to a number, from a model in which that is changed by `size`.
fn sensitivity<'a>(
    piece: &Piece,
    base: &'a [f64],
    (moved, size): (&Ready, f64),
    start: InitialState,
) -> impl Iterator<Item = f64> + use<'a> {
    piece.predict(moved, start).into_iter().zip(base).map(move |(moved, base)| (moved - base) / size)
}

fn finish(x: &DMatrix<f64>, ridges: &[f64], piece: &Piece) -> PieceEquations {
    let all = x.tr_mul(x);
    let gram = Gram::without_nuisances(&all, ridges, piece.count());
    let nuisances = ridges.len();
    let mut inner = all.view((0, 0), (nuisances, nuisances)).into_owned();
    for (index, ridge) in ridges.iter().enumerate() {
        inner[(index, index)] += ridge + f64::MIN_POSITIVE.sqrt();
    }
    let cross = all.view((0, nuisances), (nuisances, all.ncols() - nuisances)).into_owned();
    let nuisances = Cholesky::new(inner).map_or_else(|| DMatrix::zeros(0, 0), |factor| factor.solve(&cross));
    PieceEquations { gram, nuisances }
}

fn direct(additive: Additive, piece: &Piece) -> Box<dyn Iterator<Item = f64> + '_> {
    let pressure = |index: usize| piece.driven.pressure_pa().get(index).copied().unwrap_or(0.0) / 1e6;
    match additive {
        Additive::Constant => Box::new(std::iter::repeat_n(1.0, piece.len())),
        Additive::Pressure => Box::new((0..piece.len()).map(pressure)),
        Additive::Harmonic(order, sine, times_pressure) => {
            let order = order as f64;
            let motions = piece.motions.iter().enumerate();
            Box::new(motions.map(move |(index, motion)| {
                let wave =
                    if sine { (order * motion.angle_rad).sin() } else { (order * motion.angle_rad).cos() };
                if times_pressure { wave * pressure(index) } else { wave }
            }))
        }
    }
}

/// Equations summed by group; groups without a piece are empty. The last one, in no fold, is the prior from the tolerance. If the model
/// leaves more than noise, the prior's weight grows with the misfit, so that unrelated errors of the model don't overrule it.
pub(crate) fn by_group(
    campaign: &Campaign,
    hypothesis: &Hypothesis,
    equations: &[Option<PieceEquations>],
    columns: usize,
) -> Vec<Gram> {
    let mut groups = vec![Gram::zero(columns); campaign.groups.len()];
    for (piece, equations) in campaign.pieces.iter().zip(equations) {
        if let (Some(group), Some(equations)) = (groups.get_mut(piece.group), equations) {
            group.add(&equations.gram);
        }
    }
    let (square, count) = groups
        .iter()
        .fold((0.0, 0.0), |(square, count), group| (square + group.square(), count + group.count));
    groups.push(hypothesis.prior(columns).times((square / f64::max(count, 1.0)).max(1.0)));
    groups
}

/// The change of a piece's initial state when the columns change by β.
pub(crate) fn start_change(equations: &PieceEquations, beta: &DVector<f64>) -> f64 {
    let nuisances = &equations.nuisances;
    if nuisances.nrows() == 0 {
        return 0.0;
    }
    let last = nuisances.ncols() - 1;
    let others: f64 = beta.iter().enumerate().map(|(index, beta)| nuisances[(0, index)] * beta).sum();
    nuisances[(0, last)] - others
}
