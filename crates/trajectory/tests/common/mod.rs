//! A trajectory with a controller that runs and a valve that is homed, and set-points for it.
// Each test file uses what it needs of this.
#![allow(dead_code)]

use signals::{ControlStatus, ControllerState, Feedback, Reference, SetPoint, SetPointKind, validity};
use trajectory::{Input, Limits, Params, State, step};
use valve_model::{OrificeParams, Window};

pub const PERIOD_S: f64 = 1e-3;

pub fn params(limits: Limits) -> Params {
    Params {
        period_s: PERIOD_S,
        limits,
        orifice: Some(OrificeParams {
            discharge_coefficient: 0.65,
            window_area_m2: 8.75e-5,
            closed_angle_rad: 0.0,
            open_angle_rad: 0.8,
            window: Window::Linear,
        }),
        oil_density_kg_per_m3: Some(853.0),
    }
}

pub fn limits() -> Limits {
    Limits {
        min_angle_rad: Some(-0.5),
        max_angle_rad: Some(1.0),
        max_speed_rad_per_s: 20.0,
        max_acceleration_rad_per_s2: 1000.0,
        max_jerk_rad_per_s3: 2e5,
        unhomed_speed_rad_per_s: 0.2,
    }
}

pub fn endless() -> Limits {
    Limits { min_angle_rad: None, max_angle_rad: None, ..limits() }
}

pub fn set_point(id: u64, kind: SetPointKind, value: f64) -> SetPoint {
    SetPoint { id, kind: kind.code(), value, ..SetPoint::default() }
}

pub fn sine(id: u64, amplitude_rad: f64, frequency_hz: f64) -> SetPoint {
    SetPoint { frequency_hz, ..set_point(id, SetPointKind::Sine, amplitude_rad) }
}

/// The trajectory and what surrounds it.
#[derive(Clone)]
pub struct Rig {
    pub params: Params,
    pub state: State,
    pub feedback: Feedback,
    pub status: ControlStatus,
}

impl Rig {
    /// Not running yet.
    pub fn new(limits: Limits, angle_rad: f64) -> Self {
        let params = params(limits);
        params.validate().unwrap();
        let status = ControlStatus { time_scale: 1.0, ..ControlStatus::default() };
        let feedback = Feedback {
            angle_rad,
            pressure_drop_pa: 1e6,
            validity: validity::HOMED | validity::PRESSURE,
            ..Feedback::default()
        };
        Self { state: State::at_rest(0.0), params, feedback, status }
    }

    /// Running, at rest.
    pub fn running(limits: Limits, angle_rad: f64) -> Self {
        let mut rig = Self::new(limits, angle_rad);
        rig.cycle();
        rig.status.state = ControllerState::Running.code();
        rig
    }

    pub fn cycles(&mut self, advance_cycles: u64, set_point: Option<&SetPoint>) -> Reference {
        let input =
            Input { advance_cycles, feedback: Some(&self.feedback), status: Some(&self.status), set_point };
        step(&self.params, &mut self.state, &input)
    }

    pub fn cycle(&mut self) -> Reference {
        self.cycles(1, None)
    }

    pub fn set(&mut self, set_point: &SetPoint) -> Reference {
        self.cycles(1, Some(set_point))
    }

    /// Cycles until the reference rests; the last reference and how many there were.
    pub fn arrive(&mut self) -> (Reference, u64) {
        for cycles in 1..10_000_000 {
            let reference = self.cycle();
            if reference.moving == 0 {
                return (reference, cycles);
            }
        }
        panic!("never arrives");
    }
}
