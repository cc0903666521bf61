//! Moves all joints along one straight line in joint space.

use nalgebra::SVector;

use super::check;
use super::duration::common_duration;
use super::error::OtgError;
use super::joint::{Given, Joint};
use super::limits::Limits;
use super::motion::{Motion, Track};
use super::options::{Interface, Options};
use super::state::State;

/// Relative deviation from a straight line that is rounding.
const ROUNDING: f64 = 1e-12;

/// Plans along the straight line through start and target: one scalar problem, whose limits are the
/// tightest of all joints, each divided by the joint's component of the direction. The result is
/// the fastest move on that line.
///
/// # Errors
/// [`OtgError::NotStraight`] if distance, velocities and accelerations are not all multiples of
/// one direction.
pub(crate) fn plan<const N: usize>(
    start: &State<N>,
    target: &State<N>,
    limits: &Limits<N>,
    options: &Options<N>,
) -> Result<Motion<N>, OtgError> {
    let interface = one_interface(options)?;
    let vectors = vectors(start, target, options, interface);
    let Some((direction, leader)) = direction(&vectors) else {
        return Ok(standing(start, target, options));
    };
    collinear(&vectors, &direction, leader, grain(start, target))?;
    let given = scalar(&vectors, &direction, leader, limits, grain(start, target));
    let joint = Joint::new(&given, interface);
    let duration = common_duration(std::slice::from_ref(&joint), options)?;
    let blended_profile = joint.blended_profile(duration);
    let mut motion = standing(start, target, options);
    motion.duration = duration;
    for (index, track) in motion.tracks.iter_mut().enumerate() {
        let share = direction[index];
        track.duration = duration;
        track.blended_profile = blended_profile;
        track.frame = joint.frame.scaled(share);
        if interface == Interface::Velocity && options.enabled[index] {
            track.end[0] = track.last_position();
        }
    }
    check::keep_positions(&mut motion, &[], limits, options)?;
    Ok(motion)
}

fn one_interface<const N: usize>(options: &Options<N>) -> Result<Interface, OtgError> {
    let mut found = None;
    for joint in 0..N {
        let interface = options.interface[joint];
        if !options.enabled[joint] || found == Some(interface) {
            continue;
        }
        if found.is_some() {
            return Err(OtgError::NotStraight {
                joint,
                quantity: "interface",
                deviation: 1.0,
            });
        }
        found = Some(interface);
    }
    Ok(found.unwrap_or_default())
}

const NAMES: [&str; 5] = [
    "distance",
    "start velocity",
    "target velocity",
    "start acceleration",
    "target acceleration",
];

/// Distance, velocities and accelerations of the joints that take part.
fn vectors<const N: usize>(
    start: &State<N>,
    target: &State<N>,
    options: &Options<N>,
    interface: Interface,
) -> [SVector<f64, N>; 5] {
    let mut distance = target.position - start.position;
    if interface == Interface::Velocity {
        distance.fill(0.0);
    }
    let mut all = [
        distance,
        start.velocity,
        target.velocity,
        start.acceleration,
        target.acceleration,
    ];
    for vector in &mut all {
        for joint in 0..N {
            if !options.enabled[joint] {
                vector[joint] = 0.0;
            }
        }
    }
    all
}

/// The direction of the first vector that is not zero, scaled so that its largest share is one,
/// and the joint that has that share.
fn direction<const N: usize>(vectors: &[SVector<f64, N>; 5]) -> Option<(SVector<f64, N>, usize)> {
    let vector = vectors
        .iter()
        .find(|vector| vector.iter().any(|share| *share != 0.0))?;
    let mut leader = 0;
    for joint in 0..N {
        if vector[joint].abs() > vector[leader].abs() {
            leader = joint;
        }
    }
    let mut shares = vector / vector[leader];
    shares[leader] = 1.0;
    Some((shares, leader))
}

fn grain<const N: usize>(start: &State<N>, target: &State<N>) -> f64 {
    f64::EPSILON * (start.position.abs().max() + target.position.abs().max())
}

fn collinear<const N: usize>(
    vectors: &[SVector<f64, N>; 5],
    direction: &SVector<f64, N>,
    leader: usize,
    grain: f64,
) -> Result<(), OtgError> {
    // A direction that was taken from positions is only as exact as they are.
    let distance = vectors[0][leader].abs();
    let blur = if distance > 0.0 {
        ROUNDING + 4.0 * grain / distance
    } else {
        ROUNDING
    };
    for (which, vector) in vectors.iter().enumerate() {
        let room = blur * vector.abs().max();
        for joint in 0..N {
            let deviation = (vector[joint] - vector[leader] * direction[joint]).abs();
            if deviation > room {
                let quantity = NAMES[which];
                return Err(OtgError::NotStraight {
                    joint,
                    quantity,
                    deviation,
                });
            }
        }
    }
    Ok(())
}

/// The problem along the line, in the units of the leading joint.
fn scalar<const N: usize>(
    vectors: &[SVector<f64, N>; 5],
    direction: &SVector<f64, N>,
    leader: usize,
    limits: &Limits<N>,
    grain: f64,
) -> Given {
    let mut velocity = [f64::NEG_INFINITY, f64::INFINITY];
    let mut acceleration = [f64::NEG_INFINITY, f64::INFINITY];
    let mut jerk = f64::INFINITY;
    let tighten = |range: &mut [f64; 2], low: f64, high: f64, share: f64| {
        let (a, b) = (low / share, high / share);
        range[0] = range[0].max(a.min(b));
        range[1] = range[1].min(a.max(b));
    };
    for joint in 0..N {
        let share = direction[joint];
        if share != 0.0 {
            let (slow, fast) = (limits.velocity_min[joint], limits.velocity_max[joint]);
            tighten(&mut velocity, slow, fast, share);
            let (low, high) = (
                limits.acceleration_min[joint],
                limits.acceleration_max[joint],
            );
            tighten(&mut acceleration, low, high, share);
            jerk = jerk.min(limits.jerk[joint] / share.abs());
        }
    }
    let [distance, v0, vf, a0, af] = vectors.map(|vector| vector[leader]);
    Given {
        start: [0.0, v0, a0],
        target: [distance, vf, af],
        velocity,
        acceleration,
        jerk,
        grain,
    }
}

/// No joint moves: the frame into which the blended profiles are put.
fn standing<const N: usize>(
    start: &State<N>,
    target: &State<N>,
    options: &Options<N>,
) -> Motion<N> {
    let duration = options.minimum_duration;
    let mut tracks = [Track::default(); N];
    for (joint, track) in tracks.iter_mut().enumerate() {
        track.placed = options.interface[joint] == Interface::Position;
        track.duration = duration;
        track.start = [
            start.position[joint],
            start.velocity[joint],
            start.acceleration[joint],
        ];
        track.end = [
            target.position[joint],
            target.velocity[joint],
            target.acceleration[joint],
        ];
        track.finish(options.enabled[joint], options.interface[joint]);
    }
    Motion {
        tracks,
        duration,
        straight: true,
    }
}
