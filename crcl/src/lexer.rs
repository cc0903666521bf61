//! Divides the text of a program into tokens; skips spaces and comments.

use std::ops::Range;

use crate::code;
use crate::finding::{Finding, Findings};

/// The kinds of brackets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Bracket {
    Round,
    Curly,
    Square,
}

impl Bracket {
    pub(crate) fn open(self) -> char {
        match self {
            Self::Round => '(',
            Self::Curly => '{',
            Self::Square => '[',
        }
    }

    pub(crate) fn close(self) -> char {
        match self {
            Self::Round => ')',
            Self::Curly => '}',
            Self::Square => ']',
        }
    }
}

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A name: letters, digits, `_`; also a signed word such as `-inf`.
    Word,
    /// Begins like a number; may be malformed.
    Number,
    /// A text with its quotes.
    Text,
    Open(Bracket),
    Close(Bracket),
    Comma,
    Semicolon,
    /// Something that was reported already.
    Fault,
    /// The end of the source.
    End,
}

/// A piece of the source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Token {
    pub(crate) kind: Kind,
    pub(crate) start: usize,
    pub(crate) end: usize,
    /// Whether it is the first on its line.
    pub(crate) leads: bool,
}

impl Token {
    pub(crate) fn span(&self) -> Range<usize> {
        self.start..self.end
    }
}

/// Walks over the source, one token a call.
#[derive(Debug)]
pub(crate) struct Lexer<'a> {
    source: &'a str,
    at: usize,
    leads: bool,
}

impl<'a> Lexer<'a> {
    pub(crate) fn new(source: &'a str) -> Self {
        let at = if source.starts_with('\u{FEFF}') {
            '\u{FEFF}'.len_utf8()
        } else {
            0
        };
        Self {
            source,
            at,
            leads: true,
        }
    }

    /// The next token; after the last one always [`Kind::End`].
    pub(crate) fn next(&mut self, findings: &mut Findings) -> Token {
        self.skip_space(findings);
        let start = self.at;
        let kind = match self.peek() {
            None => Kind::End,
            Some(first) => self.token(first, findings),
        };
        let leads = std::mem::take(&mut self.leads);
        Token {
            kind,
            start,
            end: self.at,
            leads,
        }
    }

    fn token(&mut self, first: char, findings: &mut Findings) -> Kind {
        if let Some(kind) = punctuation(first) {
            self.at += 1;
            return kind;
        }
        match first {
            '"' => self.quoted(findings),
            '\'' | '\u{201C}' | '\u{201D}' | '\u{2018}' | '\u{2019}' => {
                self.wrongly_quoted(first, findings)
            }
            '0'..='9' | '.' => self.number(),
            '+' | '-' => self.signed(first, findings),
            _ if first.is_alphabetic() || first == '_' => self.word(),
            _ => self.stray(findings),
        }
    }

    fn rest(&self) -> &'a str {
        self.source.get(self.at..).unwrap_or_default()
    }

    fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    /// Moves on while characters fit.
    fn skip_while(&mut self, fits: impl Fn(char) -> bool) {
        let rest = self.rest();
        self.at += rest
            .find(|character| !fits(character))
            .unwrap_or(rest.len());
    }

    fn skip_space(&mut self, findings: &mut Findings) {
        loop {
            let start = self.at;
            self.skip_while(char::is_whitespace);
            let passed = self.source.get(start..self.at).unwrap_or_default();
            self.leads |= passed.contains(['\n', '\r']);
            let rest = self.rest();
            if rest.starts_with("//") {
                self.skip_while(in_line);
            } else if rest.starts_with("/*") {
                self.block_comment(findings);
            } else if rest.starts_with('#') {
                self.hash_comment(findings);
            } else {
                return;
            }
        }
    }

    fn block_comment(&mut self, findings: &mut Findings) {
        let start = self.at;
        let body = self.source.get(start + 2..).unwrap_or_default();
        if let Some(length) = body.find("*/") {
            let comment = body.get(..length).unwrap_or_default();
            self.leads |= comment.contains(['\n', '\r']);
            self.at = start + 2 + length + 2;
            return;
        }
        self.at = self.source.len();
        let finding = Finding::error(code::COMMENT, start..start + 2, "this comment never ends");
        findings.push(
            finding
                .expected("`*/`")
                .found("the end of the file")
                .help("close the comment with `*/`; everything after `/*` was left out"),
        );
    }

    fn hash_comment(&mut self, findings: &mut Findings) {
        let start = self.at;
        self.skip_while(in_line);
        let finding = Finding::error(code::CHARACTER, start..start + 1, "`#` begins no comment");
        findings.push(
            finding
                .expected("`//`")
                .found("`#`")
                .help("write `//` before a comment"),
        );
    }

    /// A text in double quotes, up to its closing quote on the same line.
    fn quoted(&mut self, findings: &mut Findings) -> Kind {
        let start = self.at;
        let mut escaped = false;
        for (offset, character) in self.rest().char_indices().skip(1) {
            match character {
                '\n' | '\r' => break,
                '"' if !escaped => {
                    self.at = start + offset + 1;
                    return Kind::Text;
                }
                _ => escaped = character == '\\' && !escaped,
            }
        }
        self.skip_while(in_line);
        let finding = Finding::error(code::TEXT, start..self.at, "this text is not closed");
        findings.push(
            finding.expected("`\"` on the same line").found("the end of the line").help(
                "close the text with `\"`; write `\\n` for a line end and `\\\"` for a quote in it",
            ),
        );
        Kind::Fault
    }

    /// A text in single or curly quotes: reported, and passed as a whole.
    fn wrongly_quoted(&mut self, first: char, findings: &mut Findings) -> Kind {
        let start = self.at;
        self.at += first.len_utf8();
        let quotes = ['\'', '"', '\u{201C}', '\u{201D}', '\u{2018}', '\u{2019}'];
        let line = self.rest().split(['\n', '\r']).next().unwrap_or_default();
        if let Some((offset, quote)) = line.char_indices().find(|(_, c)| quotes.contains(c)) {
            self.at += offset + quote.len_utf8();
        }
        let finding = Finding::error(
            code::CHARACTER,
            start..self.at,
            format!("`{first}` does not quote a text"),
        );
        findings.push(
            finding
                .expected("`\"`")
                .found(format!("`{first}`"))
                .help("write texts in straight double quotes, such as \"mm\""),
        );
        Kind::Fault
    }

    /// Everything that is joined to a first digit or point; judged when it is parsed.
    fn number(&mut self) -> Kind {
        let mut before = ' ';
        for (offset, character) in self.rest().char_indices() {
            let exponent_sign = matches!(character, '+' | '-') && matches!(before, 'e' | 'E');
            if !(character.is_alphanumeric() || matches!(character, '.' | '_') || exponent_sign) {
                self.at += offset;
                return Kind::Number;
            }
            before = character;
        }
        self.at = self.source.len();
        Kind::Number
    }

    fn signed(&mut self, sign: char, findings: &mut Findings) -> Kind {
        let start = self.at;
        self.at += 1;
        match self.peek() {
            Some('0'..='9' | '.') => self.number(),
            Some(next) if next.is_alphabetic() => self.word(),
            _ => {
                let message = format!("`{sign}` stands alone");
                let finding = Finding::error(code::CHARACTER, start..self.at, message);
                findings.push(finding.help("write the sign right before its number"));
                Kind::Fault
            }
        }
    }

    fn word(&mut self) -> Kind {
        self.skip_while(|character| character.is_alphanumeric() || character == '_');
        Kind::Word
    }

    /// A run of characters that have no place in a program.
    fn stray(&mut self, findings: &mut Findings) -> Kind {
        let start = self.at;
        let known = |c: char| {
            c.is_whitespace()
                || c.is_alphanumeric()
                || punctuation(c).is_some()
                || "\"'#".contains(c)
        };
        self.skip_while(|character| !known(character));
        let text = self.source.get(start..self.at).unwrap_or_default();
        let finding = Finding::error(
            code::CHARACTER,
            start..self.at,
            format!("{} has no place in a program", shown(text)),
        );
        findings.push(match stray_help(text) {
            Some(help) => finding.help(help),
            None => finding,
        });
        Kind::Fault
    }
}

fn punctuation(character: char) -> Option<Kind> {
    Some(match character {
        '(' => Kind::Open(Bracket::Round),
        ')' => Kind::Close(Bracket::Round),
        '{' => Kind::Open(Bracket::Curly),
        '}' => Kind::Close(Bracket::Curly),
        '[' => Kind::Open(Bracket::Square),
        ']' => Kind::Close(Bracket::Square),
        ',' => Kind::Comma,
        ';' => Kind::Semicolon,
        _ => return None,
    })
}

fn in_line(character: char) -> bool {
    !matches!(character, '\n' | '\r')
}

/// The characters themselves, or their code points where they cannot be seen.
fn shown(text: &str) -> String {
    let visible = |c: char| !c.is_control() && !matches!(c, '\u{200B}'..='\u{200F}' | '\u{FEFF}');
    if text.chars().all(visible) {
        return format!("`{}`", clip(text));
    }
    let points = text
        .chars()
        .take(4)
        .map(|c| format!("U+{:04X}", u32::from(c)));
    let points: Vec<_> = points.collect();
    let more = if text.chars().count() > points.len() {
        " ..."
    } else {
        ""
    };
    format!("{}{more}", points.join(" "))
}

fn stray_help(text: &str) -> Option<&'static str> {
    match text.chars().next()? {
        '\u{2212}' | '\u{2013}' | '\u{2014}' => Some("write minus as `-`"),
        '\u{200B}'..='\u{200F}' | '\u{FEFF}' => Some("delete this invisible character"),
        '/' => Some("a comment begins with `//`, or stands between `/*` and `*/`"),
        '*' => Some("a comment stands between `/*` and `*/`"),
        '<' => Some("this looks like XML; a program is text or JSON"),
        ':' | '=' => Some("arguments are given by their place, without names"),
        _ => None,
    }
}

/// The text on one line, or its beginning when it is long, fit to be shown in a terminal.
pub(crate) fn clip(text: &str) -> String {
    const LONGEST: usize = 40;
    let visible = |c: char| {
        if c.is_control() {
            char::REPLACEMENT_CHARACTER
        } else {
            c
        }
    };
    let clipped: String = text.chars().take(LONGEST).map(visible).collect();
    let whole = text.chars().nth(LONGEST).is_none();
    if whole { clipped } else { clipped + "..." }
}
