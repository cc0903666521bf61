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
    // Written in place: `from_fn` copies each joint several times.
    let mut joints = [Joint::default(); N];
    for joint in (0..N).filter(|&joint| options.enabled[joint]) {
        let given = Given::of(joint, start, target, limits);
        joints[joint] = Joint::new(&given, options.interface[joint]);
    }
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
    let mut tracks = [Track::default(); N];
    for (joint, track) in tracks.iter_mut().enumerate() {
        track.frame = joints[joint].frame;
        track.placed = options.interface[joint] == Interface::Position;
        track.blended_profile = joints[joint].blended_profile(durations[joint]);
        track.duration = durations[joint];
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
        if !joints[joint].smooth {
            track.end[2] = 0.0;
        }
    }
    let duration = durations.iter().copied().fold(0.0, f64::max);
    Motion {
        tracks,
        duration,
        straight: false,
    }
}
