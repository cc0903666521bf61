//! The tokens that open the view.

use std::fs::File;
use std::io::Read;

use crate::ViewError;

/// A random word of 128 bits, in hexadecimal digits.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

impl std::fmt::Debug for Token {
    /// Never the word itself: it would stand in a log.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token")
    }
}

impl Token {
    /// A new word from the operating system's random numbers.
    ///
    /// # Errors
    /// [`ViewError::Token`] when there are none.
    pub fn random() -> Result<Self, ViewError> {
        let mut bytes = [0; 16];
        File::open("/dev/urandom")
            .and_then(|mut source| source.read_exact(&mut bytes))
            .map_err(|cause| ViewError::Token {
                cause: cause.to_string(),
            })?;
        Ok(Self(
            bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
        ))
    }

    /// The word.
    #[must_use]
    pub fn word(&self) -> &str {
        &self.0
    }

    /// Whether this is the word, in a time that does not depend on where it differs.
    #[must_use]
    pub fn is(&self, word: &str) -> bool {
        let (ours, theirs) = (self.0.as_bytes(), word.as_bytes());
        let differences = ours
            .iter()
            .zip(theirs)
            .fold(ours.len() ^ theirs.len(), |sum, (a, b)| {
                sum | usize::from(a ^ b)
            });
        differences == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_word_itself_opens() {
        let token = Token::random().unwrap();
        assert_eq!(token.word().len(), 32);
        assert!(token.is(token.word()));
        assert!(!token.is(""));
        assert!(!token.is(&token.word()[1..]));
        assert!(!token.is(&format!("{}0", token.word())));
        assert_ne!(token, Token::random().unwrap());
        assert!(!format!("{token:?}").contains(token.word()));
    }
}
