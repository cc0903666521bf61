//! Long smooth moves: the whole way is checked first, then timed and certified window by window.
//!
//! The way is fixed before anything moves: a curve through all poses, and the joints along all of it,
//! inside their ranges and away from singular places. What is left is how fast it is travelled. Each
//! window is timed from the state of motion in which the one before it was cut to rest on the way;
//! both parts are certified, so a stop is always known. Where no law goes on from a cut, that stop is
//! taken and the next window begins at rest.

mod ahead;
mod certified;
mod joints;
mod part;
mod way;

use std::borrow::Cow;

use nalgebra::{Isometry3, SVector};
use realtime::Piece;
use trajectory::smooth::{RestCause, SmoothOptions, least_time};
use trajectory::{Boundary, Path, Trajectory};

use super::{Blend, MotionError, MoveCertificate, PlannedMove, Planner};
use crate::task::Move;
use ahead::Ahead;
use certified::Certified;

/// Shares of the limits that a window is timed with, one after the other: bounds are up to one percent
/// above what they bound, and a law that starts in motion cannot be slowed down afterwards.
const FROM_REST: [f64; 3] = [0.999, 0.98, 0.9];
const MOVING: [f64; 3] = [0.998, 0.993, 1.0];

/// Most poses from which the least time of a move is bounded.
const BOUND: usize = 8192;

/// A smooth move whose whole way was checked, and that is timed and certified window by window.
///
/// A curve passes every pose in order within its tolerances and stays in the corridor, and the joints
/// follow all of it on one branch, inside their ranges and away from singular places. Such a way can be
/// travelled from rest to rest, from any place on it to any other.
#[derive(Clone, Debug)]
pub struct WindowedMove<'a, const N: usize> {
    motion: Cow<'a, Move>,
    start: SVector<f64, N>,
    /// Pose of the controlled point at the start.
    origin: Isometry3<f64>,
    /// The checked way.
    ahead: Ahead<N>,
    /// Bound of the distance from the legs over the corridor's half width.
    corridor_ratio: f64,
    end: SVector<f64, N>,
    /// Where the next window begins, and how.
    from: f64,
    boundary: Boundary,
    /// Poses passed before that.
    passed: usize,
    /// The certified stop from there.
    stop: Option<Certified<N>>,
    /// What is certified so far.
    certificate: Option<MoveCertificate>,
    rests: usize,
    /// The first window, which is planned with the check of the way.
    first: Option<MoveWindow<N>>,
}

/// A part of a motion, certified: it begins in the state in which the part before it ends.
#[derive(Clone, Debug, PartialEq)]
pub struct MoveWindow<const N: usize> {
    /// The motion of the joints.
    pub pieces: Vec<Piece<N>>,
    /// Whether it is the last, which ends at rest in the last pose.
    pub last: bool,
}

impl<const N: usize> WindowedMove<'_, N> {
    /// Joints at the end of the last window, at rest (rad, m).
    #[must_use]
    pub fn end(&self) -> &SVector<f64, N> {
        &self.end
    }

    /// The move as a task.
    #[must_use]
    pub fn motion(&self) -> &Move {
        &self.motion
    }

    /// Time of the windows so far, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.certificate
            .as_ref()
            .map_or(0.0, |certificate| certificate.duration_s)
    }

    /// What was proved of all windows so far; of the whole move after the last one.
    #[must_use]
    pub fn certificate(&self) -> Option<&MoveCertificate> {
        self.certificate.as_ref()
    }

    /// Joints at the end of the windows so far (rad, m).
    #[must_use]
    pub fn here(&self) -> SVector<f64, N> {
        let path = self.ahead.path();
        path.map_or(self.start, |path| path.joint_at(self.from).q[0])
    }

    /// Rests between the start and the end of the windows so far.
    #[must_use]
    pub fn rests(&self) -> usize {
        self.rests
    }

    /// Frees what only the parts so far needed: how each pose of them was passed and when which limit was
    /// active. The certificate is complete in everything else.
    pub fn forget(&mut self) {
        if let Some(certificate) = &mut self.certificate {
            certificate.poses = Vec::new();
            certificate.active = Vec::new();
        }
    }

    fn is_done(&self) -> bool {
        self.from >= self.ahead.last()
    }

    /// Takes over a certified part of the motion, and where it ends.
    fn take(&mut self, part: Certified<N>, boundary: Boundary) -> Vec<Piece<N>> {
        self.from = part.to;
        self.passed += part.certificate.poses.len();
        self.boundary = boundary;
        self.certificate = Some(match self.certificate.take() {
            Some(before) => before.followed_by(part.certificate),
            None => part.certificate,
        });
        part.trajectory.pieces().to_vec()
    }

    /// Counts a rest on the way, and names it at the pose that was passed last.
    fn rest(&mut self) {
        self.rests += 1;
        let passes = self
            .certificate
            .as_mut()
            .map(|certificate| &mut certificate.poses);
        if let Some(pass) = passes.and_then(|passes| passes.last_mut()) {
            pass.rests = Some(RestCause::Division);
        }
    }
}

impl<const N: usize> Planner<N> {
    /// The next window of a move. It is to be executed whatever comes after it: where no motion goes
    /// on, the next window is a stop on the way.
    pub(super) fn next_window(
        &self,
        windowed: &mut WindowedMove<'_, N>,
    ) -> Result<MoveWindow<N>, MotionError> {
        if let Some(first) = windowed.first.take() {
            return Ok(first);
        }
        let planned = self.window(windowed);
        let pieces = match (planned, windowed.stop.take()) {
            (Ok((head, boundary, stop)), _) => {
                windowed.stop = stop;
                windowed.take(head, boundary)
            }
            (Err(_), Some(stop)) => windowed.take(stop, Boundary::Rest),
            (Err(error), None) => {
                return Err(MotionError::OnTheWay {
                    pose: windowed.passed + 1,
                    cause: Box::new(error),
                });
            }
        };
        let last = windowed.is_done();
        if last {
            self.conclude(windowed);
        } else if windowed.boundary == Boundary::Rest {
            windowed.rest();
        }
        Ok(MoveWindow { pieces, last })
    }

    /// Completes the certificate of the whole move.
    fn conclude(&self, windowed: &mut WindowedMove<'_, N>) {
        let motion = &windowed.motion;
        let options = SmoothOptions::new(motion.tolerance, motion.limits);
        // What bounds the way through some of the poses bounds that through all.
        let step = motion.poses.len().div_ceil(BOUND);
        let mut some = Vec::with_capacity(motion.poses.len().div_ceil(step) + 1);
        some.extend(motion.poses.iter().rev().step_by(step));
        some.push(windowed.origin);
        some.reverse();
        let tool = least_time(&some, &options).unwrap_or(0.0);
        let joints = self.least_of_joints(&windowed.start, &windowed.end);
        if let Some(certificate) = &mut windowed.certificate {
            certificate.lower_bound_s = tool.max(joints).min(certificate.duration_s);
        }
    }

    /// All windows of a move as one motion.
    pub(super) fn all_windows(
        &self,
        mut windowed: WindowedMove<'_, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        let mut pieces = Vec::new();
        loop {
            let window = self.next_window(&mut windowed)?;
            pieces.extend(window.pieces);
            if window.last {
                break;
            }
        }
        let certificate = windowed.certificate.ok_or(MotionError::NoWay)?;
        let curve = &windowed.ahead.curve;
        let blend = Blend {
            tolerance: windowed.motion.tolerance,
            exact_stop: curve.exact_stop(),
            corridor_ratio: windowed.corridor_ratio,
            jerk_ratio: certificate
                .peaks
                .tool_jerk
                .max(certificate.peaks.tool_angular_jerk),
            fallbacks: windowed.rests,
        };
        Ok(PlannedMove {
            trajectory: Trajectory::new(pieces),
            certificate,
            end: windowed.end,
            blend: Some(blend),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::Controller;
    use crate::robot::load;
    use crate::task::Shape;
    use nalgebra::Vector3;

    /// A long arc at a low speed, with its first window.
    fn begun() -> (Planner<6>, WindowedMove<'static, 6>, Vec<Piece<6>>) {
        let robot = load("ur5e").unwrap();
        let controller = Controller::<6>::new(&robot, 1000.0, crcl::LengthUnit::default()).unwrap();
        let planner = controller.planner().clone();
        let home = SVector::from_column_slice(&robot.home);
        let start = planner.chain().forward(&home);
        let at = |i: i32| {
            let (sine, cosine) = (1e-3 * f64::from(i)).sin_cos();
            let way = Vector3::new(0.1 * (cosine - 1.0), 0.1 * sine, 0.0);
            Isometry3::from_parts((start.translation.vector + way).into(), start.rotation)
        };
        let mut limits = robot.motion_limits();
        limits.speed = 0.1;
        let motion = Move {
            shape: Shape::Smooth,
            poses: (1..5000).map(at).collect(),
            tolerance: 1e-4,
            limits,
        };
        let mut windowed = planner.windows(Cow::Owned(motion), &home).unwrap();
        let first = planner.window_of(&mut windowed).unwrap();
        assert!(!first.last);
        (planner, windowed, first.pieces)
    }

    /// Where no law goes on from a cut, the certified stop is the next window, the one after it begins
    /// at rest, and the motion still passes every pose.
    #[test]
    fn a_stop_takes_the_place_of_a_window_that_fails() {
        let (planner, mut windowed, mut pieces) = begun();
        // A rate that no motion can begin with.
        windowed.boundary = Boundary::Moving {
            rate: 1e6,
            acceleration: 0.0,
        };
        let stop = planner.window_of(&mut windowed).unwrap();
        assert!(!stop.last);
        pieces.extend(stop.pieces);
        let end = pieces[pieces.len() - 1];
        let end = end.sample(end.duration);
        assert!(end.velocity.amax() < 1e-6 && (end.position - windowed.here()).amax() < 1e-9);
        assert_eq!(windowed.rests(), 1);
        let last = windowed.passed;
        loop {
            let window = planner.window_of(&mut windowed).unwrap();
            pieces.extend(window.pieces);
            if window.last {
                break;
            }
        }
        let trajectory = Trajectory::new(pieces);
        crate::motion::check_smooth(&trajectory, &windowed.start).unwrap();
        let certificate = windowed.certificate.as_ref().unwrap();
        assert!((certificate.duration_s - trajectory.duration()).abs() < 1e-9);
        assert_eq!(certificate.poses.len(), 4998);
        let named = certificate.poses.iter().filter(|pass| pass.rests.is_some());
        let named: Vec<_> = named.map(|pass| (pass.index, pass.rests)).collect();
        assert_eq!(named, [(last, Some(RestCause::Division))]);
        assert!(
            certificate.in_order && certificate.peaks.largest() <= 1.0 + crate::motion::ROUNDING
        );
    }

    /// Where nothing begins from the stop either, the error names the pose, and the arm is at rest.
    #[test]
    fn a_move_that_cannot_go_on_names_the_pose() {
        let (planner, mut windowed, _) = begun();
        windowed.motion.to_mut().limits.speed = -1.0;
        let stop = planner.window_of(&mut windowed).unwrap();
        let end = stop.pieces[stop.pieces.len() - 1];
        assert!(end.sample(end.duration).velocity.amax() < 1e-6);
        let here = planner.chain().forward(&windowed.here());
        let error = planner.window_of(&mut windowed).unwrap_err();
        let MotionError::OnTheWay { pose, .. } = error else {
            panic!("{error}");
        };
        let next = windowed.motion.poses[pose - 1].translation.vector;
        let gap = (next - here.translation.vector).norm();
        assert!(gap < 3e-4, "{gap} m from pose {pose}");
    }
}
