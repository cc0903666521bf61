//! Reads `robot.toml` and combines it with the URDF.

use super::effort::{Limits, Payload};
use super::ends::NearEnds;
use super::error::RobotError;
use super::files::Files;
use super::{EndEffector, Gripper, JointLimits, Margin, Robot, ToolChanger, ToolLimits};
use kinematics::{Inertia, Model, urdf};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use serde::Deserialize;
use std::ops::Range;
use toml::Spanned;

/// Most joints that the engine drives.
pub(super) const MOST_JOINTS: usize = 8;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    #[serde(default)]
    description: String,
    tip_link: Option<String>,
    joints: Spanned<Joints>,
    tool_limits: Tool,
    base: Option<Pose>,
    home: Home,
    tool_changer: Option<Changer>,
    #[serde(default)]
    end_effector: Vec<Effector>,
    mounted: Option<Spanned<String>>,
    limits: Option<Limits>,
    payload: Option<Payload>,
    arrival: Option<super::arrival::Given>,
}

/// Limits that the URDF does not give, one per joint.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Joints {
    source: String,
    velocity_per_s: Option<Spanned<Vec<f64>>>,
    acceleration_per_s2: Option<Spanned<Vec<f64>>>,
    jerk_per_s3: Option<Spanned<Vec<f64>>>,
    margin: Option<Shares>,
    near_ends: Option<NearEnds>,
}

/// Shares of the limits that are planned with.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Shares {
    velocity: Option<Spanned<f64>>,
    acceleration: Option<Spanned<f64>>,
    jerk: Option<Spanned<f64>>,
}

/// One limit of the joints: its key in `robot.toml`, the values there, and that of a joint's URDF.
struct LimitEntry<'a> {
    key: &'a str,
    given: Option<&'a Spanned<Vec<f64>>>,
    urdf: fn(&urdf::JointInfo) -> Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Tool {
    source: String,
    speed_m_per_s: Spanned<f64>,
    acceleration_m_per_s2: Spanned<f64>,
    jerk_m_per_s3: Spanned<f64>,
    angular_speed_rad_per_s: Spanned<f64>,
    angular_acceleration_rad_per_s2: Spanned<f64>,
    angular_jerk_rad_per_s3: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Pose {
    position_m: Spanned<[f64; 3]>,
    #[serde(default = "no_turn")]
    roll_pitch_yaw_rad: Spanned<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Home {
    joints_rad_or_m: Spanned<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Changer {
    opening_s: Spanned<f64>,
    closing_s: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Effector {
    name: Spanned<String>,
    flange_from_tcp: Pose,
    opening_s: Option<Spanned<f64>>,
    closing_s: Option<Spanned<f64>>,
    width_m: Option<Spanned<f64>>,
    payload: Option<Payload>,
    workstation_from_holder: Option<Pose>,
}

fn no_turn() -> Spanned<[f64; 3]> {
    Spanned::new(0..0, [0.0; 3])
}

impl Files<'_> {
    /// Reads both texts.
    pub(super) fn read(&self) -> Result<Robot, RobotError> {
        let document: Document = toml::from_str(self.toml).map_err(|error| {
            let (line, column) = position(self.toml, error.span().map_or(0, |span| span.start));
            let message = error.message().trim().replace('\n', ", ");
            RobotError::Toml {
                file: self.toml_file(),
                line,
                column,
                message,
            }
        })?;
        let file = self.place.join("robot.urdf").display().to_string();
        let mut model = urdf::read(self.urdf, document.tip_link.as_deref()).map_err(|source| {
            RobotError::Urdf {
                file: file.clone(),
                source,
            }
        })?;
        if model.dof() > MOST_JOINTS {
            return Err(RobotError::TooManyJoints {
                file,
                found: model.dof(),
                most: MOST_JOINTS,
            });
        }
        let payload = document.payload.as_ref();
        let payload = payload
            .map(|payload| self.payload("payload", payload))
            .transpose()?;
        let efforts = self.efforts(&model, document.limits.as_ref())?;
        let margin = self.margin(document.joints.get_ref().margin.as_ref())?;
        let mut joints = self.joint_limits(&model, &document.joints)?;
        let near_ends = document.joints.get_ref().near_ends.as_ref();
        self.near_ends(near_ends, &mut model, &mut joints)?;
        let joints = joints.with_margin(margin);
        let home = self.home(&document.home, &model)?;
        let end_effectors = self.end_effectors(&document.end_effector)?;
        Ok(Robot {
            name: self.name.to_owned(),
            description: document.description.clone(),
            folder: None,
            urdf: self.urdf.to_owned(),
            toml: self.toml.to_owned(),
            joints,
            tool: self.tool_limits(&document.tool_limits)?,
            workstation_from_base: self
                .optional_pose("base", document.base.as_ref())?
                .unwrap_or_else(Isometry3::identity),
            home,
            efforts,
            payload,
            arrival: self.arrival(document.arrival.as_ref())?,
            mounted: self.mounted(document.mounted.as_ref(), &end_effectors)?,
            end_effectors,
            tool_changer: self.changer(document.tool_changer.as_ref())?,
            model,
        })
    }

    fn toml_file(&self) -> String {
        self.place.join("robot.toml").display().to_string()
    }

    /// The error for a value that does not fit.
    pub(super) fn value(&self, span: Range<usize>, key: &str, expected: &str) -> RobotError {
        let (line, column) = position(self.toml, span.start);
        let found = self.toml.get(span).unwrap_or("").chars().take(80).collect();
        let (key, expected) = (key.to_owned(), expected.to_owned());
        RobotError::Value {
            file: self.toml_file(),
            line,
            column,
            key,
            expected,
            found,
        }
    }

    pub(super) fn positive(&self, key: &str, value: &Spanned<f64>) -> Result<f64, RobotError> {
        let number = *value.get_ref();
        if number > 0.0 && number.is_finite() {
            return Ok(number);
        }
        Err(self.value(value.span(), key, "a positive finite number"))
    }

    pub(super) fn time(&self, key: &str, value: &Spanned<f64>) -> Result<f64, RobotError> {
        let number = *value.get_ref();
        if (0.0..=600.0).contains(&number) {
            return Ok(number);
        }
        Err(self.value(value.span(), key, "a time from 0 to 600 s"))
    }

    fn tool_limits(&self, tool: &Tool) -> Result<ToolLimits, RobotError> {
        let of = |key: &str, value| self.positive(&format!("tool_limits.{key}"), value);
        Ok(ToolLimits {
            speed: of("speed_m_per_s", &tool.speed_m_per_s)?,
            acceleration: of("acceleration_m_per_s2", &tool.acceleration_m_per_s2)?,
            jerk: of("jerk_m_per_s3", &tool.jerk_m_per_s3)?,
            angular_speed: of("angular_speed_rad_per_s", &tool.angular_speed_rad_per_s)?,
            angular_acceleration: of(
                "angular_acceleration_rad_per_s2",
                &tool.angular_acceleration_rad_per_s2,
            )?,
            angular_jerk: of("angular_jerk_rad_per_s3", &tool.angular_jerk_rad_per_s3)?,
            source: tool.source.clone(),
        })
    }

    /// Limits of the URDF where it has them, of `robot.toml` elsewhere.
    fn joint_limits(
        &self,
        model: &Model,
        joints: &Spanned<Joints>,
    ) -> Result<JointLimits, RobotError> {
        let given = joints.get_ref();
        let of = |limit: &LimitEntry<'_>| self.joint_limit(model, joints.span(), limit);
        Ok(JointLimits {
            lower: model.joints.iter().map(|joint| joint.lower).collect(),
            upper: model.joints.iter().map(|joint| joint.upper).collect(),
            velocity: of(&LimitEntry {
                key: "joints.velocity_per_s",
                given: given.velocity_per_s.as_ref(),
                urdf: |joint| joint.velocity,
            })?,
            acceleration: of(&LimitEntry {
                key: "joints.acceleration_per_s2",
                given: given.acceleration_per_s2.as_ref(),
                // One bound is for both directions, so the smaller of the two is used.
                urdf: |joint| match (joint.acceleration, joint.deceleration) {
                    (Some(up), Some(down)) => Some(up.min(down)),
                    (up, down) => up.or(down),
                },
            })?,
            jerk: of(&LimitEntry {
                key: "joints.jerk_per_s3",
                given: given.jerk_per_s3.as_ref(),
                urdf: |joint| joint.jerk,
            })?,
            source: given.source.clone(),
            margin: Margin::default(),
            ends: None,
        })
    }

    /// The shares of the limits that are planned with; the whole where nothing is given.
    fn margin(&self, shares: Option<&Shares>) -> Result<Margin, RobotError> {
        let share = |key: &str, given: Option<&Spanned<f64>>| match given {
            None => Ok(1.0),
            Some(given) if *given.get_ref() > 0.0 && *given.get_ref() <= 1.0 => {
                Ok(*given.get_ref())
            }
            Some(given) => {
                let key = format!("joints.margin.{key}");
                Err(self.value(given.span(), &key, "a share above 0 and at most 1"))
            }
        };
        let Some(shares) = shares else {
            return Ok(Margin::default());
        };
        Ok(Margin {
            velocity: share("velocity", shares.velocity.as_ref())?,
            acceleration: share("acceleration", shares.acceleration.as_ref())?,
            jerk: share("jerk", shares.jerk.as_ref())?,
        })
    }

    /// One limit of every joint; `joints` is where a missing one is reported.
    fn joint_limit(
        &self,
        model: &Model,
        joints: Range<usize>,
        limit: &LimitEntry<'_>,
    ) -> Result<Vec<f64>, RobotError> {
        let key = limit.key;
        if let Some(given) = limit.given {
            self.check_count(key, given, model.dof())?;
            let values = given.get_ref();
            if !values.iter().all(|value| *value > 0.0 && value.is_finite()) {
                return Err(self.value(given.span(), key, "positive finite numbers"));
            }
        }
        let one = |(index, joint): (usize, &urdf::JointInfo)| {
            let given = limit.given.and_then(|given| given.get_ref().get(index));
            (limit.urdf)(joint).or(given.copied()).ok_or_else(|| {
                let name = &joint.name;
                let expected = format!("a value for joint \"{name}\", as its URDF has none");
                let mut error = self.value(joints.clone(), key, &expected);
                if let RobotError::Value { found, .. } = &mut error {
                    "no such key".clone_into(found);
                }
                error
            })
        };
        model.joints.iter().enumerate().map(one).collect()
    }

    pub(super) fn check_count(
        &self,
        key: &str,
        values: &Spanned<Vec<f64>>,
        dof: usize,
    ) -> Result<(), RobotError> {
        if values.get_ref().len() == dof {
            return Ok(());
        }
        let expected = format!("{dof} numbers, one per joint");
        Err(self.value(values.span(), key, &expected))
    }

    fn home(&self, home: &Home, model: &Model) -> Result<Vec<f64>, RobotError> {
        let (key, values) = ("home.joints_rad_or_m", &home.joints_rad_or_m);
        self.check_count(key, values, model.dof())?;
        for (value, joint) in values.get_ref().iter().zip(&model.joints) {
            if !(joint.lower..=joint.upper).contains(value) || !value.is_finite() {
                let (name, lower, upper) = (&joint.name, joint.lower, joint.upper);
                let expected = format!("joint \"{name}\" from {lower} to {upper}");
                return Err(self.value(values.span(), key, &expected));
            }
        }
        Ok(values.get_ref().clone())
    }

    fn pose(&self, key: &str, pose: &Pose) -> Result<Isometry3<f64>, RobotError> {
        for (part, values) in [
            ("position_m", &pose.position_m),
            ("roll_pitch_yaw_rad", &pose.roll_pitch_yaw_rad),
        ] {
            if !values.get_ref().iter().all(|value| value.abs() <= 1e4) {
                let key = format!("{key}.{part}");
                return Err(self.value(values.span(), &key, "three numbers of at most 10000"));
            }
        }
        let [x, y, z] = *pose.position_m.get_ref();
        let [roll, pitch, yaw] = *pose.roll_pitch_yaw_rad.get_ref();
        Ok(Isometry3::from_parts(
            Translation3::new(x, y, z),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        ))
    }

    fn optional_pose(
        &self,
        key: &str,
        pose: Option<&Pose>,
    ) -> Result<Option<Isometry3<f64>>, RobotError> {
        pose.map(|pose| self.pose(key, pose)).transpose()
    }

    fn changer(&self, changer: Option<&Changer>) -> Result<Option<ToolChanger>, RobotError> {
        let Some(changer) = changer else {
            return Ok(None);
        };
        Ok(Some(ToolChanger {
            opening: self.time("tool_changer.opening_s", &changer.opening_s)?,
            closing: self.time("tool_changer.closing_s", &changer.closing_s)?,
        }))
    }

    fn end_effectors(&self, effectors: &[Effector]) -> Result<Vec<EndEffector>, RobotError> {
        let mut read: Vec<EndEffector> = Vec::new();
        for effector in effectors {
            let name = effector.name.get_ref();
            if name.is_empty() || read.iter().any(|other| other.name == *name) {
                let expected = "a name that no other end effector has";
                return Err(self.value(effector.name.span(), "end_effector.name", expected));
            }
            let gripper = match (&effector.opening_s, &effector.closing_s) {
                (None, None) => None,
                (Some(opening), Some(closing)) => Some(Gripper {
                    opening: self.time("end_effector.opening_s", opening)?,
                    closing: self.time("end_effector.closing_s", closing)?,
                    width: match &effector.width_m {
                        Some(width) => Some(self.time("end_effector.width_m", width)?),
                        None => None,
                    },
                }),
                (Some(one), None) | (None, Some(one)) => {
                    let expected = "both opening_s and closing_s, or neither";
                    return Err(self.value(one.span(), "end_effector", expected));
                }
            };
            read.push(EndEffector {
                name: name.clone(),
                flange_from_tcp: self
                    .pose("end_effector.flange_from_tcp", &effector.flange_from_tcp)?,
                gripper,
                inertia: self.carried(effector, effectors)?,
                workstation_from_holder: self.optional_pose(
                    "end_effector.workstation_from_holder",
                    effector.workstation_from_holder.as_ref(),
                )?,
            });
        }
        Ok(read)
    }

    /// The masses of an end effector: all have them, or none.
    fn carried(&self, one: &Effector, all: &[Effector]) -> Result<Option<Inertia>, RobotError> {
        if let Some(payload) = &one.payload {
            return self.payload("end_effector.payload", payload).map(Some);
        }
        if all.iter().any(|other| other.payload.is_some()) {
            let expected = "a payload here too: every end effector has one, or none has";
            return Err(self.value(one.name.span(), "end_effector", expected));
        }
        Ok(None)
    }

    fn mounted(
        &self,
        mounted: Option<&Spanned<String>>,
        effectors: &[EndEffector],
    ) -> Result<Option<usize>, RobotError> {
        let Some(mounted) = mounted else {
            return Ok(None);
        };
        let index = effectors
            .iter()
            .position(|effector| effector.name == *mounted.get_ref());
        index.map(Some).ok_or_else(|| {
            self.value(
                mounted.span(),
                "mounted",
                "the name of an end effector of this file",
            )
        })
    }
}

/// Line and column of a byte offset, both counted from 1.
fn position(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
    (line, column)
}
