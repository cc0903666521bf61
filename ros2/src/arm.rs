//! The arm as driver and engine send it each period.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use ipc::{Arm, IpcError, Observer, Setpoint, SetpointFlags, State, StateFlags};
use ros2_client::builtin_interfaces::Time;

use crate::messages::{Header, JointState, Point, Span};

/// After this time without a state nothing is known of the arm.
const FRESH: Duration = Duration::from_secs(1);

/// Reads the cyclic messages of an arm.
pub(crate) struct ArmReader {
    observer: Observer,
    /// Names of the joints.
    pub(crate) joints: Vec<String>,
    state: Option<(State, Instant)>,
    setpoint: Option<Setpoint>,
}

impl ArmReader {
    /// Opens the messages of an arm with these joints.
    ///
    /// # Errors
    /// Shared memory.
    pub(crate) fn open(arm: &Arm, joints: Vec<String>) -> Result<Self, IpcError> {
        let observer = Observer::open(arm)?;
        Ok(Self {
            observer,
            joints,
            state: None,
            setpoint: None,
        })
    }

    /// Reads what has come; says whether a state has.
    pub(crate) fn look(&mut self) -> bool {
        let count = self.joints.len();
        let mut fresh = false;
        while let Some(state) = self.observer.next_state() {
            if state.check(count).is_ok() && state.flags & StateFlags::UNKNOWN == 0 {
                self.state = Some((state, Instant::now()));
                fresh = true;
            }
        }
        while let Some(setpoint) = self.observer.next_setpoint() {
            if setpoint.check(count).is_ok() {
                self.setpoint = Some(setpoint);
            }
        }
        fresh
    }

    fn state(&self) -> Option<&State> {
        let (state, at) = self.state.as_ref()?;
        (at.elapsed() < FRESH).then_some(state)
    }

    /// The measured joints as a message; none where nothing is known.
    pub(crate) fn message(&self) -> Option<JointState> {
        let state = self.state()?;
        let count = self.joints.len();
        let unless = |flag: u32, all: &[f64]| {
            let known = state.flags & flag == 0;
            if known {
                all[..count].to_vec()
            } else {
                Vec::new()
            }
        };
        Some(JointState {
            header: header(state.measured_ns),
            name: self.joints.clone(),
            position: state.position[..count].to_vec(),
            velocity: unless(StateFlags::NO_VELOCITY, &state.velocity),
            effort: unless(StateFlags::NO_EFFORT, &state.effort),
        })
    }

    /// Whether the last setpoint rests because the speed along the path is 0: a pause, a stop or an override of 0.
    pub(crate) fn is_held(&self) -> bool {
        let setpoint = self.setpoint.as_ref();
        setpoint.is_some_and(|setpoint| {
            setpoint.flags & SetpointFlags::HOLD != 0 && setpoint.time_scaling == 0.0
        })
    }

    /// Planned time since the start of the command (s).
    pub(crate) fn path_time(&self) -> f64 {
        self.setpoint
            .as_ref()
            .map_or(0.0, |setpoint| setpoint.path_time)
    }

    /// How far each joint is from its setpoint: position and velocity.
    pub(crate) fn off(&self) -> Option<Vec<(f64, f64)>> {
        let (state, setpoint) = (self.state()?, self.setpoint.as_ref()?);
        let off = |joint: usize| {
            let velocity = if state.flags & StateFlags::NO_VELOCITY == 0 {
                setpoint.velocity[joint] - state.velocity[joint]
            } else {
                0.0
            };
            (setpoint.position[joint] - state.position[joint], velocity)
        };
        Some((0..self.joints.len()).map(off).collect())
    }

    /// Setpoint, measured joints and the first less the second, with the header for them.
    pub(crate) fn progress(&self) -> Option<(Header, [Point; 3])> {
        let (state, setpoint) = (self.state()?, self.setpoint.as_ref()?);
        let count = self.joints.len();
        let time_from_start = Span::of(setpoint.path_time.max(0.0));
        let desired = Point {
            positions: setpoint.position[..count].to_vec(),
            velocities: setpoint.velocity[..count].to_vec(),
            accelerations: setpoint.acceleration[..count].to_vec(),
            effort: Vec::new(),
            time_from_start,
        };
        let actual = Point {
            positions: state.position[..count].to_vec(),
            velocities: state.velocity[..count].to_vec(),
            time_from_start,
            ..Point::default()
        };
        let less = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
        let error = Point {
            positions: less(&desired.positions, &actual.positions),
            velocities: less(&desired.velocities, &actual.velocities),
            time_from_start,
            ..Point::default()
        };
        Some((header(state.measured_ns), [desired, actual, error]))
    }
}

/// The time of ROS when the monotonic clock showed this (ns): the wall clock.
fn header(monotonic_ns: u64) -> Header {
    let wall = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    let ago = scheduling::now_ns().saturating_sub(monotonic_ns);
    let ns = i64::try_from(wall.as_nanos()).unwrap_or(i64::MAX);
    let stamp = Time::from_nanos(ns.saturating_sub(i64::try_from(ago).unwrap_or(0)));
    Header {
        stamp,
        frame_id: String::new(),
    }
}
