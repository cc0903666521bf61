//! A serial arm as flat data: forward kinematics, Jacobian, limits.

use crate::links::{Links, Reached, ScrewAxis};
use crate::urdf::{JointKind, Model, UrdfError};
use nalgebra::{ArrayStorage, Isometry3, Point3, SMatrix, SVector, Vector3};
use simd::{Build, F4, Four, Op, Plain, transposed};

/// `a x b` of vectors in the first three lanes.
#[inline(always)]
pub(crate) fn cross<A: Four>(a: F4<A>, b: F4<A>) -> F4<A> {
    a.next().taken_from(b, a * b.next()).next()
}

/// A serial arm of `N` joints as flat, immutable data.
///
/// Joint `i` turns about (or slides along) the z axis of its own frame. Poses are given in the base
/// frame of the URDF, or in the frame set by [`Chain::with_base`]. The last frame is the flange, or
/// the tool set by [`Chain::with_tool`].
///
/// ```
/// # let text = r#"<robot name="swing"><link name="base"/><link name="arm"/>
/// #  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/>
/// #  <origin xyz="0 0 1"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="2" effort="5"/>
/// #  </joint></robot>"#;
/// use nalgebra::{Isometry3, vector};
/// let arm = kinematics::urdf::read(text, None)?.chain::<1>()?
///     .with_tool(&Isometry3::translation(0.5, 0.0, 0.0));
/// let base_from_tool = arm.forward(&vector![0.0]);
/// assert_eq!(base_from_tool.translation.vector, vector![0.5, 0.0, 1.0]);
/// # Ok::<(), kinematics::UrdfError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Chain<const N: usize> {
    /// From base to flange.
    bare: Links<N>,
    /// The same between the frame that poses are given in and the tool.
    links: Links<N>,
    prismatic: [bool; N],
    lower: SVector<f64, N>,
    upper: SVector<f64, N>,
    reference_from_base: Isometry3<f64>,
    flange_from_tool: Isometry3<f64>,
    build: Build,
}

impl Model {
    /// The arm as flat data for `N` joints.
    ///
    /// # Errors
    /// [`UrdfError::JointCount`] when the arm does not have `N` joints.
    pub fn chain<const N: usize>(&self) -> Result<Chain<N>, UrdfError> {
        Chain::new(self).ok_or(UrdfError::JointCount {
            found: self.joints.len(),
            expected: N,
        })
    }
}

impl<const N: usize> Chain<N> {
    /// `None` when the model does not have `N` joints.
    fn new(model: &Model) -> Option<Self> {
        if model.joints.len() != N || model.frames.len() != N || model.axes.len() != N || N == 0 {
            return None;
        }
        let bare = Links::of(model);
        Some(Self {
            bare,
            links: bare,
            prismatic: std::array::from_fn(|i| model.joints[i].kind == JointKind::Prismatic),
            lower: SVector::from_fn(|i, _| model.joints[i].lower),
            upper: SVector::from_fn(|i, _| model.joints[i].upper),
            reference_from_base: Isometry3::identity(),
            flange_from_tool: Isometry3::identity(),
            build: Build::detect(),
        })
    }

    /// Includes base and tool in the links.
    fn fold(&mut self) {
        let (base, tool) = (&self.reference_from_base, &self.flange_from_tool);
        self.links = self.bare.between(base, tool);
    }

    /// The same arm carrying a tool: the last frame becomes the tool's.
    #[must_use]
    pub fn with_tool(mut self, flange_from_tool: &Isometry3<f64>) -> Self {
        self.flange_from_tool = *flange_from_tool;
        self.fold();
        self
    }

    /// The same arm with its base in a workstation: poses are then in the workstation frame.
    #[must_use]
    pub fn with_base(mut self, workstation_from_base: &Isometry3<f64>) -> Self {
        self.reference_from_base = *workstation_from_base;
        self.fold();
        self
    }

    /// The same arm, computed without SIMD instructions, as on a processor that has none. Poses
    /// agree with those of the SIMD build within 1e-14 times the reach.
    #[must_use]
    pub fn plain(mut self) -> Self {
        self.build = Build::Plain;
        self
    }

    /// Pose of the tool in the flange.
    #[must_use]
    pub fn flange_from_tool(&self) -> &Isometry3<f64> {
        &self.flange_from_tool
    }

    /// Pose of the robot's base in the frame that poses are given in.
    #[must_use]
    pub fn reference_from_base(&self) -> &Isometry3<f64> {
        &self.reference_from_base
    }

    /// A ball that contains every position of the tool at all joint positions: its centre, in the
    /// frame that poses are given in, and its radius (m). It is larger than the reach of the arm,
    /// and takes a few additions to compute. The radius is infinite if a sliding joint has no
    /// limits.
    #[must_use]
    pub fn reach_ball(&self) -> (Point3<f64>, f64) {
        let stroke = |i: usize| {
            if self.prismatic[i] {
                self.lower[i].abs().max(self.upper[i].abs())
            } else {
                0.0
            }
        };
        let (middle, radius) = self.links.ball(stroke);
        (middle.into(), radius)
    }

    /// Lower joint limits, rad or m; minus infinity for continuous joints.
    #[must_use]
    pub fn lower(&self) -> &SVector<f64, N> {
        &self.lower
    }

    /// Upper joint limits, rad or m; infinity for continuous joints.
    #[must_use]
    pub fn upper(&self) -> &SVector<f64, N> {
        &self.upper
    }

    /// Whether each joint slides; the others turn.
    #[must_use]
    pub fn prismatic(&self) -> &[bool; N] {
        &self.prismatic
    }

    /// Distance (rad, m) of a joint at `position` from the nearer of its limits, less than 0 beyond it; infinite without
    /// limits.
    ///
    /// ```
    /// # let text = include_str!("../../robots/panda/robot.urdf");
    /// let chain = kinematics::urdf::read(text, None)?.chain::<7>()?;
    /// // Joint 4 turns from -3.0718 to -0.0698 rad.
    /// assert!((chain.room(3, -3.0) - 0.0718).abs() < 1e-9);
    /// # Ok::<(), kinematics::UrdfError>(())
    /// ```
    #[must_use]
    pub fn room(&self, joint: usize, position: f64) -> f64 {
        (self.upper[joint] - position).min(position - self.lower[joint])
    }

    /// Whether `q` (rad, m) is inside the limits widened by `slack`.
    #[must_use]
    pub fn within_limits(&self, q: &SVector<f64, N>, slack: f64) -> bool {
        (0..N).all(|i| q[i] >= self.lower[i] - slack && q[i] <= self.upper[i] + slack)
    }

    /// Distance (m) from joint `joint` to the next joint, or from the last joint to the tool,
    /// without the travel of a sliding joint.
    pub(crate) fn beyond(&self, joint: usize) -> f64 {
        self.links.beyond(joint)
    }

    /// Which build of the arithmetic this chain uses.
    pub(crate) fn build(&self) -> Build {
        self.build
    }

    /// Pose of the tool, `base_from_tool`, at the joint positions `q` (rad, m).
    #[must_use]
    pub fn forward(&self, q: &SVector<f64, N>) -> Isometry3<f64> {
        self.build.run(Forward { chain: self, q })
    }

    /// Pose of the tool and geometric Jacobian at `q`: column `i` is the tool's
    /// velocity (m) above its angular velocity (rad) for one unit of joint `i`, in
    /// the axes of the base.
    ///
    /// # Source
    /// B. Siciliano et al., Robotics: Modelling, Planning and Control, 2009, eq. 3.30.
    #[must_use]
    pub fn jacobian(&self, q: &SVector<f64, N>) -> (Isometry3<f64>, SMatrix<f64, 6, N>) {
        self.build.run(Jacobian { chain: self, q })
    }

    /// Time derivative of the Jacobian at `q` moving with `dq` (rad/s, m/s), laid
    /// out as [`Chain::jacobian`].
    ///
    /// # Source
    /// H. Bruyninckx and J. De Schutter, "Symbolic differentiation of the velocity
    /// mapping for a serial kinematic chain", Mech. Mach. Theory 31(2), 1996, eq. 12.
    #[must_use]
    pub fn jacobian_derivative(
        &self,
        q: &SVector<f64, N>,
        dq: &SVector<f64, N>,
    ) -> SMatrix<f64, 6, N> {
        let (_, j) = self.jacobian(q);
        let linear = |i: usize| Vector3::new(j[(0, i)], j[(1, i)], j[(2, i)]);
        let angular = |i: usize| Vector3::new(j[(3, i)], j[(4, i)], j[(5, i)]);
        let mut derivative = SMatrix::<f64, 6, N>::zeros();
        for i in 0..N {
            let (mut dv, mut dw) = (Vector3::zeros(), Vector3::zeros());
            for k in 0..N {
                // A joint nearer the base moves column i; a joint nearer the tip moves the point
                // that column i acts on.
                if k <= i {
                    dv += angular(k).cross(&linear(i)) * dq[k];
                    dw += angular(k).cross(&angular(i)) * dq[k];
                } else {
                    dv += angular(i).cross(&linear(k)) * dq[k];
                }
            }
            derivative.fixed_view_mut::<3, 1>(0, i).copy_from(&dv);
            derivative.fixed_view_mut::<3, 1>(3, i).copy_from(&dw);
        }
        derivative
    }

    /// Axes of the joints and pose of the tool with all joints at zero; `None` where a joint slides.
    pub(crate) fn lines(&self) -> Option<(Vec<ScrewAxis>, Isometry3<f64>)> {
        if !self.links.all_turn() {
            return None;
        }
        let reached = self.links.reach(Plain, &SVector::zeros());
        let first = |v: F4<Plain>| [v.array()[0], v.array()[1], v.array()[2]];
        let lines = reached.points.into_iter().zip(reached.axes);
        let lines = lines.map(|(p, h)| ScrewAxis {
            h: first(h),
            p: first(p),
        });
        Some((lines.collect(), reached.end.frame().isometry()))
    }

    /// Whether a joint slides.
    #[inline(always)]
    pub(crate) fn slides(&self, joint: usize) -> bool {
        self.links.slides(joint)
    }

    /// Positions of the links with the joints at `q`.
    #[inline(always)]
    pub(crate) fn reach<A: Four>(&self, a: A, q: &SVector<f64, N>) -> Reached<A, N> {
        self.links.reach(a, q)
    }

    /// The Jacobian as rows of eight, the last ones zero; `N` is at most 8.
    #[inline(always)]
    pub(crate) fn rows<A: Four>(&self, reached: &Reached<A, N>) -> [[F4<A>; 2]; 6] {
        let zero = F4::splat(reached.end.p.build(), 0.0);
        let mut columns = [(zero, zero); 8];
        for i in 0..N {
            columns[i] = self.column(i, reached);
        }
        let mut rows = [[zero; 2]; 6];
        for half in 0..2 {
            let i = 4 * half;
            let (x, y, z, w) = (columns[i], columns[i + 1], columns[i + 2], columns[i + 3]);
            let linear = transposed([x.0, y.0, z.0, w.0]);
            let angular = transposed([x.1, y.1, z.1, w.1]);
            for r in 0..3 {
                rows[r][half] = linear[r];
                rows[3 + r][half] = angular[r];
            }
        }
        rows
    }

    /// Linear and angular part of a column of the Jacobian.
    #[inline(always)]
    fn column<A: Four>(&self, i: usize, reached: &Reached<A, N>) -> (F4<A>, F4<A>) {
        let axis = reached.axes[i];
        if self.links.slides(i) {
            return (axis, F4::splat(axis.build(), 0.0));
        }
        (cross(axis, reached.end.p - reached.points[i]), axis)
    }
}

/// Forward kinematics, compiled for both builds.
struct Forward<'a, const N: usize> {
    chain: &'a Chain<N>,
    q: &'a SVector<f64, N>,
}

impl<const N: usize> Op for Forward<'_, N> {
    type Output = Isometry3<f64>;

    #[inline(always)]
    fn run<A: Four>(self, a: A) -> Isometry3<f64> {
        self.chain.reach(a, self.q).end.frame().isometry()
    }
}

/// Forward kinematics and Jacobian, compiled for both builds.
struct Jacobian<'a, const N: usize> {
    chain: &'a Chain<N>,
    q: &'a SVector<f64, N>,
}

impl<const N: usize> Op for Jacobian<'_, N> {
    type Output = (Isometry3<f64>, SMatrix<f64, 6, N>);

    #[inline(always)]
    fn run<A: Four>(self, a: A) -> Self::Output {
        let reached = self.chain.reach(a, self.q);
        let mut columns = [[0.0; 6]; N];
        for i in 0..N {
            let (v, w) = self.chain.column(i, &reached);
            let ([vx, vy, vz, _], [wx, wy, wz, _]) = (v.array(), w.array());
            columns[i] = [vx, vy, vz, wx, wy, wz];
        }
        let jacobian = SMatrix::from_array_storage(ArrayStorage(columns));
        (reached.end.frame().isometry(), jacobian)
    }
}
