//! An arm for oracle tests: the shipped files read independently, forward kinematics by `k`.

use std::fs;

use k::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use toml::{Table, Value};

use crate::repository::root;

/// A shipped robot, without any code of ours.
pub struct Arm {
    chain: k::SerialChain<f64>,
    workstation_from_base: Isometry3<f64>,
    /// Lower and upper position limit, largest velocity, one per joint.
    pub joints: Vec<[f64; 3]>,
    /// Largest acceleration, one per joint.
    pub acceleration: Vec<f64>,
    /// Largest jerk, one per joint.
    pub jerk: Vec<f64>,
    /// Largest speed of the controlled point, m/s.
    pub tool_speed: f64,
    /// Largest acceleration of the controlled point, m/s2.
    pub tool_acceleration: f64,
    /// Largest jerk of the controlled point, m/s3.
    pub tool_jerk: f64,
    /// Largest angular speed, acceleration and jerk of the tool, rad/s, rad/s2, rad/s3.
    pub angular: [f64; 3],
    /// The joints at home.
    pub home: Vec<f64>,
    /// What the flange can carry.
    pub tools: Vec<Tool>,
    /// Index of the tool that is on the flange at first.
    pub mounted: Option<usize>,
}

/// An end effector.
pub struct Tool {
    /// Tool centre point in the flange.
    pub flange_from_tcp: Isometry3<f64>,
    /// The flange when it lets the tool go.
    pub workstation_from_holder: Option<Isometry3<f64>>,
}

impl Arm {
    /// Reads `robots/<name>`.
    ///
    /// # Panics
    /// The files are not as expected; a test stops there.
    pub fn read(name: &str) -> Self {
        let folder = root().join("robots").join(name);
        let read = |file: &str| fs::read_to_string(folder.join(file)).expect("file is readable");
        let (urdf, text) = (read("robot.urdf"), read("robot.toml"));
        let file: Table = text.parse().expect("robot.toml is TOML");
        let tree =
            k::Chain::<f64>::from_urdf_file(folder.join("robot.urdf")).expect("URDF is read");
        let tip = tree
            .find_link(file["tip_link"].as_str().expect("a name"))
            .expect("the tip link");
        let chain = k::SerialChain::from_end(tip);
        let names: Vec<_> = chain
            .iter_joints()
            .map(|joint| joint.name.clone())
            .collect();
        let limit = |from_urdf: &str, from_toml: &str| {
            let given = file["joints"].get(from_toml).map(numbers);
            given
                .or_else(|| attribute(&urdf, &names, from_urdf))
                .expect("a limit for every joint")
        };
        let [lower, upper, velocity, acceleration, jerk] = [
            limit("lower", ""),
            limit("upper", ""),
            limit("velocity", "velocity_per_s"),
            limit("acceleration", "acceleration_per_s2"),
            limit("jerk", "jerk_per_s3"),
        ];
        let joints = (0..names.len())
            .map(|k| [lower[k], upper[k], velocity[k]])
            .collect();
        let tools: Vec<&Table> = file["end_effector"]
            .as_array()
            .expect("tools")
            .iter()
            .filter_map(Value::as_table)
            .collect();
        let mounted = file.get("mounted").map(|name| {
            tools
                .iter()
                .position(|tool| tool["name"] == *name)
                .expect("mounted tool is listed")
        });
        let limits = &file["tool_limits"];
        Self {
            workstation_from_base: pose(&file["base"]),
            acceleration,
            jerk,
            tool_speed: number(&limits["speed_m_per_s"]),
            tool_acceleration: number(&limits["acceleration_m_per_s2"]),
            tool_jerk: number(&limits["jerk_m_per_s3"]),
            angular: [
                number(&limits["angular_speed_rad_per_s"]),
                number(&limits["angular_acceleration_rad_per_s2"]),
                number(&limits["angular_jerk_rad_per_s3"]),
            ],
            home: numbers(&file["home"]["joints_rad_or_m"]),
            tools: tools
                .iter()
                .map(|tool| Tool {
                    flange_from_tcp: pose(&tool["flange_from_tcp"]),
                    workstation_from_holder: tool.get("workstation_from_holder").map(pose),
                })
                .collect(),
            mounted,
            joints,
            chain,
        }
    }

    /// Pose of the flange in the workstation.
    pub fn flange(&self, q: &[f64]) -> Isometry3<f64> {
        self.chain.set_joint_positions_unchecked(q);
        self.chain.update_transforms();
        self.workstation_from_base * self.chain.end_transform()
    }

    /// The joints where [`Arm::flange`] was asked for last, in the workstation: a point on each
    /// axis, its direction, and whether it slides.
    pub fn axes(&self) -> Vec<(Vector3<f64>, Vector3<f64>, bool)> {
        let base = self.workstation_from_base;
        self.chain
            .iter()
            .filter_map(|node| {
                let (axis, slides) = match &node.joint().joint_type {
                    k::JointType::Rotational { axis } => (*axis, false),
                    k::JointType::Linear { axis } => (*axis, true),
                    k::JointType::Fixed => return None,
                };
                let frame = base * node.world_transform()?;
                Some((
                    frame.translation.vector,
                    frame.rotation * axis.into_inner(),
                    slides,
                ))
            })
            .collect()
    }

    /// From the flange to the controlled point.
    pub fn flange_from_tool(&self, mounted: Option<usize>) -> Isometry3<f64> {
        mounted.map_or_else(Isometry3::identity, |index| {
            self.tools[index].flange_from_tcp
        })
    }
}

/// An attribute of the limit of every joint of `names`, from the text of a URDF; `k` keeps none.
fn attribute(urdf: &str, names: &[String], attribute: &str) -> Option<Vec<f64>> {
    let document = roxmltree::Document::parse(urdf).expect("URDF is XML");
    let of_joint = |name: &String| {
        let joint = document
            .descendants()
            .find(|node| node.has_tag_name("joint") && node.attribute("name") == Some(name))?;
        let limit = joint.children().find(|node| node.has_tag_name("limit"))?;
        limit.attribute(attribute)?.parse().ok()
    };
    names.iter().map(of_joint).collect()
}

/// A pose of robot.toml.
fn pose(table: &Value) -> Isometry3<f64> {
    let p = numbers(&table["position_m"]);
    let turn = table
        .get("roll_pitch_yaw_rad")
        .map_or(vec![0.0; 3], numbers);
    Isometry3::from_parts(
        Translation3::new(p[0], p[1], p[2]),
        UnitQuaternion::from_euler_angles(turn[0], turn[1], turn[2]),
    )
}

fn numbers(list: &Value) -> Vec<f64> {
    list.as_array()
        .expect("a list")
        .iter()
        .map(number)
        .collect()
}

fn number(value: &Value) -> f64 {
    value
        .as_float()
        .or(value.as_integer().map(|whole| whole as f64))
        .expect("a number")
}
