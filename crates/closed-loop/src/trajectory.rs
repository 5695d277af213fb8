//! The trajectory generator's role: set-points, Feedback and ControlStatus in; Reference out.

use serde::{Deserialize, Serialize};
use signals::{ControlStatus, ControllerState, Feedback, Reference, SetPoint, SetPointKind};

/// A set-point of the scenario's, due in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DueSetPoint {
    /// The cycle.
    pub cycle: u64,
    /// Code of the kind, a [`SetPointKind`].
    pub kind: u64,
    /// Its value, in the kind's unit.
    pub value: f64,
    /// A sine's frequency, Hz; else 0.
    pub frequency_hz: f64,
    /// The pressure drop that a flow is meant at; `None` for the measured one.
    pub pressure_drop_pa: Option<f64>,
}

impl DueSetPoint {
    /// It as a message, with its place in the list as id.
    pub fn message(&self, id: u64) -> SetPoint {
        SetPoint {
            id,
            valid_until_cycle: u64::MAX,
            kind: self.kind,
            value: self.value,
            frequency_hz: self.frequency_hz,
            pressure_drop_pa: self.pressure_drop_pa.unwrap_or(0.0),
            pressure_given: u64::from(self.pressure_drop_pa.is_some()),
        }
    }

    /// One that asks for a stop.
    pub fn hold(cycle: u64) -> Self {
        Self { cycle, kind: SetPointKind::Hold.code(), value: 0.0, frequency_hz: 0.0, pressure_drop_pa: None }
    }
}

/// What the trajectory generator is told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrajectoryPart {
    /// Limits, orifice, period.
    pub params: trajectory::Params,
    /// Angle at the start, rad.
    pub initial_angle_rad: f64,
    /// The scenario's set-points in the order of their cycles.
    pub set_points: Vec<DueSetPoint>,
}

/// The trajectory generator between two cycles.
pub struct TrajectoryRole {
    part: TrajectoryPart,
    state: trajectory::State,
    next: usize,
    last_cycle: Option<u64>,
    // The scenario's set-points wait until the valve is armed, however long its drive takes to energise it.
    armed: bool,
}

impl TrajectoryRole {
    /// A trajectory that holds where the scenario begins.
    pub fn new(part: TrajectoryPart) -> Self {
        let state = trajectory::State::at_rest(part.initial_angle_rad);
        Self { part, state, next: 0, last_cycle: None, armed: false }
    }

    /// Reference k+2 of cycle k, from Feedback k, ControlStatus k−1, and an operator's set-point if one came. One
    /// that the scenario has for this cycle comes first; an operator's that came too late has no effect.
    pub fn step(
        &mut self,
        cycle: u64,
        feedback: Option<&Feedback>,
        status: Option<&ControlStatus>,
        operator: Option<&SetPoint>,
    ) -> Reference {
        self.armed |= status.is_some_and(|status| status.state == ControllerState::Running.code());
        let due = self.due(cycle);
        let advance_cycles = self.last_cycle.map_or(1, |last| cycle.saturating_sub(last).max(1));
        self.last_cycle = Some(cycle);
        let in_time = |operator: &&SetPoint| cycle <= operator.valid_until_cycle;
        let set_point = due.as_ref().or(operator.filter(in_time));
        trajectory::step(
            &self.part.params,
            &mut self.state,
            &trajectory::Input { advance_cycles, feedback, status, set_point },
        )
    }

    /// The step of a cycle to come as far as its messages are there, on a copy of the state: its code and data lie in the caches then.
    /// Nothing comes of it.
    pub fn rehearse(&self, cycle: u64, feedback: Option<&Feedback>, status: Option<&ControlStatus>) {
        let mut state = self.state.clone();
        let advance_cycles = self.last_cycle.map_or(1, |last| cycle.saturating_sub(last).max(1));
        let input = trajectory::Input { advance_cycles, feedback, status, set_point: None };
        std::hint::black_box(trajectory::step(&self.part.params, &mut state, &input));
    }

    fn due(&mut self, cycle: u64) -> Option<SetPoint> {
        let due = self.part.set_points.get(self.next).filter(|due| self.armed && due.cycle <= cycle)?;
        self.next += 1;
        Some(due.message(self.next as u64))
    }

    /// Whether the scenario has a set-point for this cycle: an operator's must wait then.
    pub fn has_due(&self, cycle: u64) -> bool {
        self.armed && self.part.set_points.get(self.next).is_some_and(|due| due.cycle <= cycle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use signals::{ControllerState, validity};
    use trajectory::{Limits, Params};

    #[test]
    fn a_set_point_that_was_given_up_has_no_effect_later() {
        let limits = Limits {
            min_angle_rad: None,
            max_angle_rad: None,
            max_speed_rad_per_s: 10.0,
            max_acceleration_rad_per_s2: 500.0,
            max_jerk_rad_per_s3: 1e5,
            unhomed_speed_rad_per_s: 0.2,
        };
        let params = Params { period_s: 1e-3, limits, orifice: None, oil_density_kg_per_m3: None };
        let part = TrajectoryPart { params, initial_angle_rad: 0.0, set_points: Vec::new() };
        let status = ControlStatus {
            state: ControllerState::Running.code(),
            time_scale: 1.0,
            ..ControlStatus::default()
        };
        let feedback = Feedback { validity: validity::HOMED, ..Feedback::default() };
        let followed = |taken_in: u64, valid_until_cycle: u64| {
            let set_point = SetPoint {
                id: 7,
                valid_until_cycle,
                kind: SetPointKind::Angle.code(),
                value: 0.3,
                ..SetPoint::default()
            };
            let mut role = TrajectoryRole::new(part.clone());
            let mut cycle = |cycle: u64| {
                let operator = (cycle == taken_in).then_some(&set_point);
                role.step(cycle, Some(&feedback), Some(&status), operator).set_point_id
            };
            (0..=taken_in).map(&mut cycle).last().unwrap() == 7
        };
        assert!(followed(50, 50), "in its last cycle");
        assert!(!followed(51, 50), "a cycle late");
    }
}
