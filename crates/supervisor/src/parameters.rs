//! Parameters of the controller that operators change: sent, taken or refused, each refusal with what it may be.

use crate::generation::Generation;
use crate::operate::order_of;
use crate::request::Answer;
use crate::set_points::beyond;
use signals::{ControlParameter, OperatorCommand, OperatorKind};

impl Generation<'_> {
    /// Gives a parameter another value; SI.
    pub fn set_parameter(&mut self, name: &str, value: f64) -> Answer {
        let known = || ControlParameter::ALL.iter().filter(|parameter| **parameter != ControlParameter::None);
        let Some(parameter) = known().find(|parameter| spelled(**parameter) == name) else {
            let names: Vec<_> = known().map(|parameter| spelled(*parameter)).collect();
            return Answer::refused(format!("no parameter \"{name}\", expected one of {}", names.join(", ")));
        };
        if !value.is_finite() {
            return Answer::refused("the value is not a number");
        }
        let order =
            OperatorCommand { parameter: parameter.code(), value, ..order_of(OperatorKind::SetParameter) };
        if let Some(refusal) = beyond(&order, "value") {
            return refusal;
        }
        self.order(order, &format!("{name} is {value}{}", unit(*parameter)))
    }

    /// Why the controller does not take a parameter's value.
    pub fn why_not(&self, order: &OperatorCommand) -> String {
        let parameter = ControlParameter::from_code(order.parameter).unwrap_or(ControlParameter::None);
        let (name, value) = (spelled(parameter), order.value);
        match self.mission().parts.controller.params.range(parameter) {
            None => format!("this controller has no {name}: the scenario gives it no observer"),
            Some((low, high)) => {
                let what = if parameter == ControlParameter::CompensationLevel {
                    "a whole number"
                } else {
                    "a value"
                };
                format!(
                    "{name} {value}, expected {what} from {low} to {high}{}{}",
                    unit(parameter),
                    why(parameter)
                )
            }
        }
    }
}

fn spelled(parameter: ControlParameter) -> String {
    parameter.name().replace(' ', "-")
}

fn unit(parameter: ControlParameter) -> &'static str {
    match parameter {
        ControlParameter::None | ControlParameter::CompensationLevel => "",
        ControlParameter::ObserverBandwidth => " Hz",
        ControlParameter::ObserverLimit => " N·m",
        ControlParameter::MaxFollowingError => " rad",
        ControlParameter::FollowingErrorPerSpeed => " s",
    }
}

/// What its range is.
fn why(parameter: ControlParameter) -> &'static str {
    match parameter {
        ControlParameter::None
        | ControlParameter::CompensationLevel
        | ControlParameter::ObserverBandwidth => "",
        ControlParameter::ObserverLimit => {
            " (the holding torque; the scenario's observer_limit is a part of it)"
        }
        ControlParameter::MaxFollowingError | ControlParameter::FollowingErrorPerSpeed => {
            " (the scenario's: it can be tightened, never widened)"
        }
    }
}
