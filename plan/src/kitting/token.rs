//! Divides text into tokens.

use super::ast::Span;
use crate::finding::Finding;

/// What a token is.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Kind {
    /// `5.2.3` at the start of a line.
    Label(Vec<u32>),
    /// A name.
    Ident(String),
    /// A number.
    Number(f64),
    /// A text in quotes, runs of blanks made one.
    Text(String),
    /// A sign or operator.
    Symbol(&'static str),
    /// The end of the text.
    End,
}

/// A token with its place.
#[derive(Clone, Debug)]
pub(super) struct Token {
    pub(super) kind: Kind,
    pub(super) span: Span,
    /// First token on its line.
    pub(super) first: bool,
}

const SYMBOLS: [&str; 21] = [
    "||", "&&", "==", "!=", "<=", ">=", "(", ")", "{", "}", ",", ".", "=", "<", ">", "+", "-", "*",
    "/", "%", "!",
];

/// Splits a text into tokens; the last is always [`Kind::End`].
pub(super) fn tokens(source: &str) -> (Vec<Token>, Vec<Finding>) {
    let mut scanner = Scanner {
        source,
        at: 0,
        depth: 0,
        tokens: Vec::new(),
        findings: Vec::new(),
    };
    scanner.run();
    (scanner.tokens, scanner.findings)
}

struct Scanner<'a> {
    source: &'a str,
    at: usize,
    depth: usize,
    tokens: Vec<Token>,
    findings: Vec<Finding>,
}

impl Scanner<'_> {
    fn rest(&self) -> &str {
        self.source.get(self.at..).unwrap_or("")
    }

    fn run(&mut self) {
        let mut first = true;
        while let Some(c) = self.rest().chars().next() {
            if c == '\n' {
                first = true;
                self.at += 1;
            } else if c.is_whitespace() {
                self.at += c.len_utf8();
            } else if c == '[' {
                self.comment();
            } else {
                self.token(c, first);
                first = false;
            }
        }
        let span = Span {
            start: self.source.len(),
            end: self.source.len(),
        };
        self.tokens.push(Token {
            kind: Kind::End,
            span,
            first: true,
        });
    }

    fn push(&mut self, kind: Kind, length: usize, first: bool) {
        let span = Span {
            start: self.at,
            end: self.at + length,
        };
        self.at += length;
        self.tokens.push(Token { kind, span, first });
    }

    fn comment(&mut self) {
        let start = self.at;
        match self.rest().find(']') {
            Some(end) => self.at += end + 1,
            None => {
                let message = "comment without closing ]";
                self.findings
                    .push(Finding::error("plan::comment", message, start..start + 1));
                self.at = self.source.len();
            }
        }
    }

    fn token(&mut self, c: char, first: bool) {
        if c == '"' {
            self.text(first);
        } else if c.is_ascii_digit() {
            if first && self.depth == 0 && self.label() {
                return;
            }
            self.number(first);
        } else if c.is_alphabetic() || c == '_' {
            let word = |c: char| c.is_alphanumeric() || c == '_';
            let length = self.rest().find(|c| !word(c)).unwrap_or(self.rest().len());
            let name = self.rest()[..length].to_owned();
            self.push(Kind::Ident(name), length, first);
        } else if let Some(symbol) = SYMBOLS.iter().find(|s| self.rest().starts_with(**s)) {
            match *symbol {
                "(" | "{" => self.depth += 1,
                ")" | "}" => self.depth = self.depth.saturating_sub(1),
                _ => {}
            }
            self.push(Kind::Symbol(symbol), symbol.len(), first);
        } else {
            let span = self.at..self.at + c.len_utf8();
            let message = format!("unexpected character {c:?}");
            self.findings
                .push(Finding::error("plan::character", message, span));
            self.at += c.len_utf8();
        }
    }

    fn text(&mut self, first: bool) {
        let start = self.at;
        let Some(end) = self.rest()[1..].find('"') else {
            let message = "text without closing quotation mark";
            self.findings
                .push(Finding::error("plan::text", message, start..start + 1));
            self.at = self.source.len();
            return;
        };
        let raw = &self.rest()[1..=end];
        let text = raw.split_whitespace().collect::<Vec<_>>().join(" ");
        self.push(Kind::Text(text), end + 2, first);
    }

    /// A label: numbers with dots, followed by a blank and a letter or parenthesis.
    fn label(&mut self) -> bool {
        let rest = self.rest();
        let length = rest
            .find(|c: char| !(c.is_ascii_digit() || c == '.'))
            .unwrap_or(rest.len());
        let after = &rest[length..];
        let next = after.trim_start_matches([' ', '\t']).chars().next();
        let blank = after.starts_with([' ', '\t']);
        if !blank || !next.is_some_and(|c| c.is_alphabetic() || c == '(') {
            return false;
        }
        let numbers = rest[..length]
            .trim_end_matches('.')
            .split('.')
            .map(str::parse);
        let Ok(numbers) = numbers.collect::<Result<Vec<u32>, _>>() else {
            return false;
        };
        self.push(Kind::Label(numbers), length, true);
        true
    }

    fn number(&mut self, first: bool) {
        let rest = self.rest();
        let digits = |text: &str| {
            text.find(|c: char| !c.is_ascii_digit())
                .unwrap_or(text.len())
        };
        let mut length = digits(rest);
        if rest[length..].starts_with('.') {
            let fraction = digits(&rest[length + 1..]);
            length += if fraction > 0 { fraction + 1 } else { 0 };
        }
        let exponent = rest[length..].strip_prefix(['e', 'E']).map(|after| {
            let sign = usize::from(after.starts_with(['+', '-']));
            (sign, digits(&after[sign..]))
        });
        if let Some((sign, power)) = exponent
            && power > 0
        {
            length += 1 + sign + power;
        }
        let value: f64 = rest[..length].parse().unwrap_or(f64::NAN);
        if !value.is_finite() {
            let span = self.at..self.at + length;
            self.findings
                .push(Finding::error("plan::number", "number out of range", span));
        }
        self.push(Kind::Number(value), length, first);
    }
}
