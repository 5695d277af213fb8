//! What operators ask for, carried out one after the other, each answered when its effect is seen on the bus.

use crate::generation::{Generation, SEEN_WITHIN};
use crate::journal::EventKind;
use crate::news::Asked;
use crate::request::{Answer, Request};
use crate::status::Status;
use processes::ToChild;
use realtime::now_ns;
use signals::{
    ControlStatus, ControllerState, FaultCode, OperatorCommand, OperatorKind, OperatorResult, Source,
    validity,
};
use std::time::{Duration, Instant};

/// How long the loop may take to show an effect.
const EFFECT_PATIENCE: Duration = Duration::from_secs(1);

/// How long arming is tried anew where the controller is not ready: a message that a busy machine delivers late, or a valve that
/// is about to stand, needs some cycles.
const READY_WITHIN: Duration = Duration::from_millis(200);

/// Time left to the client's deadline, at most `EFFECT_PATIENCE`.
fn patience(until_ns: Option<u64>) -> Duration {
    let left = until_ns.map(|until_ns| Duration::from_nanos(until_ns.saturating_sub(now_ns())));
    left.map_or(EFFECT_PATIENCE, |left| left.min(EFFECT_PATIENCE))
}

/// What becomes of a note while the disk does not take the record.
const NOTED_IN_EVENTS: &str = "noted in the events alone: THE DISK DOES NOT TAKE THE RECORD";

/// Whether whoever asked is gone, or has waited long enough.
fn is_over(asked: &Asked) -> bool {
    asked.client.is_gone() || asked.until_ns.is_some_and(|until_ns| now_ns() > until_ns)
}

/// An order that says nothing but its kind.
pub(crate) fn order_of(kind: OperatorKind) -> OperatorCommand {
    OperatorCommand { kind: kind.code(), ..OperatorCommand::default() }
}

impl Generation<'_> {
    /// Answers everything that was asked meanwhile.
    pub fn answer_waiting(&mut self) {
        while let Some(asked) = self.next_asked() {
            // Nobody is there to hear that it was done: then it is not done.
            if asked.client.is_gone() {
                continue;
            }
            self.patience = patience(asked.until_ns);
            if self.patience <= SEEN_WITHIN {
                let _ = asked.answer.send(Answer::refused("it came too late"));
                continue;
            }
            self.order_begins(&asked.request);
            let answer = self.carry_out(&asked.request);
            self.order_ends(answer.done);
            self.note_answer(&asked, &answer);
            if answer.done && is_over(&asked) {
                self.take_back(&asked.request);
            }
            let _ = asked.answer.send(answer);
        }
    }

    /// Undoes a request whose client stopped waiting and so counts it as refused.
    fn take_back(&mut self, request: &Request) {
        self.patience = EFFECT_PATIENCE;
        let answer = match request {
            Request::Arm | Request::Home => self.disarm(),
            Request::Set { .. } => self.hold(),
            // These leave nothing behind that could move the valve.
            Request::Disarm
            | Request::Reset
            | Request::Parameter { .. }
            | Request::Hold
            | Request::Status
            | Request::Mark { .. }
            | Request::SaveTiming
            | Request::Inject { .. } => return,
        };
        let text = format!("an operator was gone when the order was done; taken back: {}", answer.text);
        self.note(EventKind::Order, text);
    }

    /// Notes what became of a request.
    fn note_answer(&self, asked: &Asked, answer: &Answer) {
        let (event, text) = match (&asked.request, answer.done) {
            (Request::Status, _) => return,
            (Request::Mark { text }, true) => (EventKind::Note, text.clone()),
            (Request::Inject { .. }, true) => (EventKind::Injection, answer.text.clone()),
            (_, true) => (EventKind::Order, answer.text.clone()),
            (request, false) => (EventKind::Refused, format!("{}: {}", request.name(), answer.text)),
        };
        self.note_by(event, asked.client.peer(), text);
    }

    fn carry_out(&mut self, request: &Request) -> Answer {
        match request {
            Request::Arm => self.arm(),
            Request::Home => self.order(order_of(OperatorKind::Home), "homed"),
            Request::Disarm => self.disarm(),
            Request::Reset => self.reset(),
            Request::Set { kind, value, pressure_drop_pa } => self.set(*kind, *value, *pressure_drop_pa),
            Request::Parameter { name, value } => self.set_parameter(name, *value),
            Request::Hold => self.hold(),
            Request::Status => self.status(),
            Request::Mark { text } => {
                let recorded = self.watch.seen().is_none_or(|seen| seen.recorded);
                let noted = if recorded { "noted" } else { NOTED_IN_EVENTS };
                self.tell_recorder(ToChild::Mark(text.clone()), noted)
            }
            Request::SaveTiming => self.save_timing(),
            Request::Inject { fault } => self.inject(fault),
        }
    }

    fn arm(&mut self) -> Answer {
        let currentless =
            self.watch.feedback().is_some_and(|feedback| feedback.body.validity & validity::ENERGISED == 0);
        let running = ControllerState::Running.code();
        if self.watch.status().is_some_and(|status| status.body.state == running) {
            return self.order(order_of(OperatorKind::Arm), "it was armed already");
        }
        const ARMED: &str = "armed";
        let mut answer = self.order(order_of(OperatorKind::Arm), ARMED);
        if answer.done && answer.text != ARMED {
            answer.text += ": `stepvalve status` says when the drive holds";
        } else if answer.done && currentless {
            answer.text += "; the windings were without current: energising may have moved the rotor by up to half a tooth";
        }
        if answer.done && !self.is_homed() {
            let (why, way) = (self.why_not_homed(), self.zero_again());
            answer.text += &format!("; {why}: set-points of angle, opening and flow are refused; {way}");
        }
        answer
    }

    fn reset(&mut self) -> Answer {
        let fault = self.watch.status().map(|status| status.body.fault);
        let mut answer = self.order(order_of(OperatorKind::Reset), "reset: disarmed");
        if answer.done && fault == Some(FaultCode::LostSteps.code()) {
            answer.text += "; the angle may be wrong by whole steps; ";
            answer.text += &self.zero_again();
        }
        answer
    }

    fn is_homed(&mut self) -> bool {
        self.watch.feedback().is_some_and(|feedback| feedback.body.validity & validity::HOMED != 0)
    }

    /// Why a valve that is not homed is not.
    pub(crate) fn why_not_homed(&self) -> &'static str {
        if self.watch.angle_doubt().is_doubted() {
            "steps were lost since the zero was found"
        } else {
            "the zero is not known"
        }
    }

    /// How the zero is found, or found again.
    pub(crate) fn zero_again(&self) -> String {
        let name = &self.mission().name;
        if self.mission().parts.controller.params.homing.is_some() {
            format!("first, disarmed: stepvalve home --instance {name}")
        } else {
            "the scenario has no section [homing] (docs/scenario.md): bring the valve to its zero, end the instance and start it anew"
                .to_owned()
        }
    }

    fn disarm(&mut self) -> Answer {
        let answer = self.order(order_of(OperatorKind::Disarm), "disarmed: the valve stands");
        if answer.done && !self.wait(self.stop_patience().min(self.patience), |this| this.watch.at_rest()) {
            return Answer::refused("disarming, but the valve does not stand yet");
        }
        if answer.done && !self.watch.hears_the_valve() {
            return Answer::refused("nothing is heard of the valve: whether it stands is not known");
        }
        answer
    }

    /// Gives an order to the controller until it is ready for it; the last order's id, and the controller's answer.
    fn answered(&mut self, order: OperatorCommand) -> Option<(u64, ControlStatus)> {
        // What comes of it must be told while whoever asked is still there.
        let until = Instant::now() + self.patience.saturating_sub(SEEN_WITHIN);
        let tried_until = until.min(Instant::now() + READY_WITHIN);
        loop {
            let (id, status) = self.answered_once(order, until)?;
            let not_ready = status.operator_result == OperatorResult::NotReady.code();
            // An answer to another id is to an operator's disarm, which ends the trying.
            if !not_ready || status.operator_id != id || Instant::now() >= tried_until {
                return Some((id, status));
            }
            self.look_around();
        }
    }

    fn answered_once(&mut self, order: OperatorCommand, until: Instant) -> Option<(u64, ControlStatus)> {
        let left = || until.saturating_duration_since(Instant::now());
        let id = self.give_order(order, left());
        let mut answer = self.answer_to(id, left() + SEEN_WITHIN, |_| true);
        // Arming lasts until the drive holds. Homing lasts long: whoever asked looks at the status meanwhile.
        if order.kind == OperatorKind::Arm.code() {
            let ended = |status: &ControlStatus| status.operator_result != OperatorResult::Begun.code();
            answer = self.answer_to(id, left(), ended).or(answer);
        }
        answer.map(|status| (id, status))
    }

    /// Gives an order to the controller, and waits for what it says.
    pub(crate) fn order(&mut self, order: OperatorCommand, done: &str) -> Answer {
        let Some((id, status)) = self.answered(order) else { return Answer::refused(self.unanswered()) };
        let ControlStatus { operator_id, operator_result, state, fault, .. } = status;
        if operator_id != id {
            // An operator's disarm takes both ways, and the straight one may be first.
            return if order.kind == OperatorKind::Disarm.code() {
                Answer::done(done)
            } else {
                Answer::refused("a disarm came in between")
            };
        }
        let state = ControllerState::from_code(state).map_or("unknown", ControllerState::name);
        match OperatorResult::from_code(operator_result) {
            Some(OperatorResult::Done) => Answer::done(done),
            Some(OperatorResult::Begun) => Answer::done(state),
            Some(OperatorResult::NoHoming) => Answer::refused(self.why_not_home()),
            Some(OperatorResult::Refused) => Answer::refused(self.why_not(&order)),
            Some(OperatorResult::NotReady) => Answer::refused(self.why_not_ready()),
            Some(other) => {
                let fault = FaultCode::from_code(fault).filter(|fault| *fault != FaultCode::None);
                let next = match (fault, OperatorKind::from_code(order.kind)) {
                    (Some(fault), _) => {
                        format!(" ({fault}); first: stepvalve reset --instance {}", self.mission().name)
                    }
                    (None, Some(OperatorKind::Home)) if state == ControllerState::Running.name() => {
                        format!("; first: stepvalve disarm --instance {}", self.mission().name)
                    }
                    (None, Some(OperatorKind::Reset)) => {
                        ", without a fault: there is nothing to reset".to_owned()
                    }
                    (None, _) => String::new(),
                };
                Answer::refused(format!("{other}; the controller's state: {state}{next}"))
            }
            None => Answer::refused("the controller's answer means nothing"),
        }
    }

    /// A scenario that says nothing of homing, and what is left to do where the zero is not known.
    fn why_not_home(&mut self) -> String {
        let none = OperatorResult::NoHoming;
        if self.is_homed() {
            format!(
                "{none}: the scenario has no section [homing] (docs/scenario.md), so the valve counts as homed from the start"
            )
        } else {
            format!("{none}: {}; {}", self.why_not_homed(), self.zero_again())
        }
    }

    /// What a disarmed controller waits for before it arms.
    fn why_not_ready(&mut self) -> String {
        let feedback = self.watch.feedback().map(|feedback| feedback.body);
        let fault = feedback.and_then(|feedback| FaultCode::from_code(feedback.drive_fault));
        let why = match (feedback, fault) {
            (None, _) => "the drive has said nothing yet".to_owned(),
            (Some(_), Some(fault)) if fault != FaultCode::None => format!("the drive reports: {fault}"),
            (Some(feedback), _) if feedback.validity & validity::STANDSTILL == 0 => {
                "the valve does not stand still".to_owned()
            }
            _ => format!("a message of the drive or of the trajectory was missing for {READY_WITHIN:?}"),
        };
        format!("{}: {why}", OperatorResult::NotReady)
    }

    /// What is known of a controller that does not answer.
    fn unanswered(&mut self) -> String {
        let feedback = self.watch.feedback().map_or(0, |feedback| feedback.body.validity);
        let stopped = validity::STANDSTILL | validity::STOPPED_ITSELF;
        let drive = if feedback & stopped == stopped {
            "; the drive has stopped the valve by itself, and it stands"
        } else if feedback & validity::STOPPED_ITSELF != 0 {
            "; the drive is stopping the valve by itself"
        } else {
            ""
        };
        format!("the controller does not answer{drive}")
    }

    /// The controller's answer to an order, once it is one that counts; `None` where there is none in time.
    fn answer_to(
        &mut self,
        id: u64,
        patience: Duration,
        counts: impl Fn(&ControlStatus) -> bool,
    ) -> Option<ControlStatus> {
        let mut answer = None;
        self.wait(patience, |this| {
            let answered = this.watch.status().filter(|status| status.body.operator_id >= id);
            answer = answered.map(|status| status.body).filter(&counts);
            answer.is_some()
        });
        answer
    }

    fn status(&mut self) -> Answer {
        let (instance, generation, recorder_restarts) = self.names();
        let recorder_given_up = self.recorder_given_up();
        let seen = self.watch.describe();
        let set_point_asked = self.asked_with(seen.set_point);
        let status =
            Status { instance, generation, recorder_restarts, recorder_given_up, set_point_asked, ..seen };
        match serde_json::to_value(status) {
            Ok(value) => Answer { status: Some(value), ..Answer::done("status") },
            Err(error) => Answer::refused(error.to_string()),
        }
    }

    fn tell_recorder(&mut self, order: ToChild, done: &str) -> Answer {
        match self.tell(Source::Recorder, &order) {
            Ok(()) => Answer::done(done),
            Err(error) => Answer::refused(format!("{error:#}")),
        }
    }

    fn save_timing(&mut self) -> Answer {
        let told = self.tell_recorder(ToChild::SaveTiming, "");
        if !told.done {
            return told;
        }
        let mut saved = None;
        self.wait(self.patience, |this| {
            saved = this.take_saved();
            saved.is_some()
        });
        match saved {
            Some(Ok(path)) => Answer::done(format!("saved {}", path.display())),
            Some(Err(reason)) => Answer::refused(reason),
            None => Answer::refused("the recorder does not answer"),
        }
    }

    /// Waits for a condition while the processes are watched; whether it came.
    pub(crate) fn wait(&mut self, patience: Duration, mut condition: impl FnMut(&mut Self) -> bool) -> bool {
        let begun = Instant::now();
        while !condition(self) {
            if begun.elapsed() > patience || self.failed() {
                return false;
            }
            self.look_around();
        }
        true
    }
}
