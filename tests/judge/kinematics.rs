//! State of the tool from states of the joints, by `k`'s frames and the recursion over the links.

use k::nalgebra::{Isometry3, Vector3};

/// Controlled point and tool at one time, in the workstation.
#[derive(Clone, Copy)]
pub struct State {
    pub pose: Isometry3<f64>,
    pub velocity: Vector3<f64>,
    pub acceleration: Vector3<f64>,
    pub spin: Vector3<f64>,
    pub spin_rate: Vector3<f64>,
}

/// State of the tool when the joints have positions, velocities and accelerations.
///
/// `axes` are the joints at these positions: a point on the axis, its direction, whether it slides.
pub fn state(
    axes: &[(Vector3<f64>, Vector3<f64>, bool)],
    [dq, ddq]: [&[f64]; 2],
    pose: Isometry3<f64>,
) -> State {
    let zero = Vector3::zeros();
    let (mut velocity, mut acceleration, mut spin, mut spin_rate) = (zero, zero, zero, zero);
    let mut at = zero;
    let mut to = |at: &mut Vector3<f64>,
                  point: Vector3<f64>,
                  motion: [&mut Vector3<f64>; 2],
                  turn: [Vector3<f64>; 2]| {
        let lever = point - *at;
        let [velocity, acceleration] = motion;
        *velocity += turn[0].cross(&lever);
        *acceleration += turn[1].cross(&lever) + turn[0].cross(&turn[0].cross(&lever));
        *at = point;
    };
    for (joint, (point, axis, slides)) in axes.iter().enumerate() {
        to(
            &mut at,
            *point,
            [&mut velocity, &mut acceleration],
            [spin, spin_rate],
        );
        if *slides {
            velocity += axis * dq[joint];
            acceleration += axis * ddq[joint] + spin.cross(axis) * (2.0 * dq[joint]);
        } else {
            spin_rate += axis * ddq[joint] + spin.cross(axis) * dq[joint];
            spin += axis * dq[joint];
        }
    }
    to(
        &mut at,
        pose.translation.vector,
        [&mut velocity, &mut acceleration],
        [spin, spin_rate],
    );
    State {
        pose,
        velocity,
        acceleration,
        spin,
        spin_rate,
    }
}
