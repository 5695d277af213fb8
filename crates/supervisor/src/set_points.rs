//! Set-points that operators give: sent, followed or refused, each refusal with the limit that it is about.

use crate::generation::Generation;
use crate::request::Answer;
use signals::{Body, ControllerState, FaultCode, Rule, SetPoint, SetPointKind, SetPointRefusal};

impl Generation<'_> {
    /// Sends a set-point of a kind; SI.
    pub fn set(&mut self, kind: SetPointKind, value: f64, pressure_drop_pa: Option<f64>) -> Answer {
        self.send(SetPoint {
            kind: kind.code(),
            value,
            pressure_drop_pa: pressure_drop_pa.unwrap_or(0.0),
            pressure_given: u64::from(pressure_drop_pa.is_some()),
            ..SetPoint::default()
        })
    }

    /// Stops as soon as the limits of motion allow.
    pub fn hold(&mut self) -> Answer {
        self.send(SetPoint { kind: SetPointKind::Hold.code(), ..SetPoint::default() })
    }

    /// Sends a set-point, and waits until the reference follows it or refuses it.
    fn send(&mut self, set_point: SetPoint) -> Answer {
        // One that no reader accepts would vanish.
        if let Some(refusal) = beyond(&set_point, "value") {
            return self.beyond_a_limit(&set_point).map_or(refusal, Answer::refused);
        }
        if let Some(refusal) = beyond(&set_point, "pressure_drop_pa") {
            return refusal;
        }
        let id = self.give_set_point(set_point);
        let mut outcome = None;
        self.wait(self.patience, |this| {
            let reference = this.watch.reference().map(|message| message.body);
            outcome =
                reference.filter(|reference| reference.set_point_id == id || reference.refused_id == id);
            outcome.is_some()
        });
        match outcome {
            None => Answer::refused("the trajectory does not answer"),
            Some(reference) if reference.refused_id == id => {
                let why = SetPointRefusal::from_code(reference.refusal);
                Answer::refused(why.map_or("unknown reason".to_owned(), |why| self.explain(why, &set_point)))
            }
            Some(reference) => {
                let target = reference.target_angle_rad.to_degrees();
                let kind = SetPointKind::from_code(reference.set_point_kind).map_or("", SetPointKind::name);
                self.followed = Some(SetPoint { id, ..set_point });
                let asked = asked(&set_point).map_or(String::new(), |asked| format!(" {asked}"));
                Answer::done(if kind == SetPointKind::Speed.name() {
                    format!("set-point {id}: {kind}{asked}")
                } else {
                    format!("set-point {id}: {kind}{asked}, to {target:.3}°")
                })
            }
        }
    }

    /// What was asked with the set-point `id`, in an operator's units; empty where the angle says it, or another gave it.
    pub(crate) fn asked_with(&self, id: u64) -> String {
        self.followed.filter(|followed| followed.id == id).and_then(|it| asked(&it)).unwrap_or_default()
    }

    /// The refusal of what no message may hold, with the valve's own limit where it has one.
    fn beyond_a_limit(&mut self, set_point: &SetPoint) -> Option<String> {
        let limits = &self.mission().parts.trajectory.params.limits;
        let is_limited = limits.min_angle_rad.is_some() && limits.max_angle_rad.is_some();
        let why = match SetPointKind::from_code(set_point.kind)? {
            SetPointKind::Flow => SetPointRefusal::Flow,
            SetPointKind::Speed => SetPointRefusal::SpeedLimit,
            SetPointKind::Opening => SetPointRefusal::AngleLimit,
            SetPointKind::Angle if is_limited => SetPointRefusal::AngleLimit,
            _ => return None,
        };
        Some(self.explain(why, set_point))
    }

    /// A refusal, with what was found and what would have been accepted.
    fn explain(&mut self, why: SetPointRefusal, set_point: &SetPoint) -> String {
        let params = self.mission().parts.trajectory.params;
        let (limits, value) = (&params.limits, set_point.value);
        let kind = SetPointKind::from_code(set_point.kind);
        let more = match (why, kind) {
            (SetPointRefusal::AngleLimit, Some(SetPointKind::Opening)) if !(0.0..=1.0).contains(&value) => {
                Some(format!("opening {value}, expected 0 to 1"))
            }
            (SetPointRefusal::AngleLimit, Some(SetPointKind::Speed)) => {
                Some("a scenario with limits of angle has no turning without end".to_owned())
            }
            (SetPointRefusal::AngleLimit, _) => {
                let end = |end: Option<f64>, sign: &str| {
                    end.map_or(format!("{sign}any angle"), |rad| format!("{:.3}°", rad.to_degrees()))
                };
                let (low, high) = (end(limits.min_angle_rad, "-"), end(limits.max_angle_rad, "+"));
                let is_angle = kind == Some(SetPointKind::Angle);
                let asked =
                    if is_angle { format!("{:.3}° asked, ", value.to_degrees()) } else { String::new() };
                Some(format!("{asked}expected {low} to {high}"))
            }
            (SetPointRefusal::SpeedLimit, _) => {
                let most = limits.max_speed_rad_per_s;
                Some(format!("{} asked, expected up to {} either way", speed(value), speed(most)))
            }
            (SetPointRefusal::Flow, _) => {
                let given = (set_point.pressure_given == 1).then_some(set_point.pressure_drop_pa);
                let pressure_pa = given.or_else(|| Some(self.watch.feedback()?.body.pressure_drop_pa));
                let known = params.orifice.zip(params.oil_density_kg_per_m3).zip(pressure_pa);
                known.and_then(|((orifice, density), pressure_pa)| {
                    Some(orifice.angle_for_flow(value, pressure_pa, density).err()?.to_string())
                })
            }
            (SetPointRefusal::NotRunning, _) => self.watch.seen().map(|seen| match seen.fault {
                FaultCode::None if seen.state == ControllerState::Arming => {
                    "the controller is still arming: again when it runs".to_owned()
                }
                FaultCode::None => format!("the controller is {}; first: stepvalve arm", seen.state),
                fault => format!("stopped by a fault ({fault}); first: stepvalve reset, then arm"),
            }),
            (SetPointRefusal::NotHomed, _) => {
                let most = speed(limits.unhomed_speed_rad_per_s);
                let jog = (kind == Some(SetPointKind::Speed)).then(|| {
                    format!("{} asked, expected up to {most} either way until it is; ", speed(value))
                });
                let jog = jog.unwrap_or_default();
                Some(format!("{jog}{}; {}", self.why_not_homed(), self.zero_again()))
            }
            _ => None,
        };
        more.map_or(why.name().to_owned(), |more| format!("{}: {more}", why.name()))
    }
}

/// What was asked, in an operator's units; an angle says it by its target.
fn asked(set_point: &SetPoint) -> Option<String> {
    let SetPoint { value, pressure_drop_pa, .. } = set_point;
    match SetPointKind::from_code(set_point.kind)? {
        SetPointKind::Flow if set_point.pressure_given == 1 => {
            Some(format!("{:.4} L/min at {:.4} MPa", value * L_PER_MIN, pressure_drop_pa / 1e6))
        }
        SetPointKind::Flow => Some(format!("{:.4} L/min", value * L_PER_MIN)),
        SetPointKind::Speed => Some(speed(*value)),
        SetPointKind::Opening => Some(format!("{value:.4}")),
        _ => None,
    }
}

/// Litres a minute in a cubic metre a second.
const L_PER_MIN: f64 = 60e3;

/// A speed in an operator's units.
fn speed(rad_per_s: f64) -> String {
    format!("{:.2} rpm ({:.1}°/s)", rad_per_s * 30.0 / std::f64::consts::PI, rad_per_s.to_degrees())
}

/// The refusal of a message that its readers would not accept: a field of it is beyond what any message may hold.
pub(crate) fn beyond<B: Body>(body: &B, field: &str) -> Option<Answer> {
    let index = B::FIELDS.iter().position(|known| known.name == field)?;
    let mut words = Vec::new();
    body.each_word(|word| words.push(word));
    let (known, value) = (B::FIELDS.get(index)?, f64::from_bits(*words.get(index)?));
    let Rule::Within(low, high) = known.rule else { return None };
    if (low..=high).contains(&value) {
        return None;
    }
    Some(Answer::refused(format!("{} is {value:e}, expected {low:e} to {high:e} in SI", known.name)))
}
