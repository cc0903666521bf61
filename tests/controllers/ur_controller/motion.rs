//! How the controller moves the arm: the timing and gain law of `servoj`, stops, speed scaling, and
//! the check of the path.
//!
//! # Source
//! Universal Robots, script manual, `servoj`: `gain` is the proportional gain towards the target,
//! `lookahead_time` projects the present position forward with the present speed. So the commanded
//! joint obeys q'' = gain (target - (q + lookahead q')). All of it runs in the program's own time,
//! which the speed scaling slows down.

/// Joints of an arm.
pub(crate) const JOINTS: usize = 6;

/// Largest speed (rad/s) and acceleration (rad/s²) of the commanded joints before the controller
/// stops the arm (C204).
const SPEED: f64 = 3.4;
const ACCELERATION: f64 = 60.0;

/// The measured joint follows the commanded one with this time constant (s).
const LAG: f64 = 0.004;

/// How long the speed scaling takes from one to zero (s).
const RAMP: f64 = 0.4;

/// What `servoj` was called with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Servo {
    pub(crate) target: [f64; JOINTS],
    pub(crate) lookahead: f64,
    pub(crate) gain: f64,
}

/// What the commanded joints do.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Doing {
    /// Follow `servoj`.
    Servo(Servo),
    /// Brake with an acceleration (rad/s²), then rest.
    Stop(f64),
}

/// The joints.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    pub(crate) doing: Doing,
    /// Time of the last call of `servoj` that is left (s of the program).
    pub(crate) left: f64,
    /// Commanded position (rad), speed and acceleration.
    pub(crate) q: [f64; JOINTS],
    pub(crate) qd: [f64; JOINTS],
    pub(crate) qdd: [f64; JOINTS],
    /// Measured position (rad) and speed.
    pub(crate) actual: [f64; JOINTS],
    pub(crate) actual_qd: [f64; JOINTS],
    /// How fast the program's time goes, 0 to 1.
    pub(crate) scaling: f64,
}

impl Motion {
    /// Rests at `q` (rad).
    pub(crate) fn new(q: [f64; JOINTS]) -> Self {
        Self {
            doing: Doing::Stop(4.0),
            left: 0.0,
            q,
            qd: [0.0; JOINTS],
            qdd: [0.0; JOINTS],
            actual: q,
            actual_qd: [0.0; JOINTS],
            scaling: 1.0,
        }
    }

    /// One cycle of `dt` (s) with the speed scaling that is wanted. Returns the joint, from 0, at
    /// which the check of the path fails.
    pub(crate) fn cycle(&mut self, dt: f64, wanted: f64) -> Option<usize> {
        self.scaling += (wanted - self.scaling).clamp(-dt / RAMP, dt / RAMP);
        let time = dt * self.scaling;
        self.left -= time;
        let mut bad = None;
        for joint in 0..JOINTS {
            match self.doing {
                Doing::Servo(servo) => {
                    let ahead = self.q[joint] + servo.lookahead * self.qd[joint];
                    self.qdd[joint] = servo.gain * (servo.target[joint] - ahead);
                    self.qd[joint] += self.qdd[joint] * time;
                    self.q[joint] += self.qd[joint] * time;
                    let fast = self.qd[joint].abs() > SPEED;
                    if bad.is_none() && (fast || self.qdd[joint].abs() > ACCELERATION) {
                        bad = Some(joint);
                    }
                }
                Doing::Stop(most) => {
                    // A stop takes its own time.
                    let speed = self.qd[joint];
                    let less = (speed.abs() - most * dt).max(0.0);
                    self.qdd[joint] = (speed.signum() * less - speed) / dt;
                    self.qd[joint] = speed.signum() * less;
                    self.q[joint] += self.qd[joint] * dt;
                }
            }
            let before = self.actual[joint];
            self.actual[joint] += (self.q[joint] - before) * (1.0 - (-dt / LAG).exp());
            self.actual_qd[joint] = (self.actual[joint] - before) / dt;
        }
        bad
    }
}

/// The law itself: at constant speed the commanded joint is behind its target by the lookahead, a
/// jump is refused with its joint, and at 30 % the same way takes more than three times as long.
pub(crate) fn servoj_obeys_its_law() {
    let servo = |target| Servo {
        target,
        lookahead: 0.05,
        gain: 1000.0,
    };
    let mut motion = Motion::new([0.0; JOINTS]);
    let mut target = [0.0; JOINTS];
    for _ in 0..1000 {
        target[2] += 0.4 * 0.002;
        motion.doing = Doing::Servo(servo(target));
        assert_eq!(motion.cycle(0.002, 1.0), None);
    }
    let behind = target[2] - motion.q[2];
    assert!((behind - 0.4 * 0.05).abs() < 1e-3, "{behind}");
    target[4] += 0.2;
    motion.doing = Doing::Servo(servo(target));
    assert_eq!(motion.cycle(0.002, 1.0), Some(4));
    let cycles = |scaling: f64| {
        let mut motion = Motion::new([0.0; JOINTS]);
        motion.scaling = scaling;
        motion.doing = Doing::Servo(servo([0.03; JOINTS]));
        let reached = |motion: &Motion| (motion.q[0] - 0.03).abs() < 1e-4;
        (0..10_000).find(|_| {
            motion.cycle(0.002, scaling);
            reached(&motion)
        })
    };
    let (full, slow) = (cycles(1.0).unwrap(), cycles(0.3).unwrap());
    assert!(slow > 3 * full && slow < 4 * full, "{full} {slow}");
}
