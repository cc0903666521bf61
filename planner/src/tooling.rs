//! Which end effector is on the arm, which are in the station, and the rules of changing them.

use kinematics::Inertia;
use nalgebra::Isometry3;

use crate::command_error::{CommandError, ErrorClass};
use crate::end_effector::{EndEffector, ToolChanger};
use crate::task::ToolAction;

/// A place of the tool changing station.
#[derive(Clone, Debug, PartialEq)]
pub struct Holder {
    /// Name, unique in a station.
    pub name: String,
    /// Pose of the arm's end while it leaves or takes an end effector here.
    pub workstation_from_flange: Isometry3<f64>,
    /// Index of the end effector that is in the holder.
    pub holds: Option<usize>,
}

/// Tools of one arm and their state.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Tooling {
    /// All end effectors of the robot.
    pub end_effectors: Vec<EndEffector>,
    /// Places of the station; empty when the arm has no tool changer.
    pub holders: Vec<Holder>,
    /// Index of the end effector on the arm.
    pub mounted: Option<usize>,
    /// Whether the gripper is open, when it is known.
    pub gripper_open: Option<bool>,
    /// Whether the tool changer is open.
    pub changer_open: bool,
    /// Nominal times of the tool changer; `None` for an arm without one.
    pub changer: Option<ToolChanger>,
    /// What the flange carries beside the end effector, where it is known.
    pub payload: Option<Inertia>,
}

/// How near the arm's end must be to a holder's pose, m and rad.
const DOCKING: (f64, f64) = (1e-3, 1e-2);

impl Tooling {
    /// From the arm's end to the controlled point: the tool centre point of
    /// the mounted end effector, or the arm's end itself.
    #[must_use]
    pub fn flange_from_tool(&self) -> Isometry3<f64> {
        self.mounted_tool()
            .map_or_else(Isometry3::identity, |tool| tool.flange_from_tcp)
    }

    /// What the flange carries now, in its frame: the mounted end effector and what is always there.
    /// `None` where no mass is known: then the arm's controller keeps what it was told by others.
    #[must_use]
    pub fn carried(&self) -> Option<Inertia> {
        let mut tools = self.end_effectors.iter();
        if self.payload.is_none() && tools.all(|tool| tool.inertia.is_none()) {
            return None;
        }
        let always = self.payload.unwrap_or_else(Inertia::none);
        let mounted = self.mounted_tool().and_then(|tool| tool.inertia);
        Some(mounted.map_or(always, |tool| always.with(&tool)))
    }

    /// Nominal time of an action in the present state, s.
    #[must_use]
    pub fn nominal_time(&self, action: ToolAction) -> f64 {
        let gripper = self.mounted_tool().and_then(|tool| tool.gripper);
        match action {
            ToolAction::OpenGripper => gripper.map_or(0.0, |gripper| gripper.opening),
            ToolAction::CloseGripper => gripper.map_or(0.0, |gripper| gripper.closing),
            ToolAction::MoveGripper { .. } => {
                gripper.map_or(0.0, |gripper| gripper.opening.max(gripper.closing))
            }
            ToolAction::OpenToolChanger => self.changer.map_or(0.0, |changer| changer.opening),
            ToolAction::CloseToolChanger => self.changer.map_or(0.0, |changer| changer.closing),
        }
    }

    /// The action that opens the gripper to a share of its way, 0 to 1. A gripper that only opens
    /// and closes opens at any share above 0, as CRCL says.
    #[must_use]
    pub fn gripper_action(&self, share: f64) -> ToolAction {
        let gripper = self.mounted_tool().and_then(|tool| tool.gripper);
        match gripper.and_then(|gripper| gripper.width) {
            _ if share <= 0.0 => ToolAction::CloseGripper,
            Some(width) if share < 1.0 => ToolAction::MoveGripper {
                opening_um: (share * width * 1e6).round() as u32,
            },
            _ => ToolAction::OpenGripper,
        }
    }

    /// The end effector on the arm.
    #[must_use]
    pub fn mounted_tool(&self) -> Option<&EndEffector> {
        self.mounted.and_then(|index| self.end_effectors.get(index))
    }

    /// Checks an action with the arm's end at `workstation_from_flange` and applies it.
    ///
    /// # Errors
    /// A gripper-use or tool-change error; the state is then unchanged.
    pub fn apply(
        &mut self,
        action: ToolAction,
        workstation_from_flange: &Isometry3<f64>,
    ) -> Result<(), CommandError> {
        match action {
            ToolAction::OpenGripper => self.set_gripper(true),
            ToolAction::CloseGripper => self.set_gripper(false),
            ToolAction::MoveGripper { .. } => self.set_gripper(true),
            ToolAction::OpenToolChanger => self.release(workstation_from_flange),
            ToolAction::CloseToolChanger => self.take(workstation_from_flange),
        }
    }

    fn set_gripper(&mut self, open: bool) -> Result<(), CommandError> {
        let Some(tool) = self.mounted_tool() else {
            return Err(CommandError::new(
                ErrorClass::GripperUse,
                "no end effector is on the arm, so there is no gripper to use",
            )
            .with_help("take one from the tool changing station first"));
        };
        if tool.gripper.is_none() {
            let message = format!("end effector {:?} is not a gripper", tool.name);
            return Err(CommandError::new(ErrorClass::GripperUse, message));
        }
        self.gripper_open = Some(open);
        Ok(())
    }

    fn release(&mut self, flange: &Isometry3<f64>) -> Result<(), CommandError> {
        self.require_changer()?;
        let Some(tool) = self.mounted else {
            self.changer_open = true; // open already, or nothing to let go of: no error
            return Ok(());
        };
        if self.gripper_open == Some(false) {
            return Err(CommandError::new(
                ErrorClass::ToolChange,
                "the gripper must be open before its end effector is left in the station",
            )
            .with_help("put OpenGripper() before OpenToolChanger()"));
        }
        let holder = self.holder_at(flange)?;
        if let Some(other) = self.holders[holder].holds {
            let name = &self.end_effectors[other].name;
            return Err(CommandError::new(
                ErrorClass::ToolChange,
                format!(
                    "holder {:?} already holds {name:?}",
                    self.holders[holder].name
                ),
            ));
        }
        self.holders[holder].holds = Some(tool);
        self.mounted = None;
        self.gripper_open = None;
        self.changer_open = true;
        Ok(())
    }

    fn take(&mut self, flange: &Isometry3<f64>) -> Result<(), CommandError> {
        self.require_changer()?;
        if self.mounted.is_some() {
            return Ok(()); // closed already: no error
        }
        self.changer_open = false;
        if let Ok(holder) = self.holder_at(flange)
            && let Some(tool) = self.holders[holder].holds.take()
        {
            self.mounted = Some(tool);
            self.gripper_open = Some(true);
        }
        Ok(())
    }

    fn require_changer(&self) -> Result<(), CommandError> {
        if self.holders.is_empty() {
            return Err(CommandError::new(
                ErrorClass::ToolChange,
                "this robot has no tool changing station",
            )
            .with_help("describe its holders in robot.toml"));
        }
        Ok(())
    }

    fn holder_at(&self, flange: &Isometry3<f64>) -> Result<usize, CommandError> {
        let gap = |holder: &Holder| {
            let between = holder.workstation_from_flange.inv_mul(flange);
            (between.translation.vector.norm(), between.rotation.angle())
        };
        let near = self
            .holders
            .iter()
            .enumerate()
            .map(|(index, holder)| (index, gap(holder)))
            .min_by(|a, b| a.1.0.total_cmp(&b.1.0));
        match near {
            Some((index, (distance, angle))) if distance <= DOCKING.0 && angle <= DOCKING.1 => {
                Ok(index)
            }
            Some((index, (distance, angle))) => Err(CommandError::new(
                ErrorClass::ToolChange,
                format!(
                    "the arm's end is not at a holder: {:.1} mm and {:.2} degrees from {:?}",
                    distance * 1e3,
                    angle.to_degrees(),
                    self.holders[index].name
                ),
            )),
            None => Err(CommandError::new(
                ErrorClass::ToolChange,
                "the station has no holder",
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tooling() -> Tooling {
        let gripper = EndEffector {
            name: "gripper".into(),
            flange_from_tcp: Isometry3::translation(0.0, 0.0, 0.1),
            gripper: Some(crate::end_effector::Gripper {
                opening: 0.2,
                closing: 0.2,
                width: Some(0.08),
            }),
            inertia: None,
            workstation_from_holder: None,
        };
        let holder = Holder {
            name: "left".into(),
            workstation_from_flange: Isometry3::translation(1.0, 0.0, 0.0),
            holds: None,
        };
        Tooling {
            end_effectors: vec![gripper],
            holders: vec![holder],
            mounted: Some(0),
            gripper_open: Some(true),
            changer_open: false,
            changer: Some(ToolChanger {
                opening: 0.5,
                closing: 0.5,
            }),
            payload: None,
        }
    }

    #[test]
    fn what_the_flange_carries_changes_with_the_end_effector() {
        let mut tools = tooling();
        assert_eq!(tools.carried(), None);
        let body = |mass: f64, height: f64| Inertia {
            mass,
            centre: nalgebra::vector![0.0, 0.0, height],
            ..Inertia::none()
        };
        tools.end_effectors[0].inertia = Some(body(1.0, 0.1));
        assert_eq!(tools.carried(), Some(body(1.0, 0.1)));
        tools.payload = Some(body(3.0, 0.02));
        let both = tools.carried().unwrap();
        assert_eq!(both.mass, 4.0);
        assert!((both.centre.z - 0.04).abs() < 1e-15);
        tools.mounted = None;
        assert_eq!(tools.carried(), tools.payload);
        tools.payload = None;
        assert_eq!(tools.carried(), Some(Inertia::none()));
    }

    #[test]
    fn leaving_and_taking_moves_the_controlled_point() {
        let mut tools = tooling();
        let at = Isometry3::translation(1.0, 0.0, 0.0);
        tools.apply(ToolAction::OpenToolChanger, &at).unwrap();
        assert_eq!(tools.flange_from_tool(), Isometry3::identity());
        assert!(tools.apply(ToolAction::OpenGripper, &at).is_err());
        tools.apply(ToolAction::CloseToolChanger, &at).unwrap();
        assert_eq!(tools.flange_from_tool().translation.z, 0.1);
        assert_eq!(tools.holders[0].holds, None);
    }

    #[test]
    fn nothing_is_dropped_away_from_a_holder() {
        let mut tools = tooling();
        let before = tools.clone();
        let error = tools
            .apply(ToolAction::OpenToolChanger, &Isometry3::identity())
            .unwrap_err();
        assert_eq!(error.class, ErrorClass::ToolChange);
        assert!(error.message.contains("1000.0 mm"), "{error}");
        assert_eq!(tools, before);
    }

    #[test]
    fn a_closed_gripper_is_not_left() {
        let mut tools = tooling();
        let at = Isometry3::translation(1.0, 0.0, 0.0);
        tools.apply(ToolAction::CloseGripper, &at).unwrap();
        assert!(tools.apply(ToolAction::OpenToolChanger, &at).is_err());
    }

    #[test]
    fn a_share_of_the_way_is_an_opening() {
        let mut tools = tooling();
        let action = |tools: &Tooling, share| tools.gripper_action(share);
        assert_eq!(action(&tools, 0.0), ToolAction::CloseGripper);
        assert_eq!(
            action(&tools, 0.25),
            ToolAction::MoveGripper { opening_um: 20_000 }
        );
        assert_eq!(action(&tools, 1.0), ToolAction::OpenGripper);
        for effector in &mut tools.end_effectors {
            if let Some(gripper) = &mut effector.gripper {
                gripper.width = None;
            }
        }
        assert_eq!(action(&tools, 0.25), ToolAction::OpenGripper);
    }
}
