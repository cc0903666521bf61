//! The places that a fitted curve has to pass, with the basis of the spline at each.

use nalgebra::SVector;
use simd::{F4, Four, LANES, Op};

use super::basis::{self, PADDED};

/// Least number of targets in a knot interval.
const DENSITY: f64 = 2.0;

/// A place that the curve has to pass.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target<const D: usize> {
    pub(super) point: SVector<f64, D>,
    /// Radius of the ball, as a share of the tolerance.
    pub(super) radius: f64,
    /// Parameter at which it is passed.
    pub(super) at: f64,
    /// The way it stands for, in knot intervals.
    pub(super) share: f64,
    /// Whether it is a pose of the list.
    pub(super) given: bool,
}

/// The points as targets, with more on long legs; and which target each point is.
pub(super) fn targets<const D: usize>(
    points: &[SVector<f64, D>],
    parameters: &[f64],
    radii: &[f64],
) -> (Vec<Target<D>>, Vec<usize>) {
    let mut targets: Vec<Target<D>> = Vec::with_capacity(2 * points.len());
    let mut given = Vec::with_capacity(points.len());
    for (i, point) in points.iter().enumerate() {
        let (at, radius) = (parameters[i], radii[i]);
        if i > 0 {
            let (from, before) = (points[i - 1], parameters[i - 1]);
            let parts = (DENSITY * (at - before)).ceil().max(1.0);
            for part in 1..parts as usize {
                let share = part as f64 / parts;
                targets.push(Target {
                    point: from + (point - from) * share,
                    radius: radius.min(radii[i - 1]),
                    at: before + (at - before) * share,
                    share: 0.0,
                    given: false,
                });
            }
        }
        given.push(targets.len());
        targets.push(Target {
            point: *point,
            radius,
            at,
            share: 0.0,
            given: true,
        });
    }
    // Each target weighs as much as the way it stands for.
    let last = targets.len() - 1;
    for i in 1..last {
        let share = 0.5 * (targets[i + 1].at - targets[i - 1].at);
        targets[i].share = share.max(1e-6);
    }
    // Those at the ends of a part of a list as much as their neighbours.
    if last >= 2 {
        targets[0].share = targets[1].share;
        targets[last].share = targets[last - 1].share;
    }
    (targets, given)
}

/// First span of a target and the weights of its control points, with zeros after them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) span: usize,
    pub(super) weights: [f64; PADDED],
}

/// Where all targets are seen on a spline of so many spans.
pub(super) struct Look<'a, const D: usize> {
    pub(super) targets: &'a [Target<D>],
    pub(super) spans: usize,
    pub(super) seen: &'a mut Vec<Seen>,
}

impl<const D: usize> Op for Look<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<S: Four>(self, simd: S) {
        let nowhere = Seen {
            span: 0,
            weights: [0.0; PADDED],
        };
        self.seen.resize(self.targets.len(), nowhere);
        for (target, seen) in self.targets.iter().zip(&mut *self.seen) {
            let span = (target.at.max(0.0) as usize).min(self.spans - 1);
            let share = (target.at - span as f64).clamp(0.0, 1.0);
            seen.span = span;
            basis::values(simd, share, &mut seen.weights);
        }
    }
}

/// The normal equations of all targets, added to a system.
pub(super) struct Assemble<'a, const D: usize, const B: usize> {
    pub(super) targets: &'a [Target<D>],
    pub(super) seen: &'a [Seen],
    pub(super) weights: &'a [f64],
    pub(super) columns: &'a mut [[f64; B]],
    pub(super) sides: &'a mut [Vec<f64>; D],
}

impl<const D: usize, const B: usize> Op for Assemble<'_, D, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Four>(self, simd: S) {
        let all = self.targets.iter().zip(self.seen).zip(self.weights);
        for ((target, seen), weight) in all {
            let (span, w) = (seen.span, &seen.weights);
            let weight = F4::splat(simd, *weight);
            // Row i of column j is at i - j; the weights have zeros after the last row.
            let rows = |first: usize| F4::load(simd, &w[first..first + LANES]) * weight;
            for (j, column) in self.columns[span..span + basis::ORDER]
                .iter_mut()
                .enumerate()
            {
                let factor = F4::splat(simd, w[j]);
                add(simd, &mut column[..LANES], rows(j) * factor);
                if j + LANES < basis::ORDER {
                    add(
                        simd,
                        &mut column[LANES..2 * LANES],
                        rows(j + LANES) * factor,
                    );
                }
            }
            let rows = [rows(0), rows(LANES)];
            for (side, x) in self.sides.iter_mut().zip(target.point.iter()) {
                let (x, side) = (F4::splat(simd, *x), &mut side[span..span + 2 * LANES]);
                let (first, second) = side.split_at_mut(LANES);
                add(simd, first, rows[0] * x);
                add(simd, second, rows[1] * x);
            }
        }
    }
}

/// Adds four numbers.
#[inline(always)]
fn add<S: Four>(simd: S, to: &mut [f64], more: F4<S>) {
    (F4::load(simd, to) + more).put(to, 0);
}

/// How far a spline is from each target: place and orientation, 1 is the radius of a ball.
pub(super) struct Miss<'a, const D: usize> {
    pub(super) targets: &'a [Target<D>],
    pub(super) seen: &'a [Seen],
    /// Control points, one after the other, and zeros.
    pub(super) control: &'a [f64],
    pub(super) missed: &'a mut Vec<[f64; 2]>,
}

impl<const D: usize> Op for Miss<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<S: Four>(self, simd: S) {
        self.missed.clear();
        for (target, seen) in self.targets.iter().zip(self.seen) {
            let mut squares = [0.0; 2 * LANES];
            for first in (0..D).step_by(LANES) {
                let from = |i: usize| {
                    let at = (seen.span + i) * D + first;
                    F4::load(simd, &self.control[at..at + LANES]) * F4::splat(simd, seen.weights[i])
                };
                let mut sum = F4::splat(simd, 0.0);
                for i in 0..basis::ORDER {
                    sum += from(i);
                }
                let own = |d: usize| target.point.get(first + d).copied().unwrap_or_default();
                let off = sum - F4::new(simd, [own(0), own(1), own(2), own(3)]);
                (off * off).put(&mut squares[first..first + LANES], 0);
            }
            let turn: f64 = squares[3..D].iter().sum();
            let place = squares[0] + squares[1] + squares[2];
            self.missed.push([place.sqrt(), turn.sqrt()]);
        }
    }
}
