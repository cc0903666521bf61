//! The argument of MoveScrew.

use super::Meaning;
use crate::call::{Node, Tree};
use crate::code;
use crate::command_finding::value_finding;
use crate::finding::Finding;
use crate::screw::Screw;
use crate::shape::{Shape, describe, shape};

/// How it is written.
const FORM: &str =
    "`{{advance, turn, way before}, {x, y, z}, {pose}}`; the last three may be left out";

impl Meaning<'_, '_> {
    /// A screw: its numbers, then perhaps a point of the axis, then perhaps a pose to begin at.
    pub(super) fn screw(&mut self, node: &Node) -> Option<Screw> {
        let message = "a screw is an advance and a turn";
        let Tree::Braces(parts) = &node.value else {
            return self.wrong_type(message, FORM, node);
        };
        let (numbers, others) = match parts.split_first() {
            Some((numbers, others)) if others.len() <= 2 => (numbers, others),
            _ => return self.no_screw(node),
        };
        let mut screw = self.screw_numbers(numbers)?;
        for other in others {
            let taken = match shape(other, self.source) {
                Shape::Vector => screw
                    .axis_point
                    .replace(self.vector("a point", other)?)
                    .is_some(),
                Shape::Pose => screw.start.replace(self.pose(other)?).is_some(),
                _ => true,
            };
            if taken {
                return self.no_screw(other);
            }
        }
        if let Err(error) = screw.check() {
            // Faults of the pose were reported at its parts.
            let alone = Screw {
                start: None,
                ..screw
            };
            if alone.check().is_err() {
                self.findings.push(value_finding(&error, node.span.clone()));
            }
        }
        Some(screw)
    }

    fn screw_numbers(&mut self, node: &Node) -> Option<Screw> {
        let Tree::Braces(parts) = &node.value else {
            return self.no_screw(node);
        };
        let read: Vec<_> = parts
            .iter()
            .map(|part| self.number("a part of a screw", part))
            .collect();
        match read.into_iter().collect::<Option<Vec<_>>>()?.as_slice() {
            &[advance, turn, ref rest @ ..] if rest.len() <= 1 => Some(Screw {
                advance,
                turn,
                free: rest.first().copied().unwrap_or(0.0),
                ..Screw::default()
            }),
            _ => self.no_screw(node),
        }
    }

    fn no_screw<T>(&mut self, node: &Node) -> Option<T> {
        let message = "a screw is an advance and a turn, and what comes before them";
        let finding = Finding::error(code::SCREW, node.span.clone(), message)
            .expected(FORM)
            .found(describe(node, self.source));
        self.fail(finding)
    }
}
