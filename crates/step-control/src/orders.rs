//! What an order does in which state, as one table; and how an order is checked before it counts.
//!
//! | order    | Disarmed           | Arming    | Running   | Homing    | QuickStop | Fault      |
//! |----------|--------------------|-----------|-----------|-----------|-----------|------------|
//! | arm      | Arming, if ready   | under way | done      | wrong     | wrong     | wrong      |
//! | home     | Arming, if ready   | wrong     | wrong     | under way | wrong     | wrong      |
//! | disarm   | done               | QuickStop | QuickStop | QuickStop | done      | wrong      |
//! | reset    | wrong              | wrong     | wrong     | wrong     | wrong     | Disarmed, if heard |
//!
//! Ready is: Feedback and Reference have arrived in this very cycle, the drive stands still, and it reports no fault. To home, the
//! scenario has to say how. Heard is: Feedback has arrived in this very cycle; of a valve that nothing is heard of nobody knows whether it stands. An expired order does nothing in any state, except a disarm, which never expires. Each id is obeyed once.

use crate::input::Input;
use crate::params::Params;
use crate::state::State;
use crate::watch::benefit::Benefit;
use signals::{
    ControlParameter, ControllerState, FaultCode, Feedback, OperatorCommand, OperatorKind, OperatorResult,
    validity,
};

/// What arming and homing need.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Readiness {
    /// Feedback arrived in this cycle.
    pub feedback: bool,
    /// Reference arrived in this cycle.
    pub reference: bool,
    /// The drive stands still.
    pub still: bool,
    /// The drive reports no fault of its own.
    pub no_drive_fault: bool,
    /// The scenario says how to home.
    pub can_home: bool,
}

impl Readiness {
    fn new(params: &Params, input: &Input) -> Self {
        let says = |test: fn(&Feedback) -> bool| input.feedback.is_some_and(test);
        Self {
            feedback: input.feedback.is_some(),
            reference: input.reference.is_some(),
            still: says(|feedback| feedback.validity & validity::STANDSTILL != 0),
            no_drive_fault: says(|feedback| feedback.drive_fault == FaultCode::None.code()),
            can_home: params.homing.is_some(),
        }
    }

    fn to_arm(self) -> bool {
        self.feedback && self.reference && self.still && self.no_drive_fault
    }
}

/// The effect of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Decision {
    /// The state that follows at once; `None` if it stays the same.
    pub next: Option<ControllerState>,
    /// The answer.
    pub result: OperatorResult,
}

/// The table of this file's head.
pub(crate) fn decide(state: ControllerState, order: OperatorKind, ready: Readiness) -> Decision {
    use ControllerState::{Arming, Disarmed, Fault, Homing, QuickStop, Running};
    use OperatorKind::{Arm, Disarm, Home, Nothing, Reset, SetParameter};
    let to = |next, result| Decision { next: Some(next), result };
    let stay = |result| Decision { next: None, result };
    match (order, state) {
        (Nothing | SetParameter, _) => stay(OperatorResult::None),
        (Home, Disarmed) if !ready.can_home => stay(OperatorResult::NoHoming),
        (Arm | Home, Disarmed) if !ready.to_arm() => stay(OperatorResult::NotReady),
        (Arm | Home, Disarmed) => to(Arming, OperatorResult::Begun),
        (Arm, Arming) | (Home, Homing) => stay(OperatorResult::Begun),
        (Arm, Running) => stay(OperatorResult::Done),
        (Disarm, Arming | Running | Homing) => to(QuickStop, OperatorResult::Done),
        (Disarm, Disarmed | QuickStop) => stay(OperatorResult::Done),
        (Reset, Fault) if !ready.feedback => stay(OperatorResult::NotReady),
        (Reset, Fault) => to(Disarmed, OperatorResult::Done),
        (Arm, Homing | QuickStop | Fault)
        | (Home, Arming | Running | QuickStop | Fault)
        | (Disarm, Fault)
        | (Reset, Disarmed | Arming | Running | Homing | QuickStop) => stay(OperatorResult::WrongState),
    }
}

/// Carries out what the operator, or the scenario in the operator's place, wants in this cycle.
pub(crate) fn obey(params: &Params, state: &mut State, cycle: u64, input: &Input) {
    if params.arm_at_cycle == Some(cycle) {
        carry_out(params, state, OperatorKind::Arm, cycle, input);
    }
    if params.disarm_at_cycle == Some(cycle) {
        carry_out(params, state, OperatorKind::Disarm, cycle, input);
    }
    let Some(order) = input.order.filter(|order| order.id > state.supervision.operator_id) else { return };
    state.supervision.operator_id = order.id;
    state.supervision.operator_result = answer(params, state, order, cycle, input);
}

fn answer(
    params: &Params,
    state: &mut State,
    order: &OperatorCommand,
    cycle: u64,
    input: &Input,
) -> OperatorResult {
    let kind = OperatorKind::from_code(order.kind).unwrap_or(OperatorKind::Nothing);
    if cycle > order.valid_until_cycle && kind != OperatorKind::Disarm {
        return OperatorResult::Expired;
    }
    if kind == OperatorKind::SetParameter {
        let parameter = ControlParameter::from_code(order.parameter).unwrap_or(ControlParameter::None);
        state.observation.benefit = Benefit::default();
        state.observation.alarms.try_again();
        return state.tuning.set(params, parameter, order.value);
    }
    carry_out(params, state, kind, cycle, input)
}

fn carry_out(
    params: &Params,
    state: &mut State,
    order: OperatorKind,
    cycle: u64,
    input: &Input,
) -> OperatorResult {
    let decision = decide(state.supervision.machine, order, Readiness::new(params, input));
    if let Some(next) = decision.next {
        state.enter(next, cycle);
    }
    match (order, decision.next) {
        (OperatorKind::Arm, Some(_)) => state.supervision.arms_to_home = false,
        (OperatorKind::Home, Some(_)) => state.supervision.arms_to_home = true,
        (OperatorKind::Reset, Some(_)) => {
            state.supervision.fault = FaultCode::None;
            state.observation.following_error_peak_rad = 0.0;
        }
        _ => {}
    }
    decision.result
}

#[cfg(test)]
mod tests {
    use super::*;
    use ControllerState::{Arming, Disarmed, Fault, Homing, QuickStop, Running};
    use OperatorResult::{Begun, Done, NoHoming, None as Nothing, NotReady, WrongState};

    /// The state that an order leads to, where it changes it, and the answer.
    type Outcome = (Option<ControllerState>, OperatorResult);

    /// The table, written once more: order, then the outcome when everything is ready, by state.
    const READY: [(OperatorKind, [Outcome; 6]); 6] = [
        (OperatorKind::Nothing, [(None, Nothing); 6]),
        (
            OperatorKind::Arm,
            [
                (Some(Arming), Begun),
                (None, Done),
                (None, WrongState),
                (None, WrongState),
                (None, Begun),
                (None, WrongState),
            ],
        ),
        (
            OperatorKind::Disarm,
            [
                (None, Done),
                (Some(QuickStop), Done),
                (None, Done),
                (None, WrongState),
                (Some(QuickStop), Done),
                (Some(QuickStop), Done),
            ],
        ),
        (
            OperatorKind::Reset,
            [
                (None, WrongState),
                (None, WrongState),
                (None, WrongState),
                (Some(Disarmed), Done),
                (None, WrongState),
                (None, WrongState),
            ],
        ),
        (OperatorKind::SetParameter, [(None, Nothing); 6]),
        (
            OperatorKind::Home,
            [
                (Some(Arming), Begun),
                (None, WrongState),
                (None, WrongState),
                (None, WrongState),
                (None, WrongState),
                (None, Begun),
            ],
        ),
    ];

    fn readiness(bits: u32) -> Readiness {
        let has = |bit: u32| bits & (1 << bit) != 0;
        Readiness {
            feedback: has(0),
            reference: has(1),
            still: has(2),
            no_drive_fault: has(3),
            can_home: has(4),
        }
    }

    #[test]
    fn every_state_order_and_precondition_does_what_the_table_says() {
        let states = [Disarmed, Running, QuickStop, Fault, Arming, Homing];
        assert_eq!(states, ControllerState::ALL);
        for (kind, (order, outcomes)) in OperatorKind::ALL.iter().zip(READY) {
            assert_eq!(*kind, order);
            for (state, (next, result)) in states.into_iter().zip(outcomes) {
                for bits in 0..32 {
                    let ready = readiness(bits);
                    let begins = state == Disarmed && matches!(order, OperatorKind::Arm | OperatorKind::Home);
                    let wanted = match (begins, order) {
                        (true, OperatorKind::Home) if bits & 16 == 0 => {
                            Decision { next: None, result: NoHoming }
                        }
                        (true, _) if bits & 15 != 15 => Decision { next: None, result: NotReady },
                        (_, OperatorKind::Reset) if state == Fault && bits & 1 == 0 => {
                            Decision { next: None, result: NotReady }
                        }
                        _ => Decision { next, result },
                    };
                    assert_eq!(decide(state, order, ready), wanted, "{order} in {state} with {ready:?}");
                }
            }
        }
    }
}
