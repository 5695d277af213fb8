//! The command while running: it follows the reference, led by the wanted torque, within motor and driver.

use crate::compensation::{
    FeedForward, Wanted, command_microsteps, feed_forward, lead_within_pull_out, torque_beyond_nm, wanted,
};
use crate::correction::{Instant, Wish};
use crate::params::{LostSteps, Params};
use crate::state::State;
use crate::time_scale::next_time_scale;
use signals::{Reference, limiting};
use std::f64::consts::{FRAC_PI_2, TAU};

/// While the target is further than this part of a tooth pitch behind the reference, the reference waits for it.
const WAITS_BEYOND: f64 = 0.5;

/// One cycle of it.
pub(crate) fn track(params: &Params, state: &mut State) {
    let reference = state.window.commanded(params.loop_delay_cycles, params.period_s);
    if state.lost && params.lost_steps == LostSteps::Resynchronise {
        resynchronise(params, state, &reference);
    }
    if std::mem::take(&mut state.sets_out) {
        state.way_back.set_out(&state.led, &reference, params.period_s);
    }
    state.led = state.way_back.target(&reference, params.period_s, &params.way_back_limits());
    let target = match &params.shaper {
        Some(shaper) => state.shaped.step(shaper, &state.led),
        None => state.led,
    };
    let level = state.tuning.compensation(params);
    let fed = feed_forward(params, level, &mut state.contact, &state.surroundings, &state.aim, &target);
    state.aim = target;
    let cut = aim(params, state, &target, &fed);
    let own_way = state.target - state.target_before;
    let travel = drive::follow(&params.drive, state.position, state.travel, state.target, own_way);
    state.target_before = state.target;
    state.position = travel.position;
    state.travel = travel.way;
    state.limits = limits(&travel, state.wanted.saturated || cut);
    let position = state.position.round();
    state.correction.push(Instant {
        reference_rad: target.angle_rad,
        beyond_nm: torque_beyond_nm(params, position, &target, &fed),
        command_rad: position * params.drive.microstep_angle_rad,
    });
    state.time_scale = time_scale(params, state);
}

/// A cycle for which no command went out: the command went on at its last rate, and the rotor with it.
pub(crate) fn go_on(params: &Params, state: &mut State) {
    let way_rad = state.travel * params.drive.microstep_angle_rad;
    // The torque that accelerated the shaft is too much now.
    let freed_nm = params.inertia_kg_m2 * state.aim.acceleration_rad_per_s2;
    state.aim = Reference {
        angle_rad: state.aim.angle_rad + way_rad,
        speed_rad_per_s: way_rad / params.period_s,
        acceleration_rad_per_s2: 0.0,
        jerk_rad_per_s3: 0.0,
        ..state.aim
    };
    state.position += state.travel;
    state.target += state.travel;
    state.target_before += state.travel;
    let last = state.correction.commanded(0);
    let instant = Instant {
        reference_rad: last.reference_rad + way_rad,
        beyond_nm: last.beyond_nm + freed_nm,
        command_rad: state.position.round() * params.drive.microstep_angle_rad,
    };
    state.correction.go_on(params, instant);
}

/// Lets the next target set out from what the command aims at.
pub(crate) fn set_out_from_aim(params: &Params, state: &mut State) {
    state.led = match &params.shaper {
        Some(shaper) => state.shaped.restart(shaper, &state.aim, params.period_s),
        None => state.aim,
    };
    state.sets_out = true;
}

/// Where the command is wanted; whether it had to stay behind to keep hold of the rotor.
fn aim(params: &Params, state: &mut State, target: &Reference, fed: &FeedForward) -> bool {
    let wish = match &params.observer {
        Some(observer) => {
            state.tuning.settle(observer);
            state.correction.step(params, observer, &state.tuning, state.reading_rad, target)
        }
        None => Wish::More { beyond_nm: 0.0, deviation_rad: None },
    };
    let Wish::More { beyond_nm, deviation_rad } = wish else { return false };
    state.wanted = wanted(params, target, fed, beyond_nm);
    let lead_rad = state.wanted.lead_rad;
    let (kept_rad, cut) = deviation_rad
        .map_or((lead_rad, false), |deviation_rad| lead_within_pull_out(params, lead_rad, deviation_rad));
    state.target = command_microsteps(params, target, kept_rad, state.recovery.teeth);
    cut
}

/// Takes the rotor for where it is, and the command to it.
fn resynchronise(params: &Params, state: &mut State, reference: &Reference) {
    let Some(reading_rad) = state.reading_rad else { return };
    let teeth = f64::from(params.motor.rotor_teeth);
    // A rotor that fell back is no faster than what it lost; a reading's way may be its fall.
    let wanted_way_rad = reference.speed_rad_per_s * params.period_s;
    let way_rad = state.reading_way_rad.clamp(wanted_way_rad.min(0.0), wanted_way_rad.max(0.0));
    let ahead = (params.loop_delay_cycles + params.encoder_delay_cycles) as f64;
    let rotor_rad = reading_rad + way_rad * ahead;
    let lag_rad = teeth * (state.correction.commanded(0).command_rad - rotor_rad);
    state.recovery.resynchronise(lag_rad);
    let holding_nm = params.motor.holding_torque_nm;
    state.correction.restart(rotor_rad, way_rad, |lead_rad| holding_nm * (teeth * lead_rad).sin());
    state.aim = Reference {
        angle_rad: rotor_rad,
        speed_rad_per_s: way_rad / params.period_s,
        acceleration_rad_per_s2: 0.0,
        ..*reference
    };
    set_out_from_aim(params, state);
}

/// How fast the reference shall go on, after what this cycle asks of the motor.
fn time_scale(params: &Params, state: &State) -> f64 {
    let tooth_rad = TAU / f64::from(params.motor.rotor_teeth);
    let behind_rad = state.way_back.offset_rad() * state.window.now().speed_rad_per_s.signum();
    if behind_rad > WAITS_BEYOND * tooth_rad {
        return next_time_scale(state.time_scale, f64::INFINITY, params.period_s);
    }
    let Wanted { torque_nm, reserve_nm, .. } = state.wanted;
    let available_nm = reserve_nm + torque_nm.abs();
    let by_torque = if available_nm > 0.0 { torque_nm.abs() / available_nm } else { f64::INFINITY };
    let by_lag = state.load_angle_rad.map_or(0.0, |lag_rad| lag_rad.abs() / FRAC_PI_2);
    next_time_scale(state.time_scale, by_torque.max(by_lag), params.period_s)
}

fn limits(travel: &drive::Travel, torque_cut: bool) -> u64 {
    let bits = [
        (limiting::PULSE_RATE, travel.rate_limited),
        (limiting::PULSE_ACCELERATION, travel.change_limited),
        (limiting::TORQUE, torque_cut),
    ];
    bits.iter().filter(|(_, held)| *held).fold(0, |all, (bit, _)| all | bit)
}
