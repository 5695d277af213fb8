//! Expressions over the columns of a table, and the maps and conditions made of them.

use crate::functions::Function;
use crate::operators::Flat;
use anyhow::{anyhow, ensure};
use exmex::prelude::*;
use log_data::Channel;
use std::f64::consts::PI;
use std::fmt;
use std::str::FromStr;

/// The variable that stands for a call begins so; no column's name does.
const CALL: char = '\u{1}';
/// Calls within calls, at most.
const MOST_DEEP: usize = 10;

/// An expression, its calls of functions of whole columns taken out of it.
#[derive(Debug, Clone)]
struct Expression {
    flat: Box<Flat>,
    calls: Vec<Call>,
}

/// A function of a whole column.
#[derive(Debug, Clone)]
struct Call {
    function: Function,
    name: String,
    argument: Expression,
    numbers: Vec<f64>,
}

/// A channel, or a further signal with its unit, and its expression.
#[derive(Debug, Clone)]
pub struct Map {
    target: String,
    unit: String,
    text: String,
    expression: Expression,
}

/// What a row must fulfil: an expression that isn't 0 there.
#[derive(Debug, Clone)]
pub struct Condition {
    text: String,
    expression: Expression,
}

/// Where an expression's variable comes from.
#[derive(Debug, Clone, Copy)]
enum Operand {
    /// A column, by its place among those wanted.
    Column(usize),
    /// The row, counted from 0.
    Row,
    Pi,
    /// A call, by its place in the expression.
    Call(usize),
}

/// An expression whose variables are found in a table.
pub(crate) struct Bound<'a> {
    flat: &'a Flat,
    operands: Vec<Operand>,
    calls: Vec<(&'a Call, Bound<'a>)>,
}

/// The rows that expressions are evaluated on.
pub(crate) struct Cells<'a> {
    /// The wanted columns.
    pub(crate) columns: &'a [Vec<f64>],
    /// The rows' numbers in the file, from 0.
    pub(crate) rows: &'a [usize],
    /// Their times, once they are known, s.
    pub(crate) time_s: Option<&'a [f64]>,
}

impl FromStr for Map {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        // The first = that is no part of a comparison.
        let (target, text) =
            text.split_once('=').ok_or_else(|| format!("{text:?}, expected CHANNEL=EXPRESSION"))?;
        Self::new(target, text)
    }
}

impl FromStr for Condition {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(Self { text: text.trim().to_owned(), expression: Expression::parse(text, 0)? })
    }
}

impl Map {
    /// A channel's name, or another's with its unit in brackets, and its expression.
    ///
    /// # Errors
    /// No channel, no unit, no expression: in words.
    pub fn new(target: &str, text: &str) -> Result<Self, String> {
        let (target, unit) = target_and_unit(target.trim())?;
        Ok(Self { target, unit, text: text.trim().to_owned(), expression: Expression::parse(text, 0)? })
    }

    /// The channel's or signal's name.
    pub fn target(&self) -> &str {
        &self.target
    }

    /// Its unit.
    pub fn unit(&self) -> &str {
        &self.unit
    }

    /// The name with what else stands before the equals sign.
    pub fn left_side(&self) -> String {
        if Channel::from_name(&self.target).is_some() {
            self.target.clone()
        } else {
            format!("{}[{}]", self.target, self.unit)
        }
    }

    /// The expression as it was given.
    pub fn right_side(&self) -> &str {
        &self.text
    }

    /// The column that is taken as it is, or turned in sign; `None` where anything else is done with it.
    pub(crate) fn column_as_it_is(&self, names: &[String]) -> Option<usize> {
        let text = self.text.trim_start_matches('-').trim();
        let inside = text.strip_prefix('{').and_then(|text| text.strip_suffix('}'));
        (inside.is_some() || next_token(text) == Some(text)).then(|| column(inside.unwrap_or(text), names))?
    }

    pub(crate) fn bind(&self, names: &[String], wanted: &mut Vec<usize>) -> anyhow::Result<Bound<'_>> {
        self.expression.bind(names, wanted).map_err(|error| anyhow!("{self}: {error}"))
    }
}

impl Condition {
    /// The expression as it was given.
    pub fn text(&self) -> &str {
        &self.text
    }

    pub(crate) fn bind(&self, names: &[String], wanted: &mut Vec<usize>) -> anyhow::Result<Bound<'_>> {
        self.expression.bind(names, wanted).map_err(|error| anyhow!("{self}: {error}"))
    }
}

impl fmt::Display for Map {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.target, self.text)
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
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

impl Expression {
    fn parse(text: &str, deep: usize) -> Result<Self, String> {
        // Letters beyond ASCII and blanks are read as the end of a name.
        let braces = if text.contains('{') || !text.trim().contains(|c: char| c == ' ' || !c.is_ascii()) {
            ""
        } else {
            "; a name with blanks, brackets or letters beyond a to z stands in braces, as {Time (ms)}"
        };
        let refused = |why: &str| format!("{:?} is no expression: {why}{braces}", text.trim());
        if deep > MOST_DEEP {
            return Err(refused("too many functions within functions"));
        }
        let mut plain = String::with_capacity(text.len());
        let mut calls = Vec::new();
        let mut rest = text;
        while let Some(token) = next_token(rest) {
            let after = rest.get(token.len()..).unwrap_or_default();
            rest = after;
            match Function::named(token).filter(|_| after.trim_start().starts_with('(')) {
                Some(function) => {
                    let (inside, behind) = in_brackets(after).ok_or_else(|| refused("a bracket is open"))?;
                    plain.push_str(&format!("{{{CALL}{}}}", calls.len()));
                    calls.push(Call::parse(function, token, inside, deep).map_err(|why| refused(&why))?);
                    rest = behind;
                }
                None => push_as_exmex_reads(token, &mut plain),
            }
        }
        Ok(Self { flat: flat(&plain).map_err(|why| refused(&why))?, calls })
    }

    fn bind(&self, names: &[String], wanted: &mut Vec<usize>) -> anyhow::Result<Bound<'_>> {
        let mut find = |variable: &String| -> anyhow::Result<Operand> {
            if let Some(call) = variable.strip_prefix(CALL).and_then(|call| call.parse().ok()) {
                return Ok(Operand::Call(call));
            }
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
                    // What is no UTF-8 was read as this mark.
                    let coded = if columns.contains('\u{fffd}') {
                        "; the file is not UTF-8: save it as UTF-8, or call columns c1, c2, ..."
                    } else {
                        ""
                    };
                    let meant = meant(variable, names)
                        .map_or(String::new(), |name| format!(", is {{{name}}} meant?"));
                    Err(anyhow!(
                        "no column {variable:?}{meant}; there are {} columns: {columns}{coded}",
                        names.len()
                    ))
                }
            }
        };
        let operands = self.flat.var_names().iter().map(&mut find).collect::<anyhow::Result<Vec<_>>>()?;
        let calls = self.calls.iter().map(|call| Ok((call, call.argument.bind(names, wanted)?)));
        Ok(Bound { flat: &self.flat, operands, calls: calls.collect::<anyhow::Result<Vec<_>>>()? })
    }
}

impl Call {
    fn parse(function: Function, name: &str, inside: &str, deep: usize) -> Result<Self, String> {
        let mut arguments = arguments(inside).into_iter();
        let argument = Expression::parse(arguments.next().unwrap_or_default(), deep + 1)?;
        let number = |text: &str| match Expression::parse(text, deep + 1)?.constant() {
            Some(number) => Ok(number),
            None => Err(format!("{name}: {:?}, expected a number", text.trim())),
        };
        let numbers = arguments.map(number).collect::<Result<Vec<f64>, String>>()?;
        function.check(&numbers)?;
        Ok(Self { function, name: name.to_owned(), argument, numbers })
    }
}

impl Expression {
    /// The value of an expression in which nothing but `pi` varies.
    fn constant(&self) -> Option<f64> {
        let names = self.flat.var_names();
        let known = self.calls.is_empty() && names.iter().all(|name| name == "pi");
        known.then(|| self.flat.eval(&vec![PI; names.len()]).ok()).flatten()
    }
}

/// Apart, so that its large frame isn't on the stack for every call within a call.
#[inline(never)]
fn flat(text: &str) -> Result<Box<Flat>, String> {
    Flat::parse(text).map(Box::new).map_err(|error| error.msg().to_owned())
}

/// A column by its name, else by its number: c1 is the first.
fn column(variable: &str, names: &[String]) -> Option<usize> {
    names.iter().position(|name| name == variable).or_else(|| {
        let number: usize = variable.strip_prefix('c')?.parse().ok()?;
        (number >= 1 && number <= names.len()).then(|| number - 1)
    })
}

/// The only column whose name begins with these words: "t [ms]" for t, whatever the size of the letters.
fn meant<'a>(variable: &str, names: &'a [String]) -> Option<&'a str> {
    let begins = |name: &&String| {
        let (start, rest) = name.split_at_checked(variable.len()).unwrap_or_default();
        start.eq_ignore_ascii_case(variable) && !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_')
    };
    let mut found = names.iter().filter(begins);
    found.next().filter(|_| found.next().is_none()).map(String::as_str)
}

/// A name, a number, a name in braces, or a single character.
fn next_token(text: &str) -> Option<&str> {
    let next = text.chars().next()?;
    let length = match next {
        '{' => text.find('}').map_or(text.len(), |end| end + 1),
        _ if next.is_alphanumeric() || next == '_' || next == '.' => word_length(text),
        _ => next.len_utf8(),
    };
    text.get(..length)
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

/// A token as exmex understands it: 1.5e5 written out as 150000, since it knows no exponents; and -x^2 as (-1)*x^2, since to
/// exmex a sign comes before a power.
fn push_as_exmex_reads(token: &str, plain: &mut String) {
    let before = plain.trim_end().chars().next_back();
    match token.parse::<f64>() {
        _ if token == "-" && before.is_none_or(|before| "(,+-*<>=&|".contains(before)) => {
            plain.push_str("(-1)*");
        }
        Ok(number) if number.is_finite() && token.starts_with(|c: char| c.is_ascii_digit() || c == '.') => {
            plain.push_str(&number.to_string());
        }
        _ => plain.push_str(token),
    }
}

/// What stands in the brackets that a text begins with, and what stands behind them.
fn in_brackets(text: &str) -> Option<(&str, &str)> {
    let open = text.find('(')?;
    let mut depth = 0_usize;
    let mut at = open;
    while let Some(token) = next_token(text.get(at..)?) {
        match token {
            "(" => depth += 1,
            ")" => depth -= 1,
            _ => {}
        }
        at += token.len();
        if depth == 0 {
            return Some((text.get(open + 1..at - 1)?, text.get(at..)?));
        }
    }
    None
}

/// Arguments, parted by commas that stand in no brackets.
fn arguments(text: &str) -> Vec<&str> {
    let (mut found, mut begin, mut at, mut depth) = (Vec::new(), 0, 0, 0_usize);
    while let Some(token) = text.get(at..).and_then(next_token) {
        match token {
            "(" => depth += 1,
            ")" => depth = depth.saturating_sub(1),
            "," if depth == 0 => {
                found.extend(text.get(begin..at));
                begin = at + 1;
            }
            _ => {}
        }
        at += token.len();
    }
    found.extend(text.get(begin..));
    found
}

impl Bound<'_> {
    /// The values in all rows.
    ///
    /// # Errors
    /// What a function or the expression's own evaluation refuses.
    pub(crate) fn values(&self, cells: &Cells<'_>) -> anyhow::Result<Vec<f64>> {
        let calls = self.calls.iter().map(|(call, argument)| {
            let values = argument.values(cells)?;
            ensure!(
                !call.function.needs_time() || cells.time_s.is_some(),
                "{}() needs the time, and can't stand in it or in a condition",
                call.name
            );
            call.function.of(values, &call.numbers, cells.time_s)
        });
        let calls = calls.collect::<anyhow::Result<Vec<Vec<f64>>>>()?;
        let mut values = vec![0.0; self.operands.len()];
        let at = |column: Option<&Vec<f64>>, index: usize| {
            column.and_then(|column| column.get(index)).copied().unwrap_or(f64::NAN)
        };
        let each = cells.rows.iter().enumerate().map(|(index, row)| {
            for (value, operand) in values.iter_mut().zip(&self.operands) {
                *value = match operand {
                    Operand::Column(column) => at(cells.columns.get(*column), index),
                    Operand::Row => *row as f64,
                    Operand::Pi => PI,
                    Operand::Call(call) => at(calls.get(*call), index),
                };
            }
            self.flat.eval(&values).map_err(|error| anyhow!("{}", error.msg()))
        });
        each.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(map: &str, names: &[&str], rows: &[&[f64]], time_s: Option<&[f64]>) -> Vec<f64> {
        let map: Map = map.parse().unwrap();
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let mut wanted = Vec::new();
        let bound = map.bind(&names, &mut wanted).unwrap();
        let columns: Vec<Vec<f64>> =
            wanted.iter().map(|column| rows.iter().map(|row| row[*column]).collect()).collect();
        let numbers: Vec<usize> = (7..7 + rows.len()).collect();
        bound.values(&Cells { columns: &columns, rows: &numbers, time_s }).unwrap()
    }

    fn value(map: &str, names: &[&str], row: &[f64]) -> f64 {
        all(map, names, &[row], None)[0]
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
        assert_eq!(value("angle=max(a, b)-min(a, b)+atan2(0, 1)", &["b", "a"], &[-1.0, 2.0]), 3.0);
    }

    #[test]
    fn comparisons_are_one_or_zero() {
        let holds = |text: &str| value(&format!("x[1]={text}"), &["a", "b"], &[-1.0, 2.0]);
        for (text, expected) in [
            ("a<b", 1.0),
            ("a>=b", 0.0),
            ("a==-1 && b==2", 1.0),
            ("a+3 > b || a != -1", 0.0),
            ("a<-0.5 && (b<1 || b>1.5)", 1.0),
            ("a*2<=b-4", 1.0),
            ("abs(a)!=1", 0.0),
        ] {
            assert_eq!(holds(text), expected, "{text}");
        }
    }

    #[test]
    fn functions_of_whole_columns_within_expressions() {
        let rows: [&[f64]; 3] = [&[10.0], &[20.0], &[60.0]];
        let of = |text: &str| all(&format!("x[1]={text}"), &["rpm"], &rows, Some(&[0.0, 1.0, 2.0]));
        assert_eq!(of("integral(-rpm*2)+1"), [1.0, -29.0, -109.0]);
        assert_eq!(of("rpm-mean(rpm)"), [-20.0, -10.0, 30.0]);
        assert_eq!(of("unwrap( {rpm}*6 , 2*180)"), [60.0, 120.0, 0.0 + 360.0 - 360.0]);
        assert_eq!(of("shift(difference(rpm), -1)")[..2], [10.0, 40.0]);
        assert_eq!(of("max(first(rpm), last(rpm))"), [60.0; 3]);
    }

    #[test]
    fn refused() {
        for (wrong, says) in [
            ("torque", "CHANNEL=EXPRESSION"),
            ("tork=c1", "pressure_drop"),
            ("torque[N*m]=c1", "brackets"),
            ("torque=c1*(", "no expression"),
            ("torque=integral(c1", "open"),
            ("torque=lowpass(c1)", "expected 1"),
            ("torque=lowpass(c1, c2)", "\"c2\", expected a number"),
            ("torque=shift(c1, 0.5)", "whole rows"),
        ] {
            let error = wrong.parse::<Map>().unwrap_err();
            assert!(error.contains(says), "{error}");
        }
        let map: Map = "torque=F*0.1".parse().unwrap();
        let error =
            map.bind(&["t".to_owned(), "force".to_owned()], &mut Vec::new()).err().unwrap().to_string();
        assert!(error.contains("\"F\"") && error.contains("t, force"), "{error}");
        let deep = format!("torque={}c1{}", "mean(".repeat(50_000), ")".repeat(50_000));
        assert!(deep.parse::<Map>().is_err());
    }
}
