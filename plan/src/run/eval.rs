//! Values of expressions.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3};

use super::value::{PoseValue, Value};
use crate::PlanError;
use crate::kitting::ast::{Expression, Keyword, Operator, Plan, Requirement, Term};
use crate::kitting::types::Scope;
use crate::world::class::derived_property;
use crate::world::{Class, Location, Model, Object, ObjectId, Scalar, from_roll_pitch_yaw};

/// What an expression can refer to.
#[derive(Clone, Copy)]
pub(crate) struct Context<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) scope: &'a Scope,
    pub(crate) model: &'a Model,
    pub(crate) bindings: &'a BTreeMap<String, Value>,
    /// Implied subject of a condition.
    pub(crate) subject: Option<ObjectId>,
}

type Result<T> = std::result::Result<T, PlanError>;

fn fail<T>(message: String) -> Result<T> {
    Err(PlanError::Value(message))
}

impl Context<'_> {
    /// The value of an expression.
    pub(crate) fn value(&self, expression: &Expression) -> Result<Value> {
        match &expression.term {
            Term::Number(number) => Ok(Value::Number(*number)),
            Term::Text(text) => Ok(Value::Text(text.clone())),
            Term::Null => Ok(Value::Null),
            Term::Truth(truth) => Ok(Value::Truth(*truth)),
            Term::Keyword(keyword) => self.keyword(*keyword).map(Value::Object),
            Term::Name(name) => self.name(name),
            Term::Property(object, property) => {
                let value = self.value(object)?;
                self.property(&value, property)
            }
            Term::Call(function, arguments) => self.call(function, arguments),
            Term::Unary(Operator::Not, operand) => Ok(Value::Truth(!self.truth(operand)?)),
            Term::Unary(_, operand) => Ok(Value::Number(-self.number(operand)?)),
            Term::Binary(operator, left, right) => self.binary(*operator, left, right),
        }
    }

    /// The object that a key word stands for.
    pub(crate) fn keyword(&self, keyword: Keyword) -> Result<ObjectId> {
        match keyword {
            Keyword::Robot => Ok(self.model.robot()?.id),
            Keyword::Workstation => Ok(self.model.workstation()?.id),
            Keyword::Table => self
                .model
                .first_of(Class::WorkTable)
                .map(|table| table.id)
                .ok_or_else(|| PlanError::Missing("table".into())),
            _ => fail(format!("{} has no value", keyword.name())),
        }
    }

    fn name(&self, name: &str) -> Result<Value> {
        if let Some(subject) = self.subject
            && let Ok(value) = self.property(&Value::Object(subject), name)
        {
            return Ok(value);
        }
        if let Some(declared) = self.scope.declared(name) {
            return Ok(self.bindings.get(declared).cloned().unwrap_or_default());
        }
        if name == "Robot" {
            return Ok(Value::Object(self.model.robot()?.id));
        }
        fail(format!("nothing is called {name}"))
    }

    pub(crate) fn truth(&self, expression: &Expression) -> Result<bool> {
        match self.value(expression)? {
            Value::Truth(truth) => Ok(truth),
            other => fail(format!(
                "expected true or false, got {}",
                other.describe(self.model)
            )),
        }
    }

    pub(crate) fn number(&self, expression: &Expression) -> Result<f64> {
        match self.value(expression)? {
            Value::Number(number) => Ok(number),
            other => fail(format!(
                "expected a number, got {}",
                other.describe(self.model)
            )),
        }
    }

    pub(crate) fn object(&self, expression: &Expression) -> Result<ObjectId> {
        match self.value(expression)? {
            Value::Object(id) => self.model.object(id).map(|object| object.id),
            other => fail(format!(
                "expected an object, got {}",
                other.describe(self.model)
            )),
        }
    }

    pub(crate) fn pose(&self, expression: &Expression) -> Result<PoseValue> {
        match self.value(expression)? {
            Value::Pose(pose) => Ok(pose),
            other => fail(format!(
                "expected a Pose, got {}",
                other.describe(self.model)
            )),
        }
    }

    /// `workstation_from_place` of a pose value (m).
    pub(crate) fn in_workstation(&self, value: &PoseValue) -> Result<Isometry3<f64>> {
        if !value.known {
            let object = self.model.object(value.reference)?.name.clone();
            let why = "it only says in or on that object".into();
            return Err(PlanError::Chain { object, why });
        }
        Ok(self.model.workstation_from(value.reference)? * value.pose)
    }

    fn binary(&self, operator: Operator, left: &Expression, right: &Expression) -> Result<Value> {
        Ok(match operator {
            Operator::And => Value::Truth(self.truth(left)? && self.truth(right)?),
            Operator::Or => Value::Truth(self.truth(left)? || self.truth(right)?),
            Operator::Equal => Value::Truth(self.equal(&self.value(left)?, &self.value(right)?)),
            Operator::Unequal => Value::Truth(!self.equal(&self.value(left)?, &self.value(right)?)),
            _ => {
                let (a, b) = (self.number(left)?, self.number(right)?);
                match operator {
                    Operator::Less => Value::Truth(a < b),
                    Operator::Greater => Value::Truth(a > b),
                    Operator::AtMost => Value::Truth(a <= b),
                    Operator::AtLeast => Value::Truth(a >= b),
                    Operator::Plus => Value::Number(a + b),
                    Operator::Minus => Value::Number(a - b),
                    Operator::Times => Value::Number(a * b),
                    Operator::Over | Operator::Modulo if b == 0.0 => {
                        return fail(format!("{a} divided by zero"));
                    }
                    Operator::Over => Value::Number(a / b),
                    _ => Value::Number(a % b),
                }
            }
        })
    }

    /// Equality; an object equals a text that is its id or name.
    fn equal(&self, one: &Value, other: &Value) -> bool {
        match (one, other) {
            (Value::Object(id), Value::Text(text)) | (Value::Text(text), Value::Object(id)) => self
                .model
                .object(*id)
                .is_ok_and(|object| object.is_called(text)),
            (Value::Sku(id), Value::Text(text)) | (Value::Text(text), Value::Sku(id)) => id == text,
            (one, other) => one == other,
        }
    }

    /// A property of a value.
    pub(crate) fn property(&self, value: &Value, property: &str) -> Result<Value> {
        let missing = || {
            let whose = value.describe(self.model);
            PlanError::Value(format!("{whose} has no property {property}"))
        };
        match value {
            Value::Object(id) => {
                let object = self.model.object(*id)?;
                self.object_property(object, property).ok_or_else(missing)
            }
            Value::Pose(pose) => {
                let t = &pose.pose.translation;
                let (roll, pitch, yaw) = pose.pose.rotation.euler_angles();
                match property {
                    "hasPhysicalLocation_RefObject" => Ok(Value::Object(pose.reference)),
                    "hasPose_Point" if pose.known => Ok(Value::Triple([t.x, t.y, t.z])),
                    "hasPose_Rpy" if pose.known => Ok(Value::Triple([roll, pitch, yaw])),
                    _ => Err(missing()),
                }
            }
            Value::Triple(values) => self.component(values, property).ok_or_else(missing),
            Value::Sku(id) => {
                let sku = self.model.sku(id).ok_or_else(missing)?;
                match property {
                    "hasSku_Id" => Ok(Value::Text(sku.id.clone())),
                    "hasSku_Description" => Ok(Value::Text(sku.description.clone())),
                    "hasSku_Weight" => Ok(sku.weight.map_or(Value::Null, Value::Number)),
                    _ => Err(missing()),
                }
            }
            _ => Err(missing()),
        }
    }

    /// A coordinate or angle, in the units of the workstation.
    fn component(&self, values: &[f64; 3], property: &str) -> Option<Value> {
        let (metres, radians) = (self.model.units.metres()?, self.model.units.radians()?);
        Some(Value::Number(match property {
            "hasPoint_X" => values[0] / metres,
            "hasPoint_Y" => values[1] / metres,
            "hasPoint_Z" => values[2] / metres,
            "hasRpy_Roll" => values[0] / radians,
            "hasRpy_Pitch" => values[1] / radians,
            "hasRpy_Yaw" => values[2] / radians,
            _ => return None,
        }))
    }

    fn object_property(&self, object: &Object, property: &str) -> Option<Value> {
        if property == "hasSolidObject_PhysicalLocation" {
            let Location {
                reference,
                relation,
                pose,
            } = object.location;
            return Some(Value::Pose(PoseValue {
                reference,
                pose,
                known: relation.has_pose(),
            }));
        }
        if let Some((class, many)) = derived_property(object.class, property) {
            let mut found = self
                .model
                .children(object.id)
                .filter(|c| c.class.is_a(class));
            return Some(if many {
                Value::List(found.map(|child| child.id).collect())
            } else {
                found
                    .next()
                    .map_or(Value::Null, |child| Value::Object(child.id))
            });
        }
        if object.class == Class::KittingWorkstation {
            let units = &self.model.units;
            match property {
                "hasWorkstation_LengthUnit" => return Some(Value::Text(units.length.clone())),
                "hasWorkstation_AngleUnit" => return Some(Value::Text(units.angle.clone())),
                "hasWorkstation_WeightUnit" => return Some(Value::Text(units.weight.clone())),
                _ => {}
            }
        }
        let kind = crate::world::class::stored_property(object.class, property)?;
        let is_length = kind == crate::world::class::Kind::Length;
        Some(match object.properties.get(property) {
            None => Value::Null,
            Some(Scalar::Truth(truth)) => Value::Truth(*truth),
            Some(Scalar::Number(number)) if is_length => {
                Value::Number(number / self.model.units.metres()?)
            }
            Some(Scalar::Number(number)) => Value::Number(*number),
            Some(Scalar::Text(text)) => Value::Text(text.clone()),
        })
    }

    fn call(&self, function: &str, arguments: &[Expression]) -> Result<Value> {
        match (function, arguments) {
            ("Contains", [container, sku, levels]) => {
                let levels = self.number(levels)?.clamp(0.0, 32.0) as u32;
                let count = self
                    .model
                    .count(self.object(container)?, self.sku(sku)?, levels);
                Ok(Value::Number(count as f64))
            }
            ("GetFirst", [list]) => Ok(self
                .list(list)?
                .first()
                .map_or(Value::Null, |id| Value::Object(*id))),
            ("GetTop", [list]) => self.top(&self.list(list)?),
            ("GetPartPose", [tray, sku, index]) => {
                self.part_pose(self.object(tray)?, self.sku(sku)?, self.number(index)?)
            }
            ("GetFreePose", [container, object]) => {
                self.free_pose(self.object(container)?, self.object(object)?)
            }
            ("Point", [x, y, z]) => {
                let metres = self.unit(self.model.units.metres())?;
                let point = [self.number(x)?, self.number(y)?, self.number(z)?];
                Ok(Value::Triple(point.map(|c| c * metres)))
            }
            ("RollPitchYaw", [roll, pitch, yaw]) => {
                let radians = self.unit(self.model.units.radians())?;
                let angles = [self.number(roll)?, self.number(pitch)?, self.number(yaw)?];
                Ok(Value::Triple(angles.map(|a| a * radians)))
            }
            ("Pose", [point, angles, reference]) => {
                match (self.value(point)?, self.value(angles)?) {
                    (Value::Triple(point), Value::Triple([roll, pitch, yaw])) => {
                        let rotation = from_roll_pitch_yaw(roll, pitch, yaw);
                        let pose = Isometry3::from_parts(Translation3::from(point), rotation);
                        let reference = self.object(reference)?;
                        Ok(Value::Pose(PoseValue {
                            reference,
                            pose,
                            known: true,
                        }))
                    }
                    _ => fail("a Pose is made of a Point and RollPitchYaw".into()),
                }
            }
            _ => fail(format!(
                "no function {function} with {} arguments",
                arguments.len()
            )),
        }
    }

    fn unit(&self, factor: Option<f64>) -> Result<f64> {
        factor.ok_or_else(|| PlanError::Value("the world has an unknown unit".into()))
    }

    fn list(&self, expression: &Expression) -> Result<Vec<ObjectId>> {
        match self.value(expression)? {
            Value::List(list) => Ok(list),
            other => fail(format!(
                "expected a list, got {}",
                other.describe(self.model)
            )),
        }
    }

    fn sku<'e>(&self, expression: &'e Expression) -> Result<&'e str> {
        match &expression.term {
            Term::Name(id) | Term::Text(id) => Ok(id),
            _ => fail("expected the id of a stock keeping unit".into()),
        }
    }

    /// The object with the greatest height in the frame of the workstation; the first of equals.
    fn top(&self, list: &[ObjectId]) -> Result<Value> {
        let mut best: Option<(f64, ObjectId)> = None;
        for id in list {
            let height = self.model.workstation_from(*id)?.translation.z;
            if best.is_none_or(|(most, _)| height > most) {
                best = Some((height, *id));
            }
        }
        Ok(best.map_or(Value::Null, |(_, id)| Value::Object(id)))
    }

    /// The pose of part number `index` (from 1) of a unit in the design of the plan's kit,
    /// relative to the tray.
    fn part_pose(&self, tray: ObjectId, sku: &str, index: f64) -> Result<Value> {
        let id = self.plan.about("TargetSKU");
        let design = self.model.design(id);
        let design = design.ok_or_else(|| PlanError::Missing(format!("kit design {id}")))?;
        let tray = self.model.object(tray)?;
        if tray.sku() != Some(design.tray_sku.as_str()) {
            let found = tray.sku().unwrap_or("nothing known");
            let wanted = &design.tray_sku;
            return fail(format!(
                "{} is a {found}, the design {id} needs a {wanted}",
                tray.name
            ));
        }
        let mut parts = design.parts.iter().filter(|part| part.sku == sku);
        let count = parts.clone().count();
        if index < 1.0 || index.fract() != 0.0 || index > count as f64 {
            return fail(format!(
                "the design {id} has {count} {sku}, number {index} was asked for"
            ));
        }
        match parts.nth(index as usize - 1) {
            Some(part) => Ok(Value::Pose(PoseValue {
                reference: tray.id,
                pose: part.pose,
                known: true,
            })),
            None => fail(format!("the design {id} has no {sku} number {index}")),
        }
    }

    /// The lowest pose above the middle of a container at which an object touches nothing in it.
    fn free_pose(&self, container: ObjectId, object: ObjectId) -> Result<Value> {
        let place = self.model.workstation_from(container)?;
        let height = self.model.free_height(container, &place, object)?;
        let pose = Isometry3::translation(0.0, 0.0, height - place.translation.z);
        Ok(Value::Pose(PoseValue {
            reference: container,
            pose,
            known: true,
        }))
    }
}

/// Whether an object of the world meets a requirement at `place`.
///
/// The class, the stock keeping unit, the contents (the given number of the given kind, and nothing
/// of another kind), the place, and all conditions must fit.
pub(crate) fn matches(
    world: &Model,
    plan: &Plan,
    requirement: &Requirement,
    object: &Object,
    place: Keyword,
) -> bool {
    let Ok(class) = requirement.class.parse::<Class>() else {
        return false;
    };
    if !object.class.is_a(class)
        || requirement
            .sku
            .as_deref()
            .is_some_and(|sku| object.sku() != Some(sku))
    {
        return false;
    }
    let tables = [requirement.location, Some(place)].contains(&Some(Keyword::Table));
    let on_table =
        |table: &Object| table.class == Class::WorkTable && world.is_within(object.id, table.id);
    if tables && !world.objects().any(on_table) {
        return false;
    }
    if let Some(contents) = &requirement.contents_type {
        let movable = |child: &&Object| {
            matches!(
                child.class,
                Class::KitTray | Class::KitInstance | Class::Part
            )
        };
        let others = world
            .children(object.id)
            .filter(movable)
            .any(|c| c.sku() != Some(contents.as_str()));
        let count = world.count(object.id, contents, 1) as u64;
        if others
            || requirement
                .contents_quantity
                .is_some_and(|wanted| wanted != count)
        {
            return false;
        }
    }
    let (scope, bindings) = (Scope::default(), BTreeMap::new());
    let subject = Some(object.id);
    let context = Context {
        plan,
        scope: &scope,
        model: world,
        bindings: &bindings,
        subject,
    };
    requirement
        .conditions
        .iter()
        .all(|condition| context.truth(condition).unwrap_or(false))
}
