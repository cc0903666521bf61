//! Objects that are made of others: CreateInstance and DestroyInstance.

use nalgebra::Isometry3;

use super::machine::{Component, Machine, Result};
use super::state::{State, Step, nothing};
use super::value::Value;
use crate::PlanError;
use crate::kitting::ast::{Name, Span};
use crate::kitting::types::Type;
use crate::world::class::derived_property;
use crate::world::{Change, Class, Location, Object};

impl Machine<'_> {
    /// The new object takes the place of its first component, which becomes relative to it.
    pub(super) fn create(
        &self,
        variable: &Name,
        component: &Component<'_>,
        span: Span,
        mut state: State,
    ) -> Result<Step> {
        let declared = self.program.scope.lookup(&variable.text);
        let Some((_, Type::Object(class))) = declared else {
            return Err(PlanError::Value(format!(
                "{} is not an object",
                variable.text
            )));
        };
        let part = self.component(class, component, &state)?;
        let mut fresh = self.model.clone();
        let name = fresh.free_name(class.name());
        let id = fresh.fresh();
        let object = if class == Class::KitInstance {
            Object::kit(id, name, part.location, self.design_for(part)?)
        } else {
            Object::new(id, name, class, part.location)
        };
        let location = Location::pose(id, Isometry3::identity());
        let changes = vec![
            Change::Create(object),
            Change::Place {
                object: part.id,
                location,
            },
        ];
        let declared = self
            .program
            .scope
            .declared(&variable.text)
            .unwrap_or_default()
            .to_owned();
        state.bindings.insert(declared, Value::Object(id));
        Ok(Step {
            changes,
            ..nothing("CreateInstance", span, state)
        })
    }

    /// The object that can become this component of a new object of `class`.
    fn component(&self, class: Class, component: &Component<'_>, state: &State) -> Result<&Object> {
        let part = self.context(state).object(component.part)?;
        let part = self.model.object(part)?;
        let property = component.property;
        let wanted = derived_property(class, property).map(|(component, _)| component);
        if !wanted.is_some_and(|wanted| part.class.is_a(wanted)) {
            let message = format!("{} cannot be the {property} of a {class}", part.name);
            return Err(PlanError::Value(message));
        }
        if class.is_composite() && self.model.composite_of(part.id).is_some() {
            let message = format!("{} is already part of another", part.name);
            return Err(PlanError::Value(message));
        }
        Ok(part)
    }

    /// The plan's design of a kit, if its tray is this one.
    fn design_for(&self, tray: &Object) -> Result<String> {
        let design = self.program.plan.about("TargetSKU").to_owned();
        let wanted = self.model.design(&design);
        if wanted.map(|design| design.tray_sku.as_str()) != tray.sku() {
            let message = format!("{} is not the tray of the design {design}", tray.name);
            return Err(PlanError::Value(message));
        }
        Ok(design)
    }

    /// The one component takes the place of the object.
    pub(super) fn destroy(&self, variable: &Name, span: Span, mut state: State) -> Result<Step> {
        let object = self.model.object(self.bound(variable, &state)?)?;
        let components: Vec<&Object> = self.model.children(object.id).collect();
        let [component] = components[..] else {
            let message = format!(
                "{} has {} components, not one",
                object.name,
                components.len()
            );
            return Err(PlanError::Value(message));
        };
        let pose = object.location.pose * component.location.pose;
        let changes = vec![
            Change::Place {
                object: component.id,
                location: Location {
                    pose,
                    ..object.location
                },
            },
            Change::Delete(object.id),
        ];
        self.assign(variable, Value::Null, &mut state)?;
        Ok(Step {
            changes,
            ..nothing("DestroyInstance", span, state)
        })
    }
}
