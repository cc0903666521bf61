//! The robot: a folder with `robot.urdf` (shape, joint limits) and `robot.toml` (what a URDF does
//! not have: acceleration and jerk, tool limits, pose of the base, end effectors, home position).
//!
//! Robots that come with Canter are part of the binary; [`load`] finds them by
//! name, and any other by its folder.

mod arrival;
mod effort;
mod ends;
mod error;
mod file;
mod files;
mod import;
mod meshes;
mod shipped;

pub use arrival::Arrival;
pub use effort::EffortLimits;
pub use ends::EndSpeeds;
pub use error::RobotError;
pub use import::{from_urdf, import};
pub use meshes::{mesh_file, mesh_names};
pub use shipped::list;

use kinematics::{Chain, Inertia, Model, UrdfError};
use nalgebra::{Isometry3, SVector};
use std::path::{Path, PathBuf};

use crate::end_effector::{EndEffector, Gripper, ToolChanger};
use crate::motion::{Efforts, Planner};
use crate::tooling::{Holder, Tooling};

/// Shares of the maker's limits that are planned with, each above 0 and at most 1. An arm whose
/// controller has a clock of its own needs a margin to catch up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margin {
    /// Share of the speeds.
    pub velocity: f64,
    /// Share of the accelerations.
    pub acceleration: f64,
    /// Share of the jerks.
    pub jerk: f64,
}

impl Default for Margin {
    /// The whole limits.
    fn default() -> Self {
        Self {
            velocity: 1.0,
            acceleration: 1.0,
            jerk: 1.0,
        }
    }
}

/// Limits of the joints that are planned with, root first: rad for turning joints, m for sliding
/// ones.
#[derive(Clone, Debug, PartialEq)]
pub struct JointLimits {
    /// Lower position limit; minus infinity for continuous joints.
    pub lower: Vec<f64>,
    /// Upper position limit; infinity for continuous joints.
    pub upper: Vec<f64>,
    /// Largest speed, per s.
    pub velocity: Vec<f64>,
    /// Largest acceleration, per s2.
    pub acceleration: Vec<f64>,
    /// Largest jerk, per s3.
    pub jerk: Vec<f64>,
    /// Where the acceleration and jerk limits come from.
    pub source: String,
    /// The shares of the maker's limits that these limits are.
    pub margin: Margin,
    /// Less speed near the ends of the range, if the maker asks for it.
    pub ends: Option<EndSpeeds>,
}

impl JointLimits {
    /// The limits to plan with, from the maker's.
    pub(crate) fn with_margin(mut self, margin: Margin) -> Self {
        let scale = |values: &mut [f64], share: f64| {
            values.iter_mut().for_each(|value| *value *= share);
        };
        scale(&mut self.velocity, margin.velocity);
        scale(&mut self.acceleration, margin.acceleration);
        scale(&mut self.jerk, margin.jerk);
        self.ends = self.ends.map(|ends| ends.scaled(margin.velocity));
        self.margin = margin;
        self
    }

    /// The maker's limits: those without the margin.
    pub fn of_the_maker(&self) -> Self {
        let whole = |values: &[f64], share: f64| values.iter().map(|value| value / share).collect();
        Self {
            velocity: whole(&self.velocity, self.margin.velocity),
            acceleration: whole(&self.acceleration, self.margin.acceleration),
            jerk: whole(&self.jerk, self.margin.jerk),
            margin: Margin::default(),
            ends: self
                .ends
                .clone()
                .map(|ends| ends.scaled(1.0 / self.margin.velocity)),
            ..self.clone()
        }
    }
}

/// Limits of the controlled point.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolLimits {
    /// Largest speed, m/s.
    pub speed: f64,
    /// Largest acceleration, m/s2.
    pub acceleration: f64,
    /// Largest jerk, m/s3.
    pub jerk: f64,
    /// Largest angular speed, rad/s.
    pub angular_speed: f64,
    /// Largest angular acceleration, rad/s2.
    pub angular_acceleration: f64,
    /// Largest angular jerk, rad/s3.
    pub angular_jerk: f64,
    /// Where these come from.
    pub source: String,
}

/// A robot for the planner. All vectors have one entry per joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// Short name: the shipped name, or that of the folder.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// The folder it was loaded from; none for one that comes with Canter.
    pub folder: Option<PathBuf>,
    /// Text of the URDF, for viewers and drivers.
    pub urdf: String,
    /// Text of robot.toml, for recordings and viewers.
    pub toml: String,
    /// Chain of joints as read from the URDF.
    pub model: Model,
    /// Limits of the joints.
    pub joints: JointLimits,
    /// Limits of the controlled point.
    pub tool: ToolLimits,
    /// Limits of the efforts of the joints, if the robot asks for them.
    pub efforts: Option<EffortLimits>,
    /// What the flange carries all the time beside its end effector, where it is known.
    pub payload: Option<Inertia>,
    /// When a command is done: the measured arm has arrived.
    pub arrival: Arrival,
    /// Pose of the robot's base in the workstation.
    pub workstation_from_base: Isometry3<f64>,
    /// A ready position: well inside the limits and away from singular poses.
    pub home: Vec<f64>,
    /// What the flange can carry.
    pub end_effectors: Vec<EndEffector>,
    /// Index of the end effector carried at the start.
    pub mounted: Option<usize>,
    /// Present when the flange can change its end effector.
    pub tool_changer: Option<ToolChanger>,
}

/// Loads a robot: a shipped name such as `ur5e`, or a folder with `robot.urdf` and
/// `robot.toml`.
///
/// Text with a path separator, or the name of a folder that has a `robot.toml`, is
/// taken for a folder; all else is a shipped name.
///
/// # Errors
/// [`RobotError`]; errors in files name file, line and column.
///
/// ```
/// let robot = planner::robot::load("ur5e")?;
/// assert_eq!(robot.dof(), 6);
/// let arm: kinematics::Chain<6> = robot.chain()?;
/// # Ok::<(), planner::robot::RobotError>(())
/// ```
pub fn load(name_or_folder: &str) -> Result<Robot, RobotError> {
    let folder = Path::new(name_or_folder);
    let shipped = shipped::texts(name_or_folder);
    let is_path = name_or_folder.contains(['/', '\\']) || name_or_folder == ".";
    match shipped {
        Some((urdf, toml)) if !is_path => {
            let place = format!("robots/{name_or_folder}");
            files::Files {
                name: name_or_folder,
                place: Path::new(&place),
                urdf,
                toml,
            }
            .read()
        }
        _ if is_path || folder.join("robot.toml").is_file() => load_folder(folder),
        _ => Err(RobotError::Unknown {
            name: name_or_folder.to_owned(),
            known: list().join(", "),
        }),
    }
}

/// Reads a robot from the texts of its two files, without touching the disk.
///
/// # Errors
/// [`RobotError`]; errors name file, line and column.
pub fn parse(name: &str, urdf: &str, toml: &str) -> Result<Robot, RobotError> {
    files::Files {
        name,
        place: Path::new(name),
        urdf,
        toml,
    }
    .read()
}

/// Largest file of a robot folder, bytes: the URDF of a whole factory has a hundredth of it.
const LARGEST: u64 = 64 << 20;

/// The text of a regular file: a pipe would wait for a writer, a device may never end.
fn text_of(path: &Path) -> Result<String, RobotError> {
    use std::io::Read;
    let unreadable = |message: String| RobotError::Read {
        file: path.display().to_string(),
        message,
    };
    let failed = |error: std::io::Error| unreadable(error.to_string());
    let found = std::fs::metadata(path).map_err(failed)?;
    if !found.is_file() || found.len() > LARGEST {
        let expected = format!("expected a regular file of at most {LARGEST} bytes");
        return Err(unreadable(expected));
    }
    let mut text = String::new();
    let file = std::fs::File::open(path).map_err(failed)?;
    file.take(LARGEST)
        .read_to_string(&mut text)
        .map_err(failed)?;
    Ok(text)
}

fn load_folder(folder: &Path) -> Result<Robot, RobotError> {
    let read = |file: &str| text_of(&folder.join(file));
    let (toml, urdf) = (read("robot.toml")?, read("robot.urdf")?);
    let whole = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let name = whole.file_name().unwrap_or_default().to_string_lossy();
    let robot = files::Files {
        name: &name,
        place: folder,
        urdf: &urdf,
        toml: &toml,
    }
    .read()?;
    Ok(Robot {
        folder: Some(whole),
        ..robot
    })
}

impl Robot {
    /// Number of joints.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.model.dof()
    }

    /// The arm with its base in the workstation; poses are those of the flange.
    ///
    /// # Errors
    /// [`RobotError::Urdf`] when the robot does not have `N` joints.
    pub fn chain<const N: usize>(&self) -> Result<Chain<N>, RobotError> {
        let chain = self
            .model
            .chain::<N>()
            .map_err(|source| self.urdf_error(source))?;
        Ok(chain.with_base(&self.workstation_from_base))
    }

    /// The arm as [`Robot::chain`], ending in the controlled point: the tool centre
    /// point of the end effector with that index, or the flange.
    ///
    /// # Errors
    /// [`RobotError::Urdf`] when the robot does not have `N` joints.
    pub fn chain_with<const N: usize>(
        &self,
        end_effector: Option<usize>,
    ) -> Result<Chain<N>, RobotError> {
        let tool = end_effector.and_then(|index| self.end_effectors.get(index));
        let chain = self.chain()?;
        Ok(tool.map_or(chain, |tool| chain.with_tool(&tool.flange_from_tcp)))
    }

    fn urdf_error(&self, source: UrdfError) -> RobotError {
        RobotError::Urdf {
            file: format!("{}/robot.urdf", self.name),
            source,
        }
    }
}

/// One value per joint as a vector; missing joints get zero.
#[must_use]
pub fn vector<const N: usize>(values: &[f64]) -> SVector<f64, N> {
    SVector::from_fn(|i, _| values.get(i).copied().unwrap_or(0.0))
}

/// What the planner takes from a robot.
impl Robot {
    /// Limits of the joints; their count must be `N`, which [`Robot::chain`] checks.
    #[must_use]
    pub fn joint_limits<const N: usize>(&self) -> trajectory::JointLimits<N> {
        let joints = &self.joints;
        trajectory::JointLimits {
            lower: vector(&joints.lower),
            upper: vector(&joints.upper),
            velocity: vector(&joints.velocity),
            acceleration: vector(&joints.acceleration),
            jerk: vector(&joints.jerk),
            ends: joints.ends.as_ref().map(EndSpeeds::vectors),
        }
    }

    /// A planner of motions of the flange, in the frame of the workstation, without limits of efforts.
    ///
    /// # Errors
    /// [`RobotError::Urdf`] when the robot does not have `N` joints.
    ///
    /// # Examples
    /// ```
    /// let panda = planner::robot::load("panda")?;
    /// assert_eq!(panda.planner::<7>()?.chain().lower().len(), 7);
    /// assert!(panda.planner::<6>().is_err());
    /// # Ok::<(), planner::robot::RobotError>(())
    /// ```
    pub fn planner<const N: usize>(&self) -> Result<Planner<N>, RobotError> {
        Ok(Planner::new(
            &self.chain()?,
            Isometry3::identity(),
            self.joint_limits(),
            self.joint_names(),
        ))
    }

    /// The limits of efforts with the masses of the arm and of what it carries at the start; `None` if the
    /// robot does not ask for them or does not have `N` joints.
    #[must_use]
    pub fn efforts<const N: usize>(&self) -> Option<Efforts<N>> {
        let bare = self.bare_efforts()?;
        Some(bare.carrying(self.tooling().carried().as_ref()))
    }

    /// The same with nothing at the flange.
    #[must_use]
    pub fn bare_efforts<const N: usize>(&self) -> Option<Efforts<N>> {
        let wanted = self.efforts.as_ref()?;
        let dynamics = self.model.dynamics::<N>()?;
        Some(Efforts {
            dynamics: dynamics.with_base(&self.workstation_from_base),
            limits: vector(&wanted.limits),
        })
    }

    /// Whether each joint slides.
    #[must_use]
    pub fn sliding(&self) -> Vec<bool> {
        let slides = |joint: &kinematics::urdf::JointInfo| {
            joint.kind == kinematics::urdf::JointKind::Prismatic
        };
        self.model.joints.iter().map(slides).collect()
    }

    /// The largest speeds, accelerations and jerks of the controlled point.
    #[must_use]
    pub fn motion_limits(&self) -> trajectory::ToolLimits {
        let tool = &self.tool;
        trajectory::ToolLimits {
            speed: tool.speed,
            acceleration: tool.acceleration,
            jerk: tool.jerk,
            angular_speed: tool.angular_speed,
            angular_acceleration: tool.angular_acceleration,
            angular_jerk: tool.angular_jerk,
        }
    }

    /// Names of the joints, root first.
    #[must_use]
    pub fn joint_names(&self) -> Vec<String> {
        self.model
            .joints
            .iter()
            .map(|joint| joint.name.clone())
            .collect()
    }

    /// End effectors and holders as they are at the start: the gripper of
    /// the mounted end effector is open, all others are in their holders.
    #[must_use]
    pub fn tooling(&self) -> Tooling {
        let holders = self
            .end_effectors
            .iter()
            .enumerate()
            .filter_map(|(index, tool)| {
                Some(Holder {
                    name: tool.name.clone(),
                    workstation_from_flange: tool.workstation_from_holder?,
                    holds: (self.mounted != Some(index)).then_some(index),
                })
            });
        Tooling {
            holders: if self.tool_changer.is_some() {
                holders.collect()
            } else {
                Vec::new()
            },
            end_effectors: self.end_effectors.clone(),
            mounted: self.mounted,
            gripper_open: self.mounted.map(|_| true),
            changer_open: false,
            changer: self.tool_changer,
            payload: self.payload,
        }
    }
}
