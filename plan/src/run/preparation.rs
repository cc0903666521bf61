//! Checks before the first step: the plan is correct, its parameters have values.

use std::collections::BTreeMap;

use super::program::Program;
use super::value::Value;
use crate::PlanError;
use crate::finding::{Severity, has_errors};
use crate::kitting::types::Type;
use crate::kitting::{Reading, check, read};
use crate::world::Model;

/// Reads and checks a plan against a world.
///
/// # Errors
/// [`PlanError::Invalid`] when the plan has errors.
pub fn prepare(source: &str, model: &Model) -> Result<(Program, Vec<String>), PlanError> {
    let Reading { plan, mut findings } = read(source);
    if !has_errors(&findings) {
        findings.extend(check(&plan, Some(model)));
    }
    let errors: Vec<_> = findings
        .iter()
        .filter(|f| f.severity == Severity::Error)
        .collect();
    if let Some(first) = errors.first() {
        let (line, column) = first.position(source);
        let first = format!("{} (line {line}, column {column})", first.message);
        return Err(PlanError::Invalid {
            count: errors.len(),
            first,
        });
    }
    let warnings = findings.iter().filter(|f| f.severity == Severity::Warning);
    let warnings = warnings.map(|f| f.message.clone()).collect();
    Ok((Program::new(plan), warnings))
}

/// Values of a plan's parameters from texts.
///
/// # Errors
/// [`PlanError::Parameter`] for one that is missing, unknown or of the wrong type.
pub fn parameters(
    program: &Program,
    given: &BTreeMap<String, String>,
) -> Result<BTreeMap<String, Value>, PlanError> {
    let fail = |name: &str, why: String| PlanError::Parameter {
        name: name.to_owned(),
        why,
    };
    let mut values = BTreeMap::new();
    for parameter in &program.plan.parameters {
        let name = &parameter.name;
        let kind = Type::from_name(&parameter.class).unwrap_or(Type::Text);
        let text = given.get(name).ok_or_else(|| {
            fail(
                name,
                format!("no value was given; it is {}", kind.describe()),
            )
        })?;
        let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
        let value = match (kind, number) {
            (Type::Number { whole, least }, Some(number))
                if (!whole || number.fract() == 0.0)
                    && least.is_none_or(|least| number >= least as f64) =>
            {
                Value::Number(number)
            }
            (Type::Truth, _) if text == "true" || text == "false" => Value::Truth(text == "true"),
            (Type::Text, _) => Value::Text(text.clone()),
            _ => {
                return Err(fail(
                    name,
                    format!("expected {}, got {text}", kind.describe()),
                ));
            }
        };
        values.insert(name.clone(), value);
    }
    match given.keys().find(|name| !values.contains_key(*name)) {
        Some(unknown) => Err(fail(unknown, "the plan has no such parameter".into())),
        None => Ok(values),
    }
}
