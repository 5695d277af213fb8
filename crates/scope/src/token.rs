//! The secret in the page's address: who knows it was shown it by this user's terminal.

use std::io::Read;

/// 128 bits, as 32 hexadecimal digits.
#[derive(Debug, Clone)]
pub(crate) struct Token(String);

impl Token {
    /// A new one, from the system's random numbers.
    ///
    /// # Errors
    /// Where the system has none.
    pub(crate) fn draw() -> std::io::Result<Self> {
        let mut bytes = [0; 16];
        std::fs::File::open("/dev/urandom")?.read_exact(&mut bytes)?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether it is this one; how long that takes does not tell where they differ.
    pub(crate) fn is(&self, other: &str) -> bool {
        let differ = |(a, b): (u8, u8)| a ^ b;
        self.0.len() == other.len()
            && self.0.bytes().zip(other.bytes()).map(differ).fold(0, |all, one| all | one) == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_whole_token_opens() {
        let token = Token::draw().unwrap();
        assert_eq!(token.as_str().len(), 32);
        assert!(token.is(token.as_str()));
        let other = Token::draw().unwrap();
        for wrong in ["", "0", &token.as_str()[1..], other.as_str()] {
            assert!(!token.is(wrong), "{wrong}");
        }
    }
}
