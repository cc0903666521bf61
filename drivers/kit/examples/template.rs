//! A driver for your own robot: fill in the places marked HERE. Start it, then run a program:
//!     cargo run --release -p driver-kit --example template -- cell/arm
//!     canter run PROGRAM --robot ur5e --driver external --arm cell/arm
use driver_kit::{
    About, Command, DriverError, Measured, Measurement, Reference, Robot, RunOptions, asked_to_end,
    run,
};
use ipc::{GRIPPER, ToolAction, ToolCommand, ToolStatus};

/// Six ideal joints that reach each setpoint at once.
struct MyRobot([Measured; 6], ToolStatus);

impl Robot for MyRobot {
    fn about(&self) -> About {
        // HERE: ranges (rad), and limits of speed (rad/s), acceleration (rad/s2), jerk (rad/s3): at
        // least those of the robot's folder.
        About {
            name: "my robot".to_owned(),
            lower: vec![-6.3; 6],
            upper: vec![6.3; 6],
            velocity: vec![3.2; 6],
            acceleration: vec![20.0; 6],
            jerk: vec![400.0; 6],
            ..About::default()
        }
    }

    fn measure(&mut self, joints: &mut [Measured]) -> Measurement {
        // HERE: copy the last joint positions and velocities of the hardware; say when they were
        // measured, or that they are unknown.
        joints.copy_from_slice(&self.0);
        Measurement::Now
    }

    fn follow(&mut self, command: &Command<'_>) {
        // HERE: send the references to the hardware; use velocity and acceleration as feed-forward.
        // `command.at_ns` says when the joints shall be there.
        self.0 = core::array::from_fn(|joint| command.joints[joint].into());
    }

    // HERE: `begin` switches on and `fault` names faults, where the hardware has them; see `Robot`.

    fn act(&mut self, _tool: usize, order: &ToolCommand) {
        // HERE: begin to open or close; `tool_status` reports when it is done.
        let open = order.action == ToolAction::Open as u32;
        self.1 = [ToolStatus::Closed, ToolStatus::Open][usize::from(open)];
    }

    fn tool_status(&self, tool: usize) -> ToolStatus {
        [ToolStatus::Unknown, self.1][usize::from(tool == GRIPPER)]
    }
}

fn main() -> Result<(), DriverError> {
    let arm = std::env::args().nth(1).unwrap_or("cell/arm".to_owned());
    let domain = ipc::Domain::choose(None, |name| std::env::var_os(name))?;
    let home = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0].map(|at| Reference::rest(at).into());
    let robot = MyRobot(home, ToolStatus::Open);
    // After Ctrl-C or SIGTERM the kit brakes the arm first.
    let stop = asked_to_end()?;
    let report = run(&domain.arm(&arm)?, robot, &RunOptions::default(), &stop)?;
    report.braked.iter().for_each(|text| eprintln!("{text}"));
    Ok(())
}
