//! A window: its law, cut and certified.

use trajectory::timing::Timed;
use trajectory::{Boundary, MotionBounds, TimingOptions, Trajectory, time_path};

use super::super::draft::Crossing;
use super::super::smooth_joints::moment;
use super::super::{
    Draft, Fault, MotionError, MoveCertificate, Planner, ROUNDING, certificate, check,
};
use super::ahead::Ahead;
use super::part::{Part, cut, lowered};
use super::{FROM_REST, MOVING, WindowedMove};
use crate::task::Move;

/// Least time of a window at full speed, s, and in times of braking from full speed.
const HORIZON: f64 = 0.8;
const BRAKES: f64 = 4.0;
/// How often a window that is too short to be cut is doubled.
const DOUBLINGS: usize = 4;
/// Share of the limits that a window leaves unused where it is cut, so that the next one can begin
/// there.
const RESERVE: f64 = 0.007;
/// By how much a window that begins at rest may be slowed down.
const SLOWER: f64 = 1.2;

/// A certified part of a motion, and the parameter of the path at which it ends.
#[derive(Clone, Debug)]
pub(super) struct Certified<const N: usize> {
    pub trajectory: Trajectory<N>,
    pub certificate: MoveCertificate,
    pub to: f64,
}

/// The part up to the cut, the state there, and the stop behind it; none where the part ends at rest.
type Window<const N: usize> = (Certified<N>, Boundary, Option<Certified<N>>);

/// A window that is timed and divided, not certified yet.
struct Divided<const N: usize> {
    head: Trajectory<N>,
    tail: Trajectory<N>,
    law: Trajectory<1>,
    from: f64,
    to: f64,
    /// Pieces of the head.
    pieces: usize,
}

impl<const N: usize> Divided<N> {
    fn new(part: &Part<'_, N>, timed: &Timed<N>, pieces: usize) -> Self {
        let (head, tail) = timed.trajectory.pieces().split_at(pieces);
        Self {
            head: Trajectory::new(head.to_vec()),
            tail: Trajectory::new(tail.to_vec()),
            law: timed.law.clone(),
            from: part.from,
            to: part.to,
            pieces,
        }
    }

    /// The state of the law at the cut, and its parameter.
    fn at_cut(&self) -> (f64, Boundary) {
        match self.law.pieces().get(self.pieces) {
            Some(piece) => {
                let law = piece.sample(0.0);
                let moving = Boundary::Moving {
                    rate: law.velocity[0],
                    acceleration: law.acceleration[0],
                };
                (self.from + law.position[0], moving)
            }
            None => (self.to, Boundary::Rest),
        }
    }
}

impl<const N: usize> Planner<N> {
    /// The next window.
    pub(super) fn window(
        &self,
        windowed: &mut WindowedMove<'_, N>,
    ) -> Result<Window<N>, MotionError> {
        let shares = match windowed.boundary {
            Boundary::Moving { .. } => &MOVING[..],
            _ => &FROM_REST[..],
        };
        let mut first = None;
        for share in shares {
            match self.window_within(windowed, *share) {
                Ok(window) => return Ok(window),
                Err(error) => first = first.or(Some(error)),
            }
        }
        Err(first.unwrap_or(MotionError::NoWay))
    }

    /// The same under a share of the limits.
    fn window_within(
        &self,
        windowed: &mut WindowedMove<'_, N>,
        share: f64,
    ) -> Result<Window<N>, MotionError> {
        let WindowedMove {
            motion,
            ahead,
            from,
            boundary,
            passed,
            ..
        } = &mut *windowed;
        let (limits, from, boundary, passed) = (motion.limits, *from, *boundary, *passed);
        let brake = limits.speed / limits.acceleration + limits.acceleration / limits.jerk;
        let mut time = HORIZON.max(BRAKES * brake);
        for _ in 0..=DOUBLINGS {
            let to = self
                .look_ahead(ahead, motion, ((from, passed), time))
                .ok_or(MotionError::NoWay)?;
            let path = ahead.path().ok_or(MotionError::NoWay)?;
            let part = Part::new(&path, from, to);
            let is_last = part.to >= ahead.last();
            let reserve = if is_last { 0.0 } else { RESERVE };
            // A law that begins in motion keeps the reserve by itself.
            let share = match boundary {
                Boundary::Moving { .. } => share,
                _ => share - reserve,
            };
            let (joints, tool) = lowered(&self.limits, &limits, share);
            let options = TimingOptions {
                start: boundary,
                end: Boundary::Rest,
                reserve,
                ..Default::default()
            };
            let timed = time_path(&part, &joints, &tool, &options)?;
            let pieces = if is_last {
                timed.law.pieces().len()
            } else {
                cut(&part, &timed, &joints, &tool)
            };
            if pieces > 0 {
                let divided = Divided::new(&part, &timed, pieces);
                return self.certified(windowed, divided);
            }
            time *= 2.0;
        }
        Err(MotionError::NoWay)
    }

    /// Certifies both parts of a window. One that begins at rest is slowed down where a bound asks for
    /// that; one that begins in motion cannot be.
    fn certified(
        &self,
        windowed: &WindowedMove<'_, N>,
        mut divided: Divided<N>,
    ) -> Result<Window<N>, MotionError> {
        let motion = &windowed.motion;
        let mut bounds = [&divided.head, &divided.tail].map(|part| self.bounds(part, motion));
        let slower = bounds.iter().map(MotionBounds::slower).fold(0.0, f64::max) * (1.0 + 1e-12);
        if slower > 1.0 + ROUNDING && windowed.boundary == Boundary::Rest && slower < SLOWER {
            bounds = bounds.map(|bounds| bounds.stretched(slower));
            divided.head = divided.head.stretched(slower);
            divided.tail = divided.tail.stretched(slower);
            divided.law = divided.law.stretched(slower);
        }
        let [head, tail] = bounds;
        let (at, boundary) = divided.at_cut();
        let Ahead { curve, part, .. } = &windowed.ahead;
        let ahead = part.passes(curve, windowed.passed);
        let count = ahead.partition_point(|u| *u <= at);
        let times = |range: &[f64], since: f64| -> Vec<Crossing> {
            let pass = |u: &f64| Crossing {
                time: moment(&divided.law, u - divided.from) - since,
                rests: None,
            };
            range.iter().map(pass).collect()
        };
        let draft = Draft {
            crossings: times(&ahead[..count], 0.0),
            ..Draft::of(divided.head.clone())
        };
        let since = draft.trajectory.duration();
        let head = self.proved_part(windowed, (draft, head), (windowed.passed, at))?;
        if divided.tail.pieces().is_empty() {
            return Ok((head, boundary, None));
        }
        let later = ahead.partition_point(|u| *u <= divided.to);
        let draft = Draft {
            crossings: times(&ahead[count..later], since),
            ..Draft::of(divided.tail)
        };
        let stop = self.proved_part(
            windowed,
            (draft, tail),
            (windowed.passed + count, divided.to),
        )?;
        Ok((head, boundary, Some(stop)))
    }

    /// The certificate of a part, from the pose passed last before it to the parameter `to`.
    fn proved_part(
        &self,
        windowed: &WindowedMove<'_, N>,
        (draft, bounds): (Draft<N>, MotionBounds<N>),
        (passed, to): (usize, f64),
    ) -> Result<Certified<N>, MotionError> {
        let motion = &windowed.motion;
        let next = (passed + draft.crossings.len()).min(motion.poses.len() - 1);
        let own = Move {
            shape: motion.shape,
            poses: motion.poses[passed..=next].to_vec(),
            tolerance: motion.tolerance,
            limits: motion.limits,
        };
        let from = match passed.checked_sub(1) {
            Some(before) => motion.poses[before],
            None => windowed.origin,
        };
        let mut way = certificate::way(&own, self.chain(), &from, &draft, &bounds);
        if to < windowed.ahead.last() {
            (way.end_deviation_m, way.end_angle_rad) = (0.0, 0.0);
        }
        let mut certificate = self.proved(&draft, &bounds, way);
        check(&certificate, &own).map_err(|fault| named(fault, passed))?;
        for pass in &mut certificate.poses {
            pass.index += passed;
        }
        Ok(Certified {
            trajectory: draft.trajectory,
            certificate,
            to,
        })
    }
}

/// A fault of a part, with the number of the pose in the whole command.
fn named(fault: Fault, passed: usize) -> MotionError {
    let mut fault = fault;
    if let Fault::Pass { pose, .. } = &mut fault {
        *pose += passed;
    }
    fault.into()
}
