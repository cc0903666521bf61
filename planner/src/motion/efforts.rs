//! Limits of the efforts of the joints, by choice of the robot.

use kinematics::{Dynamics, Inertia};
use nalgebra::SVector;
use realtime::Piece;
use trajectory::{JointLimits, MotionBounds, Trajectory};

use super::{Draft, LimitReport, MotionError, PlannedMove, Planner};
use crate::task::Move;

/// Masses of an arm, and the largest efforts of its joints.
#[derive(Clone, Debug)]
pub struct Efforts<const N: usize> {
    /// The arm with what it carries.
    pub dynamics: Dynamics<N>,
    /// Largest effort of each joint (Nm, N).
    pub limits: SVector<f64, N>,
}

impl<const N: usize> Efforts<N> {
    /// The same arm with this at its flange, in the flange's frame.
    #[must_use]
    pub fn carrying(mut self, carried: Option<&Inertia>) -> Self {
        if let Some(carried) = carried {
            self.dynamics = self.dynamics.with_payload(carried);
        }
        self
    }
}

/// Longest time between two looks at the efforts, s.
const STEP: f64 = 0.01;
/// Fewest parts of a piece.
const PARTS: usize = 4;
/// An effort used to this share slows the motion down.
const USED: f64 = 0.97;
/// Shares of the acceleration limits that are tried where efforts slow the motion down.
const SHARES: [f64; 4] = [0.85, 0.7, 0.55, 0.4];
/// Times that a stretch is corrected for what lies between the samples.
const CORRECTIONS: usize = 8;

/// The efforts at one time: what holds the arm, and what moves it; the second falls with the square
/// of the time that the motion takes. Over the limits.
#[derive(Clone, Copy)]
struct Demand<const N: usize> {
    hold: SVector<f64, N>,
    motion: SVector<f64, N>,
}

impl<const N: usize> Demand<N> {
    /// The efforts when the motion takes `stretch` times as long.
    fn at(&self, stretch: f64) -> SVector<f64, N> {
        self.hold + self.motion / (stretch * stretch)
    }

    /// The least stretch with which no effort exceeds `most`; efforts that the arm needs at rest
    /// already are left out.
    fn stretch(&self, most: f64) -> f64 {
        let one = |j: usize| {
            let (hold, motion) = (self.hold[j], self.motion[j]);
            let room = if motion > 0.0 {
                most - hold
            } else {
                most + hold
            };
            if room <= 0.0 {
                return 1.0;
            }
            (motion.abs() / room).sqrt()
        };
        (0..N).map(one).fold(1.0, f64::max)
    }
}

/// The largest share of each limit over a motion, and when.
struct Used<const N: usize> {
    share: SVector<f64, N>,
    time: [f64; N],
}

impl<const N: usize> Efforts<N> {
    /// The efforts over a piece at equal steps, both ends included.
    fn over(&self, piece: &Piece<N>) -> Vec<Demand<N>> {
        let parts = ((piece.duration / STEP).ceil() as usize).clamp(PARTS, 100_000);
        let look = |part: usize| {
            let at = piece.sample(piece.duration * part as f64 / parts as f64);
            let zero = SVector::zeros();
            let hold = self.dynamics.effort(&at.position, &zero, &zero);
            let all = self
                .dynamics
                .effort(&at.position, &at.velocity, &at.acceleration);
            Demand {
                hold: hold.component_div(&self.limits),
                motion: (all - hold).component_div(&self.limits),
            }
        };
        (0..=parts).map(look).collect()
    }

    /// The largest shares when the motion takes `stretch` times as long: samples, and an eighth of
    /// their second difference for the times between them.
    fn used(&self, pieces: &[Vec<Demand<N>>], times: &[f64], stretch: f64) -> Used<N> {
        let mut used = Used {
            share: SVector::zeros(),
            time: [0.0; N],
        };
        for (piece, window) in pieces.iter().zip(times.windows(2)) {
            let efforts: Vec<SVector<f64, N>> = piece.iter().map(|d| d.at(stretch)).collect();
            let bends = efforts.windows(3).map(|e| (e[0] - e[1] * 2.0 + e[2]).abs());
            let margin =
                bends.fold(SVector::zeros(), |most: SVector<f64, N>, b| most.sup(&b)) * 0.125;
            for (i, effort) in efforts.iter().enumerate() {
                let share = effort.abs() + margin;
                let when =
                    window[0] + (window[1] - window[0]) * i as f64 / (piece.len() - 1) as f64;
                for j in 0..N {
                    // NaN counts as the largest.
                    if share[j] > used.share[j] || share[j].is_nan() {
                        (used.share[j], used.time[j]) = (share[j], when * stretch);
                    }
                }
            }
        }
        used
    }

    /// The factor on time with which the efforts keep their limits, at least 1. An effort that the
    /// arm needs at rest already does not count: no factor helps.
    fn stretch(&self, trajectory: &Trajectory<N>) -> f64 {
        let pieces: Vec<_> = trajectory
            .pieces()
            .iter()
            .map(|piece| self.over(piece))
            .collect();
        let (mut most, mut stretch) = (1.0, 1.0_f64);
        for _ in 0..CORRECTIONS {
            let samples = pieces.iter().flatten();
            stretch = samples
                .map(|demand| demand.stretch(most))
                .fold(stretch, f64::max);
            let over = self.used(&pieces, trajectory.times(), stretch).share.max() - 1.0;
            if over.is_nan() || over <= 0.0 {
                break;
            }
            most -= over + 1e-9;
        }
        stretch
    }
}

impl<const N: usize> Planner<N> {
    /// The same planner with limits of efforts, or without.
    #[must_use]
    pub fn with_efforts(mut self, efforts: Option<Efforts<N>>) -> Self {
        self.efforts = efforts;
        self
    }

    /// The limits of efforts.
    #[must_use]
    pub fn efforts(&self) -> Option<&Efforts<N>> {
        self.efforts.as_ref()
    }

    /// Slows a motion down until its efforts keep their limits.
    pub(super) fn within_efforts(
        &self,
        (draft, bounds): (Draft<N>, MotionBounds<N>),
    ) -> (Draft<N>, MotionBounds<N>) {
        let stretch = self
            .efforts
            .as_ref()
            .map_or(1.0, |e| e.stretch(&draft.trajectory));
        if stretch.is_nan() || stretch <= 1.0 {
            return (draft, bounds);
        }
        (draft.stretched(stretch), bounds.stretched(stretch))
    }

    /// The efforts of a motion over their limits; nothing without limits.
    pub(super) fn effort_reports(&self, trajectory: &Trajectory<N>) -> Vec<LimitReport> {
        let Some(efforts) = &self.efforts else {
            return Vec::new();
        };
        let pieces: Vec<_> = trajectory
            .pieces()
            .iter()
            .map(|piece| efforts.over(piece))
            .collect();
        let used = efforts.used(&pieces, trajectory.times(), 1.0);
        (0..N)
            .map(|j| LimitReport {
                limit: format!("effort of {}", self.joint_name(j)),
                ratio: used.share[j],
                time_s: used.time[j],
            })
            .collect()
    }

    /// A faster motion than `planned`, if efforts slow it down: with less acceleration of the joints
    /// whose efforts are used up, so that their speeds may stay high.
    pub(super) fn eased(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        planned: PlannedMove<N>,
    ) -> PlannedMove<N> {
        let used = &planned.certificate.peaks.joint_effort;
        if !used.iter().any(|share| *share >= USED) {
            return planned;
        }
        let used = used.clone();
        let mut best = planned;
        for share in SHARES {
            let mut acceleration = self.limits.acceleration;
            for (j, used) in used.iter().enumerate() {
                acceleration[j] *= if *used >= USED { share } else { 1.0 };
            }
            let slower = Self {
                limits: JointLimits {
                    acceleration,
                    ..self.limits
                },
                ..self.clone()
            };
            let again = slower.plan_once(motion, start);
            let again = again.and_then(|found| self.certified_again(motion, start, found));
            let Ok(found) = again else { continue };
            if found.trajectory.duration() < best.trajectory.duration() {
                best = found;
            }
        }
        best
    }

    /// The same motion with the certificate of this planner's limits.
    fn certified_again(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        planned: PlannedMove<N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        let poses = planned.certificate.poses.iter();
        let draft = Draft {
            crossings: poses.map(|pass| pass.crossing()).collect(),
            ..Draft::of(planned.trajectory)
        };
        Ok(PlannedMove {
            blend: planned.blend,
            ..self.certify(motion, start, draft)?
        })
    }
}
