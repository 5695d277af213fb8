//! One `--map`: a channel and the expression that it is made of.

use anyhow::anyhow;
use exmex::prelude::*;
use log_data::Channel;
use std::f64::consts::PI;
use std::fmt;
use std::str::FromStr;

/// A channel, or a further signal with its unit, and its expression.
#[derive(Debug, Clone)]
pub struct Map {
    target: String,
    unit: String,
    text: String,
    expression: FlatEx<f64>,
}

/// Where an expression's variable comes from.
#[derive(Debug, Clone, Copy)]
enum Operand {
    /// A column, by its place among those wanted.
    Column(usize),
    /// The row, counted from 0.
    Row,
    Pi,
}

/// An expression whose variables are found in a table.
pub struct Bound<'a> {
    map: &'a Map,
    operands: Vec<Operand>,
    values: Vec<f64>,
}

impl FromStr for Map {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (target, text) =
            text.split_once('=').ok_or_else(|| format!("{text:?}, expected CHANNEL=EXPRESSION"))?;
        let (target, unit) = target_and_unit(target.trim())?;
        let expression = FlatEx::<f64>::parse(&as_exmex_reads(text))
            .map_err(|error| format!("{text:?} is no expression: {}", error.msg()))?;
        Ok(Self { target, unit, text: text.to_owned(), expression })
    }
}

/// The expression as exmex understands it: 1.5e5 written out as 150000, since it knows no exponents; and -x^2 as (-1)*x^2,
/// since to exmex a sign comes before a power.
fn as_exmex_reads(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(next) = rest.chars().next() {
        let word = next.is_alphanumeric() || next == '_' || next == '.';
        let length = match next {
            // A name in braces may look like a number.
            '{' => rest.find('}').map_or(rest.len(), |end| end + 1),
            _ if word => word_length(rest),
            _ => next.len_utf8(),
        };
        let (token, after) = rest.split_at(length);
        let before = plain.trim_end().chars().next_back();
        match token.parse::<f64>() {
            _ if token == "-" && before.is_none_or(|before| "(,+-*".contains(before)) => {
                plain.push_str("(-1)*")
            }
            Ok(number) if number.is_finite() && (next.is_ascii_digit() || next == '.') => {
                plain.push_str(&number.to_string());
            }
            _ => plain.push_str(token),
        }
        rest = after;
    }
    plain
}

/// The length of the name or number that a text begins with; the sign of an exponent belongs to a number.
fn word_length(text: &str) -> usize {
    let number = text.starts_with(|c: char| c.is_ascii_digit() || c == '.');
    let mut last = ' ';
    let end = text.char_indices().find(|(_, c)| {
        let sign = number && matches!(c, '+' | '-') && matches!(last, 'e' | 'E');
        last = *c;
        !(c.is_alphanumeric() || matches!(c, '_' | '.') || sign)
    });
    end.map_or(text.len(), |(index, _)| index)
}

/// `torque`, or `motor_current[A]`.
fn target_and_unit(text: &str) -> Result<(String, String), String> {
    if let Some(channel) = Channel::from_name(text) {
        return Ok((text.to_owned(), channel.unit().to_owned()));
    }
    let known = || Channel::ALL.iter().map(|channel| channel.name()).collect::<Vec<_>>().join(", ");
    let further = text.strip_suffix(']').and_then(|text| text.split_once('['));
    match further {
        Some((name, _)) if Channel::from_name(name).is_some() => {
            Err(format!("{name} has its unit already, expected no brackets"))
        }
        Some((name, unit)) if !name.is_empty() && !unit.is_empty() => Ok((name.to_owned(), unit.to_owned())),
        _ => Err(format!("channel {text:?}, expected one of {}, or NAME[UNIT] for another signal", known())),
    }
}

impl fmt::Display for Map {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.target, self.text)
    }
}

impl Map {
    /// The channel's or signal's name.
    pub fn target(&self) -> &str {
        &self.target
    }

    /// Its unit.
    pub fn unit(&self) -> &str {
        &self.unit
    }

    /// Finds the variables among a table's columns; those needed are added to `wanted`.
    ///
    /// # Errors
    /// A variable that is no column.
    pub fn bind(&self, names: &[String], wanted: &mut Vec<usize>) -> anyhow::Result<Bound<'_>> {
        let find = |variable: &String| -> anyhow::Result<Operand> {
            if let Some(column) = column(variable, names) {
                let known = wanted.iter().position(|other| *other == column);
                return Ok(Operand::Column(known.unwrap_or_else(|| {
                    wanted.push(column);
                    wanted.len() - 1
                })));
            }
            match variable.as_str() {
                "row" => Ok(Operand::Row),
                "pi" => Ok(Operand::Pi),
                _ => {
                    let columns = if names.len() > 40 { "more than 40".to_owned() } else { names.join(", ") };
                    Err(anyhow!(
                        "{self}: no column {variable:?}; there are {} columns: {columns}",
                        names.len()
                    ))
                }
            }
        };
        let operands = self.expression.var_names().iter().map(find).collect::<anyhow::Result<Vec<_>>>()?;
        Ok(Bound { map: self, values: vec![0.0; operands.len()], operands })
    }
}

/// A column by its name, else by its number: c1 is the first.
fn column(variable: &str, names: &[String]) -> Option<usize> {
    names.iter().position(|name| name == variable).or_else(|| {
        let number: usize = variable.strip_prefix('c')?.parse().ok()?;
        (number >= 1 && number <= names.len()).then(|| number - 1)
    })
}

impl Bound<'_> {
    /// The map.
    pub fn map(&self) -> &Map {
        self.map
    }

    /// The value in a row, from the wanted columns' values.
    ///
    /// # Errors
    /// What the expression's own evaluation refuses.
    pub fn at(&mut self, row: usize, columns: &[f64]) -> anyhow::Result<f64> {
        for (value, operand) in self.values.iter_mut().zip(&self.operands) {
            *value = match operand {
                Operand::Column(index) => columns.get(*index).copied().unwrap_or(f64::NAN),
                Operand::Row => row as f64,
                Operand::Pi => PI,
            };
        }
        self.map.expression.eval(&self.values).map_err(|error| anyhow!("{}: {}", self.map, error.msg()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(map: &str, names: &[&str], row: &[f64]) -> f64 {
        let map: Map = map.parse().unwrap();
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let mut wanted = Vec::new();
        let mut bound = map.bind(&names, &mut wanted).unwrap();
        let columns: Vec<f64> = wanted.iter().map(|column| row[*column]).collect();
        bound.at(7, &columns).unwrap()
    }

    #[test]
    fn columns_by_name_and_number_constants_and_functions() {
        assert_eq!(value("time=t*1e-3", &["t", "qm"], &[500.0, 2.0]), 0.5);
        assert_eq!(value("angle=c2/12.5", &["t", "qm"], &[500.0, 25.0]), 2.0);
        assert_eq!(value("angle = {Lage mm}*2*pi/2.5", &["Lage mm"], &[2.5]), 2.0 * PI);
        assert_eq!(value("time=row*0.01", &["x"], &[0.0]), 0.07);
        assert_eq!(value("torque=-(a-b)^2+abs(b)", &["b", "a"], &[-1.0, 2.0]), -8.0);
        assert_eq!(value("torque=2^-b/-a^1", &["b", "a"], &[-1.0, 2.0]), -1.0);
        assert_eq!(value("speed[rad/s]=1.5E2", &["b"], &[-1.0]), 150.0);
        assert_eq!(value("pressure_drop=c1*1e5-.5e+1", &["p"], &[2.0]), 199_995.0);
        assert_eq!(value("angle={1e3}+e2-1", &["1e3", "e2"], &[2.0, 4.0]), 5.0);
    }

    #[test]
    fn refused() {
        for (wrong, says) in [
            ("torque", "CHANNEL=EXPRESSION"),
            ("tork=c1", "pressure_drop"),
            ("torque[N*m]=c1", "brackets"),
            ("torque=c1*(", "no expression"),
        ] {
            let error = wrong.parse::<Map>().unwrap_err();
            assert!(error.contains(says), "{error}");
        }
        let map: Map = "torque=F*0.1".parse().unwrap();
        let error =
            map.bind(&["t".to_owned(), "force".to_owned()], &mut Vec::new()).err().unwrap().to_string();
        assert!(error.contains("\"F\"") && error.contains("t, force"), "{error}");
    }
}
