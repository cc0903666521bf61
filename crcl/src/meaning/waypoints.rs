//! The argument of MoveThroughWaypoints.

use super::Meaning;
use crate::call::{Node, Tree};
use crate::code;
use crate::command_finding::value_finding;
use crate::finding::Finding;
use crate::lexer::clip;
use crate::pose_and_set::PoseAndSet;
use crate::shape::describe;
use crate::suggest;
use crate::value::ValueError;

/// How one is written.
const FORM: &str = "`{pose, {\"speed\", 50}, {\"tolerance\", 2}}`";

impl Meaning<'_, '_> {
    /// A list of poses, each followed by its settings.
    pub(super) fn waypoints(&mut self, node: &Node) -> Option<Vec<PoseAndSet>> {
        let Tree::Braces(items) = &node.value else {
            return self.wrong_type("the poses stand in braces", FORM, node);
        };
        if items.is_empty() {
            return self.fail(value_finding(&ValueError::NoPoses, node.span.clone()));
        }
        let read: Vec<_> = items.iter().map(|item| self.waypoint(item)).collect();
        read.into_iter().collect()
    }

    fn waypoint(&mut self, node: &Node) -> Option<PoseAndSet> {
        let parts = match &node.value {
            Tree::Braces(parts) => parts.as_slice(),
            _ => &[],
        };
        let Some((pose, settings)) = parts.split_first() else {
            let message = "a pose and its settings stand in braces";
            return self.wrong_type(message, FORM, node);
        };
        let mut waypoint = PoseAndSet::from(self.pose(pose)?);
        for setting in settings {
            self.setting(setting, &mut waypoint)?;
        }
        if let Err(error) = waypoint.check_settings() {
            self.findings.push(value_finding(&error, node.span.clone()));
        }
        Some(waypoint)
    }

    /// A name and a number in braces.
    fn setting(&mut self, node: &Node, waypoint: &mut PoseAndSet) -> Option<()> {
        let (name, value) = match &node.value {
            Tree::Braces(parts) => match parts.as_slice() {
                [name, value] => (name, value),
                _ => return self.no_setting(node),
            },
            _ => return self.no_setting(node),
        };
        let Tree::Text(word) = &name.value else {
            return self.no_setting(node);
        };
        let number = self.number("a setting of a pose", value)?;
        let Some(place) = waypoint.value_mut(word) else {
            let message = format!("a pose has no setting \"{}\"", clip(word));
            let finding = Finding::error(code::POSE_SETTING, name.span.clone(), message);
            return self.fail(match suggest::nearest(word, &PoseAndSet::NAMES) {
                Some(near) => finding.help(format!("did you mean \"{near}\"?")),
                None => finding.help(format!("the settings are {}", PoseAndSet::NAMES.join(", "))),
            });
        };
        if place.replace(number).is_some() {
            let message = format!("the setting \"{}\" comes twice", clip(word));
            let finding = Finding::error(code::POSE_SETTING, name.span.clone(), message);
            return self.fail(finding.help("keep one of them"));
        }
        Some(())
    }

    fn no_setting<T>(&mut self, node: &Node) -> Option<T> {
        let message = "a setting of a pose is a name and a number in braces";
        let finding = Finding::error(code::POSE_SETTING, node.span.clone(), message)
            .expected("`{\"speed\", 50}`")
            .found(describe(node, self.source));
        self.fail(finding)
    }
}
