//! What a user suspects: a law of his own, tried as the causes of the list are.

use crate::log::facts::Facts;
use valve_model::{ActsOn, Condition, Covariate, Effect, EffectValue, Label};

/// Places at which a law is asked what its parameters do.
const PLACES: u32 = 60;
/// Where a fit begins in a parameter of which nothing is said: its orders of magnitude, and both signs.
pub(crate) const UNKNOWN: [f64; 6] = [1.0, 0.1, 10.0, -1.0, 0.0, 0.01];
/// The first step of a fit: what it changes in parts of T_c, of the levels, and of σ2.
const STEP: f64 = 0.02;

/// A formula that a user suspects, with what is known of its parameters.
///
/// Those that take it to zero when they are zero are found by trying: a fit begins without effect, and goes along them.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspect {
    /// The formula, its parameters at any values.
    pub effect: Effect,
    /// Its parameters, as they are in the formula's order.
    pub parameters: Vec<SuspectParameter>,
    /// Those that are zero where it has no effect.
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
    /// Its unit, for who reads what is found.
    pub unit: String,
}

impl SuspectParameter {
    /// One of which nothing is known.
    pub fn unknown(key: Label) -> Self {
        Self { key, start: None, min: -1e9, max: 1e9, unit: "1".to_owned() }
    }
}

impl Suspect {
    /// A law with its parameters.
    ///
    /// # Errors
    /// In words: what of it can't be fitted.
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

    /// Those of its parameters that are zero where it has no effect.
    pub(crate) fn amplitudes(&self) -> &[usize] {
        &self.amplitudes
    }

    /// Why data can't show it.
    pub(crate) fn why_not(&self, facts: &Facts) -> Option<String> {
        let friction = self.effect.custom().is_some_and(|law| law.acts_on != ActsOn::Torque);
        if self.effect.needs(Condition::PressureDrop) && facts.pressure_mpa.is_none() {
            return Some("no pressure_drop channel".to_owned());
        }
        if self.effect.needs(Condition::OilTemperature) && facts.temperature_c.is_none() {
            return Some("no oil_temperature channel".to_owned());
        }
        let driven = !facts.kind.motion_is_measured && friction;
        let reason = "friction by acceleration is predicted from a measured motion alone";
        (driven && self.effect.depends_on(Covariate::Acceleration)).then(|| reason.to_owned())
    }

    /// Where a parameter begins in a trial: without effect, or with one of its shapes.
    pub(crate) fn begin(&self, index: usize, trial: usize) -> f64 {
        if self.amplitudes.contains(&index) { 0.0 } else { self.shape(index, trial) }
    }

    /// A value that a parameter may have, by the number of the trial.
    fn shape(&self, index: usize, trial: usize) -> f64 {
        let Some(of) = self.parameters.get(index) else { return 0.0 };
        let around = [1.0, 0.5, 2.0].get(trial).copied().unwrap_or(1.0);
        let wanted = match of.start {
            Some(start) if start != 0.0 => start * around,
            Some(start) => start,
            None => UNKNOWN.get(trial).copied().unwrap_or(1.0),
        };
        wanted.clamp(of.min, of.max)
    }

    /// A change of an amplitude that shows: by how much the law changes within what the data have.
    pub(crate) fn step(&self, index: usize, facts: &Facts) -> f64 {
        let Some(of) = self.parameters.get(index) else { return 0.0 };
        let unit = match of.start {
            Some(start) if start != 0.0 => start.abs(),
            _ => 1.0_f64.min(of.max.max(-of.min)),
        };
        let mut numbers: Vec<f64> = (0..self.parameters.len()).map(|index| self.begin(index, 0)).collect();
        numbers.iter_mut().skip(index).take(1).for_each(|number| *number = unit);
        let square: f64 = self.values(&numbers, Some(facts)).iter().map(|value| value * value).sum();
        let size = (square / f64::from(PLACES)).sqrt();
        let torque = self.effect.custom().is_some_and(|law| law.acts_on == ActsOn::Torque);
        let wanted = STEP * if torque { facts.coulomb_nm } else { 1.0 };
        if size > 0.0 && size.is_finite() { unit * wanted / size } else { 0.01 * unit }
    }

    /// Whether it has no effect where these parameters are zero.
    fn is_nothing_without(&self, gone: &[usize]) -> bool {
        let shapes = 0..UNKNOWN.len();
        shapes.into_iter().all(|trial| {
            let numbers: Vec<f64> = (0..self.parameters.len())
                .map(|index| if gone.contains(&index) { 0.0 } else { self.shape(index, trial) })
                .collect();
            self.values(&numbers, None).iter().all(|value| *value == 0.0)
        })
    }

    /// Its finite values at places spread over what valves have, or over what the data have.
    fn values(&self, numbers: &[f64], facts: Option<&Facts>) -> Vec<f64> {
        let keys = self.parameters.iter().map(|of| of.key.as_str());
        let parts: Vec<_> =
            keys.zip(numbers).map(|(key, number)| (key, EffectValue::Number(*number))).collect();
        let Ok(effect) = self.effect.with_parts(&parts) else { return Vec::new() };
        let ranges = ranges(facts);
        let place = |index: u32| {
            let mut primes = [2, 3, 5, 7, 11, 13, 17, 19].into_iter();
            ranges.map(|(low, high)| low + (high - low) * spread(index + 1, primes.next().unwrap_or(2)))
        };
        let values = (0..PLACES).filter_map(|index| effect.custom_value(&place(index)));
        values.filter(|value| value.is_finite()).collect()
    }
}

/// What the covariates span, in their order.
fn ranges(facts: Option<&Facts>) -> [(f64, f64); 8] {
    let fastest = facts.map_or(0.0, |facts| facts.fastest_rad_per_s).max(0.1);
    let angle = facts.map(|facts| facts.angle_rad).filter(|range| range.0 < range.1).unwrap_or((-3.0, 3.0));
    let pressure_pa =
        facts.and_then(|facts| facts.pressure_mpa).map_or((0.0, 1e7), |mpa| (1e6 * mpa.0, 1e6 * mpa.1));
    let temperature_c = facts.and_then(|facts| facts.temperature_c).unwrap_or((20.0, 70.0));
    let rest_s = facts.map_or(10.0, |facts| facts.longest_rest_s.max(0.1));
    let travel_rad = facts.map_or(100.0, |facts| facts.travel_rad.max(0.1));
    let speed = (-fastest, fastest);
    let acceleration = (-10.0 * fastest, 10.0 * fastest);
    [angle, speed, acceleration, (0.0, 100.0), pressure_pa, temperature_c, (0.0, rest_s), (0.0, travel_rad)]
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
    use valve_model::{CustomLaw, Rule, parameter_names};

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
