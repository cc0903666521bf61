//! Reads the fields of JSON values and keeps their place in the source.

use std::borrow::Cow;
use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

/// One field of an object.
pub(crate) struct Field<'a> {
    pub(crate) name: Cow<'a, str>,
    pub(crate) value: &'a RawValue,
}

/// The fields of an object in the order they are written, doubles included; nothing when the
/// value is not an object.
pub(crate) fn fields(raw: &RawValue) -> Option<Vec<Field<'_>>> {
    if !raw.get().starts_with('{') {
        return None;
    }
    serde_json::from_str::<Fields>(raw.get())
        .ok()
        .map(|fields| fields.0)
}

/// The items of a list; nothing when the value is not a list.
pub(crate) fn items(raw: &RawValue) -> Option<Vec<&RawValue>> {
    if !raw.get().starts_with('[') {
        return None;
    }
    serde_json::from_str(raw.get()).ok()
}

struct Fields<'a>(Vec<Field<'a>>);

/// A name, borrowed from the source where it has no escapes.
#[derive(Deserialize)]
struct Name<'a>(#[serde(borrow)] Cow<'a, str>);

impl<'de> Deserialize<'de> for Fields<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(FieldsVisitor)
    }
}

struct FieldsVisitor;

impl<'de> Visitor<'de> for FieldsVisitor {
    type Value = Fields<'de>;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut fields = Vec::new();
        while let Some((Name(name), value)) = map.next_entry::<Name, &RawValue>()? {
            fields.push(Field { name, value });
        }
        Ok(Fields(fields))
    }
}
