//! A law as a sum of amplitudes times products of elementary functions.

use crate::suspect::{Suspect, SuspectParameter};
use crate::unnamed::factor::Factor;
use valve_model::{ActsOn, Covariate, CustomLaw, Effect, Label, Rule};

/// Names of amplitudes, as many as a law has at most.
const AMPLITUDES: [&str; 12] = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l"];

/// A law that acts on something, as a product of factors.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Term {
    pub acts_on: ActsOn,
    pub factors: Vec<Factor>,
}

impl Term {
    /// Amplitudes that it has.
    pub fn amplitudes(&self) -> usize {
        self.factors.iter().map(|factor| factor.texts.len()).product()
    }

    /// Columns that its screening takes, about: one of each amplitude, from each shape that a fit may begin with.
    pub fn columns(&self) -> usize {
        const STARTS: usize = 3;
        (0..self.shapes()).fold(self.amplitudes(), |columns, _| columns * STARTS)
    }

    fn shapes(&self) -> usize {
        self.factors.iter().filter(|factor| factor.shape.is_some()).count()
    }

    /// What it costs to say: its factors, then its numbers. A torque of its own is less than a change of friction.
    pub fn complexity(&self) -> (usize, usize, bool) {
        let curves = self.factors.iter().filter(|factor| factor.is_curve()).count();
        (self.factors.len() + 2 * curves, self.amplitudes() + self.shapes(), self.acts_on != ActsOn::Torque)
    }

    /// Whether it may be multiplied by a function of this: once by each quantity, and by one of those that only grow.
    pub fn takes(&self, of: Covariate) -> bool {
        let grows =
            |of: Covariate| matches!(of, Covariate::Time | Covariate::TimeAtRest | Covariate::Distance);
        !self.covariates().any(|own| own == of || grows(own) && grows(of))
    }

    /// What it depends on.
    pub fn covariates(&self) -> impl Iterator<Item = Covariate> {
        self.factors.iter().map(|factor| factor.of)
    }

    /// Whether it depends on the same quantities, and acts on the same.
    pub fn has_quantities_of(&self, other: &Self) -> bool {
        let within =
            |one: &Self, two: &Self| one.covariates().all(|of| two.covariates().any(|other| other == of));
        self.acts_on == other.acts_on && within(self, other) && within(other, self)
    }

    /// Whether it is a curve over what the other is a formula of, so that it can follow that wherever it goes.
    pub fn bends_to(&self, other: &Self) -> bool {
        self.has_quantities_of(other) && self.factors.iter().any(Factor::is_curve)
    }

    /// Whether it is the same product, in whichever order.
    pub fn is_same(&self, other: &Self) -> bool {
        self.acts_on == other.acts_on
            && self.factors.len() == other.factors.len()
            && self.factors.iter().all(|factor| other.factors.contains(factor))
    }

    /// The same with another factor.
    pub fn times(&self, factor: &Factor) -> Self {
        let factors = self.factors.iter().chain([factor]).cloned().collect();
        Self { factors, ..*self }
    }

    /// Whether a cause of the list is the same function: it was tried already. A pressure times an order of the angle is `flow-torque`.
    pub fn is_listed(&self) -> bool {
        match self.factors.as_slice() {
            [one] => one.listed,
            [one, two] => {
                self.acts_on == ActsOn::Torque
                    && one.listed
                    && two.listed
                    && [one.of, two.of].contains(&Covariate::PressureDrop)
                    && [one.of, two.of].contains(&Covariate::Angle)
            }
            _ => false,
        }
    }

    /// The expression, and its amplitudes' names.
    fn expression(&self) -> (String, Vec<&'static str>) {
        // What all parts share stands once: a formula has room for so many operations.
        let (shared, several): (Vec<&Factor>, Vec<&Factor>) =
            self.factors.iter().partition(|factor| factor.texts.len() == 1);
        let shared: String =
            shared.iter().flat_map(|factor| &factor.texts).map(|text| format!("*{text}")).collect();
        let mut products = vec![String::new()];
        for factor in several {
            let with = |product: &String| {
                let product = product.clone();
                factor.texts.iter().map(move |text| format!("{product}*{text}"))
            };
            products = products.iter().flat_map(with).collect();
        }
        let names: Vec<&str> = AMPLITUDES.into_iter().take(products.len()).collect();
        let parts: Vec<String> =
            names.iter().zip(&products).map(|(name, product)| format!("{name}{product}")).collect();
        let sum = parts.join(" + ");
        let text = match parts.len() {
            1 => format!("{sum}{shared}"),
            _ if shared.is_empty() => sum,
            _ => format!("({sum}){shared}"),
        };
        (text, names)
    }

    /// The law by this name, to be fitted; `None` for one that is too long to be run in a cycle.
    pub fn suspect(&self, name: &str) -> Option<Suspect> {
        if self.amplitudes() > AMPLITUDES.len() {
            return None;
        }
        let (text, names) = self.expression();
        let unit = self.unit();
        let amplitude = |name: &&str| {
            Label::new(name)
                .map(|key| SuspectParameter { unit: unit.clone(), ..SuspectParameter::unknown(key) })
        };
        let mut parameters: Vec<SuspectParameter> = names.iter().filter_map(amplitude).collect();
        for shape in self.factors.iter().filter_map(|factor| factor.shape.as_ref()) {
            let known = SuspectParameter::unknown(Label::new(shape.key)?);
            let (min, max) = (shape.least, shape.most);
            let unit = shape.unit.clone();
            parameters.push(SuspectParameter { start: Some(shape.start), min, max, unit, ..known });
        }
        let law = CustomLaw { acts_on: self.acts_on, rule: Rule::Formula(text) };
        let numbers: Vec<(String, f64)> =
            parameters.iter().map(|of| (of.key.as_str().to_owned(), of.start.unwrap_or(1.0))).collect();
        let numbers: Vec<(&str, f64)> = numbers.iter().map(|(key, number)| (key.as_str(), *number)).collect();
        Suspect::new(Effect::custom_named(name, law, &numbers).ok()?, parameters).ok()
    }

    /// The unit of its amplitudes.
    fn unit(&self) -> String {
        let of = if self.acts_on == ActsOn::Torque { "N*m" } else { "1" };
        let by = self.factors.iter().map(|factor| factor.unit).filter(|unit| !unit.is_empty());
        let per = |unit: &str| {
            if unit.contains('/') && !unit.starts_with('(') {
                format!("/({unit})")
            } else {
                format!("/{unit}")
            }
        };
        std::iter::once(of.to_owned()).chain(by.map(per)).collect()
    }

    /// A name for it, unlike those taken.
    pub fn name(&self, is_taken: impl Fn(&str) -> bool) -> String {
        let short = |of: Covariate| match of {
            Covariate::Angle => "angle",
            Covariate::Speed => "speed",
            Covariate::Acceleration => "accel",
            Covariate::Time => "time",
            Covariate::PressureDrop => "pressure",
            Covariate::OilTemperature => "temp",
            Covariate::TimeAtRest => "rest",
            Covariate::Distance => "distance",
        };
        let parts: Vec<&str> = self.covariates().map(short).collect();
        let name = format!("by-{}", parts.join("-"));
        let numbered = (2..).map(|number| format!("{name}-{number}"));
        std::iter::once(name.clone()).chain(numbered).find(|name| !is_taken(name)).unwrap_or(name)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn term(acts_on: ActsOn, factors: &[Factor]) -> Term {
        Term { acts_on, factors: factors.to_vec() }
    }

    fn speed() -> Factor {
        Factor::plain(Covariate::Speed, "speed", "rad/s").on_the_list()
    }

    fn pressure() -> Factor {
        Factor::plain(Covariate::PressureDrop, "(pressure_drop/1e6)", "MPa").on_the_list()
    }

    #[test]
    fn products_have_an_amplitude_for_each_part_with_its_unit() {
        let of = term(ActsOn::Torque, &[pressure(), Factor::harmonic(2)]);
        let (text, names) = of.expression();
        assert_eq!(text, "(a*cos(2*angle) + b*sin(2*angle))*(pressure_drop/1e6)");
        assert_eq!((names.len(), of.amplitudes()), (2, 2));
        assert_eq!(of.unit(), "N*m/MPa");
        assert_eq!(term(ActsOn::Level, &[pressure(), speed()]).unit(), "1/MPa/(rad/s)");
        let squared = Factor::plain(Covariate::Speed, "speed*abs(speed)", "(rad/s)^2");
        assert_eq!(term(ActsOn::Torque, &[squared]).unit(), "N*m/(rad/s)^2");
        let suspect = of.suspect("by-pressure-angle").unwrap();
        assert_eq!(suspect.amplitudes(), &[0, 1]);
    }

    #[test]
    fn shapes_are_fitted_and_no_amplitudes() {
        for (factor, key) in
            [(Factor::saturating(0.5), "v"), (Factor::wave(Covariate::Time, 90.0, 30.0), "w")]
        {
            let suspect = term(ActsOn::Level, &[factor]).suspect("own").unwrap();
            let last = suspect.parameters.len() - 1;
            assert_eq!(suspect.parameters[last].key, key);
            assert!(!suspect.amplitudes().contains(&last), "{key}");
        }
    }

    #[test]
    fn what_a_cause_of_the_list_is_is_no_law() {
        for (acts_on, factors, listed) in [
            (ActsOn::Torque, vec![speed()], true),
            (ActsOn::Torque, vec![Factor::harmonic(1)], true),
            (ActsOn::Torque, vec![pressure(), Factor::harmonic(1)], true),
            (ActsOn::Level, vec![pressure(), Factor::harmonic(1)], false),
            (ActsOn::Torque, vec![pressure(), speed()], false),
            (ActsOn::Level, vec![Factor::saturating(0.5)], false),
            (ActsOn::Torque, vec![Factor::wave(Covariate::Angle, 2.4, 30.0)], false),
        ] {
            assert_eq!(term(acts_on, &factors).is_listed(), listed, "{factors:?}");
        }
    }

    #[test]
    fn one_quantity_is_taken_once_and_one_that_grows() {
        let time = Factor::plain(Covariate::Time, "time", "s");
        let of = term(ActsOn::Level, &[time]);
        assert!(of.takes(Covariate::Angle) && !of.takes(Covariate::Time) && !of.takes(Covariate::Distance));
    }

    #[test]
    fn names_are_unlike_those_taken() {
        let of = term(ActsOn::Torque, &[pressure(), speed()]);
        assert_eq!(of.name(|_| false), "by-pressure-speed");
        assert_eq!(of.name(|name| name == "by-pressure-speed"), "by-pressure-speed-2");
        let longest = [Covariate::Distance, Covariate::PressureDrop, Covariate::Angle];
        let longest: Vec<Factor> = longest.map(|of| Factor::plain(of, of.name(), "")).to_vec();
        assert!(Label::new(&term(ActsOn::Torque, &longest).name(|_| false)).is_some());
    }
}
