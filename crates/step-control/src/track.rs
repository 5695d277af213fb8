//! The command while running: it follows the reference, led by the wanted torque, within motor and driver.

use crate::compensation::{
    Contact, FeedForward, Wanted, command_rad, feed_forward, lead_within_pull_out, torque_beyond_nm, wanted,
};
use crate::correction::{Instant, Wish};
use crate::params::{LostSteps, Params};
use crate::rotor::Seen;
use crate::state::{State, Steering};
use crate::time_scale::next_time_scale;
use drive::Microsteps;
use signals::{Kinematics, limiting};
use std::f64::consts::{FRAC_PI_2, TAU};

/// While the target is further than this part of a tooth pitch behind the reference, the reference waits for it.
const WAITS_BEYOND: f64 = 0.5;

/// Time constant with which the friction of a relaxing contact leaves the feed-forward, s: some periods of the resonance.
const RELAXING_S: f64 = 0.05;

/// One cycle of it.
pub(crate) fn track(params: &Params, state: &mut State) {
    let reference = state.reception.window.commanded(params.loop_delay_cycles, params.period_s);
    if state.observation.lost && params.lost_steps == LostSteps::Resynchronise {
        resynchronise(params, state, &reference);
    }
    let target = next_aim(params, state, &reference);
    let level = state.tuning.compensation(params);
    let around = state.observation.surroundings;
    let steering = &mut state.steering;
    relax_at_rest(params, steering, &target);
    let mut fed = feed_forward(params, level, &mut steering.contact, &around, &steering.aim, &target);
    fed.fade(1.0 - steering.friction_held);
    steering.aim = target;
    let cut = aim(params, state, &target, &fed);
    let steering = &mut state.steering;
    let own_way = steering.target - steering.target_before;
    let travel = drive::follow(&params.drive, steering.position, steering.travel, steering.target, own_way);
    steering.target_before = steering.target;
    steering.position = travel.position;
    steering.travel = travel.way;
    let saturated = state.observation.correction.saturated();
    steering.limits = limits(&travel, steering.wanted.saturated || cut, saturated);
    let command_rad = steering.angle_rad(params, Microsteps::from(steering.position.round()));
    state.observation.correction.push(Instant {
        reference_rad: target.angle_rad,
        beyond_nm: torque_beyond_nm(params, command_rad, &target, &fed),
        command_rad,
    });
    state.steering.time_scale = time_scale(params, state);
}

/// Keeps account of how much of the friction at rest is still believed. A cycle longer than half a period of the resonance
/// excites it: the rotor rings where the reference stops, and its bristles relax while the belief's stay bent.
fn relax_at_rest(params: &Params, steering: &mut Steering, target: &Kinematics) {
    if params.period_s <= params.half_period_s() {
        return;
    }
    let rests = target.speed_rad_per_s == 0.0 && target.acceleration_rad_per_s2 == 0.0;
    if rests {
        steering.friction_held *= (-params.period_s / RELAXING_S).exp();
    } else if steering.friction_held < 1.0 {
        steering.friction_held = 1.0;
        steering.contact = Contact::relaxed();
    }
}

/// The motion to aim at: the reference or the re-entry ramp towards it, shaped where there is a shaper.
fn next_aim(params: &Params, state: &mut State, reference: &Kinematics) -> Kinematics {
    let steering = &mut state.steering;
    if std::mem::take(&mut steering.re_enters) {
        steering.re_entry.start(&steering.led, reference, params.period_s);
    }
    steering.led = steering.re_entry.target(reference, params.period_s, &params.re_entry_limits());
    match &params.shaper {
        Some(shaper) => steering.shaped.step(shaper, &steering.led),
        None => steering.led,
    }
}

/// A cycle for which no command went out: the command went on at its last rate, and the rotor with it.
pub(crate) fn coast(params: &Params, state: &mut State) {
    let steering = &mut state.steering;
    let way_rad = steering.travel.0 * params.drive.microstep_angle_rad;
    // The torque that accelerated the shaft is surplus now.
    let freed_nm = params.inertia_kg_m2 * steering.aim.acceleration_rad_per_s2;
    steering.aim = Kinematics {
        angle_rad: steering.aim.angle_rad + way_rad,
        speed_rad_per_s: way_rad / params.period_s,
        ..Kinematics::default()
    };
    steering.position += steering.travel;
    steering.target += steering.travel;
    steering.target_before += steering.travel;
    let last = state.observation.correction.commanded(0);
    let instant = Instant {
        reference_rad: last.reference_rad + way_rad,
        beyond_nm: last.beyond_nm + freed_nm,
        command_rad: steering.angle_rad(params, Microsteps::from(steering.position.round())),
    };
    state.observation.correction.coast(params, instant);
    state.observation.seen = state.observation.seen.map(Seen::passed_over);
}

/// Lets the next target start from what the command aims at.
pub(crate) fn re_enter_from_aim(params: &Params, state: &mut State) {
    let steering = &mut state.steering;
    steering.led = match &params.shaper {
        Some(shaper) => steering.shaped.restart(shaper, &steering.aim, params.period_s),
        None => steering.aim,
    };
    steering.re_enters = true;
}

/// Sets the command's target; whether the lead had to be cut to keep the rotor within pull-out.
fn aim(params: &Params, state: &mut State, target: &Kinematics, fed: &FeedForward) -> bool {
    let observation = &mut state.observation;
    let wish = match &params.observer {
        Some(_) if observation.alarms.fell_back() => observation.correction.fall_back(params.period_s),
        Some(observer) => {
            state.tuning.settle(observer);
            observation.correction.step(params, observer, &state.tuning, observation.reading_rad, target)
        }
        None => Wish::More { beyond_nm: 0.0 },
    };
    // By the readings alone: the observer's linear model does not hold for a rotor that is jammed or out of step.
    // Without an observer the command is open-loop, and waits for nobody.
    let seen = observation.seen.filter(|_| params.observer.is_some());
    let rotor = seen.and_then(|seen| seen.at(params, &observation.correction, target));
    let Wish::More { beyond_nm } = wish else { return false };
    let steering = &mut state.steering;
    steering.wanted = wanted(params, target, fed, beyond_nm);
    let lead_rad = steering.wanted.lead_rad;
    let (kept_rad, cut) = rotor
        .map_or((lead_rad, false), |rotor| lead_within_pull_out(params, lead_rad, &rotor, steering.travel));
    let command_rad = command_rad(params, target, kept_rad, observation.recovery.teeth);
    steering.target = steering.position_of(params, command_rad);
    cut
}

/// After lost steps: counts the teeth, and starts a re-entry ramp from where the rotor is.
fn resynchronise(params: &Params, state: &mut State, reference: &Kinematics) {
    let observation = &mut state.observation;
    let Some(reading_rad) = observation.reading_rad else { return };
    let teeth = f64::from(params.motor.rotor_teeth);
    // A rotor that fell back is no faster than the reference it lost; a change of the reading may be its fall.
    let wanted_way_rad = reference.speed_rad_per_s * params.period_s;
    let way_rad = observation.reading_change_rad.clamp(wanted_way_rad.min(0.0), wanted_way_rad.max(0.0));
    let ahead = (params.loop_delay_cycles + params.encoder_delay_cycles) as f64;
    let rotor_rad = reading_rad + way_rad * ahead;
    let lag_rad = teeth * (observation.correction.commanded(0).command_rad - rotor_rad);
    observation.recovery.resynchronise(lag_rad);
    let holding_nm = params.motor.holding_torque_nm;
    observation.correction.restart(rotor_rad, way_rad, |lead_rad| holding_nm * (teeth * lead_rad).sin());
    state.steering.aim = Kinematics {
        angle_rad: rotor_rad,
        speed_rad_per_s: way_rad / params.period_s,
        acceleration_rad_per_s2: 0.0,
        ..*reference
    };
    re_enter_from_aim(params, state);
}

/// How fast the trajectory's time shall run, after what this cycle asks of the motor.
fn time_scale(params: &Params, state: &State) -> f64 {
    let State { reception, steering, observation, .. } = state;
    let tooth_rad = TAU / f64::from(params.motor.rotor_teeth);
    let behind_rad = steering.re_entry.offset_rad() * reception.window.now().speed_rad_per_s.signum();
    if behind_rad > WAITS_BEYOND * tooth_rad {
        return next_time_scale(steering.time_scale, f64::INFINITY, params.period_s);
    }
    let Wanted { torque_nm, reserve_nm, .. } = steering.wanted;
    let available_nm = reserve_nm + torque_nm.abs();
    let by_torque = if available_nm > 0.0 { torque_nm.abs() / available_nm } else { f64::INFINITY };
    let by_lag = observation.load_angle_rad.map_or(0.0, |lag_rad| lag_rad.abs() / FRAC_PI_2);
    next_time_scale(steering.time_scale, by_torque.max(by_lag), params.period_s)
}

fn limits(travel: &drive::Travel, torque_cut: bool, observer_saturated: bool) -> u64 {
    let bits = [
        (limiting::PULSE_RATE, travel.rate_limited),
        (limiting::PULSE_ACCELERATION, travel.change_limited),
        (limiting::TORQUE, torque_cut),
        (limiting::OBSERVER, observer_saturated),
    ];
    bits.iter().filter(|(_, held)| *held).fold(0, |all, (bit, _)| all | bit)
}
