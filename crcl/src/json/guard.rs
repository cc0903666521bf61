//! The argument of Guard in JSON.

use serde_json::value::RawValue;

use super::reader::{Reader, describe, find};
use crate::command_finding::value_finding;
use crate::guard::{Guard, GuardEnding, GuardLimit, no_choice};

impl<'a> Reader<'a, '_> {
    /// A guard: the sensor, what trips it, the limit, and perhaps what the command is then.
    pub(super) fn guard(&mut self, raw: &'a RawValue) -> Option<Guard> {
        let noun = "a guard";
        let fields = self.fields(noun, raw)?;
        let known = self.known(noun, &fields, &["sensor", "limit", "value", "ending"]);
        let sensor = self.wanted(noun, raw, &fields, "sensor")?;
        let limit = self.wanted(noun, raw, &fields, "limit")?;
        let value = self.wanted(noun, raw, &fields, "value")?;
        let sensor = self.text("a sensor", sensor)?.into_owned();
        let limit = self.guard_choice("a limit", limit, GuardLimit::NAMES)?;
        let value = self.number("the limit of a guard", value)?;
        let ending = match find(&fields, "ending") {
            Some(ending) => self.guard_choice("an ending", ending, GuardEnding::NAMES)?,
            None => GuardEnding::Done,
        };
        let guard = Guard {
            sensor,
            limit,
            value,
            ending,
        };
        if let Err(error) = guard.check() {
            self.findings.push(value_finding(&error, self.span(raw)));
        }
        Some(guard).filter(|_| known)
    }

    fn guard_choice<T: Copy>(
        &mut self,
        noun: &str,
        raw: &'a RawValue,
        names: &[(&'static str, T)],
    ) -> Option<T> {
        let text = self.text(noun, raw)?;
        if let Some((_, value)) = names.iter().find(|(name, _)| *name == text) {
            return Some(*value);
        }
        let finding = no_choice(noun, names, self.span(raw));
        self.findings.push(finding.found(describe(raw)));
        None
    }
}
