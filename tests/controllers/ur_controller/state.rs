//! What the controller knows, and what its servers change.

use std::collections::HashMap;
use std::io::Write;
use std::net::TcpStream;
use std::time::Instant;

use super::interpreter::Running;
use super::motion::{Doing, JOINTS, Motion};

/// Kinds of messages on the primary interface.
const MESSAGE: u8 = 20;
const ERROR_CODE: u8 = 6;
const EXCEPTION: u8 = 10;

/// Robot modes, safety modes, runtime states.
pub(crate) const POWER_OFF: i32 = 3;
pub(crate) const IDLE: i32 = 5;
pub(crate) const RUNNING: i32 = 7;
pub(crate) const NORMAL: i32 = 1;
pub(crate) const PROTECTIVE: i32 = 3;
pub(crate) const STOPPED: u32 = 1;
pub(crate) const PLAYING: u32 = 2;
pub(crate) const PAUSED: u32 = 4;

/// Fields that clients ask for and that nobody here needs: they are zero.
const SIX: [&str; 13] = [
    "target_qdd",
    "target_current",
    "target_moment",
    "actual_current",
    "joint_control_output",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "target_TCP_pose",
    "target_TCP_speed",
    "joint_temperatures",
    "actual_joint_voltage",
    "ft_raw_wrench",
    "payload_inertia",
];
const NUMBERS: [&str; 8] = [
    "actual_execution_time",
    "actual_momentum",
    "actual_main_voltage",
    "actual_robot_voltage",
    "actual_robot_current",
    "standard_analog_output0",
    "standard_analog_output1",
    "payload",
];

/// How a controller is.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    /// Major, minor, bugfix, build.
    pub(crate) version: [u32; 4],
    /// Cycles a second.
    pub(crate) rate: f64,
    /// Where the arm is (rad).
    pub(crate) home: [f64; JOINTS],
    /// The mode in which it starts.
    pub(crate) robot_mode: i32,
    /// Whether it takes programs from outside.
    pub(crate) remote: bool,
    /// After this time a protective stop can be unlocked (s).
    pub(crate) unlock: f64,
}

impl Setting {
    /// An e-Series robot that is switched off, at `home` (rad).
    pub(crate) fn e_series(home: [f64; JOINTS]) -> Self {
        Self {
            version: [5, 21, 2, 1],
            rate: 500.0,
            home,
            robot_mode: POWER_OFF,
            remote: true,
            unlock: 1.0,
        }
    }

    /// A CB3 robot.
    pub(crate) fn cb3(home: [f64; JOINTS]) -> Self {
        Self {
            version: [3, 15, 8, 1],
            rate: 125.0,
            ..Self::e_series(home)
        }
    }
}

/// One cycle as it was.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Record {
    pub(crate) time: f64,
    pub(crate) actual: [f64; JOINTS],
    pub(crate) qdd: [f64; JOINTS],
    /// What `servoj` was told (rad), and how many setpoints had come.
    pub(crate) target: [f64; JOINTS],
    pub(crate) setpoints: u64,
}

/// A client of RTDE that gets states.
pub(crate) struct Listener {
    pub(crate) stream: TcpStream,
    pub(crate) fields: Vec<String>,
    /// Every how many cycles.
    pub(crate) every: u64,
}

/// Everything.
pub(crate) struct State {
    pub(crate) setting: Setting,
    pub(crate) began: Instant,
    pub(crate) cycles: u64,
    pub(crate) motion: Motion,
    pub(crate) robot_mode: i32,
    pub(crate) safety_mode: i32,
    pub(crate) runtime: u32,
    /// The slider on the pendant.
    pub(crate) slider: f64,
    /// When the next robot mode comes, by time (s).
    pub(crate) next_mode: Option<(f64, i32)>,
    pub(crate) protective_since: f64,
    pub(crate) outputs: u64,
    /// Mass and pose of the tool that the programs set.
    pub(crate) payload: f64,
    pub(crate) tool: Vec<f64>,
    pub(crate) said: Vec<String>,
    pub(crate) records: Vec<Record>,
    pub(crate) listeners: Vec<Listener>,
    pub(crate) primaries: Vec<TcpStream>,
    pub(crate) program: Option<Running>,
    pub(crate) beside: Vec<Running>,
    pub(crate) sockets: HashMap<String, (TcpStream, Vec<u8>)>,
    pub(crate) servos: u64,
    /// Setpoints that a program has read.
    pub(crate) setpoints: u64,
}

impl State {
    pub(crate) fn new(setting: Setting) -> Self {
        Self {
            began: Instant::now(),
            cycles: 0,
            motion: Motion::new(setting.home),
            robot_mode: setting.robot_mode,
            safety_mode: NORMAL,
            runtime: STOPPED,
            slider: 1.0,
            next_mode: None,
            protective_since: 0.0,
            outputs: 0,
            payload: 0.0,
            tool: Vec::new(),
            said: Vec::new(),
            records: Vec::new(),
            listeners: Vec::new(),
            primaries: Vec::new(),
            program: None,
            beside: Vec::new(),
            sockets: HashMap::new(),
            servos: 0,
            setpoints: 0,
            setting,
        }
    }

    /// The controller's time (s).
    pub(crate) fn time(&self) -> f64 {
        self.cycles as f64 / self.setting.rate
    }

    /// Moves the joints by one cycle.
    pub(crate) fn cycle(&mut self) {
        self.cycles += 1;
        let time = self.time();
        if let Some((at, mode)) = self.next_mode
            && time >= at
        {
            self.robot_mode = mode;
            // Switching on goes on until the brakes are the only thing that holds the arm.
            self.next_mode = (mode == 4).then_some((time + 0.2, IDLE));
        }
        let wanted = if self.runtime == PLAYING {
            self.slider
        } else {
            1.0
        };
        let bad = self.motion.cycle(1.0 / self.setting.rate, wanted);
        if let Some(joint) = bad {
            self.alarm(204, joint as i32, "Path sanity check failed");
            self.protective_stop();
        }
        if self.runtime == PLAYING {
            self.records.push(Record {
                time,
                actual: self.motion.actual,
                qdd: self.motion.qdd,
                target: match self.motion.doing {
                    Doing::Servo(servo) => servo.target,
                    Doing::Stop(_) => self.motion.q,
                },
                setpoints: self.setpoints,
            });
        }
    }

    /// The safety system stops the arm; the program is paused.
    pub(crate) fn protective_stop(&mut self) {
        self.safety_mode = PROTECTIVE;
        self.protective_since = self.time();
        if self.runtime == PLAYING {
            self.runtime = PAUSED;
        }
        self.motion.doing = Doing::Stop(30.0);
    }

    /// The program ends: on the pendant, by the dashboard, or by itself.
    pub(crate) fn stop_program(&mut self) -> Option<Running> {
        self.runtime = STOPPED;
        if matches!(self.motion.doing, Doing::Servo(_)) {
            self.motion.doing = Doing::Stop(10.0);
        }
        self.sockets.clear();
        self.program.take()
    }

    /// Tells an error on the primary interface.
    pub(crate) fn alarm(&mut self, code: i32, argument: i32, text: &str) {
        let mut body = Vec::new();
        for number in [code, argument, 3, 0, 0] {
            body.extend(number.to_be_bytes());
        }
        body.extend(text.as_bytes());
        self.send_message(ERROR_CODE, &body);
    }

    /// Tells that a program is wrong.
    pub(crate) fn exception(&mut self, line: usize, text: &str) {
        let mut body = (line as i32).to_be_bytes().to_vec();
        body.extend(1_i32.to_be_bytes());
        body.extend(text.as_bytes());
        self.said.push(format!("line {line}: {text}"));
        self.send_message(EXCEPTION, &body);
    }

    fn send_message(&mut self, kind: u8, body: &[u8]) {
        let mut package = vec![MESSAGE];
        package.extend([0; 8]);
        package.extend([253, kind]);
        package.extend(body);
        self.send_primary(&package);
    }

    /// Sends a package without its size to all clients of the primary interface.
    pub(crate) fn send_primary(&mut self, package: &[u8]) {
        let mut bytes = (package.len() as u32 + 4).to_be_bytes().to_vec();
        bytes.extend(package);
        self.primaries
            .retain_mut(|stream| stream.write_all(&bytes).is_ok());
    }

    /// A field of RTDE: its type and its bytes.
    pub(crate) fn field(&self, name: &str) -> Option<(&'static str, Vec<u8>)> {
        let six = |values: &[f64; JOINTS]| {
            let bytes = values.iter().flat_map(|value| value.to_be_bytes());
            ("VECTOR6D", bytes.collect())
        };
        let number = |value: f64| ("DOUBLE", value.to_be_bytes().to_vec());
        Some(match name {
            "timestamp" => number(self.time()),
            "actual_q" => six(&self.motion.actual),
            "actual_qd" => six(&self.motion.actual_qd),
            "target_q" => six(&self.motion.q),
            "target_qd" => six(&self.motion.qd),
            "actual_TCP_force" => six(&[0.0; JOINTS]),
            "speed_scaling" => number(1.0),
            "target_speed_fraction" => number(self.slider),
            "standard_analog_input0" => number(1.25),
            "standard_analog_input1" => number(0.0),
            "actual_digital_input_bits" => ("UINT64", 0b101_u64.to_be_bytes().to_vec()),
            "actual_digital_output_bits" => ("UINT64", self.outputs.to_be_bytes().to_vec()),
            "robot_mode" => ("INT32", self.robot_mode.to_be_bytes().to_vec()),
            "safety_mode" => ("INT32", self.safety_mode.to_be_bytes().to_vec()),
            "runtime_state" => ("UINT32", self.runtime.to_be_bytes().to_vec()),
            "robot_status_bits" => ("UINT32", 3_u32.to_be_bytes().to_vec()),
            "safety_status_bits" => ("UINT32", 1_u32.to_be_bytes().to_vec()),
            "actual_tool_accelerometer" | "payload_cog" => ("VECTOR3D", vec![0; 24]),
            "joint_mode" => ("VECTOR6INT32", vec![0; 24]),
            name if SIX.contains(&name) => six(&[0.0; JOINTS]),
            name if NUMBERS.contains(&name) => number(0.0),
            name if name.starts_with("output_int_register_") => ("INT32", vec![0; 4]),
            name if name.starts_with("output_double_register_") => number(0.0),
            _ => return None,
        })
    }
}
