//! A kitting process plan as data.

mod expression;
mod plan;
mod span;
mod statement;

pub use expression::{Expression, Keyword, Name, Operator, Term};
pub use plan::{Field, Parameter, Plan, Requirement, Variable};
pub use span::Span;
pub use statement::{Action, STATEMENTS, Statement, Triple};
