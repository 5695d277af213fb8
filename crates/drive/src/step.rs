//! One cycle of the guard.

use signals::{FaultCode, MAX_MICROSTEPS, StepCommand, validity};

use crate::limits::{self, Travel};
use crate::{AfterStop, Microsteps, MicrostepsPerCycle, Mode, Params, State};

/// How the micro-step command moves in one cycle, and what the drive has to say about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// Command at the cycle's beginning, whole micro-steps.
    pub start_microsteps: f64,
    /// Command at its end, whole micro-steps; linear in between.
    pub end_microsteps: f64,
    /// Pulse rate of the cycle, signed, before rounding.
    pub pulse_rate_hz: f64,
    /// Whether the windings carry current in this cycle.
    pub energised: bool,
    /// The drive's own bits of [`validity`] for the Feedback at the cycle's end: `ENERGISED`, `STANDSTILL`,
    /// `LIMITED`, `STOPPED_ITSELF`, `COMMAND_MISSED`.
    pub flags: u64,
    /// Why the drive stopped by itself; `None` while it did not.
    pub fault: FaultCode,
}

/// Takes the guard through cycle `cycle`.
///
/// `command` is the StepCommand of this very cycle, already checked; `None` when there is none.
///
/// ```
/// use drive::{AfterStop, Params, State, step};
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
/// };
/// let mut state = State::at_rest_energised(0);
/// let command = StepCommand { position_unrounded: 1e6, follow: 1, energise: 1, ..StepCommand::default() };
/// // A million micro-steps were asked for; the first cycle gives what the acceleration allows.
/// let output = step(&params, &mut state, 0, Some(&command));
/// assert_eq!(output.end_microsteps, 40.0);
/// ```
pub fn step(params: &Params, state: &mut State, cycle: u64, command: Option<&StepCommand>) -> Output {
    match command {
        Some(command) => note_command(params, state, cycle, command),
        None => state.missed = state.missed.saturating_add(1),
    }
    let start = state.accepted;
    let travel = match (state.mode, command) {
        (Mode::Following, Some(command)) => follow(params, state, command),
        (Mode::Following, None) => go_on(state),
        (Mode::StoppedItself, _) => after_silence(params, state, command),
        _ => stop(params, state, command),
    };
    accept(state, &travel, command);
    // Counted to the end, so that the ramp begins in the next cycle.
    if state.mode == Mode::Following && state.missed >= params.silence_cycles {
        state.mode = Mode::StoppedItself;
        state.settled = false;
    } else if state.mode == Mode::StoppedItself {
        state.settled =
            state.settled || state.travel == MicrostepsPerCycle::ZERO && at_neutral(params, state);
    }
    switch_current(params, state);
    report(params, state, start, travel.limited(), command.is_none())
}

/// Changes of mode that a command brings.
fn note_command(params: &Params, state: &mut State, cycle: u64, command: &StepCommand) {
    state.missed = 0;
    state.command_cycle = cycle;
    state.energise_wanted = command.energise == 1;
    let follow = command.follow == 1 && state.energise_wanted;
    if follow
        && !state.energised
        && state.travel == MicrostepsPerCycle::ZERO
        && state.mode != Mode::StoppedItself
    {
        // Without current the count means nothing: energising begins where the command does.
        state.position = Microsteps(command.position_unrounded - command.pulse_rate_hz * params.period_s);
        state.accepted = state.position.round();
    }
    let agrees = (Microsteps(command.position_unrounded) - state.position).0.abs() <= 1.0;
    state.mode = match (state.mode, follow) {
        (Mode::StoppedItself, false) if state.settled => Mode::Released,
        (Mode::StoppedItself, _) => Mode::StoppedItself,
        (Mode::Released, true) if !agrees => Mode::Released,
        (Mode::Released, false) => Mode::Released,
        (_, true) => Mode::Following,
        (_, false) => Mode::Idle,
    };
    if state.mode != Mode::Following {
        state.previous_command = None;
    }
}

/// Goes where the command wants, or as far as the limits let it.
fn follow(params: &Params, state: &State, command: &StepCommand) -> Travel {
    let target = Microsteps(command.position_unrounded);
    // The command's own word on its speed is only asked for where the last command is unknown.
    let own_way = match state.previous_command {
        Some(previous) => target - previous,
        None => {
            let way = command.pulse_rate_hz * params.period_s;
            MicrostepsPerCycle(way.clamp(-params.max_travel(), params.max_travel()))
        }
    };
    limits::follow(params, state.position, state.travel, target, own_way)
}

/// No command: the last rate for one more cycle.
fn go_on(state: &State) -> Travel {
    go(state, state.travel, false)
}

/// The next cycle of a quick stop; rest once the rate is zero. A command that wants to be followed all the same
/// counts as cut.
fn stop(params: &Params, state: &State, command: Option<&StepCommand>) -> Travel {
    let refused = command.is_some_and(|command| command.follow == 1);
    go(state, limits::ramp_down(params, state.travel), refused)
}

/// The ramp of a stop by itself; then, once it has stood, the way to the neutral position where that is wanted and the
/// motor has current to go there.
fn after_silence(params: &Params, state: &State, command: Option<&StepCommand>) -> Travel {
    let AfterStop::Neutral { microsteps, pulse_rate_hz, .. } = params.after_stop else {
        return stop(params, state, command);
    };
    // Faster than on that way: still the ramp.
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

/// Takes over the cycle's way, and rounds.
fn accept(state: &mut State, travel: &Travel, command: Option<&StepCommand>) {
    state.travel = travel.way;
    state.position = Microsteps(travel.position.0.clamp(-MAX_MICROSTEPS, MAX_MICROSTEPS));
    let untouched = command.filter(|command| {
        state.mode == Mode::Following
            && !travel.limited()
            && (Microsteps::from(command.position_microsteps) - state.position).0.abs() <= 1.0
    });
    // The controller has rounded once; rounding a second time could only differ from what it believes.
    state.accepted = match untouched {
        Some(command) => command.position_microsteps,
        None => state.position.round(),
    };
    if state.mode == Mode::Following {
        state.previous_command = command.map(|command| Microsteps(command.position_unrounded));
    }
}

/// Windings: on when asked for; off when not wanted, and after a stop by itself if so set, but never in motion.
fn switch_current(params: &Params, state: &mut State) {
    let latched = state.mode == Mode::StoppedItself;
    let wanted = state.energise_wanted && !(latched && params.after_stop == AfterStop::DeEnergise);
    if wanted && !latched {
        state.energised = true;
    } else if !wanted && state.travel == MicrostepsPerCycle::ZERO {
        state.energised = false;
    }
}

fn report(params: &Params, state: &State, start: i64, limited: bool, missed: bool) -> Output {
    let latched = state.mode == Mode::StoppedItself;
    let bits = [
        (validity::ENERGISED, state.energised),
        // On the way to the neutral position it may stand for a cycle, where it turns back.
        (validity::STANDSTILL, state.travel == MicrostepsPerCycle::ZERO && (!latched || state.settled)),
        (validity::LIMITED, limited),
        (validity::STOPPED_ITSELF, latched),
        (validity::COMMAND_MISSED, missed),
    ];
    Output {
        start_microsteps: start as f64,
        end_microsteps: state.accepted as f64,
        pulse_rate_hz: state.travel.rate_hz(params.period_s),
        energised: state.energised,
        flags: bits.iter().filter(|(_, set)| *set).fold(0, |flags, (bit, _)| flags | bit),
        fault: if latched { FaultCode::CommandSilent } else { FaultCode::None },
    }
}
