//! What the trajectory remembers from cycle to cycle.

use signals::{HeldFlow, Reference, SetPointKind};

use crate::Params;
use crate::motion::{ActiveMotion, Motion};
use crate::time_scale::TimeScale;
use signals::Kinematics;

/// The trajectory's state between two cycles: plain data.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// The present motion, and where on it the last reference stands.
    pub(crate) active: ActiveMotion,
    pub(crate) time_scale: TimeScale,
    pub(crate) followed: Followed,
    /// A stop that was asked for and would leave the limits of motion if begun now: tried again in every cycle.
    pub(crate) stop_wanted: bool,
    /// A flow that is held as the measured pressure drop changes, m³/s.
    pub(crate) held_flow_m3_per_s: Option<f64>,
    /// What became of it in the last cycle.
    pub(crate) held_flow: HeldFlow,
    pub(crate) seen: Seen,
    pub(crate) refused_id: u64,
    pub(crate) refusal: u64,
}

/// The set-point that is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Followed {
    pub id: u64,
    pub kind: SetPointKind,
}

impl Followed {
    /// None: holds.
    pub const NOTHING: Self = Self { id: 0, kind: SetPointKind::Hold };
}

/// What the partners said last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    pub running: bool,
    pub time_scale: f64,
    pub homed: bool,
    pub pressure_drop_pa: Option<f64>,
}

impl State {
    /// At rest at `angle_rad` (rad), until a Feedback says otherwise.
    pub fn at_rest(angle_rad: f64) -> Self {
        Self {
            active: ActiveMotion::starting(Motion::Rest { angle_rad }),
            time_scale: TimeScale::NORMAL,
            followed: Followed::NOTHING,
            stop_wanted: false,
            held_flow_m3_per_s: None,
            held_flow: HeldFlow::None,
            seen: Seen { running: false, time_scale: 1.0, homed: false, pressure_drop_pa: None },
            refused_id: 0,
            refusal: 0,
        }
    }

    /// The motion's state at the last reference, at time scale 1.
    pub(crate) fn now(&self, params: &Params) -> Kinematics {
        self.active.now(params.period_s)
    }

    /// Drops all planning and rests at an angle.
    pub(crate) fn rest_at(&mut self, angle_rad: f64) {
        self.active = ActiveMotion::starting(Motion::Rest { angle_rad });
        self.time_scale = TimeScale::NORMAL;
        self.followed = Followed::NOTHING;
        self.stop_wanted = false;
        self.held_flow_m3_per_s = None;
        self.held_flow = HeldFlow::None;
    }

    /// The reference as the present motion has it.
    pub(crate) fn reference(&self, params: &Params) -> Reference {
        let state = self.now(params);
        let TimeScale { scale, rate_per_s } = self.time_scale;
        Reference {
            angle_rad: state.angle_rad,
            speed_rad_per_s: state.speed_rad_per_s * scale,
            acceleration_rad_per_s2: state.acceleration_rad_per_s2 * scale * scale
                + state.speed_rad_per_s * rate_per_s,
            jerk_rad_per_s3: scale
                * (state.jerk_rad_per_s3 * scale * scale + 3.0 * state.acceleration_rad_per_s2 * rate_per_s),
            target_angle_rad: self.active.motion.rest_angle_rad().unwrap_or(state.angle_rad),
            set_point_id: self.followed.id,
            set_point_kind: self.followed.kind.code(),
            moving: u64::from(!self.active.motion.rests()),
            time_scale: scale,
            refused_id: self.refused_id,
            refusal: self.refusal,
            held_flow: self.held_flow.code(),
        }
    }
}
