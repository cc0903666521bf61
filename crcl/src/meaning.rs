//! Turns the calls of a text into commands: names, numbers of arguments, types, ranges.

mod guard;
mod screw;
mod waypoints;

use std::ops::Range;

use crate::argument::{Argument, ArgumentKind, Value};
use crate::call::{Call, Node, State, Tree};
use crate::code;
use crate::command::Command;
use crate::command_finding::{
    doubt, refused_extension, unknown_command, unknown_name, value_finding,
};
use crate::command_info::CommandInfo;
use crate::finding::{Finding, Findings};
use crate::joint::JointTarget;
use crate::lexer::clip;
use crate::pose::{Pose, PosePart};
use crate::shape::{Shape, arguments, describe, shape};
use crate::units::{AngleUnit, CoordinateFrame, LengthUnit};
use crate::value::{ValueError, check_targets};

/// Reads meaning into calls of one source.
pub(crate) struct Meaning<'a, 'f> {
    pub(crate) source: &'a str,
    pub(crate) strict: bool,
    pub(crate) findings: &'f mut Findings,
}

impl Meaning<'_, '_> {
    /// The command that a call stands for; nothing when the call is at fault.
    pub(crate) fn command(&mut self, call: &Call) -> Option<Command> {
        if call.state == State::Broken {
            return None;
        }
        let name = self.text(&call.name);
        let Some(info) = CommandInfo::find(name) else {
            self.findings.push(unknown_command(name, call.name.clone()));
            return None;
        };
        let allowed = self.allowed(info, &call.name);
        let value = self.argument(info, call)?;
        let whole = allowed && call.state == State::Sound;
        info.build(value).filter(|_| whole)
    }

    fn text(&self, span: &Range<usize>) -> &str {
        self.source.get(span.clone()).unwrap_or_default()
    }

    fn fail<T>(&mut self, finding: Finding) -> Option<T> {
        self.findings.push(finding);
        None
    }

    /// Reports an extension in strict mode.
    fn allowed(&mut self, info: &CommandInfo, span: &Range<usize>) -> bool {
        let Some(finding) = refused_extension(info, span.clone()).filter(|_| self.strict) else {
            return true;
        };
        self.findings.push(finding);
        false
    }

    fn argument(&mut self, info: &CommandInfo, call: &Call) -> Option<Value> {
        let arguments = call.arguments.as_slice();
        match (info.argument, arguments) {
            (None, []) => Some(Value::None),
            (
                Some(Argument {
                    kind: ArgumentKind::Poses,
                    ..
                }),
                [list, number],
            ) => self.counted_poses(list, number),
            (Some(Argument { kind, .. }), [node]) if kind != ArgumentKind::Poses => {
                self.value(kind, node)
            }
            _ => self.wrong_count(info, call),
        }
    }

    fn wrong_count(&mut self, info: &CommandInfo, call: &Call) -> Option<Value> {
        let takes = match info.argument.map(|argument| argument.kind) {
            None => "no argument".to_owned(),
            Some(ArgumentKind::Poses) => "a list of poses and their number".to_owned(),
            Some(kind) => kind.noun().to_owned(),
        };
        let wanted = match info.argument.map(|argument| argument.kind) {
            None => 0,
            Some(ArgumentKind::Poses) => 2,
            Some(_) => 1,
        };
        let given = call.arguments.len();
        let span = match (call.arguments.get(wanted), call.arguments.last()) {
            (Some(surplus), Some(last)) => surplus.span.start..last.span.end,
            _ => call.span.end.saturating_sub(1)..call.span.end,
        };
        let message = format!("{} takes {takes}", info.name);
        let finding = Finding::error(code::ARGUMENT_COUNT, span, message)
            .expected(arguments(wanted))
            .found(arguments(given))
            .help(self.count_help(info, &call.arguments));
        self.fail(finding)
    }

    fn count_help(&self, info: &CommandInfo, given: &[Node]) -> String {
        let kind = info.argument.map(|argument| argument.kind);
        match (kind, given) {
            (Some(ArgumentKind::Poses), [list]) => match shape(list, self.source) {
                Shape::Poses(count) => format!("write `, {count}` after the list"),
                Shape::Pose => "one pose alone is `({pose}, 1)`; or use MoveStraightTo".to_owned(),
                _ => format!("write `{}`", info.sample()),
            },
            (Some(ArgumentKind::Pose), [list, _])
                if matches!(shape(list, self.source), Shape::Poses(_)) =>
            {
                "MoveSmoothlyTo goes through a list of poses".to_owned()
            }
            (Some(ArgumentKind::Pose), [point, ..])
                if matches!(shape(point, self.source), Shape::Vector) =>
            {
                format!("put braces round the whole pose: `{}`", info.sample())
            }
            _ => format!("write `{}`", info.sample()),
        }
    }

    fn value(&mut self, kind: ArgumentKind, node: &Node) -> Option<Value> {
        match kind {
            ArgumentKind::Reason | ArgumentKind::Flag => self.integer(kind, node),
            ArgumentKind::Text => self
                .quoted(kind, node)
                .map(|text| Value::Text(text.to_owned())),
            ArgumentKind::LengthUnit => self.length_unit(node),
            ArgumentKind::AngleUnit => self.angle_unit(node),
            ArgumentKind::Frame => self.frame(node),
            ArgumentKind::Pose => self.pose(node).map(Value::Pose),
            ArgumentKind::Poses => self.poses(node).map(Value::Poses),
            ArgumentKind::Joints => self.joints(node).map(Value::Joints),
            ArgumentKind::Screw => self.screw(node).map(Value::Screw),
            ArgumentKind::Waypoints => self.waypoints(node).map(Value::Waypoints),
            ArgumentKind::Guard => self.guard(node).map(Value::Guard),
            _ => self.quantity(kind, node),
        }
    }

    fn quantity(&mut self, kind: ArgumentKind, node: &Node) -> Option<Value> {
        let number = self.number(kind.noun(), node)?;
        if let Err(error) = kind.check(number) {
            self.findings.push(value_finding(&error, node.span.clone()));
        }
        self.findings.extend(doubt(kind, number, node.span.clone()));
        Some(Value::Number(number))
    }

    fn integer(&mut self, kind: ArgumentKind, node: &Node) -> Option<Value> {
        let number = self.number(kind.noun(), node)?;
        let written = self.text(&node.span).trim_start_matches('+');
        let Ok(integer) = written.parse::<i64>() else {
            let finding = Finding::error(
                code::ARGUMENT_TYPE,
                node.span.clone(),
                format!("{} is a whole number", kind.noun()),
            );
            let found = format!("`{}`", clip(written));
            return self.fail(finding.expected("a whole number such as `0`").found(found));
        };
        if let Err(error) = kind.check(number) {
            self.findings.push(value_finding(&error, node.span.clone()));
        }
        Some(Value::Integer(integer))
    }

    fn number(&mut self, noun: &str, node: &Node) -> Option<f64> {
        match node.value {
            Tree::Number { number, .. } => Some(number),
            _ => self.wrong_type(&format!("{noun} is a number"), "a number", node),
        }
    }

    fn quoted<'n>(&mut self, kind: ArgumentKind, node: &'n Node) -> Option<&'n str> {
        match &node.value {
            Tree::Text(text) => Some(text),
            _ => {
                let message = format!("{} is a text in double quotes", kind.noun());
                self.wrong_type(&message, "a text in double quotes", node)
            }
        }
    }

    /// Reports a value of the wrong type, unless it was reported already.
    fn wrong_type<T>(&mut self, message: &str, expected: &str, node: &Node) -> Option<T> {
        if matches!(node.value, Tree::Faulty) {
            return None;
        }
        let finding = Finding::error(code::ARGUMENT_TYPE, node.span.clone(), message)
            .expected(expected)
            .found(describe(node, self.source));
        let word = self.text(&node.span);
        let finding = match node.value {
            Tree::Word if expected.contains("quotes") => {
                finding.help(format!("write `\"{}\"`", clip(word)))
            }
            Tree::Text(_) if expected == "a number" => finding.help("leave out the quotes"),
            _ => finding,
        };
        self.fail(finding)
    }

    fn length_unit(&mut self, node: &Node) -> Option<Value> {
        let name = self.quoted(ArgumentKind::LengthUnit, node)?;
        match LengthUnit::from_name(name) {
            Some(unit) => Some(Value::LengthUnit(unit)),
            None => self.fail(unknown_name(
                ArgumentKind::LengthUnit,
                name,
                node.span.clone(),
            )),
        }
    }

    fn angle_unit(&mut self, node: &Node) -> Option<Value> {
        let name = self.quoted(ArgumentKind::AngleUnit, node)?;
        match AngleUnit::from_name(name) {
            Some(unit) => Some(Value::AngleUnit(unit)),
            None => self.fail(unknown_name(
                ArgumentKind::AngleUnit,
                name,
                node.span.clone(),
            )),
        }
    }

    fn frame(&mut self, node: &Node) -> Option<Value> {
        let name = self.quoted(ArgumentKind::Frame, node)?;
        match CoordinateFrame::from_name(name) {
            Some(frame) => Some(Value::Frame(frame)),
            None => self.fail(unknown_name(ArgumentKind::Frame, name, node.span.clone())),
        }
    }

    fn counted_poses(&mut self, list: &Node, number: &Node) -> Option<Value> {
        let poses = self.poses(list);
        let stated = self.number("the number of poses", number);
        let Tree::Braces(items) = &list.value else {
            return None;
        };
        let (stated, given) = (stated?, items.len());
        if stated != given as f64 || !matches!(number.value, Tree::Number { whole: true, .. }) {
            let written = self.text(&number.span);
            let message = format!(
                "the list has {given} pose{}, but its number says {written}",
                if given == 1 { "" } else { "s" }
            );
            let finding = Finding::error(code::COUNT_MISMATCH, number.span.clone(), message)
                .expected(format!("`{given}`"))
                .found(format!("`{written}`"))
                .help(format!(
                    "write `{given}`, or look for a missing or surplus pose"
                ))
                .note(
                    list.span.clone(),
                    format!("{given} pose{}", if given == 1 { "" } else { "s" }),
                );
            return self.fail(finding);
        }
        poses.map(Value::Poses)
    }

    fn joints(&mut self, node: &Node) -> Option<Vec<JointTarget>> {
        let Tree::Braces(items) = &node.value else {
            let message = "the joints stand in braces";
            return self.wrong_type(message, ArgumentKind::Joints.noun(), node);
        };
        let read: Vec<_> = items.iter().map(|item| self.joint(item)).collect();
        let joints = read.into_iter().collect::<Option<Vec<_>>>()?;
        if let Err(error) = check_targets(&joints) {
            self.findings.push(value_finding(&error, node.span.clone()));
        }
        Some(joints)
    }

    fn joint(&mut self, node: &Node) -> Option<JointTarget> {
        let expected = "`{joint, position, speed, acceleration}`";
        let message =
            "a joint is its number and its position, and perhaps a speed and an acceleration";
        let Tree::Braces(parts) = &node.value else {
            return self.wrong_type(message, expected, node);
        };
        let read: Vec<_> = parts
            .iter()
            .map(|part| self.number("a part of a joint's target", part))
            .collect();
        let numbers = read.into_iter().collect::<Option<Vec<_>>>()?;
        let target = JointTarget::from_numbers(&numbers);
        if target.is_none() {
            let finding = Finding::error(code::JOINTS, node.span.clone(), message)
                .expected(expected)
                .found(describe(node, self.source));
            return self.fail(finding.help("joints are counted from 1 to 16"));
        }
        target
    }

    fn poses(&mut self, node: &Node) -> Option<Vec<Pose>> {
        let Tree::Braces(items) = &node.value else {
            return self.wrong_type("the poses stand in braces", "a list of poses", node);
        };
        if items.is_empty() {
            return self.fail(value_finding(&ValueError::NoPoses, node.span.clone()));
        }
        if shape(node, self.source) == Shape::Pose {
            let finding = Finding::error(
                code::ARGUMENT_TYPE,
                node.span.clone(),
                "a list of poses needs braces of its own",
            );
            let help = "put the pose in braces: `({{{x, y, z}, {z axis}, {x axis}}}, 1)`";
            return self.fail(
                finding
                    .expected("a list of poses")
                    .found("one pose")
                    .help(help),
            );
        }
        let mut poses = Vec::with_capacity(items.len());
        for item in items {
            poses.extend(self.pose(item));
        }
        (poses.len() == items.len()).then_some(poses)
    }

    fn pose(&mut self, node: &Node) -> Option<Pose> {
        match (&node.value, shape(node, self.source)) {
            (Tree::Braces(parts), Shape::Vector) if parts.len() == 3 => {
                let help = "a pose also needs its axes: `{{x, y, z}, {0, 0, -1}, {1, 0, 0}}`";
                self.misshapen("a pose has a point, a Z axis and an X axis", node, help)
            }
            (Tree::Braces(_), Shape::Poses(count)) => {
                let help = "MoveSmoothlyTo goes through a list of poses";
                let found = format!("a list of {count} poses");
                let finding =
                    Finding::error(code::ARGUMENT_TYPE, node.span.clone(), "one pose only");
                self.fail(finding.expected("a pose").found(found).help(help))
            }
            (Tree::Braces(parts), _) => self.axes_pose(node, parts),
            (Tree::Call { name, arguments }, _) => self.angles_pose(node, name, arguments),
            _ => {
                let message = "a pose is a point and two axes";
                let expected = "a pose such as `{{400, 0, 300}, {0, 0, -1}, {1, 0, 0}}`";
                self.wrong_type(message, expected, node)
            }
        }
    }

    /// A pose written `{{x, y, z}, {z axis}, {x axis}}`.
    fn axes_pose(&mut self, node: &Node, parts: &[Node]) -> Option<Pose> {
        let [point, z_axis, x_axis] = parts else {
            let help = "a pose is `{{x, y, z}, {z axis}, {x axis}}`";
            return self.misshapen("a pose has a point, a Z axis and an X axis", node, help);
        };
        let point_read = self.vector("a point", point);
        let z_read = self.vector("a Z axis", z_axis);
        let x_read = self.vector("an X axis", x_axis);
        let pose = Pose::Axes {
            point: point_read?,
            z_axis: z_read?,
            x_axis: x_read?,
        };
        self.judge(&pose, |part| match part {
            PosePart::Point | PosePart::Angles => point.span.clone(),
            PosePart::ZAxis => z_axis.span.clone(),
            PosePart::XAxis => x_axis.span.clone(),
            PosePart::Axes => z_axis.span.start..x_axis.span.end,
        });
        Some(pose)
    }

    /// A pose written `Pose(Point(x, y, z), RollPitchYaw(roll, pitch, yaw))`.
    fn angles_pose(&mut self, node: &Node, name: &Range<usize>, parts: &[Node]) -> Option<Pose> {
        let help = "write `Pose(Point(x, y, z), RollPitchYaw(roll, pitch, yaw))`";
        if self.text(name) != "Pose" {
            return self.wrong_type("a pose is a point and an orientation", "a pose", node);
        }
        let [point, angles] = parts else {
            return self.misshapen("Pose has a Point and a RollPitchYaw", node, help);
        };
        let point_read = self.called("Point", point);
        let angles_read = self.called("RollPitchYaw", angles);
        let (point_read, [roll, pitch, yaw]) = (point_read?, angles_read?);
        let pose = Pose::RollPitchYaw {
            point: point_read,
            roll,
            pitch,
            yaw,
        };
        self.judge(&pose, |part| match part {
            PosePart::Point => point.span.clone(),
            _ => angles.span.clone(),
        });
        Some(pose)
    }

    fn judge(&mut self, pose: &Pose, place: impl Fn(PosePart) -> Range<usize>) {
        for (part, error) in pose.faults() {
            self.findings.push(value_finding(&error, place(part)));
        }
    }

    fn called(&mut self, wanted: &str, node: &Node) -> Option<[f64; 3]> {
        match &node.value {
            Tree::Call { name, arguments } if self.text(name) == wanted => {
                self.three(wanted, node, arguments)
            }
            _ => {
                let expected = format!("`{wanted}(...)`");
                self.wrong_type(&format!("here should be a {wanted}"), &expected, node)
            }
        }
    }

    fn vector(&mut self, noun: &str, node: &Node) -> Option<[f64; 3]> {
        match &node.value {
            Tree::Braces(parts) => self.three(noun, node, parts),
            _ => self.wrong_type(
                &format!("{noun} is three numbers in braces"),
                "`{x, y, z}`",
                node,
            ),
        }
    }

    fn three(&mut self, noun: &str, node: &Node, parts: &[Node]) -> Option<[f64; 3]> {
        let [a, b, c] = parts else {
            let message = format!("{noun} has three numbers");
            return self.misshapen(&message, node, "write one number each for x, y and z");
        };
        let component = "a part of a pose";
        let numbers = [a, b, c].map(|part| self.number(component, part));
        Some([numbers[0]?, numbers[1]?, numbers[2]?])
    }

    fn misshapen<T>(&mut self, message: &str, node: &Node, help: &str) -> Option<T> {
        let finding = Finding::error(code::POSE_SHAPE, node.span.clone(), message);
        let found = describe(node, self.source);
        self.fail(finding.found(found).help(help))
    }
}
