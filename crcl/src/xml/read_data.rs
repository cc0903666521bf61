//! Reads the data that commands and status documents share.

use roxmltree::Node;

use super::data::{
    Guard, JointTolerance, Parameter, PoseSettings, PoseTolerance, Quantity, Waypoint,
};
use super::elements::{Reader, opening, value_span};
use crate::code;
use crate::command_finding::value_finding;
use crate::finding::Finding;
use crate::guard::GuardLimit;
use crate::pose::{Pose, PosePart};

/// How far the axes of a pose in XML may be from perpendicular: the product of the unit axes.
///
/// Clients write six digits, so that axes that were perpendicular are so to 1e-6 only.
///
/// # Source
/// NIST's CRCL library (crcl4java) refuses axes beyond this.
const ORTHOGONALITY: f64 = 1e-3;

impl Reader<'_> {
    /// The X, Y, Z of a point.
    pub(super) fn point(&mut self, node: Node) -> Option<[f64; 3]> {
        self.three(node, ["X", "Y", "Z"])
    }

    /// The I, J, K of a direction.
    pub(super) fn vector(&mut self, node: Node) -> Option<[f64; 3]> {
        self.three(node, ["I", "J", "K"])
    }

    fn three(&mut self, node: Node, names: [&str; 3]) -> Option<[f64; 3]> {
        let (_, mut children) = self.children(node);
        let found = names.map(|name| {
            let child = children.wanted(self, name)?;
            self.number(child)
        });
        children.end(self)?;
        Some([found[0]?, found[1]?, found[2]?])
    }

    /// A pose, with the settings of a `PoseAndSet`.
    pub(super) fn waypoint(&mut self, node: Node) -> Option<Waypoint> {
        let (_, mut children) = self.children(node);
        let point_node = children.wanted(self, "Point")?;
        let x_node = children.wanted(self, "XAxis")?;
        let z_node = children.wanted(self, "ZAxis")?;
        let point = self.point(point_node);
        let (x_axis, z_axis) = (self.vector(x_node), self.vector(z_node));
        let settings = if self.is_kind(node, "PoseAndSet") {
            let coordinated = children.wanted(self, "Coordinated")?;
            let coordinated = self.boolean(coordinated);
            let mut quantity = |name: &str| -> Option<Option<Quantity>> {
                match children.maybe(name) {
                    Some(child) => self.quantity(child, name).map(Some),
                    None => Some(None),
                }
            };
            let trans_speed = quantity("TransSpeed");
            let rot_speed = quantity("RotSpeed");
            let trans_accel = quantity("TransAccel");
            let rot_accel = quantity("RotAccel");
            let tolerance = match children.maybe("Tolerance") {
                Some(child) => self.pose_tolerance(child).map(Some),
                None => Some(None),
            };
            Some(PoseSettings {
                coordinated: coordinated?,
                trans_speed: trans_speed?,
                rot_speed: rot_speed?,
                trans_accel: trans_accel?,
                rot_accel: rot_accel?,
                tolerance: tolerance?,
            })
        } else {
            None
        };
        children.end(self)?;
        let pose = Pose::Axes {
            point: point?,
            z_axis: z_axis?,
            x_axis: x_axis?,
        };
        let pose = straightened(pose);
        for (part, error) in pose.faults() {
            let span = match part {
                PosePart::Point | PosePart::Angles => opening(point_node),
                PosePart::XAxis => opening(x_node),
                PosePart::ZAxis => opening(z_node),
                PosePart::Axes => x_node.range().start..z_node.range().end,
            };
            self.findings.push(value_finding(&error, span));
        }
        Some(Waypoint { pose, settings })
    }

    /// A speed or an acceleration; `name` begins the names of its kinds.
    pub(super) fn quantity(&mut self, node: Node, name: &str) -> Option<Quantity> {
        let kind = self.kind(node)?;
        let (_, mut children) = self.children(node);
        let found = match kind.strip_prefix(name) {
            Some("Absolute") => {
                let child = children.wanted(self, "Setting")?;
                self.not_negative(child).map(Quantity::Absolute)
            }
            Some("Relative") => {
                let child = children.wanted(self, "Fraction")?;
                self.fraction(child).map(Quantity::Relative)
            }
            _ => {
                let expected = format!("`{name}AbsoluteType` or `{name}RelativeType`");
                let message = format!("`{name}` is no `{kind}Type`");
                let finding = Finding::error(code::XML_KIND, opening(node), message);
                self.findings
                    .push(finding.expected(expected).found(format!("`{kind}Type`")));
                return None;
            }
        };
        children.end(self)?;
        found
    }

    /// A number that must not be below zero.
    pub(super) fn not_negative(&mut self, node: Node) -> Option<f64> {
        let number = self.number(node)?;
        if number < 0.0 {
            let message = format!(
                "`{}` must not be negative, got {number}",
                node.tag_name().name()
            );
            let finding = Finding::error(code::NEGATIVE, value_span(node), message);
            self.findings.push(finding.help("write zero or more"));
        }
        Some(number)
    }

    /// A number from 0 to 1.
    pub(super) fn fraction(&mut self, node: Node) -> Option<f64> {
        let number = self.number(node)?;
        if !(0.0..=1.0).contains(&number) {
            let message = format!("`{}` must be 0 to 1, got {number}", node.tag_name().name());
            let finding = Finding::error(code::FRACTION_RANGE, value_span(node), message);
            self.findings
                .push(finding.help("1 is all that the robot can do, 0.5 is half of it"));
        }
        Some(number)
    }

    /// How near a pose must be reached.
    pub(super) fn pose_tolerance(&mut self, node: Node) -> Option<PoseTolerance> {
        let (_, mut children) = self.children(node);
        let mut side = |name: &str| -> Option<Option<f64>> {
            match children.maybe(name) {
                Some(child) => self.not_negative(child).map(Some),
                None => Some(None),
            }
        };
        let (x, y, z) = (
            side("XPointTolerance"),
            side("YPointTolerance"),
            side("ZPointTolerance"),
        );
        let (x_axis, z_axis) = (side("XAxisTolerance"), side("ZAxisTolerance"));
        children.end(self)?;
        Some(PoseTolerance {
            x: x?,
            y: y?,
            z: z?,
            x_axis: x_axis?,
            z_axis: z_axis?,
        })
    }

    /// How near joints must come; one `Setting` for each.
    pub(super) fn joint_tolerances(&mut self, node: Node) -> Option<Vec<JointTolerance>> {
        let (_, mut children) = self.children(node);
        let settings = children.some(self, "Setting", 1)?;
        children.end(self)?;
        let read: Vec<_> = settings
            .into_iter()
            .map(|setting| {
                let (_, mut children) = self.children(setting);
                let joint = children.wanted(self, "JointNumber")?;
                let tolerance = children.wanted(self, "JointPositionTolerance")?;
                children.end(self)?;
                Some(JointTolerance {
                    joint: self.count(joint)?,
                    tolerance: self.not_negative(tolerance)?,
                })
            })
            .collect();
        read.into_iter().collect()
    }

    /// A list of names with values.
    pub(super) fn parameters(&mut self, nodes: Vec<Node>) -> Option<Vec<Parameter>> {
        let read: Vec<_> = nodes
            .into_iter()
            .map(|node| {
                let (_, mut children) = self.children(node);
                let name = children.wanted(self, "ParameterName")?;
                let value = children.wanted(self, "ParameterValue")?;
                children.end(self)?;
                Some(Parameter {
                    name: self.token(name)?,
                    value: self.token(value)?,
                })
            })
            .collect();
        read.into_iter().collect()
    }

    /// A condition on a sensor.
    pub(super) fn guard(&mut self, node: Node) -> Option<Guard> {
        let (name, mut children) = self.children(node);
        let sensor = children.wanted(self, "SensorID")?;
        let sensor = self.token(sensor);
        let field = children.maybe("SubField").map(|child| self.token(child));
        let kind = children.wanted(self, "LimitType")?;
        let kind = self.choice(kind, GuardLimit::NAMES);
        let limit = children.wanted(self, "LimitValue")?;
        let limit = self.number(limit);
        let mut integer =
            |name: &str| -> Option<_> { children.maybe(name).map(|child| self.integer(child)) };
        let recheck = integer("RecheckTimeMicroSeconds");
        let count = integer("CheckCount");
        let time = integer("LastCheckTime");
        let value = children
            .maybe("LastCheckValue")
            .map(|child| self.number(child));
        let mut boolean =
            |name: &str| -> Option<_> { children.maybe(name).map(|child| self.boolean(child)) };
        let (require, error) = (boolean("RequireTrigger"), boolean("ErrorOnTrigger"));
        children.end(self)?;
        Some(Guard {
            name,
            sensor: sensor?,
            field: whole(field)?,
            kind: kind?,
            limit: limit?,
            recheck_us: whole(recheck)?,
            check_count: whole(count)?,
            last_check_ms: whole(time)?,
            last_check_value: whole(value)?,
            require_trigger: whole(require)?,
            error_on_trigger: whole(error)?,
        })
    }
}

/// Nothing where a value is there and cannot be read.
pub(super) fn whole<T>(read: Option<Option<T>>) -> Option<Option<T>> {
    match read {
        None => Some(None),
        Some(Some(value)) => Some(Some(value)),
        Some(None) => None,
    }
}

/// A pose whose axes are a little off is given an X axis that is perpendicular to its Z axis; one
/// that is perpendicular enough for every reader stays as it is written.
fn straightened(pose: Pose) -> Pose {
    let Pose::Axes {
        point,
        z_axis,
        x_axis,
    } = pose
    else {
        return pose;
    };
    let only_axes = |(part, _): &(PosePart, _)| *part == PosePart::Axes;
    let faults = pose.faults();
    let product = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (zz, xx) = (product(&z_axis, &z_axis), product(&x_axis, &x_axis));
    let off = product(&x_axis, &z_axis) / (zz * xx).sqrt();
    if faults.len() != 1
        || !faults.iter().all(only_axes)
        || off.is_nan()
        || off.abs() > ORTHOGONALITY
    {
        return pose;
    }
    let along = product(&x_axis, &z_axis) / zz;
    let x_axis = [0, 1, 2].map(|i| x_axis[i] - along * z_axis[i]);
    Pose::Axes {
        point,
        z_axis,
        x_axis,
    }
}
