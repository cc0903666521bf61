//! Types of values, and what each name of a plan means.

use std::collections::BTreeMap;

use super::ast::Plan;
use crate::world::Class;

/// The type of a variable or expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    /// A number; whole and from the smallest value on, where given.
    Number {
        /// Only whole numbers.
        whole: bool,
        /// The smallest value.
        least: Option<i64>,
    },
    /// true or false.
    Truth,
    /// A text or an id.
    Text,
    /// A pose relative to an object.
    Pose,
    /// An object of this class.
    Object(Class),
    /// A list of objects of this class.
    List(Class),
    /// A description from the library, or other data that is not an object.
    Data,
    /// Null.
    Null,
    /// Not known before the plan runs.
    Unknown,
}

/// Any number.
pub(crate) const NUMBER: Type = Type::Number {
    whole: false,
    least: None,
};

impl Type {
    /// The type of this name.
    #[must_use]
    pub(crate) fn from_name(name: &str) -> Option<Self> {
        let whole = |least| Some(Self::Number { whole: true, least });
        match name {
            "positiveInteger" => whole(Some(1)),
            "nonNegativeInteger" => whole(Some(0)),
            "integer" | "int" | "long" => whole(None),
            "decimal" | "double" | "float" => Some(NUMBER),
            "boolean" => Some(Self::Truth),
            "string" | "NMTOKEN" | "token" => Some(Self::Text),
            "Pose" => Some(Self::Pose),
            "Point" | "RollPitchYaw" | "StockKeepingUnit" | "KitDesign" | "PartRefAndPose" => {
                Some(Self::Data)
            }
            _ => name.parse().ok().map(Self::Object),
        }
    }

    /// Whether a value of type `value` may be assigned to a variable of this type.
    #[must_use]
    pub(crate) fn accepts(self, value: Self) -> bool {
        match (self, value) {
            (_, Self::Unknown) | (Self::Unknown, _) => true,
            (Self::Object(_) | Self::Pose | Self::Data | Self::Text, Self::Null) => true,
            (Self::Number { .. }, Self::Number { .. }) => true,
            (Self::Object(wanted), Self::Object(given)) => given.is_a(wanted) || wanted.is_a(given),
            (wanted, given) => wanted == given,
        }
    }

    /// For messages.
    #[must_use]
    pub(crate) fn describe(self) -> String {
        match self {
            Self::Number {
                least: Some(least), ..
            } => format!("a whole number from {least} on"),
            Self::Number { whole: true, .. } => "a whole number".into(),
            Self::Number { .. } => "a number".into(),
            Self::Truth => "true or false".into(),
            Self::Text => "a text".into(),
            Self::Pose => "a Pose".into(),
            Self::Object(class) => format!("a {class}"),
            Self::List(class) => format!("a list of {class}"),
            Self::Data => "a description".into(),
            Self::Null => "Null".into(),
            Self::Unknown => "something".into(),
        }
    }
}

/// What kind of name it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    /// A parameter: cannot be assigned.
    Parameter,
    /// An internal variable.
    Variable,
}

/// The names that a plan declares.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scope {
    names: BTreeMap<String, (Role, Type)>,
    folded: BTreeMap<String, String>,
}

impl Scope {
    /// The names of this plan; of two equal names the first counts.
    #[must_use]
    pub(crate) fn new(plan: &Plan) -> Self {
        let mut scope = Self::default();
        let parameters = plan
            .parameters
            .iter()
            .map(|p| (Role::Parameter, &p.name, &p.class));
        let variables = plan
            .variables
            .iter()
            .map(|v| (Role::Variable, &v.name, &v.class));
        for (role, name, class) in parameters.chain(variables) {
            let kind = Type::from_name(class).unwrap_or(Type::Unknown);
            scope.names.entry(name.clone()).or_insert((role, kind));
            scope
                .folded
                .entry(name.to_lowercase())
                .or_insert_with(|| name.clone());
        }
        scope
    }

    /// The declared name for `name`: the same, or the same except for capitals.
    #[must_use]
    pub(crate) fn declared(&self, name: &str) -> Option<&str> {
        let exact = self
            .names
            .get_key_value(name)
            .map(|(known, _)| known.as_str());
        exact.or_else(|| self.folded.get(&name.to_lowercase()).map(String::as_str))
    }

    /// Role and type of a name.
    #[must_use]
    pub(crate) fn lookup(&self, name: &str) -> Option<(Role, Type)> {
        self.declared(name)
            .and_then(|name| self.names.get(name))
            .copied()
    }

    /// All declared names.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.names.keys().map(String::as_str)
    }
}
