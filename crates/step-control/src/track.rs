//! The command while running: it follows the reference with the lead for the wanted torque, within the limits of motor and driver.

use crate::compensation::{
    Contact, FeedForward, Surroundings, Wanted, command_rad, feed_forward, lead_within_pull_out,
    torque_beyond_nm, wanted,
};
use crate::correction::{Belief, Instant, Wish, is_too_coarse};
use crate::params::{LostSteps, Params};
use crate::reference::time_scale::next_time_scale;
use crate::rotor::Seen;
use crate::state::State;
use crate::watch::load_share::Expected;
use drive::Microsteps;
use signals::{Kinematics, limiting};
use std::f64::consts::{FRAC_PI_2, TAU};

/// While the target is further than this part of a tooth pitch behind the reference, the reference waits for it.
const WAITS_BEYOND: f64 = 0.5;

/// A feed-forward faded below this fraction counts as none.
const FADED: f64 = 1e-2;

/// One cycle while running.
pub(crate) fn track(params: &Params, state: &mut State) {
    let reference = state.reception.window.commanded(params.loop_delay_cycles, params.period_s);
    if state.observation.lost && params.lost_steps == LostSteps::Resynchronise {
        resynchronise(params, state, &reference);
    }
    let target = next_aim(params, state, &reference);
    let level = state.tuning.compensation(params);
    let cycle = state.reception.last_cycle.unwrap_or(0) + params.loop_delay_cycles;
    let clock_s = cycle as f64 * params.period_s;
    let around = Surroundings { clock_s, ..state.observation.surroundings };
    let steering = &mut state.steering;
    let (before, after) = motion_of_cycle(params, &steering.aim, &target);
    let mut fed = feed_forward(params, level, &mut steering.contact, &around, &before, &after);
    let expected = if contact_is_known(params, state, &target) {
        let quiet = state.steering.ringing.is_quiet(params);
        let expected =
            if quiet { Expected::of(params, &target, fed.friction_nm) } else { Expected::default() };
        let sliding_nm =
            params.coulomb_torque_nm + params.viscous_nm_s_per_rad * target.speed_rad_per_s.abs();
        fed.share(fed_part(params, state), sliding_nm);
        fed.fade(fading(params, state, &target));
        expected
    } else {
        state.steering.contact = Contact::relaxed();
        fed = FeedForward::default();
        state.steering.friction_before_nm = 0.0;
        Expected::default()
    };
    if params.period_s > params.half_period_s() && state.steering.contact_known {
        let before_nm = std::mem::replace(&mut state.steering.friction_before_nm, fed.friction_nm);
        fed = fed.smoothed(before_nm);
    }
    state.steering.aim = target;
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
        expected,
    });
    state.steering.time_scale = time_scale(params, state);
}

/// The motion that friction sees in a cycle. In cycles longer than half a period of the resonance it is the command's, which is
/// linear: a reference may start and stop within one such cycle, and rest at both its ends.
fn motion_of_cycle(params: &Params, before: &Kinematics, after: &Kinematics) -> (Kinematics, Kinematics) {
    if params.period_s <= params.half_period_s() {
        return (*before, *after);
    }
    let speed_rad_per_s = (after.angle_rad - before.angle_rad) / params.period_s;
    (Kinematics { speed_rad_per_s, ..*before }, Kinematics { speed_rad_per_s, ..*after })
}

/// Whether the belief's friction state is valid: not while long cycles excite ringing of the rotor, and not at rest after that,
/// because the bristles relaxed meanwhile. The feed-forward would only excite more ringing.
fn contact_is_known(params: &Params, state: &mut State, target: &Kinematics) -> bool {
    let State { steering, observation, .. } = state;
    let rests = target.rests() && target.angle_rad == steering.aim.angle_rad;
    let (now, before) = (observation.correction.commanded(0), observation.correction.commanded(1));
    let turn_rad = target.angle_rad - 2.0 * now.reference_rad + before.reference_rad;
    steering.ringing = steering.ringing.next(params, turn_rad, target, rests);
    let rings = steering.ringing.relaxes(params, target.speed_rad_per_s);
    steering.contact_known = !rings && (steering.contact_known || !rests);
    steering.contact_known
}

/// The factor on the feed-forward while it fades: if compensation does harm, and at rest if the rotor rings on its bristles for
/// long, which relaxes them.
fn fading(params: &Params, state: &mut State, target: &Kinematics) -> f64 {
    let State { steering, observation, .. } = state;
    let ends = observation.alarms.gave_up() || target.rests() && params.bristles_ring();
    steering.fading =
        if ends { steering.fading * (-params.period_s / params.half_period_s()).exp() } else { 1.0 };
    if steering.fading < FADED {
        steering.contact = Contact::relaxed();
    }
    steering.fading
}

/// The part of the believed friction that is fed forward.
fn fed_part(params: &Params, state: &mut State) -> f64 {
    let State { steering, observation, .. } = state;
    let doubts = params.period_s > params.half_period_s() && observation.seen.is_some();
    let part = observation.load_share.used(params, doubts);
    if part != steering.fed_part {
        let reading_age = params.loop_delay_cycles + params.encoder_delay_cycles;
        observation.correction.feed_less(reading_age, steering.fed_part - part);
        steering.fed_part = part;
    }
    part
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
        // Nothing is expected of a cycle that was not commanded.
        expected: Expected::default(),
    };
    state.observation.correction.coast(params, instant);
    state.observation.seen = state.observation.seen.map(Seen::passed_over);
}

/// Starts a re-entry ramp in the next cycle, from what the command aims at.
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
        Some(observer) if observation.alarms.fell_back() || is_too_coarse(params, observer) => {
            observation.correction.fall_back(params.period_s)
        }
        Some(observer) => {
            state.tuning.settle(observer);
            let belief = Belief {
                shaft_is_off: observation.alarms.slowed(),
                contact_is_known: state.steering.contact_known,
            };
            observation.correction.step(
                params,
                observer,
                &state.tuning,
                observation.reading_rad,
                target,
                belief,
            )
        }
        None => Wish::More { beyond_nm: 0.0 },
    };
    // By the readings alone: the observer's linear model does not hold for a rotor that is jammed or out of step.
    // Without an observer the command is open-loop, and no reading limits it.
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
