//! The closed form of a chain: branches as joint positions.

use super::classify::{Class, Form, classify};
use super::product::{Product, Zero};
use super::six::Joints;
use super::turns::Range;
use crate::chain::Chain;
use nalgebra::{Isometry3, SVector};
use simd::{Build, F4, Four, Mask, Op};

/// The closed form of one arm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closed {
    zero: Zero,
    class: Class,
    ranges: [Range; 8],
}

/// Joint positions (rad) of eight branches, in two groups of four.
pub(crate) struct Raw<const N: usize> {
    joints: [[[f64; 4]; 2]; N],
    distance: [[f64; 4]; 2],
    real: [u8; 2],
    inside: [u8; 2],
}

impl<const N: usize> Raw<N> {
    /// No branches.
    #[inline]
    pub(crate) fn none() -> Self {
        Self {
            joints: [[[0.0; 4]; 2]; N],
            distance: [[0.0; 4]; 2],
            real: [0; 2],
            inside: [0; 2],
        }
    }

    /// A branch that exists, inside the limits or not.
    #[inline]
    pub(crate) fn any(&self, id: u8) -> Option<SVector<f64, N>> {
        let (group, lane) = (usize::from(id / 4), usize::from(id % 4));
        (self.real[group] >> lane & 1 == 1).then(|| self.joints_of(group, lane))
    }

    /// A branch inside the limits.
    #[inline]
    pub(crate) fn inside(&self, id: u8) -> Option<SVector<f64, N>> {
        let (group, lane) = (usize::from(id / 4), usize::from(id % 4));
        (self.inside[group] >> lane & 1 == 1).then(|| self.joints_of(group, lane))
    }

    /// The branch inside the limits that is nearest to the seed.
    #[inline]
    pub(crate) fn nearest(&self) -> Option<(u8, SVector<f64, N>)> {
        let (mut least, mut best) = (f64::INFINITY, None);
        for id in 0..8_u8 {
            let (group, lane) = (usize::from(id / 4), usize::from(id % 4));
            let distance = self.distance[group][lane];
            if self.inside[group] >> lane & 1 == 1 && distance < least {
                (least, best) = (distance, Some(id));
            }
        }
        let id = best?;
        Some((id, self.inside(id)?))
    }

    #[inline]
    fn joints_of(&self, group: usize, lane: usize) -> SVector<f64, N> {
        SVector::from_fn(|i, _| self.joints[i][group][lane])
    }
}

impl Closed {
    /// The closed form of a chain, if it has one.
    pub(crate) fn of<const N: usize>(chain: &Chain<N>) -> Option<Self> {
        let (lines, zero) = chain.lines()?;
        let (class, zero) = (classify(&lines)?, Zero::new(&zero));
        let mut ranges = [Range::new(0.0, 0.0); 8];
        for (i, range) in ranges.iter_mut().enumerate().take(N) {
            *range = Range::new(chain.lower()[i], chain.upper()[i]);
        }
        let zero = match &class.form {
            Form::Six(six) => zero.times(six.right()),
            _ => zero,
        };
        Some(Self {
            zero,
            class,
            ranges,
        })
    }

    /// Whether the closed form is exact, not approximate.
    pub(crate) fn exact(&self) -> bool {
        self.class.exact
    }

    /// Whether the form leaves one parameter free.
    pub(crate) fn is_redundant(&self) -> bool {
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

    /// The name of the form, for display.
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

/// How the branches of an arm of `N` joints are computed. A constant: only arms with six or seven
/// joints have closed forms, and others do not carry their code.
pub(crate) const fn branching<const N: usize>() -> Option<fn(Build, Branching<'_, N>)> {
    if N == 6 || N == 7 {
        Some(compute::<N>)
    } else {
        None
    }
}

#[inline]
fn compute<const N: usize>(build: Build, branching: Branching<'_, N>) {
    build.run(branching);
}

/// All branches of one pose, compiled for both builds.
pub(crate) struct Branching<'a, const N: usize> {
    pub(crate) closed: &'a Closed,
    pub(crate) pose: &'a Isometry3<f64>,
    /// The free parameter, rad.
    pub(crate) parameter: f64,
    /// Joint positions for joints that a singular pose leaves free; whole turns are chosen nearest
    /// to them.
    pub(crate) seed: &'a SVector<f64, N>,
    /// The result.
    pub(crate) raw: &'a mut Raw<N>,
}

impl<const N: usize> Op for Branching<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run<A: Four>(self, a: A) {
        let g = Product::of(a, self.pose, &self.closed.zero);
        let (parameter, seed) = (self.parameter, self.seed);
        let (six, g, first) = match &self.closed.class.form {
            Form::Six(six) => (six, g, 0),
            Form::Last(six, line) => {
                let rest = g.without_last(line, parameter);
                (six, rest.times(six.right()), 0)
            }
            Form::First(six, line) => {
                let rest = g.without_first(line, parameter);
                (six, rest.times(six.right()), 1)
            }
            Form::Swivel(swivel) => {
                // Only seven joints have it; others need not carry its code.
                if N == 7 {
                    let found = swivel.solve(&g, parameter, &held(seed, 0));
                    self.settle(a, &[0, 1, 2, 3, 4, 5, 6], &found);
                }
                return;
            }
        };
        let found = six.solve(&g, held(seed, first));
        self.settle(a, &six.slots().map(|slot| first + slot), &found);
    }
}

impl<const N: usize> Branching<'_, N> {
    /// Chooses the whole turns of every joint that are nearest to the seed inside the limits. Angle
    /// `i` is that of joint `joints[i]`; any other joint is the free parameter.
    #[inline(always)]
    fn settle<A: Four, const M: usize>(mut self, a: A, joints: &[usize; M], found: &Joints<A, M>) {
        let zero = F4::splat(a, 0.0);
        let mut sums = [(found.real[0], zero), (found.real[1], zero)];
        for i in 0..M {
            let angles = [found.angles[0][i], found.angles[1][i]];
            self.put(joints[i], angles, &mut sums);
        }
        if let Some(joint) = self.closed.given::<N>() {
            self.put(joint, [F4::splat(a, self.parameter); 2], &mut sums);
        }
        for group in 0..2 {
            let (inside, distance) = sums[group];
            let inside = inside & distance.le(F4::splat(a, f64::MAX));
            self.raw.distance[group] = distance.array();
            self.raw.real[group] = found.real[group].bits();
            self.raw.inside[group] = inside.bits();
        }
    }

    /// Chooses the turns of one joint; adds to the sums whether it is inside and how far away it
    /// is.
    #[inline(always)]
    fn put<A: Four>(&mut self, joint: usize, angles: [F4<A>; 2], sums: &mut [(Mask<A>, F4<A>); 2]) {
        let joint = joint.min(N - 1);
        let (seed, range) = (self.seed[joint], self.closed.ranges[joint & 7]);
        let raw = &mut self.raw.joints[joint];
        for group in 0..2 {
            let (inside, distance) = sums[group];
            let (q, ok) = range.nearest(angles[group], seed);
            let away = q - F4::splat(q.build(), seed);
            sums[group] = (inside & ok, away.fma(away, distance));
            raw[group] = q.array();
        }
    }
}

/// `M` joint positions from the joint `first` on.
#[inline(always)]
fn held<const N: usize, const M: usize>(seed: &SVector<f64, N>, first: usize) -> [f64; M] {
    std::array::from_fn(|i| seed[(first + i).min(N - 1)])
}
