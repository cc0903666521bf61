//! Laws of state-to-state moves, and agreement with a peer.

use nalgebra::vector;
use rsruckig::prelude as peer;

use super::{Audit, Ends, Limits, Options, Otg, Problem, Problems, State};

/// The peer's shortest duration (s), `None` where it fails.
fn peer_duration<const N: usize>(problem: &Problem<N>) -> Option<f64> {
    let mut input = peer::InputParameter::<N>::new(None);
    for joint in 0..N {
        input.current_position[joint] = problem.start.position[joint];
        input.current_velocity[joint] = problem.start.velocity[joint];
        input.current_acceleration[joint] = problem.start.acceleration[joint];
        input.target_position[joint] = problem.target.position[joint];
        input.target_velocity[joint] = problem.target.velocity[joint];
        input.target_acceleration[joint] = problem.target.acceleration[joint];
        input.max_velocity[joint] = problem.limits.velocity_max[joint];
        input.max_acceleration[joint] = problem.limits.acceleration_max[joint];
        input.max_jerk[joint] = problem.limits.jerk[joint];
    }
    let mut otg = peer::Ruckig::<N, peer::ThrowErrorHandler>::new(None, 0.005);
    let mut trajectory = peer::Trajectory::new(None);
    otg.calculate(&input, &mut trajectory).ok()?;
    Some(trajectory.get_duration())
}

/// Plans, audits and compares one problem with the peer.
fn compare<const N: usize>(index: usize, problem: &Problem<N>, failures: &mut Vec<String>) {
    let Problem {
        start,
        target,
        limits,
        options,
    } = problem;
    let motion = match Otg::plan(start, target, limits, options) {
        Ok(motion) => motion,
        Err(error) => {
            failures.push(format!("{index}: {error}"));
            return;
        }
    };
    let audit = Audit::of(&motion, start, target, limits);
    if !(audit.worst() <= 1e-12) {
        failures.push(format!(
            "{index}: {audit:?} {}",
            if N == 1 {
                format!("{problem:?} {motion:?}")
            } else {
                String::new()
            }
        ));
    }
    if let Some(duration) = peer_duration(problem)
        && motion.duration() > duration * (1.0 + 1e-9)
    {
        failures.push(format!(
            "{index}: {} instead of {duration}",
            motion.duration()
        ));
    }
}

fn agree<const N: usize>(seed: u64, ends: Ends, count: usize) {
    let mut problems = Problems::new(seed, ends);
    let mut failures = Vec::new();
    for index in 0..count {
        compare(index, &problems.draw::<N>(), &mut failures);
    }
    assert!(
        failures.is_empty(),
        "{} of {count}: {:#?}",
        failures.len(),
        &failures[..failures.len().min(20)]
    );
}

#[test]
fn agrees_with_peer_one_joint() {
    agree::<1>(1, Ends::Moving, 20_000);
}

#[test]
fn agrees_with_peer_moving() {
    agree::<3>(2, Ends::Moving, 10_000);
}

#[test]
fn agrees_with_peer_stopping() {
    agree::<3>(3, Ends::Stopping, 10_000);
}

#[test]
fn agrees_with_peer_resting() {
    agree::<7>(4, Ends::Resting, 5_000);
}

#[test]
fn textbook_move() {
    let limits = Limits::symmetric(vector![10.0], vector![10.0], vector![1.0]);
    let (start, target) = (State::rest(vector![0.0]), State::rest(vector![2.0]));
    let motion = Otg::plan(&start, &target, &limits, &Options::default()).unwrap();
    // Four equal phases of jerk 1: distance = jerk T³ / 32.
    assert!((motion.duration() - 4.0).abs() < 1e-14);
    assert_eq!(motion.sample(motion.duration()).position, vector![2.0]);
    assert!((motion.sample(2.0).velocity[0] - 1.0).abs() < 1e-14);
}
