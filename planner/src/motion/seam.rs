//! Where the motion along one part of a list goes over into that along the next, which begins before the first ends.

use std::ops::Range;

use kinematics::follow::FollowPoint;
use nalgebra::SVector;
use trajectory::Trajectory;

use super::cartesian::pieces;
use super::smooth_joints::Followed;

/// Points of a seam.
const POINTS: u32 = 40;
/// Share of the legs at either side over which it reaches.
const REACH: f64 = 0.8;

/// A part of a list, planned from rest to rest.
pub(super) struct Part<const N: usize> {
    /// The indices of its poses; it begins at the pose before them.
    pub(super) poses: Range<usize>,
    pub(super) followed: Followed<N>,
    joints: Trajectory<N>,
}

impl<const N: usize> Part<N> {
    pub(super) fn new(poses: Range<usize>, followed: Followed<N>) -> Self {
        Self {
            joints: Trajectory::new(pieces(&followed.points)),
            poses,
            followed,
        }
    }

    /// The time at which it passes a pose, or begins or ends where that is none of those it passes, s.
    pub(super) fn pass(&self, pose: usize) -> f64 {
        let plan = &self.followed.path.plan;
        let Some(at) = pose.checked_sub(self.poses.start) else {
            return 0.0;
        };
        let pass = plan.crossings().get(at);
        pass.map_or(plan.duration(), |pass| pass.time)
    }

    /// Its joints at a time (s), with three derivatives.
    pub(super) fn at(&self, time: f64) -> [SVector<f64, N>; 4] {
        let sample = self.joints.sample(time);
        [
            sample.position,
            sample.velocity,
            sample.acceleration,
            sample.jerk,
        ]
    }
}

/// Where one part goes over into the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seam {
    /// Times of the first at which it begins and ends, s.
    pub(super) within: [f64; 2],
    /// The time of the second less that of the first, s.
    pub(super) shift: f64,
}

impl Seam {
    /// The seam around a pose that both parts pass, over so many legs at either side.
    pub(super) fn around<const N: usize>(
        (first, second): (&Part<N>, &Part<N>),
        pose: usize,
        legs: usize,
    ) -> Self {
        let parts = [first, second];
        let [here, shifted] = parts.map(|part| part.pass(pose));
        let before = parts.map(|part| part.pass(pose) - part.pass(pose - legs));
        let after = parts.map(|part| part.pass(pose + legs) - part.pass(pose));
        let [before, after] = [before, after].map(|[a, b]| REACH * a.min(b));
        Self {
            within: [here - before, here + after],
            shift: shifted - here,
        }
    }

    /// The share of the second part at a time of the first, with three derivatives: a polynomial of degree seven that is level up to
    /// its third derivative at both ends.
    fn share(&self, time: f64) -> [f64; 4] {
        let [from, to] = self.within;
        let length = to - from;
        let x = ((time - from) / length).clamp(0.0, 1.0);
        let both = x * (1.0 - x);
        [
            x.powi(4) * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x))),
            140.0 * both.powi(3) / length,
            420.0 * both.powi(2) * (1.0 - 2.0 * x) / length.powi(2),
            840.0 * both * (1.0 - 5.0 * both) / length.powi(3),
        ]
    }

    /// The joints at a time of the first part, with three derivatives.
    pub(super) fn at<const N: usize>(
        &self,
        (first, second): (&Part<N>, &Part<N>),
        time: f64,
    ) -> [SVector<f64, N>; 4] {
        let [w0, w1, w2, w3] = self.share(time);
        let [p, v, a, j] = first.at(time);
        let other = second.at(time + self.shift);
        let [dp, dv, da, dj] = [other[0] - p, other[1] - v, other[2] - a, other[3] - j];
        [
            p + dp * w0,
            v + dv * w0 + dp * w1,
            a + da * w0 + dv * (2.0 * w1) + dp * w2,
            j + dj * w0 + da * (3.0 * w1) + dv * (3.0 * w2) + dp * w3,
        ]
    }

    /// The joints at points of the seam, whose parameter is the time of the first part.
    pub(super) fn points<const N: usize>(
        &self,
        parts: (&Part<N>, &Part<N>),
    ) -> Vec<FollowPoint<N>> {
        let [from, to] = self.within;
        let time = |k: u32| from + (to - from) * f64::from(k) / f64::from(POINTS);
        let point = |u: f64| FollowPoint {
            u,
            q: self.at(parts, u),
            jump: SVector::zeros(),
        };
        (0..=POINTS).map(time).map(point).collect()
    }

    /// The time of the first part at which a pose is passed that both pass.
    pub(super) fn pass<const N: usize>(
        &self,
        (first, second): (&Part<N>, &Part<N>),
        pose: usize,
    ) -> f64 {
        let (time, other) = (first.pass(pose), second.pass(pose) - self.shift);
        time + self.share(time)[0] * (other - time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share of the second part rises from 0 to 1, and its derivatives are those of its values.
    #[test]
    fn the_share_rises_smoothly() {
        let seam = Seam {
            within: [2.0, 2.7],
            shift: 0.4,
        };
        for (time, share) in [(2.0, 0.0), (2.35, 0.5), (2.7, 1.0)] {
            assert!((seam.share(time)[0] - share).abs() < 1e-12);
        }
        for end in [2.0, 2.7] {
            assert!(seam.share(end)[1..].iter().all(|w| w.abs() < 1e-12));
        }
        let step = 1e-5;
        for k in 1..70 {
            let time = 2.0 + 0.01 * f64::from(k);
            let [before, here, after] = [-step, 0.0, step].map(|by| seam.share(time + by));
            for order in 0..3 {
                let slope = (after[order] - before[order]) / (2.0 * step);
                let off = (slope - here[order + 1]).abs();
                assert!(
                    off < 1e-5 * (1.0 + here[order + 1].abs()),
                    "{time} {order}: {off}"
                );
            }
        }
    }
}
