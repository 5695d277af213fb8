//! A law that a user suspects, tried as the causes of the list are.

use valve_model::{Effect, EffectValue, Label};

/// Points at which a law is evaluated to find what its parameters do.
pub(crate) const PLACES: u32 = 60;
/// Starts of a parameter about which nothing is said: several orders of magnitude, and both signs.
const UNKNOWN: [f64; 6] = [1.0, 0.1, 10.0, -1.0, 0.0, 0.01];
/// Most shapes that the screening begins from.
const MOST_SHAPES: usize = 16;

/// The ranges of the covariates, in their order.
pub(crate) type Ranges = [(f64, f64); 8];

/// Ranges that are usual for valves.
const USUAL: Ranges = [
    (-3.0, 3.0),
    (-5.0, 5.0),
    (-50.0, 50.0),
    (0.0, 100.0),
    (0.0, 1e7),
    (20.0, 70.0),
    (0.0, 10.0),
    (0.0, 100.0),
];

/// A formula that a user suspects, with what is known of its parameters.
///
/// Its amplitudes (the law is zero when they are) are found numerically: a fit starts with them at zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspect {
    /// The formula; its parameters may have any values.
    pub effect: Effect,
    /// Its parameters, as they are in the formula's order.
    pub parameters: Vec<SuspectParameter>,
    /// Indices of those that are zero where it has no effect.
    amplitudes: Vec<usize>,
}

/// A parameter of a suspected law.
#[derive(Debug, Clone, PartialEq)]
pub struct SuspectParameter {
    /// Its name in the formula.
    pub key: Label,
    /// Where a fit begins, if the user says.
    pub start: Option<f64>,
    /// The least value.
    pub min: f64,
    /// The greatest value.
    pub max: f64,
    /// Its unit, for reports.
    pub unit: String,
}

impl SuspectParameter {
    /// One about which nothing is known.
    pub fn unknown(key: Label) -> Self {
        Self { key, start: None, min: -1e9, max: 1e9, unit: "1".to_owned() }
    }
}

impl Suspect {
    /// A law with its parameters.
    ///
    /// # Errors
    /// In words: why it can't be fitted.
    pub fn new(effect: Effect, parameters: Vec<SuspectParameter>) -> Result<Self, String> {
        let mut suspect = Self { effect, parameters, amplitudes: Vec::new() };
        let all: Vec<usize> = (0..suspect.parameters.len()).collect();
        if all.is_empty() || !suspect.is_nothing_without(&all) {
            return Err("found a law that acts whatever its parameters are, expected one that is zero where parameters are, such as a*speed".to_owned());
        }
        suspect.amplitudes = all.clone();
        for last in all.into_iter().rev() {
            let fewer: Vec<usize> = suspect.amplitudes.iter().copied().filter(|of| *of != last).collect();
            if !fewer.is_empty() && suspect.is_nothing_without(&fewer) {
                suspect.amplitudes = fewer;
            }
        }
        for (index, of) in suspect.parameters.iter().enumerate() {
            let amplitude = suspect.amplitudes.contains(&index);
            if of.min >= of.max || amplitude && !(of.min..=of.max).contains(&0.0) {
                let zero = if amplitude { " around 0, where the law has no effect" } else { "" };
                return Err(format!(
                    "found {} from {} to {}, expected a range{zero}",
                    of.key, of.min, of.max
                ));
            }
            if of.start.is_some_and(|start| !(of.min..=of.max).contains(&start)) {
                return Err(format!("found a start of {} outside its range", of.key));
            }
        }
        Ok(suspect)
    }

    pub(crate) fn unit(&self, key: &str) -> &str {
        self.parameters.iter().find(|of| of.key == key).map_or("1", |of| &of.unit)
    }

    /// Indices of the parameters that are zero where it has no effect.
    pub(crate) fn amplitudes(&self) -> &[usize] {
        &self.amplitudes
    }

    /// The starts of the fits, all without effect: one shape, and those in which one of its parameters has another value.
    pub(crate) fn shapes(&self) -> Vec<Vec<f64>> {
        let numbers = 0..self.parameters.len();
        let first: Vec<f64> = numbers.clone().map(|index| self.begin(index)).collect();
        let mut shapes = vec![first.clone()];
        for index in numbers.filter(|index| !self.amplitudes.contains(index)) {
            for value in self.values_of(index).into_iter().skip(1) {
                let mut shape = first.clone();
                shape.iter_mut().skip(index).take(1).for_each(|number| *number = value);
                shapes.push(shape);
            }
        }
        shapes.truncate(MOST_SHAPES);
        shapes
    }

    /// The start of a parameter.
    pub(crate) fn begin(&self, index: usize) -> f64 {
        if self.amplitudes.contains(&index) { 0.0 } else { self.shape(index, 0) }
    }

    /// The start of a parameter in a trial, by the trial's number.
    fn shape(&self, index: usize, trial: usize) -> f64 {
        let values = self.values_of(index);
        values.get(trial).or(values.first()).copied().unwrap_or(0.0)
    }

    /// The starts of a parameter: the first is the likeliest, the others are within its bounds.
    fn values_of(&self, index: usize) -> Vec<f64> {
        let Some(of) = self.parameters.get(index) else { return Vec::new() };
        let wanted = match of.start {
            Some(start) if start != 0.0 => vec![start, 0.5 * start, 2.0 * start],
            Some(start) => vec![start],
            None => UNKNOWN.to_vec(),
        };
        let first = wanted.first().map(|first| first.clamp(of.min, of.max));
        let others = wanted.into_iter().skip(1).filter(|value| (of.min..=of.max).contains(value));
        first.into_iter().chain(others).collect()
    }

    /// Whether it has no effect where these parameters are zero.
    fn is_nothing_without(&self, gone: &[usize]) -> bool {
        let shapes = 0..UNKNOWN.len();
        shapes.into_iter().all(|trial| {
            let numbers: Vec<f64> = (0..self.parameters.len())
                .map(|index| if gone.contains(&index) { 0.0 } else { self.shape(index, trial) })
                .collect();
            self.values(&numbers, &USUAL).iter().all(|value| *value == 0.0)
        })
    }

    /// Its finite values at points spread over these ranges.
    pub(crate) fn values(&self, numbers: &[f64], ranges: &Ranges) -> Vec<f64> {
        let keys = self.parameters.iter().map(|of| of.key.as_str());
        let parts: Vec<_> =
            keys.zip(numbers).map(|(key, number)| (key, EffectValue::Number(*number))).collect();
        let Ok(effect) = self.effect.with_parts(&parts) else { return Vec::new() };
        let place = |index: u32| {
            let mut primes = [2, 3, 5, 7, 11, 13, 17, 19].into_iter();
            ranges.map(|(low, high)| low + (high - low) * spread(index + 1, primes.next().unwrap_or(2)))
        };
        let values = (0..PLACES).filter_map(|index| effect.custom_value(&place(index)));
        values.filter(|value| value.is_finite()).collect()
    }
}

/// The `index`th number of a sequence that fills 0 to 1 evenly (van der Corput's to a base).
fn spread(mut index: u32, base: u32) -> f64 {
    let (mut sum, mut part) = (0.0, 1.0);
    while index > 0 {
        part /= f64::from(base);
        sum += part * f64::from(index % base);
        index /= base;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use valve_model::{ActsOn, CustomLaw, Rule, parameter_names};

    fn suspect(text: &str) -> Result<Suspect, String> {
        let names = parameter_names(text).unwrap();
        let law = CustomLaw { acts_on: ActsOn::Torque, rule: Rule::Formula(text.to_owned()) };
        let numbers: Vec<(&str, f64)> = names.iter().map(|name| (name.as_str(), 1.0)).collect();
        let effect = Effect::custom_named("own", law, &numbers).unwrap();
        let parameters = names.iter().map(|name| SuspectParameter::unknown(Label::new(name).unwrap()));
        Suspect::new(effect, parameters.collect())
    }

    #[test]
    fn amplitudes_are_what_takes_a_law_to_zero() {
        for (text, amplitudes) in [
            ("a*speed*abs(speed)", &[0][..]),
            ("a*sin(w*time + b)", &[0]),
            ("a*sin(3*time) + b*cos(3*time)", &[0, 1]),
            ("tanh(speed/b)*a", &[1]),
            ("exp(-b*(oil_temperature - 40)) - 1", &[0]),
            ("a*(speed + b)", &[0]),
        ] {
            assert_eq!(suspect(text).unwrap().amplitudes, amplitudes, "{text}");
        }
        for text in ["1 + a*speed", "0.1*speed", "speed^n"] {
            assert!(suspect(text).is_err(), "{text}");
        }
    }

    #[test]
    fn bounds_hold_the_start_and_no_effect() {
        let with = |min: f64, max: f64, start: Option<f64>| {
            let mut own = suspect("a*speed").unwrap();
            own.parameters[0] = SuspectParameter { min, max, start, ..own.parameters[0].clone() };
            Suspect::new(own.effect, own.parameters)
        };
        assert!(with(-1.0, 1.0, Some(0.5)).is_ok());
        for (min, max, start) in [(0.5, 1.0, None), (1.0, -1.0, None), (-1.0, 1.0, Some(2.0))] {
            assert!(with(min, max, start).is_err(), "{min} {max} {start:?}");
        }
    }
}
