//! From URDF text to the joints of one serial arm.
//!
//! The text is checked element by element first, so that every error names the element and its
//! place. Then the joints between root and tip are loaded with the crate `k`. This is the only file
//! that uses `k`.
//!
//! URDF 1.2 attributes `acceleration`, `deceleration` and `jerk` of `<limit>` are
//! read. Joints off the chain (gripper fingers, mimic joints) are ignored; the masses behind them count
//! as fixed at zero.

mod error;
mod inertia;
mod limit;
mod tree;

pub use error::{Place, UrdfError};

use k::nalgebra as k_nalgebra;
use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};
use std::fmt::Write as _;
use tree::{Joint, Tree};

use crate::inertia::Inertia;

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns between two limits, rad.
    Revolute,
    /// Turns without end, rad.
    Continuous,
    /// Slides between two limits, m.
    Prismatic,
}

/// One movable joint as the URDF describes it: rad for turning, m for sliding ones.
#[derive(Clone, Debug, PartialEq)]
pub struct JointInfo {
    /// Name.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// Lower limit; minus infinity for continuous joints.
    pub lower: f64,
    /// Upper limit; infinity for continuous joints.
    pub upper: f64,
    /// Largest speed, where the file gives one above zero.
    pub velocity: Option<f64>,
    /// Largest torque (Nm) or force (N), where the file gives one above zero.
    pub effort: Option<f64>,
    /// Largest acceleration (URDF 1.2).
    pub acceleration: Option<f64>,
    /// Largest deceleration (URDF 1.2).
    pub deceleration: Option<f64>,
    /// Largest jerk (URDF 1.2).
    pub jerk: Option<f64>,
}

/// A serial arm read from a URDF: the movable joints from root to tip; fixed joints are included in
/// the frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Name of the robot.
    pub name: String,
    /// Link at the root; the base frame is its frame.
    pub base_link: String,
    /// Link at the tip; the flange frame is its frame.
    pub tip_link: String,
    /// The movable joints, root first.
    pub joints: Vec<JointInfo>,
    /// Pose of each joint in the frame of the joint before it (of the base for the first) when that
    /// joint is at zero.
    pub frames: Vec<Isometry3<f64>>,
    /// Axis of each joint in its own frame.
    pub axes: Vec<Unit<Vector3<f64>>>,
    /// Pose of the flange in the frame of the last joint at zero.
    pub last_from_flange: Isometry3<f64>,
    /// What moves with each joint, in its frame; `None` where the file gives no inertia.
    pub inertias: Vec<Option<Inertia>>,
}

/// Reads a URDF and follows its joints from the root to `tip`.
///
/// Without a `tip` the only leaf behind a movable joint is taken.
///
/// # Errors
/// [`UrdfError`], which names the element at fault and its place.
///
/// ```
/// let text = r#"<robot name="swing">
///   <link name="base"/> <link name="arm"/>
///   <joint name="shoulder" type="revolute">
///     <parent link="base"/> <child link="arm"/>
///     <origin xyz="0 0 1"/> <axis xyz="0 0 1"/>
///     <limit lower="-1" upper="1" velocity="2" effort="5" acceleration="9"/>
///   </joint>
/// </robot>"#;
/// let model = kinematics::urdf::read(text, None)?;
/// assert_eq!(model.joints[0].acceleration, Some(9.0));
/// # Ok::<(), kinematics::UrdfError>(())
/// ```
pub fn read(text: &str, tip: Option<&str>) -> Result<Model, UrdfError> {
    if text.len() > tree::MAX_BYTES {
        return Err(UrdfError::TooLarge {
            bytes: text.len(),
            limit: tree::MAX_BYTES,
        });
    }
    let options = roxmltree::ParsingOptions {
        allow_dtd: false,
        ..Default::default()
    };
    let document = roxmltree::Document::parse_with_options(text, options).map_err(|error| {
        let at = error.pos();
        UrdfError::NotXml {
            place: Place {
                line: at.row,
                column: at.col,
            },
            message: error.to_string(),
        }
    })?;
    let tree = Tree::read(&document)?;
    let tip = tree.tip(tip)?;
    let way = tree.way_to(tip);
    let mut infos = Vec::new();
    let mut skeleton = Skeleton::new(tree.root());
    for joint in &way {
        let info = limit::joint_info(joint)?;
        skeleton.push(joint, info.is_some())?;
        infos.extend(info);
    }
    if infos.is_empty() {
        return Err(UrdfError::NoChain {
            place: tree::place(tree.robot),
            root: tree.root().to_owned(),
            tip: tip.to_owned(),
        });
    }
    let mut model = through_k(&skeleton.finish(), tip)?;
    if model.frames.len() != infos.len() {
        return Err(UrdfError::JointCount {
            found: model.frames.len(),
            expected: infos.len(),
        });
    }
    let movable = way.iter().filter(|joint| joint.kind != "fixed");
    let movable: Vec<&str> = movable.map(|joint| joint.child).collect();
    model.inertias = inertia::bodies(&tree, &movable);
    model.name = tree.name.to_owned();
    model.base_link = tree.root().to_owned();
    model.joints = infos;
    Ok(model)
}

impl Model {
    /// Number of movable joints.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.joints.len()
    }
}

/// A URDF with only the joints of the chain, numbers at full precision.
struct Skeleton(String);

impl Skeleton {
    fn new(root: &str) -> Self {
        Self(format!(
            "<robot name=\"chain\"><link name=\"{}\"/>",
            escaped(root)
        ))
    }

    fn push(&mut self, joint: &Joint<'_>, movable: bool) -> Result<(), UrdfError> {
        let [xyz, rpy] = limit::origin(joint)?;
        let kind = if movable { joint.kind } else { "fixed" };
        let (name, parent) = (escaped(joint.name), escaped(joint.parent));
        let child = escaped(joint.child);
        let triple = |v: [f64; 3]| format!("{:?} {:?} {:?}", v[0], v[1], v[2]);
        let axis = if movable {
            limit::axis(joint)?
        } else {
            [1.0, 0.0, 0.0]
        };
        // Writing to a `String` cannot fail.
        let _ = write!(
            self.0,
            "<link name=\"{child}\"/><joint name=\"{name}\" type=\"{kind}\">\
             <parent link=\"{parent}\"/><child link=\"{child}\"/>\
             <origin xyz=\"{}\" rpy=\"{}\"/><axis xyz=\"{}\"/>\
             <limit lower=\"-1\" upper=\"1\" effort=\"0\" velocity=\"0\"/></joint>",
            triple(xyz),
            triple(rpy),
            triple(axis),
        );
        Ok(())
    }

    fn finish(mut self) -> String {
        self.0.push_str("</robot>");
        self.0
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// Loads the reduced text with `k` and takes its joints as plain data.
fn through_k(text: &str, tip: &str) -> Result<Model, UrdfError> {
    let robot = urdf_rs::read_from_string(text).map_err(|error| UrdfError::Loader {
        message: error.to_string(),
    })?;
    let chain = k::Chain::<f64>::from(&robot);
    let mut model = Model {
        name: String::new(),
        base_link: String::new(),
        tip_link: tip.to_owned(),
        joints: Vec::new(),
        frames: Vec::new(),
        axes: Vec::new(),
        last_from_flange: Isometry3::identity(),
        inertias: Vec::new(),
    };
    // The chain is serial, so the nodes come in order, root first.
    let mut since_last = Isometry3::identity();
    for node in chain.iter() {
        let joint = node.joint();
        since_last *= isometry(joint.origin());
        let axis = match &joint.joint_type {
            k::JointType::Fixed => continue,
            k::JointType::Rotational { axis } | k::JointType::Linear { axis } => axis,
        };
        model.frames.push(since_last);
        model
            .axes
            .push(Unit::new_normalize(Vector3::new(axis.x, axis.y, axis.z)));
        since_last = Isometry3::identity();
    }
    model.last_from_flange = since_last;
    Ok(model)
}

/// The same pose in our version of nalgebra.
fn isometry(pose: &k_nalgebra::Isometry3<f64>) -> Isometry3<f64> {
    let (t, r) = (&pose.translation.vector, pose.rotation.quaternion());
    Isometry3::from_parts(
        Translation3::new(t.x, t.y, t.z),
        UnitQuaternion::from_quaternion(Quaternion::new(r.w, r.i, r.j, r.k)),
    )
}
