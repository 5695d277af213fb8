//! One cycle of the guard.

use signals::{FaultCode, MAX_MICROSTEPS, StepCommand, validity};

use crate::limits::{self, Travel};
use crate::state::Continuation;
use crate::{AfterStop, Microsteps, MicrostepsPerCycle, Mode, Params, State};

/// The motion of the micro-step command in one cycle, and the drive's status.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// Command at the cycle's beginning, whole micro-steps.
    pub start: Microsteps,
    /// Command at its end, whole micro-steps; linear in between.
    pub end: Microsteps,
    /// Pulse rate of the cycle, signed, before rounding.
    pub pulse_rate_hz: f64,
    /// Whether the windings carry current in this cycle.
    pub energised: bool,
    /// Part of the rated current that they carry then.
    pub current_ratio: f64,
    /// The drive's own bits of [`validity`] for the Feedback at the cycle's end: `ENERGISED`, `STANDSTILL`,
    /// `LIMITED`, `STOPPED_ITSELF`, `COMMAND_MISSED`.
    pub flags: u64,
    /// Why the drive stopped by itself; [`FaultCode::None`] if it did not.
    pub fault: FaultCode,
}

/// What the guard itself measures of the valve.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sensors {
    /// The encoder's angle, where one is fitted, rad.
    pub encoder_rad: Option<f64>,
    /// Whether the angle's zero is known, so that limits of angle apply.
    pub homed: bool,
}

/// Advances the guard by one cycle.
///
/// `command` is the StepCommand of this very cycle, already checked; `None` when there is none.
///
/// ```
/// use drive::{AfterStop, Microsteps, Params, Sensors, State, step};
/// use signals::StepCommand;
///
/// let params = Params {
///     period_s: 1e-3,
///     microstep_angle_rad: 5.585e-5,
///     max_pulse_rate_hz: 600e3,
///     max_pulse_acceleration_hz_per_s: 40e6,
///     quick_stop_deceleration_hz_per_s: 100e6,
///     after_stop: AfterStop::Hold,
///     silence_cycles: 3,
///     energise_cycles: 0,
///     lowest_angle_rad: None,
///     highest_angle_rad: None,
///     standstill_rad: 1e-4,
/// };
/// let mut state = State::at_rest_energised(0);
/// let follow = |position| StepCommand {
///     position_unrounded: position,
///     follow: 1,
///     follow_id: 1,
///     energise: 1,
///     ..StepCommand::default()
/// };
/// let mut cycle = |position| step(&params, &mut state, 0, Some(&follow(position)), &Sensors::default());
/// assert_eq!(cycle(0.0).end, Microsteps(0.0));
/// // A thousand micro-steps are asked for; the next cycle gives what the acceleration allows.
/// assert_eq!(cycle(1000.0).end, Microsteps(40.0));
/// ```
pub fn step(
    params: &Params,
    state: &mut State,
    cycle: u64,
    command: Option<&StepCommand>,
    sensors: &Sensors,
) -> Output {
    let sensible = command.filter(|command| !contradicts_itself(command) && !jumps(params, state, command));
    state.refused = command.is_some() && sensible.is_none();
    let command = sensible;
    match command {
        Some(command) => note_command(params, state, cycle, command),
        None => state.missed = state.missed.saturating_add(1),
    }
    note_encoder(params, state, sensors);
    let start = state.accepted;
    let travel = match (state.mode, command) {
        (Mode::Following, Some(command)) => follow(params, state, command),
        (Mode::Following, None) => go_on(params, state),
        (Mode::StoppedItself, _) => after_silence(params, state, command),
        _ => stop(params, state, command),
    };
    accept(params, state, &travel, command);
    // Checked at the end of the cycle, so the ramp begins in the next one.
    if let Some(fault) = reason_to_stop(params, state, sensors) {
        state.mode = Mode::StoppedItself;
        state.settled = false;
        state.fault = fault;
    } else if state.mode == Mode::StoppedItself {
        state.settled =
            state.settled || state.travel == MicrostepsPerCycle::ZERO && at_neutral(params, state);
    }
    switch_current(params, state);
    report(params, state, start, travel.limited(), command.is_none())
}

/// Whether one of the two fields that say whether to follow was altered on the way.
fn contradicts_itself(command: &StepCommand) -> bool {
    (command.follow == 1) != (command.follow_id != 0)
}

/// Whether a command is further away than a healthy controller's can be: a jump.
fn jumps(params: &Params, state: &State, command: &StepCommand) -> bool {
    let way = Microsteps(command.position_unrounded) - state.position;
    // Rounding of the position itself.
    let rounding = 4.0 * f64::EPSILON * command.position_unrounded.abs();
    state.mode == Mode::Following
        && command.follow == 1
        && way.0.abs() > params.largest_jump(state.missed) + rounding
}

/// Takes in a command: current, zero, and change of mode.
fn note_command(params: &Params, state: &mut State, cycle: u64, command: &StepCommand) {
    state.missed = 0;
    state.command_cycle = cycle;
    state.energise_wanted = command.energise == 1;
    state.current_ratio = command.current_ratio;
    take_zero(state, command);
    let follow = command.follow == 1 && state.energise_wanted;
    let new = command.follow_id != state.follow_id;
    // Distance of the command from where the drive would coast in this cycle.
    let apart = (Microsteps(command.position_unrounded) - (state.position + state.travel)).0.abs();
    let before = state.mode;
    state.mode = match (before, follow) {
        (Mode::StoppedItself, false) if state.settled => Mode::Released,
        (Mode::StoppedItself, _) => Mode::StoppedItself,
        (Mode::Released, true) if apart > 1.0 || !state.energised || !new => Mode::Released,
        (Mode::Released, false) => Mode::Released,
        (Mode::Idle | Mode::Following, true) if !state.energised => Mode::Idle,
        // The sender believes the valve to be elsewhere, or this arming has had its beginning.
        (Mode::Idle, true) if apart > 1.0 + params.max_change() || !new => Mode::Idle,
        (_, true) => Mode::Following,
        (_, false) => Mode::Idle,
    };
    if state.mode != Mode::Following {
        state.course = None;
    } else if before != Mode::Following {
        state.follow_id = command.follow_id;
    }
}

/// Shifts the count to a new zero, once, at standstill and while no command is followed. The motor's phase stays.
fn take_zero(state: &mut State, command: &StepCommand) {
    let stands = state.travel == MicrostepsPerCycle::ZERO && state.mode != Mode::StoppedItself;
    if command.zero_id > state.zero_id && command.follow == 0 && stands {
        state.zero_id = command.zero_id;
        state.position = Microsteps(state.position.0 + command.zero_shift_microsteps as f64);
        state.accepted = state.accepted.saturating_add(command.zero_shift_microsteps);
        state.rebased = state.rebased.saturating_add(command.zero_shift_microsteps);
        state.rests_at_rad = None;
    }
}

/// Counts the cycles for which the encoder has rested.
fn note_encoder(params: &Params, state: &mut State, sensors: &Sensors) {
    let Some(encoder_rad) = sensors.encoder_rad else { return };
    match state.rests_at_rad {
        Some(rest_rad) if (encoder_rad - rest_rad).abs() > params.standstill_rad => {
            state.rests_at_rad = Some(encoder_rad);
            state.rested_cycles = 0;
        }
        Some(_) => state.rested_cycles = state.rested_cycles.saturating_add(1),
        None => state.rests_at_rad = Some(encoder_rad),
    }
}

/// The reason for a following drive to stop by itself, if there is one.
fn reason_to_stop(params: &Params, state: &State, sensors: &Sensors) -> Option<FaultCode> {
    if state.mode != Mode::Following {
        return None;
    }
    if state.missed >= params.silence_cycles {
        return Some(if state.refused { FaultCode::CommandMismatch } else { FaultCode::CommandSilent });
    }
    let command_rad = state.position.0 * params.microstep_angle_rad;
    let angle_rad = sensors.encoder_rad.unwrap_or(command_rad);
    let (way, homed) = (state.travel.0, sensors.homed);
    let below = params.lowest_angle_rad.is_some_and(|lowest| angle_rad < lowest) && way < 0.0;
    let above = params.highest_angle_rad.is_some_and(|highest| angle_rad > highest) && way > 0.0;
    (homed && (below || above)).then_some(FaultCode::AngleLimit)
}

/// Follows the command, within the limits.
fn follow(params: &Params, state: &State, command: &StepCommand) -> Travel {
    let target = Microsteps(command.position_unrounded);
    // The command's pulse rate is needed only where the command before is unknown.
    let own_way =
        state.course.map_or_else(|| commanded_way(params, command), |course| target - course.position);
    limits::follow(params, state.position, state.travel, target, own_way)
}

/// Travel of a cycle at the command's own pulse rate, within what the drive can do.
fn commanded_way(params: &Params, command: &StepCommand) -> MicrostepsPerCycle {
    let way = command.pulse_rate_hz * params.period_s;
    MicrostepsPerCycle(way.clamp(-params.max_travel(), params.max_travel()))
}

/// Without a command: goes where it would have led at the rate of the one before. The drive's own last rate will not do: in a
/// cycle that catches up it is higher, and a drive that coasts at that rate overshoots, more so with each further loss.
fn go_on(params: &Params, state: &State) -> Travel {
    match state.course {
        Some(course) => {
            let target = course.position + course.way;
            limits::follow(params, state.position, state.travel, target, course.way)
        }
        None => go(state, state.travel, false),
    }
}

/// The next cycle of a quick stop. A command that asks to be followed meanwhile counts as limited.
fn stop(params: &Params, state: &State, command: Option<&StepCommand>) -> Travel {
    let refused = command.is_some_and(|command| command.follow == 1);
    go(state, limits::ramp_down(params, state.travel), refused)
}

/// The ramp of a stop by itself, then the move to the neutral position if one is configured and the motor has current.
fn after_silence(params: &Params, state: &State, command: Option<&StepCommand>) -> Travel {
    let AfterStop::Neutral { microsteps, pulse_rate_hz, .. } = params.after_stop else {
        return stop(params, state, command);
    };
    // Still faster than that move: the ramp goes on.
    let way = pulse_rate_hz * params.period_s;
    if state.settled || !state.energised || state.travel.0.abs() > way * (1.0 + f64::EPSILON) {
        return stop(params, state, command);
    }
    limits::follow(
        &params.towards_neutral(pulse_rate_hz),
        state.position,
        state.travel,
        microsteps.into(),
        MicrostepsPerCycle::ZERO,
    )
}

fn at_neutral(params: &Params, state: &State) -> bool {
    match params.after_stop {
        AfterStop::Neutral { microsteps, .. } if state.energised => state.accepted == microsteps,
        _ => true,
    }
}

fn go(state: &State, way: MicrostepsPerCycle, change_limited: bool) -> Travel {
    Travel { way, position: state.position + way, rate_limited: false, change_limited }
}

/// Takes over the cycle's travel, and rounds the position.
fn accept(params: &Params, state: &mut State, travel: &Travel, command: Option<&StepCommand>) {
    state.travel = travel.way;
    state.position = Microsteps(travel.position.0.clamp(-MAX_MICROSTEPS, MAX_MICROSTEPS));
    let untouched = command.filter(|command| {
        state.mode == Mode::Following
            && !travel.limited()
            && (Microsteps::from(command.position_microsteps) - state.position).0.abs() <= 1.0
    });
    // The controller has rounded already; its own rounding is kept where the command passed unchanged.
    state.accepted = match untouched {
        Some(command) => command.position_microsteps,
        None => state.position.round(),
    };
    if state.mode == Mode::Following {
        state.course = match command {
            Some(command) => Some(Continuation {
                position: Microsteps(command.position_unrounded),
                way: commanded_way(params, command),
            }),
            None => state
                .course
                .map(|course| Continuation { position: course.position + course.way, way: course.way }),
        };
    }
}

/// Switches the current: on when asked for, after the time that the driver needs; off when no longer asked for, or after a
/// stop by itself if so configured, but never in motion.
fn switch_current(params: &Params, state: &mut State) {
    let latched = state.mode == Mode::StoppedItself;
    let wanted = state.energise_wanted && !(latched && params.after_stop == AfterStop::DeEnergise);
    state.energising_cycles = if wanted { state.energising_cycles.saturating_add(1) } else { 0 };
    if wanted && !latched {
        let had_current = state.energised;
        state.energised = had_current || state.energising_cycles > params.energise_cycles;
        if state.energised && !had_current && state.rests_at_rad.is_some() {
            // The rotor may jump to the nearest tooth.
            state.rested_cycles = 0;
        }
    } else if !wanted && state.travel == MicrostepsPerCycle::ZERO {
        state.energised = false;
    }
}

fn report(params: &Params, state: &State, start: i64, limited: bool, missed: bool) -> Output {
    let latched = state.mode == Mode::StoppedItself;
    let bits = [
        (validity::ENERGISED, state.energised),
        // A drive that reverses on its way to the neutral position stands for one cycle.
        (
            validity::STANDSTILL,
            state.travel == MicrostepsPerCycle::ZERO
                && (!latched || state.settled)
                && state.rested_cycles >= params.standstill_cycles(),
        ),
        (validity::LIMITED, limited),
        (validity::STOPPED_ITSELF, latched),
        (validity::COMMAND_MISSED, missed),
    ];
    Output {
        start: start.into(),
        end: state.accepted.into(),
        pulse_rate_hz: state.travel.rate_hz(params.period_s),
        energised: state.energised,
        current_ratio: state.current_ratio,
        flags: bits.iter().filter(|(_, set)| *set).fold(0, |flags, (bit, _)| flags | bit),
        fault: if latched { state.fault } else { FaultCode::None },
    }
}
