use clap::Args;
use driver_ur::{Delivery, GripperOutput, UrOptions};

use super::{about, until_signal};
use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::robot::RobotOption;

/// Drive an arm of Universal Robots (CB3, e-Series) until Ctrl-C
///
/// Nothing moves before an engine starts. Read docs/drivers/ur.md before the first start.
#[derive(Args, Debug)]
pub(super) struct Ur {
    #[command(flatten)]
    robot: RobotOption,
    #[command(flatten)]
    arm: ArmOption,
    /// Address of the controller
    #[arg(long, value_name = "ADDRESS")]
    address: String,
    /// States a second; without it what the series offers, 125 (CB3) or 500 (e-Series)
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// How far the setpoints that are sent are behind those of the engine, ms
    #[arg(long, value_name = "MS", default_value_t = 6.0)]
    delay: f64,
    /// Time over which servoj smooths, s: 0.03 to 0.2
    #[arg(long, value_name = "S", default_value_t = 0.03)]
    lookahead: f64,
    /// Gain of servoj: 100 to 2000
    #[arg(long, value_name = "GAIN", default_value_t = 2000.0)]
    gain: f64,
    /// After this time without a setpoint the program on the robot stops the arm, ms: 20 to 500
    #[arg(long, value_name = "MS", default_value_t = 100.0)]
    timeout: f64,
    /// The program is started on the pendant, by a node that asks this machine for it on this port
    /// (the URCap External Control: 50002); without it the program is sent to the robot
    #[arg(long, value_name = "PORT")]
    pendant: Option<u16>,
    /// Address of this machine as the robot sees it; without it that of the connection
    #[arg(long, value_name = "ADDRESS")]
    host: Option<String>,
    /// Port on which this machine waits for the program; 0 is any free one
    #[arg(long, value_name = "PORT", default_value_t = 50001)]
    port: u16,
    /// Digital output that closes a gripper: 0 to 7 standard, 8 to 15 configurable, 16 and 17 tool
    #[arg(long, value_name = "OUTPUT")]
    gripper_output: Option<u32>,
    /// How long that gripper takes to open and to close, s
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    gripper_time: f64,
}

impl Ur {
    /// Drives until a signal.
    pub(super) fn run(&self) -> Result<Exit, Failure> {
        let robot = self.robot.load()?;
        let arm = self.arm.open()?;
        let time = self.gripper_time;
        let options = UrOptions {
            rate: self.rate,
            delay: self.delay * 1e-3,
            lookahead: self.lookahead,
            gain: self.gain,
            timeout: self.timeout * 1e-3,
            delivery: match self.pendant {
                Some(port) => Delivery::Pendant { port },
                None => Delivery::Send,
            },
            host: self.host.clone(),
            port: self.port,
            gripper: self
                .gripper_output
                .map(|output| GripperOutput { output, time }),
            ..UrOptions::new(&self.address, about(&robot))
        };
        until_signal(|how, stop| driver_ur::run(&arm, options, how, stop))
    }
}
