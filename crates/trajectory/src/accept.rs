//! What a set-point turns into: another motion, or a refusal that leaves the present one as it is.

use signals::{SetPoint, SetPointKind, SetPointRefusal};

use crate::Params;
use crate::motion::{ActiveMotion, Motion, Planned, Then};
use crate::planner::{plan_angle, plan_speed};
use crate::profile::Profile;
use crate::sine::Sine;
use crate::state::{Followed, State};
use crate::target::target_angle;
use signals::Kinematics;

/// How far a planned motion may pass a limit of motion: what is lost in rounding, not more.
const ANGLE_TOLERANCE_RAD: f64 = 1e-9;

/// Takes a set-point over, from where the last reference stands.
///
/// # Errors
/// Why it is refused; nothing has changed then.
pub(crate) fn accept(
    params: &Params,
    state: &mut State,
    set_point: &SetPoint,
) -> Result<(), SetPointRefusal> {
    let kind = SetPointKind::from_code(set_point.kind).ok_or(SetPointRefusal::NoPlan)?;
    let jogs = match kind {
        SetPointKind::Hold => true,
        SetPointKind::Speed => set_point.value.abs() <= params.limits.unhomed_speed_rad_per_s,
        SetPointKind::Angle | SetPointKind::Opening | SetPointKind::Flow | SetPointKind::Sine => false,
    };
    if !state.seen.homed && !jogs {
        return Err(SetPointRefusal::NotHomed);
    }
    let active = match kind {
        SetPointKind::Hold => stop(params, state),
        SetPointKind::Speed => Some(to_speed(params, state, set_point.value)?),
        SetPointKind::Sine => Some(to_sine(params, state, set_point)?),
        SetPointKind::Angle | SetPointKind::Opening | SetPointKind::Flow => {
            let target_rad = target_angle(params, set_point, state.seen.pressure_drop_pa)?;
            let target_rad = target_rad.ok_or(SetPointRefusal::NoPlan)?;
            Some(to_angle(params, state, target_rad).ok_or(SetPointRefusal::NoPlan)?)
        }
    };
    state.stop_wanted = active.is_none();
    if let Some(active) = active {
        state.active = active;
    }
    state.followed = Followed { id: set_point.id, kind };
    let holds_flow = kind == SetPointKind::Flow && set_point.pressure_given == 0;
    state.held_flow_m3_per_s = holds_flow.then_some(set_point.value);
    Ok(())
}

/// The motion to an angle; `None` if none stays within the limits of motion.
pub(crate) fn to_angle(params: &Params, state: &State, target_rad: f64) -> Option<ActiveMotion> {
    let start = state.now(params);
    if state.active.motion.rest_angle_rad() == Some(target_rad) {
        // The fastest way there is what is left of the present motion.
        return Some(state.active);
    }
    let profile = plan_angle(&params.limits, &start, target_rad - start.angle_rad)?;
    planned(params, &start, profile, Then::Rest { angle_rad: target_rad })
}

/// The shortest stop; `None` while it would leave the limits of motion. That happens only when the present motion
/// turns back just in front of a limit, for which it brakes harder than a stop would: so the stop comes a little
/// later.
pub(crate) fn stop(params: &Params, state: &State) -> Option<ActiveMotion> {
    if state.active.motion.rests() {
        return Some(state.active);
    }
    let start = state.now(params);
    let profile = plan_speed(&params.limits, &start, 0.0)?;
    let angle_rad = start.angle_rad + profile.end().angle_rad;
    planned(params, &start, profile, Then::Rest { angle_rad })
}

fn to_speed(params: &Params, state: &State, speed_rad_per_s: f64) -> Result<ActiveMotion, SetPointRefusal> {
    let limits = &params.limits;
    if limits.min_angle_rad.is_some() || limits.max_angle_rad.is_some() {
        return Err(SetPointRefusal::AngleLimit);
    }
    if speed_rad_per_s == 0.0 {
        return stop(params, state).ok_or(SetPointRefusal::NoPlan);
    }
    if speed_rad_per_s.is_nan() || speed_rad_per_s.abs() > limits.max_speed_rad_per_s {
        return Err(SetPointRefusal::SpeedLimit);
    }
    let start = state.now(params);
    let profile = plan_speed(&params.limits, &start, speed_rad_per_s).ok_or(SetPointRefusal::NoPlan)?;
    planned(params, &start, profile, Then::Rotate { speed_rad_per_s }).ok_or(SetPointRefusal::NoPlan)
}

/// A sine about where the motion rests, or comes to rest by the shortest stop.
fn to_sine(params: &Params, state: &State, set_point: &SetPoint) -> Result<ActiveMotion, SetPointRefusal> {
    let stopping = stop(params, state).ok_or(SetPointRefusal::NoPlan)?;
    let centre_rad = stopping.motion.rest_angle_rad().ok_or(SetPointRefusal::NoPlan)?;
    let (amplitude_rad, frequency_hz) = (set_point.value, set_point.frequency_hz);
    let sine = Sine { centre_rad, amplitude_rad, frequency_hz };
    sine.check(params)?;
    Ok(ActiveMotion::starting(match stopping.motion {
        Motion::Planned(stop) => Motion::Planned(Planned { then: Then::Sine(sine), ..stop }),
        _ => Motion::Sine(sine),
    }))
}

/// The planned motion, unless it leaves the limits of motion somewhere. One that starts outside them, because the
/// valve stood there, may come back but go no further out.
fn planned(params: &Params, start: &Kinematics, profile: Profile, then: Then) -> Option<ActiveMotion> {
    let start_rad = start.angle_rad;
    let (low, high) = profile.reach_rad();
    let limits = &params.limits;
    let below = limits
        .min_angle_rad
        .is_some_and(|lowest| start_rad + low < lowest.min(start_rad) - ANGLE_TOLERANCE_RAD);
    let above = limits
        .max_angle_rad
        .is_some_and(|highest| start_rad + high > highest.max(start_rad) + ANGLE_TOLERANCE_RAD);
    let motion = Motion::Planned(Planned { profile, start_rad, then });
    (!below && !above).then(|| ActiveMotion::starting(motion))
}
