//! Elementary functions of one recorded quantity, of which laws are made.

use valve_model::Covariate;

/// A speed at which something saturates may be off by this factor from where its fit begins.
const SATURATING_WITHIN: f64 = 30.0;
/// Orders of the angle that are a curve around the turn together: it can follow what is an eighth of a turn wide.
pub(crate) const AROUND: usize = 4;

/// A function of one covariate, or several that belong together, such as cosine and sine of one order.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Factor {
    pub of: Covariate,
    /// The expressions; a law has an amplitude for each.
    pub texts: Vec<String>,
    /// The unit of their values; empty where they have none.
    pub unit: &'static str,
    /// A number within the expressions that is fitted too.
    pub shape: Option<Shape>,
    /// Whether a cause of the list is this function where it acts alone: it was tried already.
    pub listed: bool,
    /// The knots of a curve: the first expression is the covariate itself, the others bend at these.
    pub knots: Vec<f64>,
}

/// A number within an expression.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shape {
    pub key: &'static str,
    /// Where its fit begins, and between which values it stays.
    pub start: f64,
    pub least: f64,
    pub most: f64,
    pub unit: String,
}

impl Factor {
    pub fn plain(of: Covariate, text: &str, unit: &'static str) -> Self {
        Self { of, texts: vec![text.to_owned()], unit, shape: None, listed: false, knots: Vec::new() }
    }

    /// Cosine and sine of an order of the angle.
    pub fn harmonic(order: usize) -> Self {
        let angle = if order == 1 { "angle".to_owned() } else { format!("{order}*angle") };
        let texts = ["cos", "sin"].map(|function| format!("{function}({angle})")).to_vec();
        Self { of: Covariate::Angle, texts, unit: "", shape: None, listed: true, knots: Vec::new() }
    }

    /// A spring over angles from and to: its angle without torque is fitted, to a stroke on either side of them.
    pub fn spring((from, to): (f64, f64)) -> Self {
        let (least, most) = (2.0 * from - to, 2.0 * to - from);
        let shape = Shape { key: "rest", start: 0.5 * (from + to), least, most, unit: "rad".to_owned() };
        Self { shape: Some(shape), ..Self::plain(Covariate::Angle, "(angle - rest)", "rad") }
    }

    /// A power of the speed, which is fitted, with the speed's sign.
    pub fn power_of_speed() -> Self {
        let shape = Shape { key: "n", start: 0.5, least: 0.05, most: 3.0, unit: String::new() };
        let text = "speed*(abs(speed)/1)^n";
        Self { shape: Some(shape), ..Self::plain(Covariate::Speed, text, "rad/s") }
    }

    /// A curve around the whole turn: the lowest orders of the angle together.
    pub fn around() -> Self {
        let texts = (1..=AROUND).flat_map(|order| Self::harmonic(order).texts).collect();
        Self { texts, ..Self::harmonic(1) }
    }

    /// Cosine and sine over a covariate that spans so much, of a frequency that is fitted: within half a period over the span, beyond which
    /// lies another wave.
    pub fn wave(of: Covariate, frequency: f64, span: f64) -> Self {
        let key = if of == Covariate::Angle { "order" } else { "w" };
        let texts = ["cos", "sin"].map(|function| format!("{function}({key}*{})", of.name())).to_vec();
        let beside = std::f64::consts::PI / span;
        let (least, most) = (frequency - beside, frequency + beside);
        let unit = format!("rad/{}", of.unit());
        let shape = Some(Shape { key, start: frequency, least, most, unit });
        Self { of, texts, unit: "", shape, listed: false, knots: Vec::new() }
    }

    /// A speed's part of one, saturating at a speed that is fitted.
    pub fn saturating(start: f64) -> Self {
        let (least, most) = (start / SATURATING_WITHIN, start * SATURATING_WITHIN);
        let shape = Shape { key: "v", start, least, most, unit: Covariate::Speed.unit().to_owned() };
        let text = "abs(speed)/(abs(speed) + v)";
        Self { shape: Some(shape), ..Self::plain(Covariate::Speed, text, "") }
    }

    /// A curve that is linear between its knots, and linear on outside them.
    pub fn curve(of: Covariate, knots: Vec<f64>) -> Self {
        let name = of.name();
        let straight = Some(name.to_owned());
        let inner = knots.iter().skip(1).take(knots.len().saturating_sub(2));
        let bend = |knot: &f64| {
            if *knot < 0.0 {
                format!("max(0, {name} + {})", -knot)
            } else {
                format!("max(0, {name} - {knot})")
            }
        };
        let texts = straight.into_iter().chain(inner.map(bend)).collect();
        Self { of, texts, unit: of.unit(), shape: None, listed: false, knots }
    }

    /// The same, known to the list.
    pub fn on_the_list(self) -> Self {
        Self { listed: true, ..self }
    }

    /// Whether it can follow nearly any course.
    pub fn is_curve(&self) -> bool {
        !self.knots.is_empty() || self.texts.len() == 2 * AROUND
    }
}
