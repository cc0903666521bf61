//! Variables and properties that get values.

use super::eval::matches;
use super::machine::{Machine, Result};
use super::state::{State, Step, nothing};
use super::value::Value;
use crate::PlanError;
use crate::kitting::ast::{Expression, Keyword, Name, Span, Term};
use crate::kitting::types::Type;
use crate::world::class::{Kind, stored_property};
use crate::world::{Change, Object, ObjectId, Scalar};

impl Machine<'_> {
    pub(super) fn assign(&self, variable: &Name, value: Value, state: &mut State) -> Result<()> {
        let missing = || PlanError::Value(format!("nothing is called {}", variable.text));
        let declared = self
            .program
            .scope
            .declared(&variable.text)
            .ok_or_else(missing)?
            .to_owned();
        self.accepts(&declared, &value)?;
        state.bindings.insert(declared, value);
        Ok(())
    }

    /// The value has the type of the variable and, for objects, its stock keeping unit.
    pub(super) fn accepts(&self, declared: &str, value: &Value) -> Result<()> {
        let kind = self
            .program
            .scope
            .lookup(declared)
            .map_or(Type::Unknown, |(_, kind)| kind);
        let object = if let Value::Object(id) = value {
            Some(self.model.object(*id)?)
        } else {
            None
        };
        let fits = match (kind, value) {
            (Type::Object(class), Value::Object(_)) => object.is_some_and(|o| o.class.is_a(class)),
            (Type::Number { whole, least }, Value::Number(number)) => {
                (!whole || number.fract() == 0.0)
                    && least.is_none_or(|least| *number >= least as f64)
            }
            (
                Type::Object(_) | Type::Pose | Type::Data | Type::Text | Type::Unknown,
                Value::Null,
            )
            | (Type::Pose, Value::Pose(_))
            | (Type::Text, Value::Text(_))
            | (Type::Truth, Value::Truth(_))
            | (Type::Data | Type::Unknown, _) => true,
            _ => false,
        };
        let description = || value.describe(self.model);
        if !fits {
            let message = format!("{declared} is {}, not {}", kind.describe(), description());
            return Err(PlanError::Value(message));
        }
        let variable = self
            .program
            .plan
            .variables
            .iter()
            .find(|v| v.name == declared);
        if let (Some(sku), Some(object)) = (variable.and_then(|v| v.sku.as_deref()), object)
            && object.sku().is_some_and(|own| own != sku)
        {
            let message = format!("{declared} holds only {sku}, {} is not one", description());
            return Err(PlanError::Value(message));
        }
        Ok(())
    }

    /// The first object that meets the variable's requirement and is bound to no other variable
    /// with a requirement.
    pub(super) fn find(
        &self,
        variable: &Name,
        location: Keyword,
        state: &State,
    ) -> Option<ObjectId> {
        let plan = &self.program.plan;
        let declared = self.program.scope.declared(&variable.text)?;
        let own = plan.variables.iter().find(|v| v.name == declared)?;
        let requirement = plan
            .requirements
            .iter()
            .find(|r| Some(&r.name) == own.requirement.as_ref())?;
        let taken = |id: ObjectId| {
            plan.variables.iter().any(|other| {
                other.requirement.is_some()
                    && other.name != declared
                    && state.bindings.get(&other.name) == Some(&Value::Object(id))
            })
        };
        let fits = |object: &&Object| {
            !taken(object.id) && matches(self.model, plan, requirement, object, location)
        };
        self.model.objects().find(fits).map(|object| object.id)
    }

    pub(super) fn set(
        &self,
        target: &Expression,
        value: &Expression,
        span: Span,
        mut state: State,
    ) -> Result<Step> {
        let value = self.context(&state).value(value)?;
        let (object, property) = match &target.term {
            Term::Property(object, property) => (object, property),
            Term::Name(text) => {
                let name = Name {
                    text: text.clone(),
                    span: target.span,
                };
                self.assign(&name, value, &mut state)?;
                return Ok(nothing("Set", span, state));
            }
            _ => {
                return Err(PlanError::Value(
                    "only variables and properties can be set".into(),
                ));
            }
        };
        let object = self.model.object(self.context(&state).object(object)?)?;
        let missing =
            || PlanError::Value(format!("{} has no property {property} to set", object.name));
        let kind = stored_property(object.class, property).ok_or_else(missing)?;
        let metres = self.model.units.metres().unwrap_or(1.0);
        let value = match (kind, value) {
            (Kind::Truth, Value::Truth(truth)) => Scalar::Truth(truth),
            (Kind::Text, Value::Text(text) | Value::Sku(text)) => Scalar::Text(text),
            (Kind::Length, Value::Number(number)) => Scalar::Number(number * metres),
            (Kind::Number | Kind::Weight, Value::Number(number)) => Scalar::Number(number),
            (_, other) => {
                let found = other.describe(self.model);
                return Err(PlanError::Value(format!("{property} cannot be {found}")));
            }
        };
        if property == "isKitInstance_Finished" && value == Scalar::Truth(true) {
            state.counters.kits += 1;
        }
        let change = Change::Set {
            object: object.id,
            property: property.clone(),
            value,
        };
        Ok(Step {
            changes: vec![change],
            ..nothing("Set", span, state)
        })
    }

    pub(super) fn bound(&self, variable: &Name, state: &State) -> Result<ObjectId> {
        let declared = self
            .program
            .scope
            .declared(&variable.text)
            .unwrap_or_default();
        match state.bindings.get(declared) {
            Some(Value::Object(id)) => Ok(*id),
            other => {
                let found = other.map_or("nothing".into(), |value| value.describe(self.model));
                Err(PlanError::Value(format!(
                    "{} is {found}, not an object",
                    variable.text
                )))
            }
        }
    }
}
