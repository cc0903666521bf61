//! Numbers of one joint: origin, axis, limits.

use super::error::UrdfError;
use super::tree::{Joint, child, place, title};
use super::{JointInfo, JointKind};
use roxmltree::Node;

/// Largest coordinate that a robot may have, m; beyond it the file is in other units.
const MAX_LENGTH: f64 = 1e4;

/// The error for an attribute that does not hold what it should.
fn bad(
    node: Node<'_, '_>,
    joint: &Joint<'_>,
    attribute: &str,
    expected: &'static str,
) -> UrdfError {
    let found = node
        .attribute(attribute)
        .unwrap_or("")
        .chars()
        .take(80)
        .collect();
    UrdfError::BadNumber {
        place: place(node),
        element: title(joint.node),
        attribute: format!("{} {attribute}", node.tag_name().name()),
        expected,
        found,
    }
}

/// Three finite numbers of an attribute, or `default` where it is absent.
fn triple(
    node: Node<'_, '_>,
    joint: &Joint<'_>,
    attribute: &str,
    default: [f64; 3],
) -> Result<[f64; 3], UrdfError> {
    let Some(text) = node.attribute(attribute) else {
        return Ok(default);
    };
    let numbers: Vec<f64> = text
        .split_whitespace()
        .map(|word| {
            word.parse()
                .ok()
                .filter(|x: &f64| x.is_finite() && x.abs() <= MAX_LENGTH)
        })
        .collect::<Option<_>>()
        .unwrap_or_default();
    <[f64; 3]>::try_from(numbers).map_err(|_| {
        bad(
            node,
            joint,
            attribute,
            "three finite numbers of at most 10000",
        )
    })
}

/// Position (m) and roll, pitch, yaw (rad) of the joint's origin.
pub(super) fn origin(joint: &Joint<'_>) -> Result<[[f64; 3]; 2], UrdfError> {
    let Some(node) = child(joint.node, "origin") else {
        return Ok([[0.0; 3]; 2]);
    };
    Ok([
        triple(node, joint, "xyz", [0.0; 3])?,
        triple(node, joint, "rpy", [0.0; 3])?,
    ])
}

/// Axis of the joint, not yet of unit length.
pub(super) fn axis(joint: &Joint<'_>) -> Result<[f64; 3], UrdfError> {
    let node = child(joint.node, "axis").unwrap_or(joint.node);
    let [x, y, z] = triple(node, joint, "xyz", [1.0, 0.0, 0.0])?;
    let length = (x * x + y * y + z * z).sqrt();
    if length < 1e-9 {
        return Err(UrdfError::ZeroAxis {
            place: place(node),
            joint: joint.name.to_owned(),
            x,
            y,
            z,
        });
    }
    Ok([x / length, y / length, z / length])
}

/// One number of a `<limit>`: `None` where it is absent.
fn number(node: Node<'_, '_>, joint: &Joint<'_>, name: &str) -> Result<Option<f64>, UrdfError> {
    let Some(text) = node.attribute(name) else {
        return Ok(None);
    };
    match text.trim().parse::<f64>() {
        Ok(value) if !value.is_nan() => Ok(Some(value)),
        _ => Err(bad(node, joint, name, "a number")),
    }
}

/// A bound that must not be negative: `None` where it is absent, zero or infinite.
fn bound(node: Node<'_, '_>, joint: &Joint<'_>, name: &str) -> Result<Option<f64>, UrdfError> {
    match number(node, joint, name)? {
        Some(value) if value < 0.0 => Err(bad(node, joint, name, "zero or a positive number")),
        value => Ok(value.filter(|value| *value > 0.0 && value.is_finite())),
    }
}

/// The data of a joint of the chain; `None` for a fixed joint.
///
/// # Errors
/// [`UrdfError::UnsupportedJoint`] for floating, planar and mimic joints, and
/// whatever is wrong with its limits.
pub(super) fn joint_info(joint: &Joint<'_>) -> Result<Option<JointInfo>, UrdfError> {
    let unsupported = |found: &str| UrdfError::UnsupportedJoint {
        place: place(joint.node),
        joint: joint.name.to_owned(),
        found: found.chars().take(40).collect(),
    };
    let kind = match joint.kind {
        "fixed" => return Ok(None),
        "revolute" => JointKind::Revolute,
        "continuous" => JointKind::Continuous,
        "prismatic" => JointKind::Prismatic,
        other => return Err(unsupported(other)),
    };
    if child(joint.node, "mimic").is_some() {
        return Err(unsupported("a mimic joint"));
    }
    let limit = child(joint.node, "limit");
    let (lower, upper) = match (kind, limit) {
        (JointKind::Continuous, _) => (f64::NEG_INFINITY, f64::INFINITY),
        (_, Some(node)) => range(node, joint)?,
        (_, None) => {
            return Err(UrdfError::Missing {
                place: place(joint.node),
                element: title(joint.node),
                missing: "<limit> element".to_owned(),
            });
        }
    };
    let of = |name: &str| limit.map_or(Ok(None), |node| bound(node, joint, name));
    Ok(Some(JointInfo {
        name: joint.name.to_owned(),
        kind,
        lower,
        upper,
        velocity: of("velocity")?,
        effort: of("effort")?,
        acceleration: of("acceleration")?,
        deceleration: of("deceleration")?,
        jerk: of("jerk")?,
    }))
}

/// Lower and upper limit, rad or m; an absent one is zero, as URDF says.
fn range(node: Node<'_, '_>, joint: &Joint<'_>) -> Result<(f64, f64), UrdfError> {
    let lower = number(node, joint, "lower")?;
    let upper = number(node, joint, "upper")?;
    if lower.is_none() && upper.is_none() {
        return Err(UrdfError::Missing {
            place: place(node),
            element: title(joint.node),
            missing: "limit lower and upper".to_owned(),
        });
    }
    let (lower, upper) = (lower.unwrap_or(0.0), upper.unwrap_or(0.0));
    for (name, value) in [("lower", lower), ("upper", upper)] {
        if !value.is_finite() || value.abs() > MAX_LENGTH {
            return Err(bad(node, joint, name, "a finite number of at most 10000"));
        }
    }
    if lower >= upper {
        let joint = joint.name.to_owned();
        return Err(UrdfError::LimitsReversed {
            place: place(node),
            joint,
            lower,
            upper,
        });
    }
    Ok((lower, upper))
}
