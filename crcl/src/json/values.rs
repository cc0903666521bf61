//! The arguments of commands in JSON.

use std::ops::Range;

use serde_json::value::RawValue;

use super::reader::{Reader, describe, find};
use crate::argument::{ArgumentKind, Value};
use crate::code;
use crate::command_finding::{doubt, unknown_name, value_finding};
use crate::fields::Field;
use crate::finding::Finding;
use crate::joint::JointTarget;
use crate::pose::{Pose, PosePart};
use crate::pose_and_set::PoseAndSet;
use crate::screw::Screw;
use crate::units::{AngleUnit, CoordinateFrame, LengthUnit};
use crate::value::{ValueError, check_targets};

impl<'a> Reader<'a, '_> {
    pub(super) fn value(&mut self, kind: ArgumentKind, raw: &'a RawValue) -> Option<Value> {
        match kind {
            ArgumentKind::Reason | ArgumentKind::Flag => self.integer(kind, raw),
            ArgumentKind::Text => self
                .text(kind.noun(), raw)
                .map(|t| Value::Text(t.into_owned())),
            ArgumentKind::LengthUnit | ArgumentKind::AngleUnit | ArgumentKind::Frame => {
                self.named(kind, raw)
            }
            ArgumentKind::Pose => self.pose(raw).map(Value::Pose),
            ArgumentKind::Poses => self.poses(raw).map(Value::Poses),
            ArgumentKind::Joints => self.joints(raw).map(Value::Joints),
            ArgumentKind::Screw => self.screw(raw).map(Value::Screw),
            ArgumentKind::Waypoints => self.waypoints(raw).map(Value::Waypoints),
            ArgumentKind::Guard => self.guard(raw).map(Value::Guard),
            _ => self.quantity(kind, raw),
        }
    }

    fn quantity(&mut self, kind: ArgumentKind, raw: &RawValue) -> Option<Value> {
        let number = self.number(kind.noun(), raw)?;
        self.in_range(kind, number, raw);
        self.findings.extend(doubt(kind, number, self.span(raw)));
        Some(Value::Number(number))
    }

    fn integer(&mut self, kind: ArgumentKind, raw: &RawValue) -> Option<Value> {
        let number = self.number(kind.noun(), raw)?;
        let Ok(integer) = raw.get().parse::<i64>() else {
            return self.wrong_type(kind.noun(), "a whole number", raw);
        };
        self.in_range(kind, number, raw);
        Some(Value::Integer(integer))
    }

    fn in_range(&mut self, kind: ArgumentKind, number: f64, raw: &RawValue) {
        if let Err(error) = kind.check(number) {
            self.findings.push(value_finding(&error, self.span(raw)));
        }
    }

    fn named(&mut self, kind: ArgumentKind, raw: &'a RawValue) -> Option<Value> {
        let name = self.text(kind.noun(), raw)?;
        let value = match kind {
            ArgumentKind::LengthUnit => LengthUnit::from_name(&name).map(Value::LengthUnit),
            ArgumentKind::AngleUnit => AngleUnit::from_name(&name).map(Value::AngleUnit),
            _ => CoordinateFrame::from_name(&name).map(Value::Frame),
        };
        if value.is_none() {
            self.findings
                .push(unknown_name(kind, &name, self.span(raw)));
        }
        value
    }

    fn joints(&mut self, raw: &'a RawValue) -> Option<Vec<JointTarget>> {
        let items = self.items("the joints", raw)?;
        let read: Vec<_> = items.into_iter().map(|item| self.joint(item)).collect();
        let joints = read.into_iter().collect::<Option<Vec<_>>>()?;
        if let Err(error) = check_targets(&joints) {
            self.findings.push(value_finding(&error, self.span(raw)));
        }
        Some(joints)
    }

    fn joint(&mut self, raw: &'a RawValue) -> Option<JointTarget> {
        const NAMES: [&str; 4] = ["joint", "position", "speed", "acceleration"];
        let noun = "the target of a joint";
        let fields = self.fields(noun, raw)?;
        let known = self.known(noun, &fields, &NAMES);
        let joint = self.wanted(noun, raw, &fields, "joint")?;
        let position = self.wanted(noun, raw, &fields, "position")?;
        let numbers = [
            Some(joint),
            Some(position),
            find(&fields, "speed"),
            find(&fields, "acceleration"),
        ]
        .map(|field| {
            field.map_or(Some(0.0), |field| {
                self.number("a part of a joint's target", field)
            })
        });
        let numbers = numbers.into_iter().collect::<Option<Vec<_>>>()?;
        let target = JointTarget::from_numbers(&numbers);
        if target.is_none() {
            let message = "a joint is a whole number from 1 to 16";
            let finding = Finding::error(code::JOINTS, self.span(joint), message);
            self.findings.push(finding.found(describe(joint)));
        }
        target.filter(|_| known)
    }

    fn waypoints(&mut self, raw: &'a RawValue) -> Option<Vec<PoseAndSet>> {
        let items = self.items("the poses", raw)?;
        if items.is_empty() {
            self.findings
                .push(value_finding(&ValueError::NoPoses, self.span(raw)));
            return None;
        }
        let read: Vec<_> = items.into_iter().map(|item| self.waypoint(item)).collect();
        read.into_iter().collect()
    }

    fn waypoint(&mut self, raw: &'a RawValue) -> Option<PoseAndSet> {
        let noun = "a pose with settings";
        let fields = self.fields(noun, raw)?;
        let names: Vec<_> = ["pose"].into_iter().chain(PoseAndSet::NAMES).collect();
        let known = self.known(noun, &fields, &names);
        let pose = self.wanted(noun, raw, &fields, "pose")?;
        let mut waypoint = PoseAndSet::from(self.pose(pose)?);
        for name in PoseAndSet::NAMES {
            if let Some(field) = find(&fields, name) {
                let number = self.number("a setting of a pose", field)?;
                if let Some(place) = waypoint.value_mut(name) {
                    *place = Some(number);
                }
            }
        }
        if let Err(error) = waypoint.check_settings() {
            self.findings.push(value_finding(&error, self.span(raw)));
        }
        Some(waypoint).filter(|_| known)
    }

    fn screw(&mut self, raw: &'a RawValue) -> Option<Screw> {
        const NAMES: [&str; 5] = ["advance", "turn", "free", "axis_point", "start"];
        let noun = "a screw";
        let fields = self.fields(noun, raw)?;
        let known = self.known(noun, &fields, &NAMES);
        let advance = self.wanted(noun, raw, &fields, "advance")?;
        let turn = self.wanted(noun, raw, &fields, "turn")?;
        let mut number = |field| self.number("a part of a screw", field);
        let (advance, turn) = (number(advance)?, number(turn)?);
        let free = find(&fields, "free").map_or(Some(0.0), number)?;
        let axis_point = match find(&fields, "axis_point") {
            Some(_) => Some(self.vector(raw, &fields, "axis_point")?),
            None => None,
        };
        let start = match find(&fields, "start") {
            Some(pose) => Some(self.pose(pose)?),
            None => None,
        };
        let screw = Screw {
            advance,
            turn,
            free,
            axis_point,
            start,
        };
        let alone = Screw {
            start: None,
            ..screw
        };
        if let Err(error) = alone.check() {
            self.findings.push(value_finding(&error, self.span(raw)));
        }
        Some(screw).filter(|_| known)
    }

    fn poses(&mut self, raw: &'a RawValue) -> Option<Vec<Pose>> {
        let items = self.items("the poses", raw)?;
        if items.is_empty() {
            self.findings
                .push(value_finding(&ValueError::NoPoses, self.span(raw)));
            return None;
        }
        let mut poses = Vec::with_capacity(items.len());
        for &item in &items {
            poses.extend(self.pose(item));
        }
        (poses.len() == items.len()).then_some(poses)
    }

    fn pose(&mut self, raw: &'a RawValue) -> Option<Pose> {
        const NAMES: [&str; 6] = ["point", "z_axis", "x_axis", "roll", "pitch", "yaw"];
        let fields = self.fields("a pose", raw)?;
        let angles = NAMES[3..].iter().any(|name| find(&fields, name).is_some());
        let axes = NAMES[1..3].iter().any(|name| find(&fields, name).is_some());
        let known = self.known("a pose", &fields, &NAMES);
        if angles && axes {
            let message = "a pose has axes or angles, not both";
            let finding = Finding::error(code::POSE_SHAPE, self.opening(raw), message);
            let help = "keep `z_axis` and `x_axis`, or `roll`, `pitch` and `yaw`";
            self.findings.push(finding.help(help));
            return None;
        }
        let pose = if angles {
            self.angles_pose(raw, &fields)
        } else {
            self.axes_pose(raw, &fields)
        };
        let pose = pose?;
        for (part, error) in pose.faults() {
            let span = self.part(raw, &fields, part);
            self.findings.push(value_finding(&error, span));
        }
        known.then_some(pose)
    }

    fn axes_pose(&mut self, raw: &'a RawValue, fields: &[Field<'a>]) -> Option<Pose> {
        let point = self.vector(raw, fields, "point");
        let z_axis = self.vector(raw, fields, "z_axis");
        let x_axis = self.vector(raw, fields, "x_axis");
        Some(Pose::Axes {
            point: point?,
            z_axis: z_axis?,
            x_axis: x_axis?,
        })
    }

    fn angles_pose(&mut self, raw: &'a RawValue, fields: &[Field<'a>]) -> Option<Pose> {
        let point = self.vector(raw, fields, "point");
        let [roll, pitch, yaw] = ["roll", "pitch", "yaw"].map(|name| {
            let angle = self.wanted("a pose", raw, fields, name)?;
            self.number("an angle", angle)
        });
        Some(Pose::RollPitchYaw {
            point: point?,
            roll: roll?,
            pitch: pitch?,
            yaw: yaw?,
        })
    }

    /// Where a part of a pose stands.
    fn part(&self, raw: &RawValue, fields: &[Field<'a>], part: PosePart) -> Range<usize> {
        let name = match part {
            PosePart::Point => "point",
            PosePart::ZAxis => "z_axis",
            PosePart::XAxis => "x_axis",
            PosePart::Axes | PosePart::Angles => return self.span(raw),
        };
        find(fields, name).map_or_else(|| self.span(raw), |value| self.span(value))
    }

    fn vector(
        &mut self,
        pose: &'a RawValue,
        fields: &[Field<'a>],
        name: &'static str,
    ) -> Option<[f64; 3]> {
        let raw = self.wanted("a pose", pose, fields, name)?;
        let items = self.items(name, raw)?;
        let &[x, y, z] = items.as_slice() else {
            let message = format!("`{name}` has three numbers");
            let finding = Finding::error(code::POSE_SHAPE, self.span(raw), message);
            let found = format!("a list of {}", items.len());
            self.findings
                .push(finding.expected("`[x, y, z]`").found(found));
            return None;
        };
        let numbers = [x, y, z].map(|item| self.number("a part of a pose", item));
        Some([numbers[0]?, numbers[1]?, numbers[2]?])
    }
}
