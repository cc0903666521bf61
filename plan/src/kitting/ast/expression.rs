//! Expressions, names and key words.

use serde::{Deserialize, Serialize};

use super::Span;

/// A key word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Keyword {
    /// Any item that meets the conditions.
    Any,
    /// Quit if there is an error.
    Quit,
    /// The robot as reference object.
    Robot,
    /// On the table; the table as reference object.
    Table,
    /// Anywhere in the workstation; the workstation as reference object.
    Workstation,
}

impl Keyword {
    /// All with their spelling.
    pub const ALL: [(Self, &str); 5] = [
        (Self::Any, "ANY"),
        (Self::Quit, "QUIT"),
        (Self::Robot, "ROBOT"),
        (Self::Table, "TABLE"),
        (Self::Workstation, "WORKSTATION"),
    ];

    /// The key word of this spelling.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL
            .iter()
            .find(|(_, known)| *known == name)
            .map(|(keyword, _)| *keyword)
    }

    /// Its spelling.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(known, _)| *known == self)
            .map_or("ANY", |(_, name)| name)
    }
}

/// A name with its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub struct Name {
    /// The name as written.
    pub text: String,
    /// Where.
    pub span: Span,
}

impl From<String> for Name {
    fn from(text: String) -> Self {
        Self {
            text,
            span: Span::default(),
        }
    }
}

impl From<Name> for String {
    fn from(name: Name) -> Self {
        name.text
    }
}

/// An expression with its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Term", into = "Term")]
pub struct Expression {
    /// What it says.
    pub term: Term,
    /// Where it is written.
    pub span: Span,
}

impl From<Term> for Expression {
    fn from(term: Term) -> Self {
        Self {
            term,
            span: Span::default(),
        }
    }
}

impl From<Expression> for Term {
    fn from(expression: Expression) -> Self {
        expression.term
    }
}

/// What an expression says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Term {
    /// A number.
    Number(f64),
    /// A text in quotes.
    Text(String),
    /// Null.
    Null,
    /// true or false.
    Truth(bool),
    /// A key word.
    Keyword(Keyword),
    /// A variable, parameter, stock keeping unit or implied property.
    Name(String),
    /// A property of an object or value.
    Property(Box<Expression>, String),
    /// A function, or a literal such as Pose(...).
    Call(String, Vec<Expression>),
    /// `-` or `!` before an operand.
    Unary(Operator, Box<Expression>),
    /// An operator between two operands.
    Binary(Operator, Box<Expression>, Box<Expression>),
}

/// An operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Operator {
    /// `||`
    Or,
    /// `&&`
    And,
    /// `==`
    Equal,
    /// `!=`
    Unequal,
    /// `<`
    Less,
    /// `>`
    Greater,
    /// `<=`
    AtMost,
    /// `>=`
    AtLeast,
    /// `+`
    Plus,
    /// `-`
    Minus,
    /// `*`
    Times,
    /// `/`
    Over,
    /// `%`
    Modulo,
    /// `!`
    Not,
}

impl Operator {
    /// All binary operators with spelling and strength (a higher one binds more tightly).
    pub const BINARY: [(Self, &str, u8); 13] = [
        (Self::Or, "||", 1),
        (Self::And, "&&", 2),
        (Self::Equal, "==", 3),
        (Self::Unequal, "!=", 3),
        (Self::AtMost, "<=", 4),
        (Self::AtLeast, ">=", 4),
        (Self::Less, "<", 4),
        (Self::Greater, ">", 4),
        (Self::Plus, "+", 5),
        (Self::Minus, "-", 5),
        (Self::Times, "*", 6),
        (Self::Over, "/", 6),
        (Self::Modulo, "%", 6),
    ];

    /// Its spelling.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        Self::BINARY
            .iter()
            .find(|(known, _, _)| *known == self)
            .map_or("!", |(_, text, _)| text)
    }

    /// How tightly it binds.
    #[must_use]
    pub fn strength(self) -> u8 {
        Self::BINARY
            .iter()
            .find(|(known, _, _)| *known == self)
            .map_or(7, |(_, _, s)| *s)
    }
}
