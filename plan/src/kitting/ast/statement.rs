//! The statements.

use serde::{Deserialize, Serialize};

use super::{Expression, Keyword, Name, Span};

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
