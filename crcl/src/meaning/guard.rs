//! The argument of Guard.

use super::Meaning;
use crate::call::{Node, Tree};
use crate::code;
use crate::command_finding::value_finding;
use crate::finding::Finding;
use crate::guard::{Guard, GuardEnding, GuardLimit, no_choice};
use crate::shape::describe;

/// How it is written.
const FORM: &str = "`{\"sensor\", \"OVER_MAX\", limit}`, perhaps with an ending";

impl Meaning<'_, '_> {
    /// A guard: the sensor, what trips it, the limit, and perhaps what the command is then.
    pub(super) fn guard(&mut self, node: &Node) -> Option<Guard> {
        let Tree::Braces(parts) = &node.value else {
            return self.wrong_type("a guard is a sensor with a limit", FORM, node);
        };
        let (sensor, limit, value, ending) = match parts.as_slice() {
            [sensor, limit, value] => (sensor, limit, value, None),
            [sensor, limit, value, ending] => (sensor, limit, value, Some(ending)),
            _ => return self.no_guard(node),
        };
        let name = self.guard_text("a sensor", sensor);
        let limit = self.guard_choice("a limit", limit, GuardLimit::NAMES);
        let value = self.number("the limit of a guard", value);
        let ending = match ending {
            Some(ending) => self.guard_choice("an ending", ending, GuardEnding::NAMES),
            None => Some(GuardEnding::Done),
        };
        let guard = Guard {
            sensor: name?,
            limit: limit?,
            value: value?,
            ending: ending?,
        };
        if let Err(error) = guard.check() {
            self.findings.push(value_finding(&error, node.span.clone()));
        }
        Some(guard)
    }

    fn guard_text(&mut self, noun: &str, node: &Node) -> Option<String> {
        match &node.value {
            Tree::Text(text) => Some(text.to_string()),
            _ => {
                let message = format!("{noun} is a text in double quotes");
                self.wrong_type(&message, "a text in double quotes", node)
            }
        }
    }

    fn guard_choice<T: Copy>(
        &mut self,
        noun: &str,
        node: &Node,
        names: &[(&'static str, T)],
    ) -> Option<T> {
        let text = self.guard_text(noun, node)?;
        if let Some((_, value)) = names.iter().find(|(name, _)| *name == text) {
            return Some(*value);
        }
        let finding = no_choice(noun, names, node.span.clone());
        self.fail(finding.found(describe(node, self.source)))
    }

    fn no_guard<T>(&mut self, node: &Node) -> Option<T> {
        let message = "a guard is a sensor, what trips it, and a limit";
        let finding = Finding::error(code::GUARD, node.span.clone(), message)
            .expected(FORM)
            .found(describe(node, self.source));
        self.fail(finding)
    }
}
