//! A plan and what it declares.

use serde::{Deserialize, Serialize};

use super::{Expression, Keyword, Span, Statement};

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
