//! From the text of an expression to its program, in one pass.
//!
//! ```text
//! sum    = term (('+' | '-') term)*
//! term   = signed (('*' | '/') signed)*
//! signed = '-' signed | '+' signed | power
//! power  = atom ('^' signed)?
//! atom   = number | name | function '(' sum (',' sum)? ')' | '(' sum ')'
//! ```

use crate::ExpressionError;
use crate::error::hint;
use crate::function::{Binary, FUNCTIONS, Function, Unary};
use crate::program::{Instruction, MOST_DEEP, Program};
use crate::token::{Token, Words};
use std::f64::consts::PI;

/// Instructions that a program has, at most: they bound its cost.
pub const MOST_INSTRUCTIONS: usize = 64;
/// Bytes of an expression's text, at most.
pub const MOST_BYTES: usize = 500;
/// Brackets, functions and signs within each other, at most.
const MOST_NESTED: usize = 32;

/// Compiles an expression in variables, which stay open, and parameters, whose values become part of the program.
///
/// # Errors
/// What is wrong first, with its place: no expression, an unknown name, a wrong number of arguments, a parameter that is not
/// used or has the name of something else, more than [`MOST_INSTRUCTIONS`] instructions or [`MOST_BYTES`] bytes.
pub fn compile(
    text: &str,
    variables: &[&str],
    parameters: &[(&str, f64)],
) -> Result<Program, ExpressionError> {
    if text.len() > MOST_BYTES {
        let found = format!("{} bytes", text.len());
        return Err(ExpressionError::new(0, found, format!("at most {MOST_BYTES}")));
    }
    check_names(variables, parameters)?;
    let mut words = Words::new(text);
    let next = words.next()?;
    let used = vec![false; parameters.len()];
    let program = Program { code: Vec::new(), places: Vec::new() };
    let mut parser = Parser { words, next, variables, parameters, used, program, depth: 0, nested: 0 };
    parser.sum()?;
    parser.end()?;
    parser.all_used()?;
    Ok(parser.program)
}

/// The names in an expression that are no variable's, no function's and not `pi`, each once, in their order.
///
/// # Errors
/// A word that is none; a name that is nearly a variable's, since it is likely to be misspelt.
pub fn free_names(text: &str, variables: &[&str]) -> Result<Vec<String>, ExpressionError> {
    const SHORTEST: usize = 3;
    let mut words = Words::new(text);
    let mut found: Vec<String> = Vec::new();
    loop {
        let name = match words.next()? {
            (Token::End, _) => return Ok(found),
            (Token::Name(name), at) => (name, at),
            _ => continue,
        };
        let (name, at) = name;
        let known = variables.contains(&name) || Function::from_name(name).is_some() || name == "pi";
        if known || found.iter().any(|other| other == name) {
            continue;
        }
        let near = if name.len() < SHORTEST { String::new() } else { hint(name, variables.iter().copied()) };
        if !near.is_empty() {
            let found = format!("an unknown name `{name}`");
            return Err(ExpressionError::new(at, found, format!("{near}another name for a parameter")));
        }
        found.push(name.to_owned());
    }
}

/// Whether a parameter may be called so.
fn check_names(variables: &[&str], parameters: &[(&str, f64)]) -> Result<(), ExpressionError> {
    for (index, (name, _)) in parameters.iter().enumerate() {
        let first = name.chars().next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_');
        let plain = first && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let taken = variables.contains(name) || Function::from_name(name).is_some() || *name == "pi";
        let twice = parameters.iter().skip(index + 1).any(|(other, _)| other == name);
        let expected = match (plain, taken, twice) {
            (false, _, _) => "letters, digits and _, no digit first",
            (_, true, _) => "a name that is no variable's and no function's",
            (_, _, true) => "each parameter once",
            _ => continue,
        };
        return Err(ExpressionError::of_parameter(index, format!("a parameter `{name}`"), expected));
    }
    Ok(())
}

struct Parser<'a> {
    words: Words<'a>,
    /// The word to come, and its place.
    next: (Token<'a>, usize),
    variables: &'a [&'a str],
    parameters: &'a [(&'a str, f64)],
    used: Vec<bool>,
    program: Program,
    /// Numbers on the stack after the code so far.
    depth: usize,
    nested: usize,
}

impl<'a> Parser<'a> {
    fn advance(&mut self) -> Result<(Token<'a>, usize), ExpressionError> {
        let word = self.next;
        self.next = self.words.next()?;
        Ok(word)
    }

    /// Takes this sign if it comes next; its place.
    fn takes(&mut self, sign: char) -> Result<Option<usize>, ExpressionError> {
        let (token, at) = self.next;
        if token != Token::Sign(sign) {
            return Ok(None);
        }
        self.advance()?;
        Ok(Some(at))
    }

    fn refuse<T>(&self, expected: &str) -> Result<T, ExpressionError> {
        let (token, at) = self.next;
        let found = match token {
            Token::Number(number) => format!("{number}"),
            Token::Name(name) => format!("`{name}`"),
            Token::Sign(sign) => format!("`{sign}`"),
            Token::End => "the end".to_owned(),
        };
        Err(ExpressionError::new(at, found, expected))
    }

    fn end(&self) -> Result<(), ExpressionError> {
        if self.next.0 == Token::End { Ok(()) } else { self.refuse("an operator or the end") }
    }

    fn all_used(&self) -> Result<(), ExpressionError> {
        let Some(unused) = self.used.iter().position(|used| !used) else { return Ok(()) };
        let name = self.parameters.get(unused).map_or("", |(name, _)| *name);
        let found = format!("a parameter `{name}` that is not in the expression");
        Err(ExpressionError::of_parameter(unused, found, "parameters that the expression uses"))
    }

    fn sum(&mut self) -> Result<(), ExpressionError> {
        self.chain([('+', Binary::Add), ('-', Binary::Subtract)], Self::term)
    }

    fn term(&mut self) -> Result<(), ExpressionError> {
        self.chain([('*', Binary::Multiply), ('/', Binary::Divide)], Self::signed)
    }

    fn chain(
        &mut self,
        signs: [(char, Binary); 2],
        part: impl Fn(&mut Self) -> Result<(), ExpressionError>,
    ) -> Result<(), ExpressionError> {
        part(self)?;
        'next: loop {
            for (sign, function) in signs {
                if let Some(at) = self.takes(sign)? {
                    part(self)?;
                    self.emit(Instruction::Two(function), at)?;
                    continue 'next;
                }
            }
            return Ok(());
        }
    }

    fn signed(&mut self) -> Result<(), ExpressionError> {
        self.nested += 1;
        if self.nested > MOST_NESTED {
            return self.refuse("at most 32 brackets, functions and signs within each other");
        }
        if let Some(at) = self.takes('-')? {
            self.signed()?;
            self.emit(Instruction::One(Unary::Negative), at)?;
        } else if self.takes('+')?.is_some() {
            self.signed()?;
        } else {
            self.power()?;
        }
        self.nested -= 1;
        Ok(())
    }

    fn power(&mut self) -> Result<(), ExpressionError> {
        self.atom()?;
        if let Some(at) = self.takes('^')? {
            self.signed()?;
            self.emit(Instruction::Two(Binary::Power), at)?;
        }
        Ok(())
    }

    fn atom(&mut self) -> Result<(), ExpressionError> {
        match self.next.0 {
            Token::Number(number) => {
                let (_, at) = self.advance()?;
                self.emit(Instruction::Constant(number), at)
            }
            Token::Name(name) => {
                let (_, at) = self.advance()?;
                self.name(name, at)
            }
            Token::Sign('(') => {
                self.advance()?;
                self.sum()?;
                self.closes()
            }
            _ => self.refuse("a number, a name or a bracket"),
        }
    }

    fn closes(&mut self) -> Result<(), ExpressionError> {
        if self.takes(')')?.is_some() { Ok(()) } else { self.refuse("an operator or `)`") }
    }

    fn name(&mut self, name: &'a str, at: usize) -> Result<(), ExpressionError> {
        if let Some(function) = Function::from_name(name) {
            return self.call(name, function, at);
        }
        if let Some(place) = self.variables.iter().position(|known| *known == name) {
            return self.emit(Instruction::Variable(place as u8), at);
        }
        if let Some(place) = self.parameters.iter().position(|(known, _)| *known == name) {
            self.used.iter_mut().skip(place).take(1).for_each(|used| *used = true);
            let value = self.parameters.get(place).map_or(f64::NAN, |(_, value)| *value);
            return self.emit(Instruction::Constant(value), at);
        }
        if name == "pi" {
            return self.emit(Instruction::Constant(PI), at);
        }
        Err(self.unknown(name, at))
    }

    fn unknown(&self, name: &str, at: usize) -> ExpressionError {
        let parameters = self.parameters.iter().map(|(known, _)| *known);
        let values = self.variables.iter().copied().chain(parameters);
        let functions = FUNCTIONS.iter().map(|(known, _)| *known);
        let known: Vec<&str> = values.chain(["pi"]).collect();
        let near = hint(name, known.iter().copied().chain(functions));
        let expected = format!("{near}one of {}, or a function", known.join(", "));
        ExpressionError::new(at, format!("an unknown name `{name}`"), expected)
    }

    fn call(&mut self, name: &str, function: Function, at: usize) -> Result<(), ExpressionError> {
        if self.takes('(')?.is_none() {
            return self.refuse(&format!("`(` behind the function {name}"));
        }
        let given = self.arguments()?;
        let wanted = function.arguments();
        if given != wanted {
            let expected = format!("{wanted} of {name}");
            return Err(ExpressionError::new(at, format!("{given} argument(s)"), expected));
        }
        match function {
            Function::One(function) => self.emit(Instruction::One(function), at),
            Function::Two(function) => self.emit(Instruction::Two(function), at),
        }
    }

    /// The arguments of a function up to its closing bracket; how many they are.
    fn arguments(&mut self) -> Result<usize, ExpressionError> {
        if self.takes(')')?.is_some() {
            return Ok(0);
        }
        let mut given = 1;
        self.sum()?;
        while self.takes(',')?.is_some() {
            self.sum()?;
            given += 1;
        }
        if self.takes(')')?.is_none() {
            return self.refuse("an operator, `,` or `)`");
        }
        Ok(given)
    }

    /// Adds an instruction; of numbers that are known already, their result.
    fn emit(&mut self, instruction: Instruction, at: usize) -> Result<(), ExpressionError> {
        let Program { code, places } = &mut self.program;
        let folded = match (instruction, code.as_slice()) {
            (Instruction::One(function), [.., Instruction::Constant(x)]) => Some((function.of(*x), 1)),
            (Instruction::Two(function), [.., Instruction::Constant(x), Instruction::Constant(y)]) => {
                Some((function.of(*x, *y), 2))
            }
            _ => None,
        };
        let instruction = match folded.filter(|(value, _)| value.is_finite()) {
            Some((value, gone)) => {
                code.truncate(code.len() - gone);
                places.truncate(code.len());
                self.depth -= gone;
                Instruction::Constant(value)
            }
            None => instruction,
        };
        self.depth = match instruction {
            Instruction::Constant(_) | Instruction::Variable(_) => self.depth + 1,
            Instruction::One(_) => self.depth,
            Instruction::Two(_) => self.depth - 1,
        };
        code.push(instruction);
        places.push(at as u16);
        if self.depth > MOST_DEEP {
            let expected = format!("an expression that keeps at most {MOST_DEEP} numbers at once");
            return Err(ExpressionError::new(at, "a term that is nested too deep", expected));
        }
        if code.len() > MOST_INSTRUCTIONS {
            let expected = format!("at most {MOST_INSTRUCTIONS} numbers, names and operations");
            return Err(ExpressionError::new(at, "an expression that is too long", expected));
        }
        Ok(())
    }
}
