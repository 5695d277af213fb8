//! The torque that a motion needs, and the lead of the command over the rotor that produces it.
//!
//! A stepper's torque is T_hold·sin(N_r·(θ_cmd − θ)), so the command must lead the wanted angle by asin(T/T_hold)/N_r for the
//! rotor to be where it is wanted. Without that lead, 2 N·m cause an error of 0.39°.

use crate::params::{Compensation, Params};
use crate::rotor::Rotor;
use drive::MicrostepsPerCycle;
use serde::{Deserialize, Serialize};
use signals::Kinematics;
use std::f64::consts::TAU;
use valve_model::{FrictionState, MotionInput, MotionSample, MotionState, motion_step};

/// Below this speed Coulomb friction is faded in linearly, rad/s: its sign has no meaning at rest.
const COULOMB_FADE_RAD_PER_S: f64 = 0.02;

/// The largest lead, electrical rad: 70°, where the motor gives 94 % of its torque and still pulls back.
const MAX_LEAD_RAD: f64 = 70.0 * std::f64::consts::PI / 180.0;

/// The largest load angle that the command may take on a rotor whose angle is known, electrical rad: short of 90°, where
/// the torque begins to fall.
const MAX_PULL_RAD: f64 = 85.0 * std::f64::consts::PI / 180.0;

/// The feed-forward torque, and the part of it that is friction.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct FeedForward {
    /// Friction that is compensated, N·m.
    pub friction_nm: f64,
    /// Inertia, the motor's damping and friction, N·m.
    pub torque_nm: f64,
}

impl FeedForward {
    /// With the mean of this cycle's friction and the previous cycle's. Where cycles are long, a change of the command makes
    /// the rotor ring less if it is spread over more of them.
    pub(crate) fn smoothed(self, friction_before_nm: f64) -> Self {
        let change_nm = (friction_before_nm - self.friction_nm) / 2.0;
        Self { friction_nm: self.friction_nm + change_nm, torque_nm: self.torque_nm + change_nm }
    }

    /// Scales all of it.
    pub(crate) fn fade(&mut self, part: f64) {
        self.torque_nm *= part;
        self.friction_nm *= part;
    }

    /// Scales friction by this share. Below 1 all of it is scaled. Above 1 only the sliding part, `sliding_nm` at most, is
    /// increased: the share is measured by the load angle while sliding, which says nothing about friction at rest.
    pub(crate) fn share(&mut self, share: f64, sliding_nm: f64) {
        let more_nm = if share > 1.0 {
            (share - 1.0) * self.friction_nm.clamp(-sliding_nm, sliding_nm)
        } else {
            (share - 1.0) * self.friction_nm
        };
        self.torque_nm += more_nm;
        self.friction_nm += more_nm;
    }
}

/// The torque wanted from the motor, and how the command gives it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Wanted {
    /// Friction that is compensated, what the observer adds included, N·m.
    pub friction_nm: f64,
    /// The part of it that the observer adds, N·m.
    pub beyond_nm: f64,
    /// The total torque, N·m.
    pub torque_nm: f64,
    /// Electrical lead that produces it, rad.
    pub lead_rad: f64,
    /// The motor's reserve beyond it, N·m.
    pub reserve_nm: f64,
    /// Whether the lead had to be cut.
    pub saturated: bool,
}

/// The believed contact, driven by the reference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Contact {
    friction: FrictionState,
    with_effects: Option<MotionState>,
}

impl Contact {
    /// At rest, its bristles relaxed.
    pub(crate) fn relaxed() -> Self {
        Self { friction: FrictionState::default(), with_effects: None }
    }
}

/// The last readings of the valve's sensors, or defaults where there are none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Surroundings {
    pub pressure_drop_pa: f64,
    pub oil_temperature_c: f64,
    /// The clock at the beginning of the cycle that is commanded, s.
    pub clock_s: f64,
}

impl Default for Surroundings {
    fn default() -> Self {
        Self { pressure_drop_pa: 0.0, oil_temperature_c: 40.0, clock_s: 0.0 }
    }
}

/// The torque that the motion from `before` to `after`, one cycle later, needs at its end.
pub(crate) fn feed_forward(
    params: &Params,
    level: Compensation,
    contact: &mut Contact,
    around: &Surroundings,
    before: &Kinematics,
    after: &Kinematics,
) -> FeedForward {
    let friction_nm = match level {
        Compensation::None => {
            // The friction state is advanced all the same, so that it is right when the level changes.
            _ = law_nm(params, contact, before, after);
            return FeedForward::default();
        }
        Compensation::CoulombViscous => {
            _ = law_nm(params, contact, before, after);
            let speed = after.speed_rad_per_s;
            params.coulomb_torque_nm * (speed / COULOMB_FADE_RAD_PER_S).clamp(-1.0, 1.0)
                + params.viscous_nm_s_per_rad * speed
        }
        Compensation::Full => law_nm(params, contact, before, after),
        Compensation::FullWithEffects => with_effects_nm(params, contact, around, before, after),
    };
    let torque_nm = params.inertia_kg_m2 * after.acceleration_rad_per_s2
        + params.motor.damping_nm_s_per_rad * after.speed_rad_per_s
        + friction_nm;
    FeedForward { friction_nm, torque_nm }
}

fn law_nm(params: &Params, contact: &mut Contact, before: &Kinematics, after: &Kinematics) -> f64 {
    if let Some(motion) = contact.with_effects.take() {
        contact.friction = motion.friction;
    }
    contact.friction.step(&params.friction, before.speed_rad_per_s, after.speed_rad_per_s, params.period_s)
}

fn with_effects_nm(
    params: &Params,
    contact: &mut Contact,
    around: &Surroundings,
    before: &Kinematics,
    after: &Kinematics,
) -> f64 {
    let motion = |reference: &Kinematics| MotionSample {
        angle_rad: reference.angle_rad,
        speed_rad_per_s: reference.speed_rad_per_s,
        acceleration_rad_per_s2: reference.acceleration_rad_per_s2,
    };
    let (start, end) = (motion(before), motion(after));
    let friction = contact.friction;
    let state = contact.with_effects.get_or_insert_with(|| {
        let mut state = params.with_effects.at_start(&start);
        state.friction = friction;
        state
    });
    let Surroundings { pressure_drop_pa, oil_temperature_c, clock_s } = *around;
    state.set_clock(clock_s);
    let input = MotionInput { start, end, pressure_drop_pa, oil_temperature_c };
    let output = motion_step(&params.with_effects, state, &input, params.period_s);
    output.friction_torque_nm + output.other_torque_nm
}

/// The torque and lead for the feed-forward and `beyond_nm` more, at the speed of `after`.
pub(crate) fn wanted(params: &Params, after: &Kinematics, fed: &FeedForward, beyond_nm: f64) -> Wanted {
    let available_nm = available_torque_nm(params, after);
    let torque_nm = fed.torque_nm + beyond_nm;
    let most = MAX_LEAD_RAD.sin();
    let ratio = if available_nm > 0.0 { torque_nm / available_nm } else { 1.0_f64.copysign(torque_nm) };
    Wanted {
        friction_nm: fed.friction_nm + beyond_nm,
        beyond_nm,
        torque_nm,
        lead_rad: ratio.clamp(-most, most).asin(),
        reserve_nm: available_nm - torque_nm.abs(),
        saturated: ratio.abs() > most,
    }
}

/// The greatest torque at the reference's speed, N·m.
pub(crate) fn available_torque_nm(params: &Params, reference: &Kinematics) -> f64 {
    params.motor.available_torque_nm(reference.speed_rad_per_s)
}

/// The torque beyond the one fed forward that a command at an angle gives a spool on its reference, N·m.
pub(crate) fn torque_beyond_nm(
    params: &Params,
    command_rad: f64,
    reference: &Kinematics,
    fed: &FeedForward,
) -> f64 {
    let electrical_rad = f64::from(params.motor.rotor_teeth) * (command_rad - reference.angle_rad);
    available_torque_nm(params, reference) * electrical_rad.sin() - fed.torque_nm
}

/// The angle of the command that puts the rotor at `reference`, if the command is `teeth` tooth pitches away from it, rad.
pub(crate) fn command_rad(params: &Params, reference: &Kinematics, lead_rad: f64, teeth: i64) -> f64 {
    let electrical_rad = lead_rad + TAU * teeth as f64;
    reference.angle_rad + electrical_rad / f64::from(params.motor.rotor_teeth)
}

/// The lead over the target at which the load angle on a rotor is at most [`MAX_PULL_RAD`], rad, and whether it had to be cut.
///
/// The command moved by `travel` in the previous cycle. If it approaches the limit, it is cut early enough to brake before it
/// at the driver's acceleration.
pub(crate) fn lead_within_pull_out(
    params: &Params,
    lead_rad: f64,
    rotor: &Rotor,
    travel: MicrostepsPerCycle,
) -> (f64, bool) {
    let teeth = f64::from(params.motor.rotor_teeth);
    let microstep_rad = params.drive.microstep_angle_rad;
    let approach = travel.0 - rotor.way_rad / microstep_rad;
    let braking_rad = teeth * microstep_rad * braking_way(params, approach);
    let (ahead_rad, behind_rad) = if approach > 0.0 { (braking_rad, 0.0) } else { (0.0, braking_rad) };
    let rotor_rad = teeth * rotor.deviation_rad;
    let low_rad = rotor_rad - (MAX_PULL_RAD - behind_rad).max(0.0);
    let high_rad = rotor_rad + (MAX_PULL_RAD - ahead_rad).max(0.0);
    let kept_rad = lead_rad.clamp(low_rad, high_rad);
    (kept_rad, kept_rad != lead_rad)
}

/// How far a command still moves, micro-steps, that brakes from `way` per cycle at the driver's acceleration: the sum over the
/// following cycles, each `change` shorter than the one before.
fn braking_way(params: &Params, way: f64) -> f64 {
    let change = params.drive.max_pulse_acceleration_hz_per_s * params.period_s * params.period_s;
    let way = way.abs();
    (way * (way / change - 1.0) / 2.0).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::tests::params;
    use approx::assert_relative_eq;

    #[test]
    fn friction_is_spread_and_all_of_it_fades() {
        let fed = FeedForward { friction_nm: 1.5, torque_nm: 1.8 };
        assert_eq!(fed.smoothed(-1.5), FeedForward { friction_nm: 0.0, torque_nm: 1.8 - 1.5 });
        assert_eq!(fed.smoothed(1.5), fed);
        let mut faded = fed;
        faded.fade(0.5);
        assert_eq!(faded, FeedForward { friction_nm: 0.75, torque_nm: 0.9 });
    }

    #[test]
    fn the_limit_of_the_pull_leaves_the_way_to_brake() {
        // 400 MHz/s at 1 ms: 400 micro-steps a cycle less each cycle, so 1000 a cycle go on by 600 and 200.
        let params = params();
        let microstep_rad = 50.0 * params.drive.microstep_angle_rad;
        assert_relative_eq!(braking_way(&params, 1000.0), 750.0, max_relative = 1e-9);
        let way =
            |steps: f64| Rotor { deviation_rad: 0.0, way_rad: steps * params.drive.microstep_angle_rad };
        let cut = |rotor: Rotor, lead_rad| {
            lead_within_pull_out(&params, lead_rad, &rotor, MicrostepsPerCycle(1000.0))
        };
        let braking_rad = 750.0 * microstep_rad;
        // The command approaches by its motion beyond the rotor's own.
        for (rotor, ahead_rad) in [(way(0.0), braking_rad), (way(1000.0), 0.0)] {
            let (kept_rad, was_cut) = cut(rotor, 3.0);
            assert!(was_cut);
            assert_relative_eq!(kept_rad, (MAX_PULL_RAD - ahead_rad).max(0.0), epsilon = 1e-9);
            let (kept_rad, was_cut) = cut(rotor, -3.0);
            assert!(was_cut);
            assert_relative_eq!(kept_rad, -MAX_PULL_RAD, epsilon = 1e-9);
        }
        let aside = Rotor { deviation_rad: 0.01, way_rad: 1000.0 * params.drive.microstep_angle_rad };
        assert_relative_eq!(cut(aside, 3.0).0, 0.5 + MAX_PULL_RAD, epsilon = 1e-9);
        assert_eq!(cut(aside, 0.3), (0.3, false));
    }
}
