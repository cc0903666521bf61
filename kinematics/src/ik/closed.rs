//! Closed forms joined to a chain: branches as joint positions.

use super::classify::{Class, Form, classify};
use super::lanes::{Angle, B4, F4, angle_of};
use super::six::{Line, Product, Zero};
use crate::arith::{Arith, Op};
use crate::chain::Chain;
use nalgebra::{Isometry3, Rotation3, SVector, Unit, Vector3};

/// The closed form of one arm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closed {
    zero: Zero,
    class: Class,
}

/// Joint angles (rad, one turn) of eight branches and which of them exist.
pub(crate) struct Raw<const N: usize> {
    pub(crate) joints: [[F4; N]; 2],
    pub(crate) real: [B4; 2],
}

impl Closed {
    /// The closed form of a chain, if it has one.
    pub(crate) fn of<const N: usize>(chain: &Chain<N>) -> Option<Self> {
        let (lines, zero) = chain.lines()?;
        Some(Self {
            zero: Zero::new(&zero),
            class: classify(&lines)?,
        })
    }

    /// Whether the closed form is exact, not only near.
    pub(crate) fn exact(&self) -> bool {
        self.class.exact
    }

    /// Whether the form leaves one parameter free.
    pub(crate) fn spare(&self) -> bool {
        !matches!(self.class.form, Form::Six(_))
    }

    /// The joint that is the free parameter, if one is.
    pub(crate) fn given<const N: usize>(&self) -> Option<usize> {
        match &self.class.form {
            Form::Six(_) | Form::Swivel(_) => None,
            Form::Last(..) => Some(N - 1),
            Form::First(..) => Some(0),
        }
    }

    /// One line for people.
    pub(crate) fn name(&self) -> &'static str {
        use super::six::Shape;
        match &self.class.form {
            Form::Six(six) => match six.shape {
                Shape::Wrist(..) if six.reversed => "spherical shoulder",
                Shape::Wrist(..) => "spherical wrist",
                Shape::Parallels(..) => "three parallel axes",
            },
            Form::Last(..) => "seven joints, last given",
            Form::First(..) => "seven joints, first given",
            Form::Swivel(_) => "spherical shoulder and wrist, swivel given",
        }
    }

    /// The free parameter of a joint position, rad; 0 where there is none.
    pub(crate) fn parameter<const N: usize>(&self, q: &SVector<f64, N>) -> f64 {
        match &self.class.form {
            Form::Six(_) => 0.0,
            Form::Last(..) => q[N - 1],
            Form::First(..) => q[0],
            Form::Swivel(swivel) => swivel.of(&std::array::from_fn(|i| q[i.min(N - 1)])),
        }
    }
}

/// All branches of one pose as a dispatched computation.
pub(crate) struct Branching<'a, const N: usize> {
    pub(crate) closed: &'a Closed,
    pub(crate) pose: &'a Isometry3<f64>,
    /// The free parameter, rad.
    pub(crate) parameter: f64,
    /// Joint positions for joints that a singular pose leaves free.
    pub(crate) hold: &'a SVector<f64, N>,
}

impl<const N: usize> Op for Branching<'_, N> {
    type Output = Raw<N>;

    #[inline(always)]
    fn run<A: Arith>(self, a: A) -> Raw<N> {
        let Self {
            closed,
            pose,
            parameter,
            hold,
        } = self;
        let g = Product::of(pose, &closed.zero);
        let mut joints = [[[0.0; 4]; N]; 2];
        let real;
        match &closed.class.form {
            Form::Six(six) => {
                let angles = six.solve(a, &g, held(hold, 0));
                fill(a, &mut joints, 0, &angles.joints);
                real = angles.real;
            }
            Form::Last(six, line) => {
                let angles = six.solve(a, &without_last(&g, line, parameter), held(hold, 0));
                fill(a, &mut joints, 0, &angles.joints);
                joints[0][N - 1] = [parameter; 4];
                joints[1][N - 1] = [parameter; 4];
                real = angles.real;
            }
            Form::First(six, line) => {
                let angles = six.solve(a, &without_first(&g, line, parameter), held(hold, 1));
                fill(a, &mut joints, 1, &angles.joints);
                joints[0][0] = [parameter; 4];
                joints[1][0] = [parameter; 4];
                real = angles.real;
            }
            Form::Swivel(swivel) => {
                let angles = swivel.solve(a, &g, parameter, &held(hold, 0));
                fill(a, &mut joints, 0, &angles.joints);
                real = angles.real;
            }
        }
        Raw { joints, real }
    }
}

/// `M` joint positions from the joint `first` on.
#[inline(always)]
fn held<const N: usize, const M: usize>(hold: &SVector<f64, N>, first: usize) -> [f64; M] {
    std::array::from_fn(|i| hold[(first + i).min(N - 1)])
}

#[inline(always)]
fn fill<A: Arith, const N: usize, const M: usize>(
    a: A,
    joints: &mut [[F4; N]; 2],
    first: usize,
    angles: &[[Angle; M]; 2],
) {
    for group in 0..2 {
        for i in 0..M {
            if first + i < N {
                joints[group][first + i] = angle_of(a, angles[group][i]);
            }
        }
    }
}

/// One turn about a line: rotation and translation.
fn turn(line: &Line, angle: f64) -> Product {
    let axis = Unit::new_unchecked(Vector3::from(line.h));
    let r = Rotation3::from_axis_angle(&axis, angle).into_inner();
    let p = Vector3::from(line.p);
    Product::new(r, p - r * p)
}

#[inline(always)]
fn without_last(g: &Product, line: &Line, angle: f64) -> Product {
    let back = turn(line, -angle);
    Product::new(g.r * back.r, g.r * back.t + g.t)
}

#[inline(always)]
fn without_first(g: &Product, line: &Line, angle: f64) -> Product {
    let back = turn(line, -angle);
    Product::new(back.r * g.r, back.r * g.t + back.t)
}
