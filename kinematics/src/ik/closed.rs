//! Closed forms joined to a chain: branches as joint positions.

use super::classify::{Class, Form, classify};
use super::product::{Product, Zero};
use super::six::Joints;
use super::turns;
use crate::arith::{Arith, Op};
use crate::chain::Chain;
use crate::wide::F4;
use nalgebra::{Isometry3, SVector};

/// The closed form of one arm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closed {
    zero: Zero,
    class: Class,
}

/// Joint positions (rad) of eight branches, in two groups of four.
pub(crate) struct Raw<const N: usize> {
    joints: [[[f64; 4]; N]; 2],
    distance: [[f64; 4]; 2],
    real: [u8; 2],
    inside: [u8; 2],
}

impl<const N: usize> Raw<N> {
    /// No branches.
    #[inline]
    pub(crate) fn none() -> Self {
        Self {
            joints: [[[0.0; 4]; N]; 2],
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
        SVector::from_fn(|i, _| self.joints[group][i][lane])
    }
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
    pub(crate) chain: &'a Chain<N>,
    pub(crate) closed: &'a Closed,
    pub(crate) pose: &'a Isometry3<f64>,
    /// The free parameter, rad.
    pub(crate) parameter: f64,
    /// Joint positions for joints that a singular pose leaves free, and to which the
    /// turns are to be nearest.
    pub(crate) seed: &'a SVector<f64, N>,
    /// Where the answer goes.
    pub(crate) raw: &'a mut Raw<N>,
}

impl<const N: usize> Op for Branching<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arith>(self, a: A) {
        let g = Product::of(a, self.pose, &self.closed.zero);
        let (parameter, seed) = (self.parameter, self.seed);
        let (six, g, first) = match &self.closed.class.form {
            Form::Six(six) => (six, g, 0),
            Form::Last(six, line) => (six, g.without_last(line, parameter), 0),
            Form::First(six, line) => (six, g.without_first(line, parameter), 1),
            Form::Swivel(swivel) => {
                // Only seven joints have it; others need not carry its code.
                if N == 7 {
                    let found = swivel.solve(&g, parameter, &held(seed, 0));
                    self.settle(a, 0, &found);
                }
                return;
            }
        };
        let found = six.solve(&g, held(seed, first));
        self.settle(a, first, &found);
    }
}

impl<const N: usize> Branching<'_, N> {
    /// Takes the turns of every joint that are nearest to the seed inside the limits; the
    /// angles are those of the joints from `first` on, any other joint is the free parameter.
    #[inline(always)]
    fn settle<A: Arith, const M: usize>(self, a: A, first: usize, found: &Joints<A, M>) {
        let raw = self.raw;
        for group in 0..2 {
            let mut inside = found.real[group];
            let mut distance = F4::splat(a, 0.0);
            for i in 0..N {
                let angle = if i >= first && i < first + M {
                    found.angles[group][i - first]
                } else {
                    F4::splat(a, self.parameter)
                };
                let range = [self.chain.lower()[i], self.chain.upper()[i]];
                let (q, ok) = turns::nearest_in(angle, self.seed[i], range);
                let away = q - F4::splat(a, self.seed[i]);
                distance = away.fma(away, distance);
                inside = inside & ok;
                raw.joints[group][i] = q.array();
            }
            raw.distance[group] = distance.array();
            raw.real[group] = found.real[group].bits();
            raw.inside[group] = inside.bits();
        }
    }
}

/// `M` joint positions from the joint `first` on.
#[inline(always)]
fn held<const N: usize, const M: usize>(seed: &SVector<f64, N>, first: usize) -> [f64; M] {
    std::array::from_fn(|i| seed[(first + i).min(N - 1)])
}
