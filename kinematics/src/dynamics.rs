//! Inverse dynamics: the efforts of the joints that a motion needs.

use nalgebra::{Isometry3, SVector, Unit, UnitQuaternion, Vector3};

use crate::inertia::Inertia;
use crate::urdf::{JointKind, Model};

/// Acceleration of gravity, m/s²: the standard value.
const GRAVITY: f64 = 9.806_65;

/// The masses of an arm of `N` joints: from a motion of the joints to the efforts that it needs.
///
/// Friction and the inertia of rotors are not part of it.
///
/// ```
/// # let text = r#"<robot name="swing"><link name="base"/><link name="arm"><inertial>
/// #  <origin xyz="0.5 0 0"/><mass value="2"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/>
/// #  </inertial></link><joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/>
/// #  <axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="2" effort="5"/></joint></robot>"#;
/// use nalgebra::vector;
/// let arm = kinematics::urdf::read(text, None)?.dynamics::<1>().expect("every link has a mass");
/// // 2 kg at half a metre are held against gravity.
/// let effort = arm.effort(&vector![0.0], &vector![0.0], &vector![0.0]);
/// assert!((effort[0] + 2.0 * 0.5 * 9.80665).abs() < 1e-12);
/// # Ok::<(), kinematics::UrdfError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Dynamics<const N: usize> {
    frames: [Isometry3<f64>; N],
    axes: [Unit<Vector3<f64>>; N],
    slides: [bool; N],
    /// What moves with each joint, in its frame.
    bodies: [Inertia; N],
    last_from_flange: Isometry3<f64>,
    /// Acceleration of gravity in the frame of the base (m/s²).
    gravity: Vector3<f64>,
}

impl Model {
    /// The masses of the arm for `N` joints; `None` when it does not have `N` joints, or a link that
    /// moves has no inertia.
    #[must_use]
    pub fn dynamics<const N: usize>(&self) -> Option<Dynamics<N>> {
        if self.joints.len() != N || self.inertias.len() != N {
            return None;
        }
        let mut bodies = [Inertia::none(); N];
        for (body, known) in bodies.iter_mut().zip(&self.inertias) {
            *body = (*known)?;
        }
        Some(Dynamics {
            frames: std::array::from_fn(|i| self.frames[i]),
            axes: std::array::from_fn(|i| self.axes[i]),
            slides: std::array::from_fn(|i| self.joints[i].kind == JointKind::Prismatic),
            bodies,
            last_from_flange: self.last_from_flange,
            gravity: Vector3::new(0.0, 0.0, -GRAVITY),
        })
    }
}

/// The motion of one link, in its own axes.
#[derive(Clone, Copy)]
struct LinkMotion {
    /// Pose of the link in the one before it.
    pose: Isometry3<f64>,
    /// Force and moment about the origin that its body needs (N, Nm).
    force: Vector3<f64>,
    torque: Vector3<f64>,
}

impl<const N: usize> Dynamics<N> {
    /// The same arm with its base mounted as given; gravity is along -z of the workstation.
    #[must_use]
    pub fn with_base(mut self, workstation_from_base: &Isometry3<f64>) -> Self {
        let down = Vector3::new(0.0, 0.0, -GRAVITY);
        self.gravity = workstation_from_base.rotation.inverse() * down;
        self
    }

    /// The same arm with a body fixed to its flange, given in the frame of the flange.
    #[must_use]
    pub fn with_payload(mut self, payload: &Inertia) -> Self {
        if let Some(last) = self.bodies.last_mut() {
            *last = last.with(&payload.in_frame(&self.last_from_flange));
        }
        self
    }

    /// The efforts (Nm; N for joints that slide) that the joints need to move with the velocities
    /// `dq` (rad/s, m/s) and accelerations `ddq` (rad/s², m/s²) at `q` (rad, m).
    ///
    /// # Source
    /// Recursive Newton-Euler: J. Y. S. Luh, M. W. Walker, R. P. C. Paul, "On-line computational
    /// scheme for mechanical manipulators", J. Dyn. Sys. Meas. Control 102(2), 1980.
    #[must_use]
    pub fn effort(
        &self,
        q: &SVector<f64, N>,
        dq: &SVector<f64, N>,
        ddq: &SVector<f64, N>,
    ) -> SVector<f64, N> {
        let zero = Vector3::zeros();
        // Gravity is an acceleration of the base upwards.
        let (mut w, mut dw, mut a) = (zero, zero, -self.gravity);
        let mut links = [LinkMotion {
            pose: Isometry3::identity(),
            force: zero,
            torque: zero,
        }; N];
        for i in 0..N {
            let (axis, body) = (self.axes[i].into_inner(), &self.bodies[i]);
            let pose = self.frames[i] * self.turned(i, q[i]);
            let arm = pose.translation.vector;
            let back = pose.rotation.inverse();
            a = back * (a + dw.cross(&arm) + w.cross(&w.cross(&arm)));
            (w, dw) = (back * w, back * dw);
            if self.slides[i] {
                a += axis * ddq[i] + w.cross(&axis) * (2.0 * dq[i]);
            } else {
                dw += axis * ddq[i] + w.cross(&axis) * dq[i];
                w += axis * dq[i];
            }
            let c = &body.centre;
            let force = (a + dw.cross(c) + w.cross(&w.cross(c))) * body.mass;
            let own = body.moment * dw + w.cross(&(body.moment * w));
            let torque = own + c.cross(&force);
            links[i] = LinkMotion {
                pose,
                force,
                torque,
            };
        }
        let (mut force, mut torque) = (zero, zero);
        let mut effort = SVector::zeros();
        for i in (0..N).rev() {
            let link = &links[i];
            force += link.force;
            torque += link.torque;
            let along = if self.slides[i] { &force } else { &torque };
            effort[i] = self.axes[i].dot(along);
            // From this link to the one before it.
            force = link.pose.rotation * force;
            torque = link.pose.rotation * torque + link.pose.translation.vector.cross(&force);
        }
        effort
    }

    /// The motion of joint `i` to `q`, in its own frame.
    fn turned(&self, i: usize, q: f64) -> Isometry3<f64> {
        if self.slides[i] {
            return Isometry3::translation(
                self.axes[i].x * q,
                self.axes[i].y * q,
                self.axes[i].z * q,
            );
        }
        Isometry3::from_parts(
            nalgebra::Translation3::identity(),
            UnitQuaternion::from_axis_angle(&self.axes[i], q),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn arm() -> Model {
        crate::urdf::read(include_str!("../../robots/ur5e/robot.urdf"), None).unwrap()
    }

    /// Kinetic and potential energy (J), from the pose of each body alone.
    fn energy(model: &Model, q: &SVector<f64, 6>, dq: &SVector<f64, 6>) -> f64 {
        let places = |q: &SVector<f64, 6>| {
            let mut place = Isometry3::identity();
            std::array::from_fn::<_, 6, _>(|i| {
                let turn = UnitQuaternion::from_axis_angle(&model.axes[i], q[i]);
                place = place * model.frames[i] * turn;
                place
            })
        };
        let (h, mut sum) = (1e-6, 0.0);
        let (before, here, after) = (places(&(q - dq * h)), places(q), places(&(q + dq * h)));
        for i in 0..6 {
            let body = model.inertias[i].unwrap();
            let centre =
                |place: &Isometry3<f64>| (place * nalgebra::Point3::from(body.centre)).coords;
            let v = (centre(&after[i]) - centre(&before[i])) / (2.0 * h);
            let turn = after[i].rotation * before[i].rotation.inverse();
            let w = here[i].rotation.inverse() * (turn.scaled_axis() / (2.0 * h));
            sum += 0.5 * body.mass * v.norm_squared() + 0.5 * w.dot(&(body.moment * w));
            sum += body.mass * GRAVITY * centre(&here[i]).z;
        }
        sum
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(9), ..Default::default() })]

        /// The power of the joints is the change of the energy.
        #[test]
        fn power_is_the_change_of_energy(
            q in prop::array::uniform6(-3.0..3.0_f64),
            dq in prop::array::uniform6(-2.0..2.0_f64),
            ddq in prop::array::uniform6(-5.0..5.0_f64),
        ) {
            let (q, dq, ddq) = (SVector::from(q), SVector::from(dq), SVector::from(ddq));
            let model = arm();
            let effort = model.dynamics::<6>().unwrap().effort(&q, &dq, &ddq);
            let h = 1e-4;
            let at = |t: f64| {
                energy(&model, &(q + dq * t + ddq * (0.5 * t * t)), &(dq + ddq * t))
            };
            let change = (at(h) - at(-h)) / (2.0 * h);
            prop_assert!((effort.dot(&dq) - change).abs() < 1e-4 * (1.0 + change.abs()), "{change}");
        }

        /// A payload is a body of the last link.
        #[test]
        fn a_payload_at_rest_adds_its_weight(q in prop::array::uniform6(-3.0..3.0_f64)) {
            let (q, zero) = (SVector::from(q), SVector::zeros());
            let arm = arm();
            let bare = arm.dynamics::<6>().unwrap();
            let payload = Inertia { mass: 5.0, centre: Vector3::new(0.0, 0.02, 0.1), ..Inertia::none() };
            let added = bare.with_payload(&payload).effort(&q, &zero, &zero) - bare.effort(&q, &zero, &zero);
            let chain = arm.chain::<6>().unwrap();
            let tool = chain.with_tool(&Isometry3::from(payload.centre));
            let (_, jacobian) = tool.jacobian(&q);
            let weight = jacobian.row(2).transpose() * (5.0 * GRAVITY);
            prop_assert!((added - weight).amax() < 1e-10);
        }
    }
}
