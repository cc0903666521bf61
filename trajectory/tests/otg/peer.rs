//! Durations compared with rsruckig: equal to 1e-9, or shorter. All motions are audited.

use rsruckig::prelude as peer;

use measure::{Ends, Problems};
use trajectory::otg::{Interface, Problem, Synchronisation};

use super::{KINDS, Kind, PERIOD, draw, report, sound};

/// The peer's shortest duration (s), `None` where it fails.
fn peer_duration<const N: usize>(problem: &Problem<N>) -> Option<f64> {
    let mut input = peer::InputParameter::<N>::new(None);
    let mut lower_velocity = peer::DataArrayOrVec::new(Some(N), 0.0);
    let mut lower_acceleration = peer::DataArrayOrVec::new(Some(N), 0.0);
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
        lower_velocity[joint] = problem.limits.velocity_min[joint];
        lower_acceleration[joint] = problem.limits.acceleration_min[joint];
    }
    input.min_velocity = Some(lower_velocity);
    input.min_acceleration = Some(lower_acceleration);
    if problem.options.interface[0] == Interface::Velocity {
        input.control_interface = peer::ControlInterface::Velocity;
    }
    if problem.options.minimum_duration > 0.0 {
        input.minimum_duration = Some(problem.options.minimum_duration);
    }
    if problem.options.period.is_some() {
        input.duration_discretization = peer::DurationDiscretization::Discrete;
    }
    if problem.options.synchronisation == Synchronisation::None {
        input.synchronization = peer::Synchronization::None;
    }
    let mut otg = peer::Ruckig::<N, peer::ThrowErrorHandler>::new(None, PERIOD);
    let mut trajectory = peer::Trajectory::new(None);
    otg.calculate(&input, &mut trajectory).ok()?;
    Some(trajectory.get_duration())
}

/// Plans, audits and compares random problems; returns how many the peer refused.
fn agree<const N: usize>(seed: u64, ends: Ends, kind: Kind, count: usize) -> usize {
    let mut problems = Problems::new(seed, ends);
    let mut failures = Vec::new();
    let mut refused = 0;
    for index in 0..count {
        let problem = draw::<N>(&mut problems, kind);
        let ours = match sound(&problem) {
            Ok(duration) => duration,
            Err(message) => {
                failures.push(format!("{kind:?} {index}: {message} {problem:?}"));
                continue;
            }
        };
        match peer_duration(&problem) {
            Some(theirs) if ours > theirs * (1.0 + 1e-9) + 1e-12 => {
                failures.push(format!(
                    "{kind:?} {index}: {ours} instead of {theirs} {problem:?}"
                ));
            }
            Some(_) => {}
            None => refused += 1,
        }
    }
    report(&failures, count);
    refused
}

/// `scale` times 1e5 problems over all kinds and ends.
fn agrees_in_all_modes(seed: u64, scale: usize) {
    for (index, kind) in KINDS.into_iter().enumerate() {
        let seed = seed + index as u64;
        let refused = agree::<1>(seed, Ends::Moving, kind, 5_000 * scale)
            + agree::<3>(seed, Ends::Moving, kind, 4_000 * scale)
            + agree::<3>(seed, Ends::Stopping, kind, 2_000 * scale)
            + agree::<7>(seed, Ends::Resting, kind, 1_500 * scale);
        println!("{kind:?}: the peer refused {refused} of {}", 12_500 * scale);
        assert!(
            refused < 250 * scale,
            "{kind:?}: nothing to compare with in {refused} cases"
        );
    }
}

#[test]
fn agrees_with_peer_in_all_modes() {
    agrees_in_all_modes(100, 1);
}

/// The nightly size: 1e7 problems.
#[test]
#[ignore = "takes minutes"]
fn agrees_with_peer_in_all_modes_at_length() {
    agrees_in_all_modes(1000, 100);
}
