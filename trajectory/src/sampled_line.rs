//! A straight line in joint space whose tool is interpolated.

use nalgebra::{Isometry3, Quaternion, SVector, Translation3, UnitQuaternion, Vector3};
use realtime::{Piece, Sample};

use crate::{JointLine, JointPoint, Path, PathPoint, ToolPoint};

/// How far all joints together move from one sample to the next, at most (rad, m).
const STEP: f64 = 0.12;
/// Fewest and most samples of a line, in addition to that of its start.
const SAMPLES: [f64; 2] = [8.0, 1000.0];

/// A [`JointLine`] whose tool is looked at in a few places only, and interpolated between them: for
/// searches that look at many places where the kinematics are dear. The joints are exact.
///
/// Along the line the tool's motion is a sum of waves none of which turns faster than all joints
/// together, so close samples give its first derivative to about 1e-9 of the reach, the third to 1e-7.
///
/// ```
/// use nalgebra::{Isometry3, Vector3, vector};
/// use trajectory::{JointLine, Path, SampledLine, ToolPoint};
///
/// // One joint that turns an arm of 1 m about the z axis.
/// let turning = |joint: &trajectory::JointPoint<1>| {
///     let (angle, rate) = (joint.q[0][0], joint.q[1][0]);
///     let (out, aside) = (Vector3::new(angle.cos(), angle.sin(), 0.0), Vector3::new(-angle.sin(), angle.cos(), 0.0));
///     ToolPoint {
///         pose: Isometry3::new(out, Vector3::z() * angle),
///         linear: [aside * rate, out * -rate.powi(2), aside * -rate.powi(3)],
///         angular: [Vector3::z() * rate, Vector3::zeros(), Vector3::zeros()],
///     }
/// };
/// let line = JointLine::new(vector![0.0], vector![1.5], turning);
/// let (exact, sampled) = (line.tool_at(0.37), SampledLine::new(&line).tool_at(0.37));
/// assert!((exact.linear[2] - sampled.linear[2]).norm() < 1e-6);
/// ```
#[derive(Clone, Debug)]
pub struct SampledLine<const N: usize> {
    joints: JointLine<N, ()>,
    spans: Vec<Span>,
}

/// The tool between two samples.
#[derive(Clone, Debug)]
struct Span {
    /// Position (m), a polynomial of the parameter since the first sample.
    place: [Vector3<f64>; 7],
    /// The first derivative of the position and the angular velocity.
    rates: [SVector<f64, 6>; 6],
    /// Quaternion of the orientation, not yet of length 1.
    turn: [SVector<f64, 4>; 4],
}

impl Span {
    /// The tool from one sample to the next, `step` of the parameter apart.
    fn new(step: f64, from: &ToolPoint, to: &ToolPoint) -> Self {
        let rates = Piece::hermite(step, &rates(from), &rates(to)).coefficients;
        let mut place = [from.pose.translation.vector; 7];
        for (k, (place, rate)) in place[1..].iter_mut().zip(&rates).enumerate() {
            *place = rate.fixed_rows::<3>(0) / (k + 1) as f64;
        }
        let ([q0, v0], [mut q1, mut v1]) = (turn(from), turn(to));
        if q0.dot(&q1) < 0.0 {
            (q1, v1) = (-q1, -v1);
        }
        // The cubic with these ends.
        let mean = (q1 - q0) / step;
        let second = (mean * 3.0 - v0 * 2.0 - v1) / step;
        let third = (v0 + v1 - mean * 2.0) / (step * step);
        Self {
            place,
            rates,
            turn: [q0, v0, second, third],
        }
    }

    /// The tool `t` of the parameter after the first sample.
    fn at(&self, t: f64) -> ToolPoint {
        // Horner's rule for the value, its derivative and half of the second.
        let zero = SVector::zeros();
        let (mut rate, mut second, mut third) = (self.rates[5], zero, zero);
        for c in self.rates[..5].iter().rev() {
            third = third * t + second;
            second = second * t + rate;
            rate = rate * t + c;
        }
        let [c0, c1, c2, c3, c4, c5, c6] = &self.place;
        let place = c0 + (c1 + (c2 + (c3 + (c4 + (c5 + c6 * t) * t) * t) * t) * t) * t;
        let [q0, q1, q2, q3] = &self.turn;
        let turn = q0 + (q1 + (q2 + q3 * t) * t) * t;
        let part = |first: usize| {
            [rate, second, third * 2.0].map(|x| x.fixed_rows::<3>(first).into_owned())
        };
        ToolPoint {
            pose: Isometry3::from_parts(
                Translation3::from(place),
                UnitQuaternion::new_normalize(Quaternion::from(turn)),
            ),
            linear: part(0),
            angular: part(3),
        }
    }
}

/// First derivatives of position and orientation, with two of theirs.
fn rates(tool: &ToolPoint) -> Sample<6> {
    let both = |k: usize| {
        let (linear, angular) = (&tool.linear[k], &tool.angular[k]);
        SVector::from_fn(|i, _| if i < 3 { linear[i] } else { angular[i - 3] })
    };
    Sample {
        position: both(0),
        velocity: both(1),
        acceleration: both(2),
        jerk: SVector::zeros(),
    }
}

/// The quaternion of the orientation and its derivative.
///
/// # Source
/// Siciliano et al. 2009, Robotics: Modelling, Planning and Control, eq. 3.94: half the angular velocity
/// times the quaternion.
fn turn(tool: &ToolPoint) -> [SVector<f64, 4>; 2] {
    let at = tool.pose.rotation.into_inner();
    let rate = Quaternion::from_imag(tool.angular[0]) * at * 0.5;
    [at.coords, rate.coords]
}

impl<const N: usize> SampledLine<N> {
    /// The line with its tool sampled.
    pub fn new<F: Fn(&JointPoint<N>) -> ToolPoint>(line: &JointLine<N, F>) -> Self {
        let way = line.joints(0.0).q[1].lp_norm(1);
        let count = (way / STEP).ceil().clamp(SAMPLES[0], SAMPLES[1]) as usize;
        let at = |i: usize| line.tool_at(i as f64 / count as f64);
        let step = 1.0 / count as f64;
        let mut from = at(0);
        let spans = (1..=count).map(|i| {
            let to = at(i);
            Span::new(step, &std::mem::replace(&mut from, to), &to)
        });
        Self {
            spans: spans.collect(),
            joints: line.with_tool(()),
        }
    }
}

impl<const N: usize> Path<N> for SampledLine<N> {
    fn end(&self) -> f64 {
        1.0
    }

    fn knots(&self) -> &[f64] {
        &[0.0, 1.0]
    }

    fn at(&self, u: f64) -> PathPoint<N> {
        PathPoint {
            joint: self.joint_at(u),
            tool: self.tool_at(u),
        }
    }

    fn tool_at(&self, u: f64) -> ToolPoint {
        let count = self.spans.len() as f64;
        let index = ((u * count) as usize).min(self.spans.len() - 1);
        let since = u.clamp(0.0, 1.0) - index as f64 / count;
        self.spans[index].at(since)
    }

    fn joint_at(&self, u: f64) -> JointPoint<N> {
        self.joints.joints(u)
    }
}
