//! What operators ask for, carried out one after the other, each answered when its effect is seen on the bus.

use crate::generation::Generation;
use crate::request::{Answer, Request, SetKind};
use crate::status::Status;
use processes::ToChild;
use signals::{
    ControlParameter, ControllerState, FaultCode, OperatorCommand, OperatorKind, OperatorResult, SetPoint,
    SetPointKind, SetPointRefusal, Source, validity,
};
use std::time::{Duration, Instant};

/// How long the loop may take to show an effect.
const EFFECT_PATIENCE: Duration = Duration::from_secs(1);

/// An order that says nothing but its kind.
fn order_of(kind: OperatorKind) -> OperatorCommand {
    OperatorCommand { kind: kind.code(), ..OperatorCommand::default() }
}

impl Generation<'_> {
    /// Answers everything that was asked meanwhile.
    pub fn answer_waiting(&mut self) {
        while let Some(asked) = self.next_asked() {
            let answer = self.carry_out(&asked.request);
            // A client that is gone does no harm: what it asked for is done all the same.
            let _ = asked.answer.send(answer);
        }
    }

    fn carry_out(&mut self, request: &Request) -> Answer {
        match request {
            Request::Arm => self.arm(),
            Request::Disarm => self.disarm(),
            Request::Reset => self.order(order_of(OperatorKind::Reset), "reset: disarmed"),
            Request::Set { kind, value, pressure_drop_pa } => self.set(*kind, *value, *pressure_drop_pa),
            Request::Parameter { name, value } => self.set_parameter(name, *value),
            Request::Hold => self.send(SetPoint { kind: SetPointKind::Hold.code(), ..SetPoint::default() }),
            Request::Status => self.status(),
            Request::Mark { text } => self.tell_recorder(ToChild::Mark(text.clone()), "noted"),
            Request::SaveTiming => self.save_timing(),
            Request::Inject { fault } => self.inject(fault),
        }
    }

    fn arm(&mut self) -> Answer {
        let currentless =
            self.watch.feedback().is_some_and(|feedback| feedback.body.validity & validity::ENERGISED == 0);
        let answer = self.order(order_of(OperatorKind::Arm), "armed");
        if answer.done && currentless {
            let text = "armed; the windings were without current: energising may have moved the rotor by up to half a tooth";
            return Answer::done(text);
        }
        answer
    }

    fn disarm(&mut self) -> Answer {
        let answer = self.order(order_of(OperatorKind::Disarm), "disarmed: the valve stands");
        if answer.done && !self.wait(self.stop_patience(), |this| this.watch.at_rest()) {
            return Answer::refused("disarming, but the valve does not stand yet");
        }
        answer
    }

    /// Gives an order to the controller, and waits for what it says.
    fn order(&mut self, order: OperatorCommand, done: &str) -> Answer {
        let id = self.give_order(order);
        let mut result = None;
        self.wait(EFFECT_PATIENCE, |this| {
            let answered = this.watch.status().filter(|status| status.body.operator_id >= id);
            result =
                answered.map(|status| (status.body.operator_result, status.body.state, status.body.fault));
            result.is_some()
        });
        let Some((result, state, fault)) = result else {
            return Answer::refused("the controller does not answer");
        };
        let state = ControllerState::from_code(state).map_or("unknown", ControllerState::name);
        match OperatorResult::from_code(result) {
            Some(OperatorResult::Done) => Answer::done(done),
            Some(other) => {
                let fault = FaultCode::from_code(fault).filter(|fault| *fault != FaultCode::None);
                let fault = fault.map_or(String::new(), |fault| format!(" ({fault})"));
                Answer::refused(format!("{other}: the controller is in {state}{fault}"))
            }
            None => Answer::refused("the controller's answer means nothing"),
        }
    }

    fn set_parameter(&mut self, name: &str, value: f64) -> Answer {
        let spelled = |parameter: &ControlParameter| parameter.name().replace(' ', "-");
        let known = || ControlParameter::ALL.iter().filter(|parameter| **parameter != ControlParameter::None);
        let Some(parameter) = known().find(|parameter| spelled(parameter) == name) else {
            let names: Vec<_> = known().map(spelled).collect();
            return Answer::refused(format!("no parameter \"{name}\", expected one of {}", names.join(", ")));
        };
        if !value.is_finite() {
            return Answer::refused("the value is not a number");
        }
        let order =
            OperatorCommand { parameter: parameter.code(), value, ..order_of(OperatorKind::SetParameter) };
        self.order(order, &format!("{name} is {value}"))
    }

    fn set(&mut self, kind: SetKind, value: f64, pressure_drop_pa: Option<f64>) -> Answer {
        if !value.is_finite() || pressure_drop_pa.is_some_and(|pressure| !pressure.is_finite()) {
            return Answer::refused("the value is not a number");
        }
        let kind = match kind {
            SetKind::Angle => SetPointKind::Angle,
            SetKind::Opening => SetPointKind::Opening,
            SetKind::Flow => SetPointKind::Flow,
            SetKind::Speed => SetPointKind::Speed,
        };
        self.send(SetPoint {
            kind: kind.code(),
            value,
            pressure_drop_pa: pressure_drop_pa.unwrap_or(0.0),
            pressure_given: u64::from(pressure_drop_pa.is_some()),
            ..SetPoint::default()
        })
    }

    /// Sends a set-point, and waits until the reference follows it or refuses it.
    fn send(&mut self, set_point: SetPoint) -> Answer {
        let id = self.give_set_point(set_point);
        let mut outcome = None;
        self.wait(EFFECT_PATIENCE, |this| {
            let reference = this.watch.reference().map(|message| message.body);
            outcome =
                reference.filter(|reference| reference.set_point_id == id || reference.refused_id == id);
            outcome.is_some()
        });
        match outcome {
            None => Answer::refused("the trajectory does not answer"),
            Some(reference) if reference.refused_id == id => {
                let why = SetPointRefusal::from_code(reference.refusal)
                    .map_or("unknown reason", SetPointRefusal::name);
                Answer::refused(why)
            }
            Some(reference) => {
                let target = reference.target_angle_rad.to_degrees();
                let kind = SetPointKind::from_code(reference.set_point_kind).map_or("", SetPointKind::name);
                Answer::done(if kind == SetPointKind::Speed.name() {
                    format!("set-point {id}: {kind}")
                } else {
                    format!("set-point {id}: {kind}, to {target:.3}°")
                })
            }
        }
    }

    fn status(&mut self) -> Answer {
        let (instance, generation, recorder_restarts) = self.names();
        let status = Status { instance, generation, recorder_restarts, ..self.watch.describe() };
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
        self.wait(EFFECT_PATIENCE, |this| {
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
    fn wait(&mut self, patience: Duration, mut condition: impl FnMut(&mut Self) -> bool) -> bool {
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
