//! Plans a move from states, limits and options.

use super::duration::common_duration;
use super::error::OtgError;
use super::joint::{Given, Joint};
use super::limits::Limits;
use super::motion::{Motion, Track};
use super::options::{Interface, Options, Synchronisation};
use super::state::State;
use super::{check, line};

/// Plans the fastest move; see `Otg::plan`.
pub(crate) fn plan<const N: usize>(
    start: &State<N>,
    target: &State<N>,
    limits: &Limits<N>,
    options: &Options<N>,
) -> Result<Motion<N>, OtgError> {
    check::input(start, target, limits, options)?;
    match options.synchronisation {
        Synchronisation::Phase => return line::plan(start, target, limits, options),
        Synchronisation::PhaseIfPossible => match line::plan(start, target, limits, options) {
            Err(OtgError::NotStraight { .. }) => {}
            other => return other,
        },
        Synchronisation::Time | Synchronisation::None => {}
    }
    let joints: [Joint; N] = std::array::from_fn(|joint| {
        if options.enabled[joint] {
            Joint::new(
                &Given::of(joint, start, target, limits),
                options.interface[joint],
            )
        } else {
            Joint::default()
        }
    });
    let mut motion = if options.synchronisation == Synchronisation::None {
        apart(&joints, start, target, options)?
    } else {
        let duration = common_duration(&joints, options)?;
        assemble(&joints, start, target, options, &[duration; N])
    };
    check::keep_positions(&mut motion, &joints, limits, options)?;
    Ok(motion)
}

/// Every joint for itself.
fn apart<const N: usize>(
    joints: &[Joint; N],
    start: &State<N>,
    target: &State<N>,
    options: &Options<N>,
) -> Result<Motion<N>, OtgError> {
    let mut durations = [0.0; N];
    for joint in 0..N {
        let alone = std::slice::from_ref(&joints[joint]);
        durations[joint] = common_duration(alone, options).map_err(|error| match error {
            OtgError::OutOfRange { time, .. } => OtgError::OutOfRange { joint, time },
            other => other,
        })?;
    }
    Ok(assemble(joints, start, target, options, &durations))
}

fn assemble<const N: usize>(
    joints: &[Joint; N],
    start: &State<N>,
    target: &State<N>,
    options: &Options<N>,
    durations: &[f64; N],
) -> Motion<N> {
    let tracks = std::array::from_fn(|joint| {
        let mut track = Track {
            frame: joints[joint].frame,
            placed: options.interface[joint] == Interface::Position,
            blended_profile: joints[joint].blended_profile(durations[joint]),
            duration: durations[joint],
            start: [
                start.position[joint],
                start.velocity[joint],
                start.acceleration[joint],
            ],
            end: [
                target.position[joint],
                target.velocity[joint],
                target.acceleration[joint],
            ],
        };
        finish(&mut track, options.enabled[joint], options.interface[joint]);
        if !joints[joint].smooth {
            track.end[2] = 0.0;
        }
        track
    });
    let duration = durations.iter().copied().fold(0.0, f64::max);
    Motion {
        tracks,
        duration,
        straight: false,
    }
}

/// Sets the end of a joint whose position is not asked for.
fn finish(track: &mut Track, enabled: bool, interface: Interface) {
    if !enabled {
        track.end = [track.start[0], 0.0, 0.0];
    } else if interface == Interface::Velocity {
        track.end[0] = track.last_position();
    }
}
