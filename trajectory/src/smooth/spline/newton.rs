//! Gradient and Hessian of the barrier at an iterate, and the Newton step.

use super::ball::Ball;
use super::band::Band;
use super::coordinates::Coordinates;
use super::iterate::Iterate;
use super::norms::{ENTRY, Norms, Sum, WIDE};
use super::passes::Passes;
use super::problem::{Point, Problem, Room};
use simd::Build;

/// Gradient and Hessian of the barrier: a band for the control points, one
/// border column for `z`. `B` is `5 D` and the spare diagonals of [`Band`]; or `5 * 3` of them, where
/// position and orientation stand apart, coupled only by [`Passes`].
pub(crate) struct System<const D: usize, const B: usize> {
    pub(super) band: Band<B>,
    /// What limits and corridors of one group add.
    norms: Norms,
    /// Gradient and border, side by side.
    pub(super) sides: Vec<[f64; 2]>,
    pub(super) gradient_z: f64,
    pub(super) hessian_z: f64,
    pub(super) passes: Passes,
    /// The balls of the iterate.
    pub(super) around: Vec<Ball<D>>,
}

/// A direction in control points and `z`, and the fall of the barrier along it.
pub(crate) struct Step {
    pub(crate) control: Vec<f64>,
    pub(crate) z: f64,
    /// By how much each passing time moves, in knots.
    pub(crate) times: Vec<f64>,
    /// Square of the Newton decrement.
    pub(crate) decrement: f64,
}

impl<const D: usize, const B: usize> System<D, B> {
    /// Whether the groups stand one behind the other in the band.
    pub(super) const APART: bool = B < 5 * D;
    /// Rows from one control point to the next.
    pub(super) const STRIDE: usize = if Self::APART { 3 } else { D };

    /// Room for an iterate with its control points.
    pub(crate) fn new(point: &Point<D>) -> Self {
        let size = D * point.control.len().saturating_sub(8);
        let times = if Self::APART {
            point.crossings.len()
        } else {
            0
        };
        Self {
            band: Band::zeros(size),
            norms: Norms::new(point.control.len()),
            sides: vec![[0.0; 2]; size],
            gradient_z: 0.0,
            hessian_z: 0.0,
            passes: Passes::new(times, size, B),
            around: Vec::with_capacity(point.crossings.len()),
        }
    }

    /// The row of the first coordinate of group `g` of the free control point `k`, of `free` in all.
    #[inline(always)]
    pub(super) fn row(free: usize, k: usize, g: usize) -> usize {
        if Self::APART {
            3 * (g * free + k)
        } else {
            k * D + 3 * g
        }
    }

    /// The same of control point `k` of all, if it is free.
    #[inline(always)]
    pub(super) fn free_row(free: usize, k: usize, g: usize) -> Option<usize> {
        let k = k.checked_sub(4).filter(|k| *k < free)?;
        Some(Self::row(free, k, g))
    }

    /// The Newton step of the barrier with weight `t` on `z`.
    pub(crate) fn step(
        &mut self,
        problem: &Problem<D>,
        point: &Point<D>,
        room: &Room,
        t: f64,
    ) -> Option<Step> {
        let at = Iterate::new(problem, point, room);
        self.of(&at, t)
    }

    /// The step with which an iterate at a centre follows its inner vertices, to first order, when each moves by so much.
    pub(crate) fn shift(
        &mut self,
        problem: &Problem<D>,
        point: &Point<D>,
        (room, shifts): (&Room, &[[f64; D]]),
    ) -> Option<Step> {
        let at = Iterate {
            shifts: Some(shifts),
            ..Iterate::new(problem, point, room)
        };
        self.of(&at, 0.0)
    }

    /// The step of an iterate.
    fn of(&mut self, at: &Iterate<'_, D>, t: f64) -> Option<Step> {
        if Self::STRIDE > 3 {
            self.band.clear();
            self.sides.fill([0.0; 2]);
        }
        (self.gradient_z, self.hessian_z) = (t, 0.0);
        let coordinates = Coordinates::of(&at.point.control);
        let moves = at.moves();
        let moves = (!moves.is_empty()).then(|| Coordinates::of(&moves));
        for g in 0..Problem::<D>::GROUPS {
            Build::detect().run(Sum {
                at,
                coordinates: &coordinates,
                moves: moves.as_ref(),
                g,
                norms: &mut self.norms,
            });
            self.place(g, at.shifts.is_none());
        }
        self.balls(at);
        self.joints(at);
        self.forward(at);
        self.legs(at);
        self.solve(&at.slides)
    }

    fn solve(&mut self, slides: &[[f64; D]]) -> Option<Step> {
        if !self.band.factor() {
            return None;
        }
        let size = self.sides.len();
        let [mut along, mut border] = [0, 1].map(|m| {
            let values = self.sides.iter().map(|side| side[m]);
            values.chain([0.0; B]).collect::<Vec<_>>()
        });
        self.band.lower([&mut along, &mut border], 0..size);
        let eliminated = self.passes.eliminate(&self.band, [&along, &border])?;
        let pivot = self.hessian_z - eliminated.bent;
        if pivot <= 0.0 || pivot.is_nan() {
            return None;
        }
        let z = -(self.gradient_z - eliminated.cross) / pivot;
        for (step, border) in along[..size].iter_mut().zip(&border) {
            *step = -*step - border * z;
        }
        self.passes.take(&eliminated, z, &mut along[..size]);
        self.band.upper(&mut along);
        let falls = self.sides.iter().zip(&along);
        let falls: f64 = falls.map(|(side, step)| side[0] * step).sum();
        let free = size / D;
        let entry = |i: usize| along[Self::row(free, i / D, i % D / 3) + i % D % 3];
        let mut control: Vec<f64> = (0..size).map(entry).collect();
        for (step, slide) in control.iter_mut().zip(slides.iter().skip(4).flatten()) {
            *step += slide * z;
        }
        let times: Vec<f64> = self.around.iter().map(|ball| ball.time(&control)).collect();
        // Elsewhere the sides hold what the passing times do.
        let passes = self.around.iter().zip(&times).filter(|_| Self::APART);
        let passing: f64 = passes.map(|(ball, time)| ball.slope * time).sum();
        let slope = self.gradient_z * z + falls + passing;
        (slope < 0.0 && slope.is_finite()).then_some(Step {
            control,
            z,
            times,
            decrement: -slope,
        })
    }

    /// Writes the sums of limits and corridors of group `g` into the sides and the band, with or without their slopes.
    fn place(&mut self, g: usize, sloping: bool) {
        let free = self.sides.len() / D;
        let steep = if sloping { 1.0 } else { 0.0 };
        self.gradient_z += steep * self.norms.along_z[0];
        self.hessian_z += self.norms.along_z[1];
        for k in 0..free {
            let row = Self::row(free, k, g);
            for d in 0..3 {
                let [slope, border] = self.norms.side(k + 4, d);
                self.sides[row + d] = [steep * slope, border];
            }
            let Some(columns) = self.band.columns[row..].first_chunk_mut::<3>() else {
                continue;
            };
            if Self::STRIDE == 3 {
                *columns = [[0.0; B]; 3];
            }
            for back in 0..WIDE {
                if k + back >= free {
                    continue;
                }
                let block = self.norms.block(k + back + 4, back);
                for (b, column) in columns.iter_mut().enumerate() {
                    let above = if back == 0 { b } else { 0 };
                    for a in above..3 {
                        column[back * Self::STRIDE + a - b] = block[ENTRY[a][b]];
                    }
                }
            }
        }
    }
}
