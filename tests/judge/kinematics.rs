//! State of the tool from states of the joints, with the frames of `k` and the recursion over the
//! links.

use k::nalgebra::{Isometry3, Vector3};

/// Controlled point and tool at one time, in the workstation.
#[derive(Clone, Copy)]
pub(crate) struct State {
    pub(crate) pose: Isometry3<f64>,
    pub(crate) velocity: Vector3<f64>,
    pub(crate) acceleration: Vector3<f64>,
    pub(crate) spin: Vector3<f64>,
    pub(crate) spin_rate: Vector3<f64>,
}

/// State of the tool when the joints have positions, velocities and accelerations.
///
/// `axes` are the joints at these positions: a point on the axis, its direction, whether it slides.
pub(crate) fn state(
    axes: &[(Vector3<f64>, Vector3<f64>, bool)],
    [dq, ddq]: [&[f64]; 2],
    pose: Isometry3<f64>,
) -> State {
    let zero = Vector3::zeros();
    let mut at = Frame {
        point: zero,
        velocity: zero,
        acceleration: zero,
        spin: zero,
        spin_rate: zero,
    };
    for (joint, (point, axis, slides)) in axes.iter().enumerate() {
        at.go_to(*point);
        let spin = at.spin;
        if *slides {
            at.velocity += axis * dq[joint];
            at.acceleration += axis * ddq[joint] + spin.cross(axis) * (2.0 * dq[joint]);
        } else {
            at.spin_rate += axis * ddq[joint] + spin.cross(axis) * dq[joint];
            at.spin += axis * dq[joint];
        }
    }
    at.go_to(pose.translation.vector);
    State {
        pose,
        velocity: at.velocity,
        acceleration: at.acceleration,
        spin: at.spin,
        spin_rate: at.spin_rate,
    }
}

/// A point of a link, with how it and the link move.
struct Frame {
    point: Vector3<f64>,
    velocity: Vector3<f64>,
    acceleration: Vector3<f64>,
    spin: Vector3<f64>,
    spin_rate: Vector3<f64>,
}

impl Frame {
    /// Another point of the same link.
    fn go_to(&mut self, point: Vector3<f64>) {
        let lever = point - self.point;
        self.velocity += self.spin.cross(&lever);
        self.acceleration +=
            self.spin_rate.cross(&lever) + self.spin.cross(&self.spin.cross(&lever));
        self.point = point;
    }
}
