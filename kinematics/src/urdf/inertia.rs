//! Masses and inertias of the links that move with each joint.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use roxmltree::Node;

use super::limit;
use super::tree::{Joint, Tree, child};
use crate::inertia::Inertia;

/// One finite number of an attribute.
fn number(node: Node<'_, '_>, attribute: &str) -> Option<f64> {
    let value: f64 = node.attribute(attribute)?.trim().parse().ok()?;
    value.is_finite().then_some(value)
}

/// Three finite numbers of an attribute; zeros where it is absent.
fn triple(node: Node<'_, '_>, attribute: &str) -> Option<[f64; 3]> {
    let Some(text) = node.attribute(attribute) else {
        return Some([0.0; 3]);
    };
    let numbers = text.split_whitespace().map(|word| word.parse().ok());
    let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
    let numbers = <[f64; 3]>::try_from(numbers).ok()?;
    numbers.iter().all(|x| x.is_finite()).then_some(numbers)
}

fn isometry([x, y, z]: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}

/// The inertia of a link in its own frame: none if the file gives none, or one that no body has.
fn of_link(link: Node<'_, '_>) -> Option<Inertia> {
    let inertial = child(link, "inertial")?;
    let mass = number(child(inertial, "mass")?, "value")?;
    let moment = match child(inertial, "inertia") {
        None => Matrix3::zeros(),
        Some(node) => {
            let of = |name: &str| number(node, name);
            let (xx, xy, xz) = (of("ixx")?, of("ixy")?, of("ixz")?);
            let (yy, yz, zz) = (of("iyy")?, of("iyz")?, of("izz")?);
            Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        }
    };
    let sound = mass >= 0.0 && moment.symmetric_eigenvalues().min() >= -1e-9 * moment.amax();
    let own = match child(inertial, "origin") {
        Some(origin) => isometry(triple(origin, "xyz")?, triple(origin, "rpy")?),
        None => Isometry3::identity(),
    };
    let body = Inertia {
        mass,
        centre: Vector3::zeros(),
        moment,
    };
    sound.then(|| body.in_frame(&own))
}

/// The bodies that move with each movable joint of `way` (links named by `movable`), in the frame of
/// the joint: its link, and everything behind it that is not behind the next movable joint. None for
/// a joint whose own link has no inertia.
pub(super) fn bodies(tree: &Tree<'_>, movable: &[&str]) -> Vec<Option<Inertia>> {
    let gather = |link: &&str| {
        let mut sum = of_link(tree.link(link)?)?;
        let mut open = behind(tree, movable, link, &Isometry3::identity())?;
        while let Some((name, joint_from_link)) = open.pop() {
            if let Some(own) = tree.link(name).and_then(of_link) {
                sum = sum.with(&own.in_frame(&joint_from_link));
            }
            open.extend(behind(tree, movable, name, &joint_from_link)?);
        }
        Some(sum)
    };
    movable.iter().map(gather).collect()
}

/// The links that joints fix to a link, but for the `movable` ones, and where.
fn behind<'a>(
    tree: &Tree<'a>,
    movable: &[&str],
    link: &str,
    joint_from_link: &Isometry3<f64>,
) -> Option<Vec<(&'a str, Isometry3<f64>)>> {
    let pose = |joint: &Joint<'a>| {
        let [xyz, rpy] = limit::origin(joint).ok()?;
        Some((joint.child, joint_from_link * isometry(xyz, rpy)))
    };
    let joints = tree.joints_of(link);
    let fixed = joints.filter(|joint| !movable.contains(&joint.child));
    fixed.map(|joint| pose(&joint)).collect()
}
