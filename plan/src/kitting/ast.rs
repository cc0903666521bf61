//! A kitting process plan as data.

use std::ops::Range;

use serde::{Deserialize, Serialize};

/// Bytes of the source. Two plans that differ only in their spans are equal.
#[derive(Clone, Copy, Debug, Default)]
pub struct Span {
    /// First byte.
    pub start: usize,
    /// One after the last byte.
    pub end: usize,
}

impl PartialEq for Span {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl From<Span> for Range<usize> {
    fn from(span: Span) -> Self {
        span.start..span.end
    }
}

impl Span {
    /// The span from the start of this one to the end of `other`.
    #[must_use]
    pub fn to(self, other: Self) -> Self {
        Self {
            start: self.start,
            end: other.end.max(self.start),
        }
    }

    /// As a range of bytes.
    #[must_use]
    pub fn range(self) -> Range<usize> {
        self.into()
    }
}

/// A whole plan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Fields of the section About, in order; unknown ones are kept.
    pub about: Vec<Field>,
    /// What must be in the workstation.
    #[serde(default)]
    pub requirements: Vec<Requirement>,
    /// Values given at the start.
    #[serde(default)]
    pub parameters: Vec<Parameter>,
    /// Variables of the plan.
    #[serde(default)]
    pub variables: Vec<Variable>,
    /// What to do.
    pub todo: Vec<Statement>,
}

impl Plan {
    /// A field of the section About; empty when it is missing.
    #[must_use]
    pub fn about(&self, name: &str) -> &str {
        let field = self.about.iter().find(|field| field.name == name);
        field.map_or("", |field| field.value.as_str())
    }

    /// All statements, each before the statements in it.
    #[must_use]
    pub fn statements(&self) -> Vec<&Statement> {
        let mut all = Vec::new();
        let mut open: Vec<&Statement> = self.todo.iter().rev().collect();
        while let Some(statement) = open.pop() {
            all.push(statement);
            open.extend(statement.children().into_iter().rev());
        }
        all
    }
}

/// One field of the section About.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// Its value; runs of blanks in the source are one blank.
    pub value: String,
    /// Where it is.
    #[serde(skip)]
    pub span: Span,
}

/// A required item.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Requirement {
    /// Its name.
    pub name: String,
    /// Class of the item.
    #[serde(rename = "type")]
    pub class: String,
    /// Id of the stock keeping unit of the item.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sku: Option<String>,
    /// Id of the stock keeping unit (or design) of what is in it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contents_type: Option<String>,
    /// How many of these are in it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contents_quantity: Option<u64>,
    /// Where it is: TABLE or WORKSTATION.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub location: Option<Keyword>,
    /// Further conditions, with the item as implied subject.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub conditions: Vec<Expression>,
    /// Where it is written.
    #[serde(skip)]
    pub span: Span,
}

/// A parameter of the plan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its type.
    #[serde(rename = "type")]
    pub class: String,
    /// Where it is written.
    #[serde(skip)]
    pub span: Span,
}

/// An internal variable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Its type.
    #[serde(rename = "type")]
    pub class: String,
    /// Requirement that its value fulfils.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub requirement: Option<String>,
    /// Stock keeping unit (or design) of its value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sku: Option<String>,
    /// Value at the start; none means Null.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial: Option<Expression>,
    /// Where it is written.
    #[serde(skip)]
    pub span: Span,
}

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

/// A statement with its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Action", into = "Action")]
pub struct Statement {
    /// What to do.
    pub action: Action,
    /// Where it is written.
    pub span: Span,
}

impl From<Action> for Statement {
    fn from(action: Action) -> Self {
        Self {
            action,
            span: Span::default(),
        }
    }
}

impl From<Statement> for Action {
    fn from(statement: Statement) -> Self {
        statement.action
    }
}

impl Statement {
    /// The statements in it.
    #[must_use]
    pub fn children(&self) -> Vec<&Self> {
        match &self.action {
            Action::DoInGivenOrder(list) | Action::DoInAnyOrder(list) | Action::DoOne(list) => {
                list.iter().collect()
            }
            Action::DoInPreconditionOrder(list) => list.iter().map(|t| &t.statement).collect(),
            Action::If { then, .. } | Action::ElseIf { then, .. } | Action::Else { then } => {
                vec![then]
            }
            Action::LoopInGivenOrderWhile { body, .. }
            | Action::LoopInAnyOrderWhile { body, .. } => body.iter().collect(),
            _ => Vec::new(),
        }
    }
}

/// The 24 statements.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Action {
    /// Nothing; the first statement of a plan.
    Start {},
    /// The plan ends well.
    Stop {},
    /// The plan ends badly.
    Quit {},
    /// Find an object for a variable.
    Bind {
        /// The variable.
        variable: Name,
        /// Where to look.
        location: Keyword,
        /// Which to take.
        which: Keyword,
        /// What to do when there is none.
        on_failure: Keyword,
    },
    /// Assign a value to a variable or a property.
    Set {
        /// The variable or property path.
        target: Expression,
        /// The value.
        value: Expression,
    },
    /// Assign a pose, expressed relative to an object.
    SetPose {
        /// The variable.
        variable: Name,
        /// The reference object.
        reference: Expression,
        /// The pose.
        pose: Expression,
    },
    /// Make an object out of its first component.
    CreateInstance {
        /// The variable for the new object.
        variable: Name,
        /// The component.
        object: Expression,
        /// Property of the new object whose value is the component.
        property: String,
    },
    /// Unmake an object of one component.
    DestroyInstance {
        /// Its variable.
        variable: Name,
    },
    /// All, one after another.
    DoInGivenOrder(Vec<Statement>),
    /// All, in the order that is best.
    DoInAnyOrder(Vec<Statement>),
    /// All, in an order that the indexes before each allow.
    DoInPreconditionOrder(Vec<Triple>),
    /// One of them.
    DoOne(Vec<Statement>),
    /// If the test is true.
    If {
        /// The test.
        test: Expression,
        /// What to do then.
        then: Box<Statement>,
    },
    /// If no test before was true and this is.
    ElseIf {
        /// The test.
        test: Expression,
        /// What to do then.
        then: Box<Statement>,
    },
    /// If no test before was true.
    Else {
        /// What to do then.
        then: Box<Statement>,
    },
    /// As long as the test is true, all one after another.
    LoopInGivenOrderWhile {
        /// The test, made before each pass.
        test: Expression,
        /// The list.
        body: Vec<Statement>,
    },
    /// As long as the test is true, all in the order that is best.
    LoopInAnyOrderWhile {
        /// The test, made before each pass.
        test: Expression,
        /// The list.
        body: Vec<Statement>,
    },
    /// The factotum brings an object.
    FactotumRefill {
        /// Variable of the requirement.
        variable: Name,
    },
    /// The factotum takes an object away.
    FactotumRemove {
        /// Its variable.
        variable: Name,
    },
    /// The factotum takes an object away and brings another to its place.
    FactotumReplace {
        /// Its variable.
        variable: Name,
    },
    /// The robot changes its end effector.
    RobotChangeEndEffector {
        /// Id of the end effector.
        effector: Expression,
    },
    /// The robot moves above a pose.
    RobotMoveAbove {
        /// The pose.
        pose: Expression,
    },
    /// The robot picks an object up.
    RobotPickUp {
        /// The object.
        object: Expression,
    },
    /// The robot puts an object down.
    RobotPutDown {
        /// The object.
        object: Expression,
        /// Where.
        pose: Expression,
    },
}

impl Action {
    /// Name of the statement.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Start {} => "Start",
            Self::Stop {} => "Stop",
            Self::Quit {} => "Quit",
            Self::Bind { .. } => "Bind",
            Self::Set { .. } => "Set",
            Self::SetPose { .. } => "SetPose",
            Self::CreateInstance { .. } => "CreateInstance",
            Self::DestroyInstance { .. } => "DestroyInstance",
            Self::DoInGivenOrder(_) => "DoInGivenOrder",
            Self::DoInAnyOrder(_) => "DoInAnyOrder",
            Self::DoInPreconditionOrder(_) => "DoInPreconditionOrder",
            Self::DoOne(_) => "DoOne",
            Self::If { .. } => "If",
            Self::ElseIf { .. } => "ElseIf",
            Self::Else { .. } => "Else",
            Self::LoopInGivenOrderWhile { .. } => "LoopInGivenOrderWhile",
            Self::LoopInAnyOrderWhile { .. } => "LoopInAnyOrderWhile",
            Self::FactotumRefill { .. } => "FactotumRefill",
            Self::FactotumRemove { .. } => "FactotumRemove",
            Self::FactotumReplace { .. } => "FactotumReplace",
            Self::RobotChangeEndEffector { .. } => "RobotChangeEndEffector",
            Self::RobotMoveAbove { .. } => "RobotMoveAbove",
            Self::RobotPickUp { .. } => "RobotPickUp",
            Self::RobotPutDown { .. } => "RobotPutDown",
        }
    }
}

/// The names of the statements.
pub const STATEMENTS: [&str; 24] = [
    "Start",
    "Stop",
    "Quit",
    "Bind",
    "Set",
    "SetPose",
    "CreateInstance",
    "DestroyInstance",
    "DoInGivenOrder",
    "DoInAnyOrder",
    "DoInPreconditionOrder",
    "DoOne",
    "If",
    "ElseIf",
    "Else",
    "LoopInGivenOrderWhile",
    "LoopInAnyOrderWhile",
    "FactotumRefill",
    "FactotumRemove",
    "FactotumReplace",
    "RobotChangeEndEffector",
    "RobotMoveAbove",
    "RobotPickUp",
    "RobotPutDown",
];

/// One entry of a DoInPreconditionOrder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Triple {
    /// Its number.
    pub index: u32,
    /// Numbers of the entries that come before it.
    pub before: Vec<u32>,
    /// What to do.
    pub statement: Statement,
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
