//! The words of an expression, each with its place.

use crate::ExpressionError;

/// A word.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Token<'a> {
    Number(f64),
    Name(&'a str),
    /// An operator, a bracket or a comma.
    Sign(char),
    End,
}

/// Cuts a text into words, one at a time.
#[derive(Clone, Copy)]
pub(crate) struct Words<'a> {
    rest: &'a str,
    /// Characters before `rest`.
    at: usize,
}

impl<'a> Words<'a> {
    pub fn new(text: &'a str) -> Self {
        Self { rest: text, at: 0 }
    }

    /// The next word and how many characters stand before it.
    pub fn next(&mut self) -> Result<(Token<'a>, usize), ExpressionError> {
        self.take(|c| c.is_ascii_whitespace());
        let at = self.at;
        let Some(first) = self.rest.chars().next() else { return Ok((Token::End, at)) };
        if first.is_ascii_digit() || first == '.' {
            return self.number().map(|number| (Token::Number(number), at));
        }
        if first.is_ascii_alphabetic() || first == '_' {
            return Ok((Token::Name(self.take(|c| c.is_ascii_alphanumeric() || c == '_')), at));
        }
        if "+-*/^(),".contains(first) {
            self.skip(1);
            return Ok((Token::Sign(first), at));
        }
        let shown = if first.is_control() { "a control character".to_owned() } else { format!("`{first}`") };
        Err(ExpressionError::new(at, shown, "a number, a name, a bracket or one of + - * / ^"))
    }

    /// Digits with a point and an exponent.
    fn number(&mut self) -> Result<f64, ExpressionError> {
        let at = self.at;
        let mut length = 0;
        let mut before = ' ';
        for c in self.rest.chars() {
            let exponent = matches!(c, 'e' | 'E');
            let sign = matches!(c, '+' | '-') && matches!(before, 'e' | 'E');
            if !(c.is_ascii_digit() || c == '.' || exponent || sign) {
                break;
            }
            length += 1;
            before = c;
        }
        let text = self.skip(length);
        let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| ExpressionError::new(at, format!("`{text}`"), "a number"))
    }

    fn take(&mut self, of: impl Fn(char) -> bool) -> &'a str {
        let length = self.rest.chars().take_while(|c| of(*c)).count();
        self.skip(length)
    }

    /// Goes on by so many ASCII characters; what they are.
    fn skip(&mut self, length: usize) -> &'a str {
        let (taken, rest) = self.rest.split_at_checked(length).unwrap_or((self.rest, ""));
        self.rest = rest;
        self.at += length;
        taken
    }
}
