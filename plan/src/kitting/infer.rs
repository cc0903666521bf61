//! Types of expressions, with findings about type errors.

use super::ast::{Expression, Keyword, Operator, Term};
use super::check::Checker;
use super::types::{NUMBER, Type};
use crate::world::Class;
use crate::world::class::{Kind, derived_property, stored_property};

/// The functions: name and number of arguments.
pub(crate) const FUNCTIONS: [(&str, usize); 8] = [
    ("Contains", 3),
    ("GetTop", 1),
    ("GetFirst", 1),
    ("GetPartPose", 3),
    ("GetFreePose", 2),
    ("Pose", 3),
    ("Point", 3),
    ("RollPitchYaw", 3),
];

/// Properties of poses, points, units and designs: name and type.
pub(crate) const DATA_PROPERTIES: [(&str, Type); 24] = [
    (
        "hasPhysicalLocation_RefObject",
        Type::Object(Class::SolidObject),
    ),
    ("hasPose_Point", Type::Data),
    ("hasPose_Rpy", Type::Data),
    ("hasPoint_X", NUMBER),
    ("hasPoint_Y", NUMBER),
    ("hasPoint_Z", NUMBER),
    ("hasRpy_Roll", NUMBER),
    ("hasRpy_Pitch", NUMBER),
    ("hasRpy_Yaw", NUMBER),
    ("hasSku_Id", Type::Text),
    ("hasSku_Description", Type::Text),
    ("hasSku_Weight", NUMBER),
    ("hasSku_Shape", Type::Data),
    ("hasSku_EndEffectorRefs", Type::Data),
    ("hasKitDesign_Id", Type::Text),
    ("hasDesign_KitTraySkuRef", Type::Text),
    ("hasDesign_PartPoses", Type::Data),
    ("hasPartRefAndPose_Ref", Type::Text),
    ("hasPartRefAndPose_Point", Type::Data),
    ("hasPartRefAndPose_Rpy", Type::Data),
    ("hasWorkstation_LengthUnit", Type::Text),
    ("hasWorkstation_AngleUnit", Type::Text),
    ("hasWorkstation_WeightUnit", Type::Text),
    ("hasWorkstation_SkuLibrary", Type::Data),
];

/// The type of a property of an object of this class.
pub(crate) fn property_type(class: Class, property: &str) -> Option<Type> {
    if property == "hasSolidObject_PhysicalLocation" {
        return Some(Type::Pose);
    }
    if let Some((value, many)) = derived_property(class, property) {
        return Some(if many {
            Type::List(value)
        } else {
            Type::Object(value)
        });
    }
    if let Some(kind) = stored_property(class, property) {
        return Some(match kind {
            Kind::Text => Type::Text,
            Kind::Truth => Type::Truth,
            _ => NUMBER,
        });
    }
    let workstation = class == Class::KittingWorkstation && property.starts_with("hasWorkstation_");
    let data = DATA_PROPERTIES.iter().find(|(known, _)| *known == property);
    data.filter(|_| workstation).map(|(_, kind)| *kind)
}

impl Checker<'_> {
    /// Type of an expression; `subject` is the class of the implied subject of a condition.
    pub(super) fn infer(&mut self, expression: &Expression, subject: Option<Class>) -> Type {
        match &expression.term {
            Term::Number(number) => Type::Number {
                whole: number.fract() == 0.0,
                least: None,
            },
            Term::Text(_) => Type::Text,
            Term::Null => Type::Null,
            Term::Truth(_) => Type::Truth,
            Term::Keyword(Keyword::Robot) => Type::Object(Class::Robot),
            Term::Keyword(Keyword::Table) => Type::Object(Class::WorkTable),
            Term::Keyword(Keyword::Workstation) => Type::Object(Class::KittingWorkstation),
            Term::Keyword(keyword) => {
                let message = format!("{} has no value", keyword.name());
                self.error("plan::type", message, expression.span);
                Type::Unknown
            }
            Term::Name(name) => self.infer_name(name, expression, subject),
            Term::Property(object, property) => {
                self.infer_property(object, property, expression, subject)
            }
            Term::Call(function, arguments) => {
                self.infer_call(function, arguments, expression, subject)
            }
            Term::Unary(operator, operand) => {
                let wanted = if *operator == Operator::Not {
                    Type::Truth
                } else {
                    NUMBER
                };
                self.expect(operand, wanted, subject);
                wanted
            }
            Term::Binary(operator, left, right) => {
                self.infer_binary(*operator, left, right, subject)
            }
        }
    }

    fn infer_name(&mut self, name: &str, at: &Expression, subject: Option<Class>) -> Type {
        if let Some(kind) = subject.and_then(|class| property_type(class, name)) {
            return kind;
        }
        if let Some((_, kind)) = self.known(name, at.span) {
            return kind;
        }
        if name == "Robot" {
            return Type::Object(Class::Robot);
        }
        self.unknown_name(name, at.span);
        Type::Unknown
    }

    fn infer_property(
        &mut self,
        object: &Expression,
        property: &str,
        at: &Expression,
        subject: Option<Class>,
    ) -> Type {
        let of = self.infer(object, subject);
        let found = match of {
            Type::Object(class) => property_type(class, property)
                // A variable of a general class may hold an object of a special one.
                .or_else(|| below(class).find_map(|class| property_type(class, property))),
            Type::Pose | Type::Data => DATA_PROPERTIES
                .iter()
                .find(|(known, _)| *known == property)
                .map(|(_, kind)| *kind),
            Type::Unknown => return Type::Unknown,
            _ => None,
        };
        if found.is_none() {
            let message = format!("{} has no property {property}", of.describe());
            self.error("plan::property", message, at.span);
        }
        found.unwrap_or(Type::Unknown)
    }

    fn infer_call(
        &mut self,
        function: &str,
        arguments: &[Expression],
        at: &Expression,
        subject: Option<Class>,
    ) -> Type {
        let Some((_, count)) = FUNCTIONS.iter().find(|(known, _)| *known == function) else {
            self.error(
                "plan::unknown_function",
                format!("unknown function {function}"),
                at.span,
            );
            return Type::Unknown;
        };
        if arguments.len() != *count {
            let message = format!(
                "{function} takes {count} argument(s), found {}",
                arguments.len()
            );
            self.error("plan::arguments", message, at.span);
            return Type::Unknown;
        }
        match (function, arguments) {
            ("Contains", [container, sku, levels]) => {
                self.expect(container, Type::Object(Class::SolidObject), subject);
                self.sku_argument(sku);
                self.expect(levels, NUMBER, subject);
                Type::Number {
                    whole: true,
                    least: Some(0),
                }
            }
            ("GetTop" | "GetFirst", [list]) => match self.infer(list, subject) {
                Type::List(class) => Type::Object(class),
                Type::Unknown => Type::Unknown,
                other => {
                    let message = format!("{function} takes a list, found {}", other.describe());
                    self.error("plan::type", message, list.span);
                    Type::Unknown
                }
            },
            ("GetPartPose", [tray, sku, index]) => {
                self.expect(tray, Type::Object(Class::KitTray), subject);
                self.sku_argument(sku);
                self.expect(index, NUMBER, subject);
                Type::Pose
            }
            ("GetFreePose", [container, object]) => {
                self.expect(container, Type::Object(Class::SolidObject), subject);
                self.expect(object, Type::Object(Class::SolidObject), subject);
                Type::Pose
            }
            ("Pose", [point, rpy, reference]) => {
                self.expect(point, Type::Data, subject);
                self.expect(rpy, Type::Data, subject);
                self.expect(reference, Type::Object(Class::SolidObject), subject);
                Type::Pose
            }
            (_, numbers) => {
                numbers
                    .iter()
                    .for_each(|number| self.expect(number, NUMBER, subject));
                Type::Data
            }
        }
    }

    /// The id of a stock keeping unit or design: a bare name here is never a variable.
    fn sku_argument(&mut self, argument: &Expression) {
        let id = match &argument.term {
            Term::Name(id) => {
                if self.scope.declared(id) == Some(id.as_str()) {
                    let message = format!("{id} is read as a stock keeping unit, not the variable");
                    self.warning("plan::sku_or_variable", message, argument.span);
                }
                id
            }
            Term::Text(id) => id,
            _ => {
                let message = "expected the id of a stock keeping unit".to_owned();
                self.error("plan::type", message, argument.span);
                return;
            }
        };
        self.check_sku(id, argument.span);
    }

    fn infer_binary(
        &mut self,
        operator: Operator,
        left: &Expression,
        right: &Expression,
        subject: Option<Class>,
    ) -> Type {
        match operator {
            Operator::And | Operator::Or => {
                self.expect(left, Type::Truth, subject);
                self.expect(right, Type::Truth, subject);
                Type::Truth
            }
            Operator::Equal | Operator::Unequal => {
                self.infer_equality(left, right, subject);
                Type::Truth
            }
            Operator::Less | Operator::Greater | Operator::AtMost | Operator::AtLeast => {
                self.expect(left, NUMBER, subject);
                self.expect(right, NUMBER, subject);
                Type::Truth
            }
            _ => {
                let left = self.typed(left, NUMBER, subject);
                let right = self.typed(right, NUMBER, subject);
                let whole = |kind| matches!(kind, Type::Number { whole: true, .. });
                let whole = whole(left) && whole(right) && operator != Operator::Over;
                Type::Number { whole, least: None }
            }
        }
    }

    fn infer_equality(&mut self, left: &Expression, right: &Expression, subject: Option<Class>) {
        let (one, other) = (self.infer(left, subject), self.infer(right, subject));
        match (one, other) {
            (Type::Object(_), Type::Text) | (Type::Text, Type::Object(_)) => {
                let message = "an object is compared with a text; its id is meant";
                self.warning(
                    "plan::object_and_text",
                    message.into(),
                    left.span.to(right.span),
                );
            }
            (one, other) if one.accepts(other) || other.accepts(one) => {
                self.lint_capacity(left, right);
            }
            (one, other) => {
                let message = format!("{} is never equal to {}", one.describe(), other.describe());
                self.error("plan::type", message, left.span.to(right.span));
            }
        }
    }

    /// A number of things in a box compared with a number other than 0: there is a property for it.
    fn lint_capacity(&mut self, left: &Expression, right: &Expression) {
        if let (Term::Call(function, _), Term::Number(number)) = (&left.term, &right.term)
            && function == "Contains"
            && *number > 0.0
        {
            let message = format!("the number {number} stands for a capacity");
            let help = "compare with the container's hasLargeContainer_Capacity";
            self.note("plan::capacity", message, help, left.span.to(right.span));
        }
    }
}

fn below(class: Class) -> impl Iterator<Item = Class> {
    crate::world::class::CLASSES
        .into_iter()
        .map(|(c, _)| c)
        .filter(move |c| c.is_a(class))
}
