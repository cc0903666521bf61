//! Planned motions of a six-joint arm for the tests of the servo loop.

use nalgebra::{SMatrix, SVector};
use realtime::{JointLimits, Piece, Sample, Segment};
use servo::{EndTolerance, ExecutorConfig, SegmentSender, Work};

/// Joints of the test arm.
pub const JOINTS: usize = 6;

/// Positions or limits of the test arm.
pub type Joints = SVector<f64, JOINTS>;

/// Limits of the test arm.
pub fn limits() -> JointLimits<JOINTS> {
    JointLimits {
        lower: Joints::from_element(-6.3),
        upper: Joints::from_element(6.3),
        velocity: Joints::from_element(3.1),
        acceleration: Joints::from_element(15.0),
        jerk: Joints::from_element(200.0),
        ends: None,
    }
}

/// Where the test arm begins.
pub fn home() -> Joints {
    Joints::from_column_slice(&[0.0, -1.2, 1.4, -1.5, -1.5, 0.0])
}

/// Options of the simulated driver of the test arm.
pub fn driver_options(arm: ipc::Arm) -> driver_sim::Options {
    let limits = limits();
    let mut options = driver_sim::Options::new(arm, JOINTS);
    options.position = home().as_slice().to_vec();
    options.lower = limits.lower.as_slice().to_vec();
    options.upper = limits.upper.as_slice().to_vec();
    options.velocity = limits.velocity.as_slice().to_vec();
    options.acceleration = limits.acceleration.as_slice().to_vec();
    options.jerk = limits.jerk.as_slice().to_vec();
    options
}

/// Configuration of the executor of the test arm.
pub fn executor_config(arm: ipc::Arm, clock: ipc::Clock) -> ExecutorConfig<JOINTS> {
    ExecutorConfig {
        clock,
        record: true,
        ..ExecutorConfig::new(arm, limits())
    }
}

/// Command `index` of a motion back and forth between home and a position at most 0.5 rad away in
/// each joint: two pieces, a little under a second.
pub fn command(index: u32) -> [Segment<JOINTS>; 2] {
    let away = home() + Joints::from_column_slice(&[0.5, -0.3, 0.4, 0.2, -0.5, 0.1]);
    let (from, to) = if index.is_multiple_of(2) {
        (home(), away)
    } else {
        (away, home())
    };
    let middle = Sample {
        position: (from + to) / 2.0,
        velocity: (to - from) * 1.9,
        ..Sample::rest(from)
    };
    [
        Segment {
            piece: Piece::hermite(0.4896, &Sample::rest(from), &middle),
            command: index,
            last: false,
        },
        Segment {
            piece: Piece::hermite(0.4896, &middle, &Sample::rest(to)),
            command: index,
            last: true,
        },
    ]
}

/// The planned position of [`command`] at a time since its start (s).
pub fn planned(index: u32, time: f64) -> Joints {
    let [first, second] = command(index).map(|segment| segment.piece);
    if time < first.duration {
        first.sample(time).position
    } else {
        second
            .sample((time - first.duration).min(second.duration))
            .position
    }
}

/// Sends a whole command to the executor; `false` if there was no room for it.
pub fn feed(sender: &mut SegmentSender<JOINTS>, index: u32) -> bool {
    sender.room() >= 2
        && command(index)
            .into_iter()
            .all(|segment| sender.push(segment).is_ok())
}

/// How near the tool of the test arm must come to the end of [`command`] `index` (m): its first three
/// joints move the tool, each by a metre for a radian, along axes at right angles to each other.
pub fn end_tolerance(index: u32, point: f64) -> EndTolerance<JOINTS> {
    EndTolerance {
        command: index,
        joints: planned(index, f64::INFINITY),
        jacobian: SMatrix::identity(),
        point,
        angle: f64::INFINITY,
    }
}

/// Sends a whole command whose end has a tolerance (m); `false` if there was no room for it.
pub fn feed_within(sender: &mut SegmentSender<JOINTS>, index: u32, point: f64) -> bool {
    sender.room() >= 3
        && sender
            .hand_over(Work::End(end_tolerance(index, point)))
            .is_ok()
        && feed(sender, index)
}
