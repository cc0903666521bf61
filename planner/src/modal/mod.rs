//! Applies the modes of the language (settings, units, the state between InitCanon and EndCanon):
//! each command becomes a self-contained [`Task`] in SI units.

mod moves;
mod pose;
mod settings;

use nalgebra::{Isometry3, Vector3};

pub use pose::isometry;
pub use settings::Settings;

use crate::command_error::CommandError;
use crate::task::{Shape, Task, ToolAction};
use crate::tooling::Tooling;
use crcl::{AngleUnit, Command, CoordinateFrame, Guard, LengthUnit, Pose};
use trajectory::ToolLimits;

/// What the controller accepts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CanonState {
    /// Before the first InitCanon.
    Unready,
    /// Between InitCanon and EndCanon.
    Ready,
    /// After EndCanon; only InitCanon is accepted.
    Ended,
}

/// The modes of one program on one arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Modal {
    state: CanonState,
    length: LengthUnit,
    angle: AngleUnit,
    frame: CoordinateFrame,
    settings: Settings,
    default_length: LengthUnit,
    maxima: ToolLimits,
    workstation_from_base: Isometry3<f64>,
    tooling: Tooling,
    /// Whether each joint slides.
    sliding: Vec<bool>,
    /// What SaveSettings has kept, the newest last.
    saved: Vec<Settings>,
    /// Guards of the next command that moves the arm or waits.
    guards: Vec<Guard>,
}

impl Modal {
    /// Modes before any command: unready, millimetres and degrees (or the
    /// dialect's default length), 10 % of the robot's speed and acceleration,
    /// tolerances 0. `sliding` says of each joint whether it slides.
    #[must_use]
    pub fn new(
        maxima: ToolLimits,
        workstation_from_base: Isometry3<f64>,
        tooling: Tooling,
        default_length: LengthUnit,
        sliding: Vec<bool>,
    ) -> Self {
        Self {
            sliding,
            saved: Vec::new(),
            guards: Vec::new(),
            state: CanonState::Unready,
            length: default_length,
            angle: AngleUnit::default(),
            frame: CoordinateFrame::Workstation,
            settings: Settings::start(&maxima),
            default_length,
            maxima,
            workstation_from_base,
            tooling,
        }
    }

    /// Whether commands are accepted.
    #[must_use]
    pub fn state(&self) -> CanonState {
        self.state
    }

    /// Settings in force, SI.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Tools and where they are.
    #[must_use]
    pub fn tooling(&self) -> &Tooling {
        &self.tooling
    }

    /// Units that numbers of the program are in.
    #[must_use]
    pub fn units(&self) -> (LengthUnit, AngleUnit) {
        (self.length, self.angle)
    }

    /// Refuses everything except InitCanon from now on, as after an aborted program.
    pub fn abort(&mut self) {
        self.state = CanonState::Ended;
        self.guards.clear();
        // What was kept was for the time after a move that has not ended.
        if let Some(settings) = self.saved.drain(..).next() {
            self.settings = settings;
        }
    }

    /// Turns one command into a task; the arm's end is at `workstation_from_flange` when the
    /// command starts.
    ///
    /// # Errors
    /// A [`CommandError`]; the modes are then unchanged.
    pub fn resolve(
        &mut self,
        command: &Command,
        workstation_from_flange: &Isometry3<f64>,
    ) -> Result<Task, CommandError> {
        self.check_sequence(command)?;
        command.check()?;
        match command {
            Command::InitCanon => {
                self.state = CanonState::Ready;
                self.length = self.default_length;
                self.angle = AngleUnit::default();
                self.frame = CoordinateFrame::Workstation;
                self.guards.clear();
                Ok(Task::Begin)
            }
            Command::EndCanon { reason } => {
                self.state = CanonState::Ended;
                Ok(Task::End { reason: *reason })
            }
            Command::Message { text } => Ok(Task::Message { text: text.clone() }),
            Command::Dwell { seconds } => Ok(Task::Dwell { seconds: *seconds }),
            Command::StopMotion { emergency } => Ok(Task::Stop {
                emergency: *emergency != 0,
            }),
            Command::OpenGripper => self.tool(ToolAction::OpenGripper, workstation_from_flange),
            Command::CloseGripper => self.tool(ToolAction::CloseGripper, workstation_from_flange),
            Command::SetEndEffector { setting } => {
                let action = self.tooling.gripper_action(*setting);
                self.tool(action, workstation_from_flange)
            }
            Command::OpenToolChanger => {
                self.tool(ToolAction::OpenToolChanger, workstation_from_flange)
            }
            Command::CloseToolChanger => {
                self.tool(ToolAction::CloseToolChanger, workstation_from_flange)
            }
            Command::MoveTo { pose } => self.motion(
                Shape::Joint,
                std::slice::from_ref(pose),
                workstation_from_flange,
            ),
            Command::MoveStraightTo { pose } => self.motion(
                Shape::Straight,
                std::slice::from_ref(pose),
                workstation_from_flange,
            ),
            Command::MoveSmoothlyTo { poses } | Command::MoveThroughTo { poses } => {
                self.motion(Shape::Smooth, poses, workstation_from_flange)
            }
            Command::ActuateJoints { joints } => self.joints(joints),
            Command::MoveScrew { screw } => self.screw(screw, workstation_from_flange),
            Command::MoveThroughWaypoints { waypoints } => {
                self.legs(waypoints, workstation_from_flange)
            }
            Command::Guard { guard } => self.guard(guard),
            Command::SaveSettings => self.save_settings(),
            Command::RestoreSettings => self.restore_settings(),
            setting => self.set(setting),
        }
    }

    /// The guards of the command that comes now; none is left for a later one.
    pub(crate) fn take_guards(&mut self) -> Vec<Guard> {
        std::mem::take(&mut self.guards)
    }

    fn guard(&mut self, guard: &Guard) -> Result<Task, CommandError> {
        /// How many guards a command can have.
        const MOST: usize = 4;
        if self.guards.len() >= MOST {
            let message = format!("a command with more than {MOST} guards");
            return Err(CommandError::sequence(message)
                .with_help("each guard is for the next command that moves the arm or waits"));
        }
        self.guards.push(guard.clone());
        Ok(Task::Setting)
    }

    fn restore_settings(&mut self) -> Result<Task, CommandError> {
        let refused = || CommandError::sequence("RestoreSettings without SaveSettings before it");
        self.settings = self.saved.pop().ok_or_else(refused)?;
        Ok(Task::Setting)
    }

    fn save_settings(&mut self) -> Result<Task, CommandError> {
        /// How often settings can be kept one above the other.
        const MOST: usize = 16;
        if self.saved.len() >= MOST {
            let message = format!("SaveSettings for the {}th time", MOST + 1);
            return Err(CommandError::sequence(message)
                .with_help("RestoreSettings goes back to what was kept last"));
        }
        self.saved.push(self.settings.clone());
        Ok(Task::Setting)
    }

    fn check_sequence(&self, command: &Command) -> Result<(), CommandError> {
        let name = command.name();
        match (self.state, command) {
            (_, Command::StopMotion { .. })
            | (CanonState::Ready, _)
            | (CanonState::Unready | CanonState::Ended, Command::InitCanon) => {}
            (CanonState::Unready, _) => {
                return Err(CommandError::sequence(format!("{name} before InitCanon"))
                    .with_help("begin the program with InitCanon()"));
            }
            (CanonState::Ended, _) => {
                return Err(CommandError::sequence(format!("{name} after EndCanon"))
                    .with_help("only InitCanon() may follow EndCanon"));
            }
        }
        if self.state == CanonState::Ready && matches!(command, Command::InitCanon) {
            return Err(
                CommandError::sequence("InitCanon in a program that has begun already")
                    .with_help("end the running program with EndCanon(0) first"),
            );
        }
        Ok(())
    }

    fn tool(
        &mut self,
        action: ToolAction,
        workstation_from_flange: &Isometry3<f64>,
    ) -> Result<Task, CommandError> {
        self.tooling.apply(action, workstation_from_flange)?;
        Ok(Task::Tool(action))
    }

    fn workstation_from_frame(&self, workstation_from_flange: &Isometry3<f64>) -> Isometry3<f64> {
        match self.frame {
            CoordinateFrame::Workstation => Isometry3::identity(),
            CoordinateFrame::RobotBase => self.workstation_from_base,
            CoordinateFrame::ToolTip => workstation_from_flange * self.tooling.flange_from_tool(),
        }
    }

    /// A pose of the controlled point (m) as the program would write it now: in its frame and
    /// units, with the arm's end at `workstation_from_flange`.
    #[must_use]
    pub fn written(
        &self,
        workstation_from_tool: &Isometry3<f64>,
        workstation_from_flange: &Isometry3<f64>,
    ) -> Pose {
        let frame = self.workstation_from_frame(workstation_from_flange);
        let pose = frame.inv_mul(workstation_from_tool);
        let axis = |axis: Vector3<f64>| (pose.rotation * axis).into();
        Pose::Axes {
            point: (pose.translation.vector / self.length.metres()).into(),
            z_axis: axis(Vector3::z()),
            x_axis: axis(Vector3::x()),
        }
    }

    fn set(&mut self, command: &Command) -> Result<Task, CommandError> {
        match command {
            Command::SetLengthUnits { unit } => self.length = *unit,
            Command::SetAngleUnits { unit } => self.angle = *unit,
            Command::SetCoordinateFrame { frame } => self.frame = *frame,
            other => {
                let (length, angle) = (self.length.metres(), self.angle.radians());
                self.settings.set(other, length, angle, &self.maxima)?;
            }
        }
        Ok(Task::Setting)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn maxima() -> ToolLimits {
        ToolLimits {
            speed: 1.0,
            acceleration: 10.0,
            jerk: 100.0,
            angular_speed: 2.0,
            angular_acceleration: 20.0,
            angular_jerk: 200.0,
        }
    }

    fn modal() -> Modal {
        Modal::new(
            maxima(),
            Isometry3::identity(),
            Tooling::default(),
            LengthUnit::default(),
            vec![false; 6],
        )
    }

    fn run(modal: &mut Modal, commands: &[Command]) -> Result<Vec<Task>, CommandError> {
        let flange = Isometry3::identity();
        commands
            .iter()
            .map(|command| modal.resolve(command, &flange))
            .collect()
    }

    #[test]
    fn nothing_before_init_and_only_init_after_end() {
        let mut modal = modal();
        let error = run(&mut modal, &[Command::OpenGripper]).unwrap_err();
        assert_eq!(error.class, crate::command_error::ErrorClass::Sequence);
        let end = Command::EndCanon { reason: 0 };
        run(&mut modal, &[Command::InitCanon, end.clone()]).unwrap();
        assert!(run(&mut modal, std::slice::from_ref(&end)).is_err());
        run(&mut modal, &[Command::InitCanon]).unwrap();
        assert_eq!(modal.state(), CanonState::Ready);
    }

    #[test]
    fn init_resets_units_and_nothing_else() {
        let mut modal = modal();
        run(
            &mut modal,
            &[
                Command::InitCanon,
                Command::SetLengthUnits {
                    unit: LengthUnit::Inch,
                },
                Command::SetAbsoluteSpeed { value: 10.0 },
                Command::EndCanon { reason: 0 },
                Command::InitCanon,
            ],
        )
        .unwrap();
        assert_eq!(modal.units(), (LengthUnit::Millimeter, AngleUnit::Degree));
        assert!((modal.settings().speed - 0.254).abs() < 1e-15);
    }

    #[test]
    fn absolute_and_relative_speed_are_one_value() {
        let mut modal = modal();
        run(&mut modal, &[Command::InitCanon]).unwrap();
        run(&mut modal, &[Command::SetRelativeSpeed { percent: 50.0 }]).unwrap();
        assert_eq!(modal.settings().speed, 0.5);
        run(&mut modal, &[Command::SetAbsoluteSpeed { value: 250.0 }]).unwrap();
        assert_eq!(modal.settings().speed, 0.25);
        let error = run(&mut modal, &[Command::SetAbsoluteSpeed { value: 1000.1 }]).unwrap_err();
        assert!(error.message.contains("at most"), "{error}");
        assert_eq!(modal.settings().speed, 0.25);
    }

    #[test]
    fn no_speed_no_motion() {
        let mut modal = modal();
        let pose = crcl::Pose::Axes {
            point: [1.0, 0.0, 0.0],
            z_axis: [0.0, 0.0, 1.0],
            x_axis: [1.0, 0.0, 0.0],
        };
        run(
            &mut modal,
            &[
                Command::InitCanon,
                Command::SetRelativeSpeed { percent: 0.0 },
            ],
        )
        .unwrap();
        assert!(run(&mut modal, &[Command::MoveTo { pose }]).is_err());
    }

    fn unit_change() -> impl Strategy<Value = Command> {
        let length = [LengthUnit::Inch, LengthUnit::Millimeter, LengthUnit::Meter];
        let angle = [AngleUnit::Degree, AngleUnit::Radian];
        prop_oneof![
            proptest::sample::select(length.to_vec())
                .prop_map(|unit| Command::SetLengthUnits { unit }),
            proptest::sample::select(angle.to_vec())
                .prop_map(|unit| Command::SetAngleUnits { unit }),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(7), ..Default::default() })]

        /// A change of units changes how later numbers are read and no physical value.
        #[test]
        fn units_change_nothing_physical(changes in prop::collection::vec(unit_change(), 0..12)) {
            let mut modal = modal();
            run(&mut modal, &[
                Command::InitCanon,
                Command::SetAbsoluteSpeed { value: 123.0 },
                Command::SetIntermediatePointTolerance { tolerance: 1.5 },
                Command::SetEndAngleTolerance { tolerance: 2.0 },
            ]).unwrap();
            let before = modal.settings().clone();
            run(&mut modal, &changes).unwrap();
            prop_assert_eq!(modal.settings(), &before);
        }

        /// A refused command leaves the modes as they were.
        #[test]
        fn refusal_changes_nothing(value in prop_oneof![Just(f64::NAN), -1e9..-1e-9_f64]) {
            let mut modal = modal();
            run(&mut modal, &[Command::InitCanon]).unwrap();
            let before = format!("{modal:?}");
            for command in [
                Command::SetAbsoluteSpeed { value },
                Command::SetRelativeAcceleration { percent: value },
                Command::SetEndPointTolerance { tolerance: value },
                Command::Dwell { seconds: value },
            ] {
                prop_assert!(run(&mut modal, &[command]).is_err());
            }
            prop_assert_eq!(format!("{modal:?}"), before);
        }
    }
}
