//! The four robot statements as canonical commands, with heights from shapes.

use crcl::{AngleUnit, Command, LengthUnit};
use nalgebra::Isometry3;

use super::batch::{Batch, Tool, canonical};
use super::motion::Situation;
use crate::PlanError;
use crate::world::{Change, Class, Location, Model, Object, ObjectId, pointing_down};

/// How the robot statements are turned into commands.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotOptions {
    /// Distance (m) kept above everything in the workstation while travelling.
    pub clearance: f64,
    /// Standstill (s) before and after the gripper acts.
    pub settle: f64,
    /// Travel above the workstation in straight lines; otherwise along any convenient trajectory.
    pub straight: bool,
    /// Put an object on top of another that is already at its place in a container.
    pub stack: bool,
    /// Percentage of the arm's speed and acceleration to set; `None` does not change the settings.
    pub percent: Option<f64>,
}

impl Default for RobotOptions {
    fn default() -> Self {
        Self {
            clearance: 0.04,
            settle: 0.0,
            straight: true,
            stack: true,
            percent: None,
        }
    }
}

/// The largest number of joints with which an arm travels in straight lines.
const STRAIGHT_JOINTS: usize = 6;

impl RobotOptions {
    /// The options for an arm of so many joints. An arm with more joints than a pose needs may come
    /// into a bad posture after several straight lines in a row: it travels on free paths, so that
    /// it can choose a good one.
    ///
    /// ```
    /// use plan::run::RobotOptions;
    /// assert!(RobotOptions::for_arm(6).straight);
    /// assert!(!RobotOptions::for_arm(7).straight);
    /// ```
    #[must_use]
    pub fn for_arm(joints: usize) -> Self {
        Self {
            straight: joints <= STRAIGHT_JOINTS,
            ..Self::default()
        }
    }

    /// The commands that every plan begins with: metres, radians, and the speed where one is asked
    /// for.
    #[must_use]
    pub fn opening(&self) -> Vec<Command> {
        let mut commands = vec![
            Command::InitCanon,
            Command::SetLengthUnits {
                unit: LengthUnit::Meter,
            },
            Command::SetAngleUnits {
                unit: AngleUnit::Radian,
            },
        ];
        if let Some(percent) = self.percent {
            commands.push(Command::SetRelativeSpeed { percent });
            commands.push(Command::SetRelativeAcceleration { percent });
        }
        commands
    }
}

/// Commands for one model of the world.
pub(crate) struct Robot<'a> {
    pub(crate) model: &'a Model,
    pub(crate) options: &'a RobotOptions,
}

/// The tool that an end effector is.
pub(crate) fn tool_of(effector: &Object) -> Tool {
    Tool {
        name: effector.name.clone(),
        length: effector.effector_length(),
    }
}

/// Where the arm is, as the model has it.
pub(crate) fn situation(model: &Model) -> Result<Situation, PlanError> {
    let arm = model
        .arm
        .ok_or_else(|| PlanError::Missing("known pose of the arm".into()))?;
    Ok(Situation {
        arm,
        tool: model.effector().map(tool_of),
    })
}

fn fail<T>(statement: &str, why: String) -> Result<T, PlanError> {
    Err(PlanError::Statement {
        statement: statement.to_owned(),
        why,
    })
}

/// The pose with another height.
fn at_height(pose: &Isometry3<f64>, z: f64) -> Isometry3<f64> {
    let mut raised = *pose;
    raised.translation.z = z;
    raised
}

impl Robot<'_> {
    /// The controlled point now.
    fn tip(&self) -> Result<Isometry3<f64>, PlanError> {
        let Situation { arm, tool } = situation(self.model)?;
        Ok(tool.map_or(arm, |tool| arm * tool.arm_from_tip()))
    }

    /// `tip_from_arm`.
    fn tip_from_arm(&self) -> Isometry3<f64> {
        let tool = self.model.effector().map(tool_of);
        tool.map_or_else(Isometry3::identity, |tool| tool.arm_from_tip().inverse())
    }

    /// How far the lowest point of the held object is below the controlled point (m).
    fn below_tip(&self) -> Result<f64, PlanError> {
        let Some(held) = self.model.held() else {
            return Ok(0.0);
        };
        let bounds = self.model.bounds(held.id)?;
        Ok(bounds.map_or(0.0, |b| {
            (self.tip().map_or(0.0, |tip| tip.translation.z) - b.minimum[2]).max(0.0)
        }))
    }

    /// Height of the controlled point (m) at which nothing can be touched.
    pub(crate) fn travel_height(&self) -> Result<f64, PlanError> {
        Ok(self.model.highest()? + self.options.clearance + self.below_tip()?)
    }

    fn travel(&self, batch: &mut Batch, pose: &Isometry3<f64>) {
        let pose = canonical(pose);
        batch.push(if self.options.straight {
            Command::MoveStraightTo { pose }
        } else {
            Command::MoveTo { pose }
        });
    }

    fn settle(&self, batch: &mut Batch) {
        if self.options.settle > 0.0 {
            batch.push(Command::Dwell {
                seconds: self.options.settle,
            });
        }
    }

    /// Records that the controlled point ends at `tip`.
    fn ends_at(&self, batch: &mut Batch, tip: &Isometry3<f64>) -> Result<(), PlanError> {
        batch
            .changes
            .extend(self.model.arm_changes(&(tip * self.tip_from_arm()))?);
        Ok(())
    }

    /// The path from the present end of the arm to its place in the model: up, across, down. `None`
    /// if it is there.
    pub(crate) fn way_back(&self, arm: &Isometry3<f64>) -> Result<Option<Batch>, PlanError> {
        let wanted = situation(self.model)?;
        let from_tip = wanted
            .tool
            .as_ref()
            .map(Tool::arm_from_tip)
            .unwrap_or_default();
        let (here, there) = (arm * from_tip, wanted.arm * from_tip);
        let difference = here.inv_mul(&there);
        if difference.translation.vector.norm() < 1e-3 && difference.rotation.angle() < 1e-2 {
            return Ok(None);
        }
        let height = self.travel_height()?;
        let raised = |pose: &Isometry3<f64>| at_height(pose, pose.translation.z.max(height));
        let mut batch = Batch::default();
        batch.straight(&raised(&here));
        batch.straight(&raised(&there));
        batch.straight(&there);
        Ok(Some(batch))
    }

    /// Moves above a pose (m, frame of the workstation), turned so that the held object has the
    /// orientation of the pose, or an empty gripper could take an object there. From lower down the
    /// controlled point first rises to the travel height.
    pub(crate) fn move_above(&self, pose: &Isometry3<f64>) -> Result<Batch, PlanError> {
        let height = self.travel_height()?;
        let rotation = match (self.model.held(), self.model.effector()) {
            (Some(held), Some(effector)) => {
                let tip_from_object =
                    tool_of(effector).arm_from_tip().inverse() * held.location.pose;
                pose.rotation * tip_from_object.rotation.inverse()
            }
            _ => pose.rotation * pointing_down(),
        };
        let target = Isometry3::from_parts(
            [pose.translation.x, pose.translation.y, height].into(),
            rotation,
        );
        let mut batch = Batch::default();
        let now = self.tip()?;
        if now.translation.z < height - 1e-6 {
            batch.straight(&at_height(&now, height));
        }
        self.travel(&mut batch, &target);
        self.ends_at(&mut batch, &target)?;
        Ok(batch)
    }

    /// Down to the grasp, close, up until the lowest point of the object is as high as the tip was.
    pub(crate) fn pick_up(&self, object: ObjectId) -> Result<Batch, PlanError> {
        const NAME: &str = "RobotPickUp";
        let object = self.model.object(object)?;
        let Some(effector) = self.model.effector() else {
            return fail(NAME, "the arm has no end effector".into());
        };
        if let Some(held) = self.model.held() {
            return fail(NAME, format!("the gripper already holds {}", held.name));
        }
        self.suits(effector, object)?;
        let object_from_tip = self.model.grasp(object.id)?;
        let goal = self.model.workstation_from(object.id)? * object_from_tip;
        let lowest = self
            .model
            .bounds(object.id)?
            .map_or(goal.translation.z, |b| b.minimum[2]);
        let rise = (self.tip()?.translation.z - lowest).max(0.0);
        let up = at_height(&goal, goal.translation.z + rise);
        let mut batch = Batch::default();
        batch.straight(&goal);
        self.settle(&mut batch);
        batch.push(Command::CloseGripper);
        self.settle(&mut batch);
        batch.straight(&up);
        let pose = tool_of(effector).arm_from_tip() * object_from_tip.inverse();
        let location = Location::pose(effector.id, pose);
        batch.changes.push(Change::Place {
            object: object.id,
            location,
        });
        self.ends_at(&mut batch, &up)?;
        Ok(batch)
    }

    /// The end effector can hold this kind of object.
    fn suits(&self, effector: &Object, object: &Object) -> Result<(), PlanError> {
        let sku = match object.class {
            Class::KitInstance => self
                .model
                .children(object.id)
                .find(|c| c.class == Class::KitTray),
            _ => Some(object),
        };
        let sku = sku
            .and_then(Object::sku)
            .and_then(|sku| self.model.sku(sku));
        let Some(sku) = sku else { return Ok(()) };
        if sku.effectors.is_empty() || sku.effectors.iter().any(|id| effector.is_called(id)) {
            return Ok(());
        }
        let wanted = sku.effectors.join(" or ");
        fail(
            "RobotPickUp",
            format!("{} cannot hold a {}, {wanted} can", effector.name, sku.id),
        )
    }

    /// Into the pose, open, up until the tip is as high as the lowest point of the object was. The
    /// object is then located relative to what is below it.
    pub(crate) fn put_down(
        &self,
        object: ObjectId,
        pose: &Isometry3<f64>,
    ) -> Result<(Batch, Option<String>), PlanError> {
        const NAME: &str = "RobotPutDown";
        let object = self.model.object(object)?;
        let (Some(effector), Some(held)) = (self.model.effector(), self.model.held()) else {
            return fail(NAME, format!("the gripper does not hold {}", object.name));
        };
        if held.id != object.id {
            return fail(
                NAME,
                format!("the gripper holds {}, not {}", held.name, object.name),
            );
        }
        let t = pose.translation;
        let support = self
            .model
            .support(object.class, [t.x, t.y, t.z], object.id)?;
        let (place, warning) = self.place(object, pose, support)?;
        let object_from_tip = held.location.pose.inverse() * tool_of(effector).arm_from_tip();
        let goal = place * object_from_tip;
        let lowest = self.tip()?.translation.z - self.below_tip()?;
        let up = at_height(&goal, lowest.max(goal.translation.z));
        let mut batch = Batch::default();
        batch.straight(&goal);
        self.settle(&mut batch);
        batch.push(Command::OpenGripper);
        self.settle(&mut batch);
        batch.straight(&up);
        let pose = self.model.workstation_from(support)?.inv_mul(&place);
        let location = Location::pose(support, pose);
        batch.changes.push(Change::Place {
            object: object.id,
            location,
        });
        self.ends_at(&mut batch, &up)?;
        Ok((batch, warning))
    }

    /// The place as given, or raised on top of what is there already.
    fn place(
        &self,
        object: &Object,
        pose: &Isometry3<f64>,
        support: ObjectId,
    ) -> Result<(Isometry3<f64>, Option<String>), PlanError> {
        let container = self.model.object(support)?;
        if !container.class.is_container() || !self.options.stack {
            return Ok((*pose, None));
        }
        let height = self.model.free_height(support, pose, object.id)?;
        let rise = height - pose.translation.z;
        if rise < 1e-6 {
            return Ok((*pose, None));
        }
        let warning = format!(
            "{} is put {:.1} mm higher than the plan says, on top of what is in {}",
            object.name,
            rise * 1000.0,
            container.name
        );
        Ok((at_height(pose, height), Some(warning)))
    }

    /// To the changing station: put the present end effector into an empty holder, take the other.
    pub(crate) fn change_effector(&self, id: &str) -> Result<Batch, PlanError> {
        const NAME: &str = "RobotChangeEndEffector";
        let wanted = self
            .model
            .named(id)
            .filter(|object| object.class.is_a(Class::EndEffector));
        let Some(wanted) = wanted else {
            return fail(NAME, format!("the world has no end effector {id}"));
        };
        let present = self.model.effector();
        if present.is_some_and(|present| present.id == wanted.id) {
            return Ok(Batch::default());
        }
        if let Some(held) = self.model.held() {
            return fail(NAME, format!("the gripper still holds {}", held.name));
        }
        let mut batch = Batch::default();
        match present {
            Some(present) => self.detach(&mut batch, present)?,
            None => batch.push(Command::OpenToolChanger),
        }
        self.attach(&mut batch, wanted)?;
        Ok(batch)
    }

    /// An empty holder of the changing station; preferably one whose name contains that of the end
    /// effector.
    fn holder_for(&self, effector: &Object) -> Result<&Object, PlanError> {
        let empty = |object: &&Object| {
            object.class == Class::EndEffectorHolder
                && self.model.children(object.id).next().is_none()
        };
        let named = format!("{}holder", effector.name)
            .to_lowercase()
            .replace('_', "");
        let mut holders: Vec<&Object> = self.model.objects().filter(empty).collect();
        holders.sort_by_key(|holder| holder.name.to_lowercase().replace('_', "") != named);
        holders
            .first()
            .copied()
            .ok_or_else(|| PlanError::Statement {
                statement: "RobotChangeEndEffector".into(),
                why: format!("no holder is empty for {}", effector.name),
            })
    }

    /// Puts the end effector into an empty holder.
    pub(crate) fn detach(&self, batch: &mut Batch, effector: &Object) -> Result<(), PlanError> {
        let holder = self.holder_for(effector)?;
        self.detach_into(batch, effector, holder)
    }

    /// Puts the end effector into this holder; the controlled point is then the end of the arm.
    pub(crate) fn detach_into(
        &self,
        batch: &mut Batch,
        effector: &Object,
        holder: &Object,
    ) -> Result<(), PlanError> {
        let in_holder = Isometry3::from_parts([0.0; 3].into(), pointing_down());
        let arm = self.model.workstation_from(holder.id)? * in_holder;
        let tip = arm * tool_of(effector).arm_from_tip();
        let height = self.travel_height()?;
        let now = self.tip()?;
        if now.translation.z < height - 1e-6 {
            batch.straight(&at_height(&now, height));
        }
        self.travel(batch, &at_height(&tip, height));
        batch.straight(&tip);
        self.settle(batch);
        batch.push(Command::OpenToolChanger);
        batch.tool(None);
        self.settle(batch);
        let up = at_height(&arm, height.max(arm.translation.z));
        batch.straight(&up);
        let location = Location::pose(holder.id, in_holder);
        batch.changes.push(Change::Place {
            object: effector.id,
            location,
        });
        batch.changes.push(Change::Arm(up));
        Ok(())
    }

    /// Takes the end effector out of its holder; the controlled point is then its tip.
    pub(crate) fn attach(&self, batch: &mut Batch, effector: &Object) -> Result<(), PlanError> {
        let tool = tool_of(effector);
        let arm = self.model.workstation_from(effector.id)?;
        let height = self.model.highest()? + self.options.clearance;
        let above = at_height(&arm, height.max(arm.translation.z));
        if batch.commands.len() < 2 {
            let now = situation(self.model)?.arm;
            if now.translation.z < above.translation.z - 1e-6 {
                batch.straight(&at_height(&now, above.translation.z));
            }
        }
        self.travel(batch, &above);
        batch.straight(&arm);
        self.settle(batch);
        batch.push(Command::CloseToolChanger);
        batch.tool(Some(tool.clone()));
        self.settle(batch);
        let tip = at_height(&(arm * tool.arm_from_tip()), height);
        batch.straight(&tip);
        batch.push(Command::OpenGripper);
        let up = tip * tool.arm_from_tip().inverse();
        let robot = self.model.robot()?.id;
        let pose = self.model.workstation_from(robot)?.inv_mul(&up);
        batch.changes.push(Change::Place {
            object: effector.id,
            location: Location::pose(robot, pose),
        });
        batch.changes.push(Change::Arm(up));
        Ok(())
    }
}
