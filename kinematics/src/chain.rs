//! A serial arm as flat data: forward kinematics, Jacobian, limits.

use crate::arith::{self, Arith, Build, Op, V4};
use crate::ik::Line;
use crate::urdf::{JointKind, Model};
use crate::wide::{F4, transposed};
use nalgebra::{
    Isometry3, Matrix3, Rotation3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3,
};

/// Columns of a rotation and a position.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub(crate) x: V4,
    pub(crate) y: V4,
    pub(crate) z: V4,
    pub(crate) p: V4,
}

impl Frame {
    pub(crate) fn from_isometry(pose: &Isometry3<f64>) -> Self {
        let r = pose.rotation.to_rotation_matrix();
        let column = |j: usize| V4::new(r[(0, j)], r[(1, j)], r[(2, j)]);
        let t = &pose.translation.vector;
        Self {
            x: column(0),
            y: column(1),
            z: column(2),
            p: V4::new(t.x, t.y, t.z),
        }
    }

    #[inline(always)]
    fn rotation(&self) -> Matrix3<f64> {
        let [x, y, z] = [self.x.0, self.y.0, self.z.0];
        Matrix3::new(x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])
    }

    pub(crate) fn isometry(&self) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::new(self.p.0[0], self.p.0[1], self.p.0[2]),
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
                self.rotation(),
            )),
        )
    }
}

/// A frame on its way along the chain, in registers.
#[derive(Clone, Copy)]
struct Moving<A: Arith> {
    x: F4<A>,
    y: F4<A>,
    z: F4<A>,
    p: F4<A>,
}

impl<A: Arith> Moving<A> {
    #[inline(always)]
    fn of(a: A, frame: &Frame) -> Self {
        Self {
            x: F4::new(a, frame.x.0),
            y: F4::new(a, frame.y.0),
            z: F4::new(a, frame.z.0),
            p: F4::new(a, frame.p.0),
        }
    }

    /// `self * local`: the pose of `local` in the frame that `self` is in.
    #[inline(always)]
    fn times(self, local: &Frame) -> Self {
        Self {
            x: self.direction(local.x),
            y: self.direction(local.y),
            z: self.direction(local.z),
            p: self.direction(local.p) + self.p,
        }
    }

    /// A direction given in this frame.
    #[inline(always)]
    fn direction(self, V4([x, y, z, _]): V4) -> F4<A> {
        let a = self.p.build();
        let first = self.y.fma(F4::splat(a, y), self.x * x);
        self.z.fma(F4::splat(a, z), first)
    }

    /// This frame turned by an angle about its own z axis.
    #[inline(always)]
    fn turned(self, sin: f64, cos: f64) -> Self {
        let a = self.p.build();
        let (sin, cos) = (F4::splat(a, sin), F4::splat(a, cos));
        Self {
            x: self.y.fma(sin, self.x * cos),
            y: self.x.taken_from(sin, self.y * cos),
            ..self
        }
    }

    #[inline(always)]
    fn frame(self) -> Frame {
        Frame {
            x: V4(self.x.array()),
            y: V4(self.y.array()),
            z: V4(self.z.array()),
            p: V4(self.p.array()),
        }
    }
}

/// `a x b` of vectors in the first three lanes.
#[inline(always)]
fn cross<A: Arith>(a: F4<A>, b: F4<A>) -> F4<A> {
    a.next().taken_from(b, a * b.next()).next()
}

/// A serial arm of `N` joints as flat, immutable data.
///
/// Joint `i` turns about (or slides along) the z axis of its own frame. The frame
/// that poses are given in is the base of the URDF, unless [`Chain::with_base`]
/// put another before it; the last frame is the flange, unless
/// [`Chain::with_tool`] put a tool behind it.
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
    /// Frame of joint `i` at zero in the frame of joint `i - 1`, z along its axis.
    local: [Frame; N],
    prismatic: [bool; N],
    all_turn: bool,
    /// Tool in the frame of the last joint.
    end: Frame,
    lower: SVector<f64, N>,
    upper: SVector<f64, N>,
    base_from_first: Isometry3<f64>,
    reference_from_base: Isometry3<f64>,
    last_from_flange: Isometry3<f64>,
    flange_from_tool: Isometry3<f64>,
    build: Build,
}

/// A rotation that takes z to `axis`; exact for axes along a coordinate.
pub(crate) fn z_to(axis: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&Vector3::z(), axis).unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
    })
}

impl<const N: usize> Chain<N> {
    /// `None` when the model does not have `N` joints.
    pub(crate) fn new(model: &Model) -> Option<Self> {
        if model.joints.len() != N || model.frames.len() != N || model.axes.len() != N || N == 0 {
            return None;
        }
        let mut before = UnitQuaternion::identity();
        let mut poses = [Isometry3::identity(); N];
        for i in 0..N {
            let align = z_to(&model.axes[i]);
            poses[i] = before.inverse() * model.frames[i] * align;
            before = align;
        }
        let last_from_flange = before.inverse() * model.last_from_flange;
        let prismatic = std::array::from_fn(|i| model.joints[i].kind == JointKind::Prismatic);
        let mut chain = Self {
            local: poses.map(|pose| Frame::from_isometry(&pose)),
            prismatic,
            all_turn: !prismatic.contains(&true),
            end: Frame::from_isometry(&last_from_flange),
            lower: SVector::from_fn(|i, _| model.joints[i].lower),
            upper: SVector::from_fn(|i, _| model.joints[i].upper),
            base_from_first: poses[0],
            reference_from_base: Isometry3::identity(),
            last_from_flange,
            flange_from_tool: Isometry3::identity(),
            build: Build::detect(),
        };
        chain.fold();
        Some(chain)
    }

    /// Folds base and tool into the data that is multiplied.
    fn fold(&mut self) {
        self.local[0] = Frame::from_isometry(&(self.reference_from_base * self.base_from_first));
        self.end = Frame::from_isometry(&(self.last_from_flange * self.flange_from_tool));
    }

    /// The same arm carrying a tool: the last frame becomes the tool's.
    #[must_use]
    pub fn with_tool(mut self, flange_from_tool: &Isometry3<f64>) -> Self {
        self.flange_from_tool = *flange_from_tool;
        self.fold();
        self
    }

    /// The same arm standing in a workstation: poses become those of the workstation.
    #[must_use]
    pub fn with_base(mut self, workstation_from_base: &Isometry3<f64>) -> Self {
        self.reference_from_base = *workstation_from_base;
        self.fold();
        self
    }

    /// The same arm computed without wide instructions, as on a processor that
    /// has none. Poses agree with the wide build within 1e-14 times the reach.
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

    /// Whether `q` (rad, m) is inside the limits, give or take `slack`.
    #[must_use]
    pub fn within_limits(&self, q: &SVector<f64, N>, slack: f64) -> bool {
        (0..N).all(|i| q[i] >= self.lower[i] - slack && q[i] <= self.upper[i] + slack)
    }

    /// Which build of the arithmetic this chain uses.
    pub(crate) fn build(&self) -> Build {
        self.build
    }

    /// Pose of the tool, `base_from_tool`, at the joint positions `q` (rad, m).
    #[must_use]
    pub fn forward(&self, q: &SVector<f64, N>) -> Isometry3<f64> {
        self.build.run(Forward { chain: self, q }).isometry()
    }

    /// Pose of the tool and geometric Jacobian at `q`: column `i` is the tool's
    /// velocity (m) above its angular velocity (rad) for one unit of joint `i`, in
    /// the axes of the base.
    ///
    /// # Source
    /// B. Siciliano et al., Robotics: Modelling, Planning and Control, 2009, eq. 3.30.
    #[must_use]
    pub fn jacobian(&self, q: &SVector<f64, N>) -> (Isometry3<f64>, SMatrix<f64, 6, N>) {
        let (frame, jacobian) = self.build.run(Jacobian { chain: self, q });
        (frame.isometry(), jacobian)
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
        let (_, j) = self.build.run(Jacobian { chain: self, q });
        let linear = |i: usize| Vector3::new(j[(0, i)], j[(1, i)], j[(2, i)]);
        let angular = |i: usize| Vector3::new(j[(3, i)], j[(4, i)], j[(5, i)]);
        let mut derivative = SMatrix::<f64, 6, N>::zeros();
        for i in 0..N {
            let (mut dv, mut dw) = (Vector3::zeros(), Vector3::zeros());
            for k in 0..N {
                // A joint nearer the base carries column i along; one nearer the tip moves
                // the point that column i acts on.
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
    pub(crate) fn lines(&self) -> Option<(Vec<Line>, Isometry3<f64>)> {
        if !self.all_turn {
            return None;
        }
        let (points, axes, tool) = self.frames(arith::Plain, &SVector::zeros());
        let tool = tool.frame();
        let first = |v: F4<arith::Plain>| [v.array()[0], v.array()[1], v.array()[2]];
        let lines = points.into_iter().zip(axes).map(|(p, h)| Line {
            h: first(h),
            p: first(p),
        });
        Some((lines.collect(), tool.isometry()))
    }

    /// Position and axis of every joint and the tool frame, in base axes.
    #[inline(always)]
    fn frames<A: Arith>(&self, a: A, q: &SVector<f64, N>) -> ([F4<A>; N], [F4<A>; N], Moving<A>) {
        let mut angles = [0.0; N];
        for i in 0..N {
            angles[i] = if self.prismatic[i] { 0.0 } else { q[i] };
        }
        let (sin, cos) = arith::sin_cos(a, angles);
        let zero = F4::splat(a, 0.0);
        let (mut points, mut axes) = ([zero; N], [zero; N]);
        let mut frame = Moving::of(a, &self.local[0]).turned(sin[0], cos[0]);
        for i in 0..N {
            if i > 0 {
                frame = frame.times(&self.local[i]).turned(sin[i], cos[i]);
            }
            if !self.all_turn && self.prismatic[i] {
                frame.p = frame.z.fma(F4::splat(a, q[i]), frame.p);
            }
            points[i] = frame.p;
            axes[i] = frame.z;
        }
        (points, axes, frame.times(&self.end))
    }

    /// Tool frame and Jacobian in one build of the arithmetic.
    #[inline(always)]
    pub(crate) fn jacobian_in<A: Arith>(
        &self,
        a: A,
        q: &SVector<f64, N>,
    ) -> (Frame, SMatrix<f64, 6, N>) {
        let (points, axes, tool) = self.frames(a, q);
        let mut j = SMatrix::zeros();
        for i in 0..N {
            let (v, w) = self.column(i, (points[i], axes[i]), &tool);
            let (v, w) = (v.array(), w.array());
            for row in 0..3 {
                j[(row, i)] = v[row];
                j[(3 + row, i)] = w[row];
            }
        }
        (tool.frame(), j)
    }

    /// Tool frame and Jacobian as rows of eight, the last ones zero; `N` is at most 8.
    #[inline(always)]
    pub(crate) fn jacobian_rows<A: Arith>(
        &self,
        a: A,
        q: &SVector<f64, N>,
    ) -> (Frame, [[F4<A>; 2]; 6]) {
        let (points, axes, tool) = self.frames(a, q);
        let zero = F4::splat(a, 0.0);
        let mut columns = [(zero, zero); 8];
        for i in 0..N {
            columns[i] = self.column(i, (points[i], axes[i]), &tool);
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
        (tool.frame(), rows)
    }

    /// Linear and angular part of a column of the Jacobian.
    #[inline(always)]
    fn column<A: Arith>(
        &self,
        i: usize,
        (point, axis): (F4<A>, F4<A>),
        tool: &Moving<A>,
    ) -> (F4<A>, F4<A>) {
        if !self.all_turn && self.prismatic[i] {
            return (axis, F4::splat(axis.build(), 0.0));
        }
        (cross(axis, tool.p - point), axis)
    }
}

/// Forward kinematics as a dispatched computation.
struct Forward<'a, const N: usize> {
    chain: &'a Chain<N>,
    q: &'a SVector<f64, N>,
}

impl<const N: usize> Op for Forward<'_, N> {
    type Output = Frame;

    #[inline(always)]
    fn run<A: Arith>(self, a: A) -> Frame {
        self.chain.frames(a, self.q).2.frame()
    }
}

/// Forward kinematics and Jacobian as a dispatched computation.
pub(crate) struct Jacobian<'a, const N: usize> {
    pub(crate) chain: &'a Chain<N>,
    pub(crate) q: &'a SVector<f64, N>,
}

impl<const N: usize> Op for Jacobian<'_, N> {
    type Output = (Frame, SMatrix<f64, 6, N>);

    #[inline(always)]
    fn run<A: Arith>(self, a: A) -> Self::Output {
        self.chain.jacobian_in(a, self.q)
    }
}
