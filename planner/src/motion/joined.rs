//! Motions one after the other, as one.

use trajectory::Trajectory;

use super::{ActiveLimit, CrossingReport, LimitReport, MoveCertificate, Peaks, PlannedMove};

impl<const N: usize> PlannedMove<N> {
    /// The motions one after the other, each of which begins where the one before it rests; none of
    /// no motion.
    pub(super) fn joined(parts: Vec<Self>) -> Option<Self> {
        parts.into_iter().reduce(|first, second| {
            let pieces = [first.trajectory.pieces(), second.trajectory.pieces()].concat();
            Self {
                certificate: both(first.certificate, second.certificate),
                trajectory: Trajectory::new(pieces),
                end: second.end,
                blend: None,
            }
        })
    }
}

impl MoveCertificate {
    /// What holds of two parts of one smooth move, the second of which goes on where the first ends.
    pub(super) fn followed_by(self, second: Self) -> Self {
        let after = self.duration_s;
        let corridors = [self.corridor_m, second.corridor_m].into_iter().flatten();
        let corridor_m = corridors.reduce(f64::max);
        let (mut first, mut second) = (self, second);
        let mut poses = std::mem::take(&mut first.poses);
        let later = std::mem::take(&mut second.poses).into_iter();
        poses.extend(later.map(|pass| CrossingReport {
            time_s: pass.time_s + after,
            ..pass
        }));
        Self {
            poses,
            corridor_m,
            ..both(first, second)
        }
    }
}

/// What holds of two motions one after the other.
fn both(first: MoveCertificate, second: MoveCertificate) -> MoveCertificate {
    let after = first.duration_s;
    let active = second.active.into_iter().map(|span| ActiveLimit {
        start_s: span.start_s + after,
        end_s: span.end_s + after,
        ..span
    });
    let mut limits = first.limits;
    for later in second.limits {
        let later = LimitReport {
            time_s: later.time_s + after,
            ..later
        };
        match limits.iter_mut().find(|limit| limit.limit == later.limit) {
            Some(limit) if limit.ratio >= later.ratio => {}
            Some(limit) => *limit = later,
            None => limits.push(later),
        }
    }
    MoveCertificate {
        duration_s: after + second.duration_s,
        lower_bound_s: first.lower_bound_s + second.lower_bound_s,
        active: first.active.into_iter().chain(active).collect(),
        poses: Vec::new(),
        in_order: first.in_order && second.in_order,
        peaks: larger(&first.peaks, &second.peaks),
        limits,
        straightness_m: None,
        corridor_m: None,
        end_deviation_m: second.end_deviation_m,
        end_angle_rad: second.end_angle_rad,
        joint_margin: first.joint_margin.min(second.joint_margin),
    }
}

/// The larger of each peak.
fn larger(a: &Peaks, b: &Peaks) -> Peaks {
    let joints = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a.max(*b)).collect();
    Peaks {
        joint_velocity: joints(&a.joint_velocity, &b.joint_velocity),
        joint_acceleration: joints(&a.joint_acceleration, &b.joint_acceleration),
        joint_jerk: joints(&a.joint_jerk, &b.joint_jerk),
        joint_effort: joints(&a.joint_effort, &b.joint_effort),
        tool_speed: a.tool_speed.max(b.tool_speed),
        tool_acceleration: a.tool_acceleration.max(b.tool_acceleration),
        tool_jerk: a.tool_jerk.max(b.tool_jerk),
        tool_angular_speed: a.tool_angular_speed.max(b.tool_angular_speed),
        tool_angular_acceleration: a.tool_angular_acceleration.max(b.tool_angular_acceleration),
        tool_angular_jerk: a.tool_angular_jerk.max(b.tool_angular_jerk),
    }
}
