//! A long list fitted in blocks: what a fit needs beside its result does not grow with the list.
//!
//! What happens at one place of a fit hardly changes it some knots further on: the influence falls
//! exponentially. So blocks that overlap are fitted one after the other, and in the middle of each
//! overlap the control points go over from those of one block to those of the next. The result is one
//! spline; its callers check it as any other.

use nalgebra::SVector;

use super::basis::ORDER;
use super::fit::{Fit, Orientation};
use super::fitting::Part;

/// Knot intervals of a block, at least, and those that it has beyond its ends.
const BLOCK: usize = 400;
const OVERLAP: usize = 32;
/// Knot intervals to both sides of an end over which one block goes over into the next.
const BLEND: f64 = 6.0;

impl<const D: usize> Fit<D> {
    /// The curve through balls of one radius around `points`, as that of [`Fit::new`]; `None` where some
    /// ball cannot be kept.
    pub(super) fn in_blocks(
        (points, parameters): (&[SVector<f64, D>], &[f64]),
        (radius, orientation): (f64, Orientation),
    ) -> Option<Self> {
        let spans = parameters.last()?.round().max(1.0) as usize;
        let count = Block::count(spans);
        let mut whole = Self {
            control: vec![SVector::zeros(); spans + ORDER - 1],
            parameters: vec![0.0; points.len()],
        };
        for block in 0..count {
            let block = Block::new(block, count, spans);
            let first = parameters.partition_point(|u| *u < block.from as f64);
            let last = parameters.partition_point(|u| *u <= block.to as f64);
            if last < first + 2 {
                return None;
            }
            let shift = block.from as f64;
            let own: Vec<f64> = parameters[first..last].iter().map(|u| u - shift).collect();
            let part = block.part();
            let list = (&points[first..last], &own[..], &vec![radius; own.len()][..]);
            let fit = Self::of(part, list, orientation).ok()?;
            for (j, c) in fit.control.iter().enumerate() {
                // Control point j is in the middle of its spans at j - 2.
                let j = block.from + j;
                whole.control[j] += c * block.share(j as f64 - 2.0);
            }
            for (i, at) in fit.parameters.iter().enumerate() {
                whole.parameters[first + i] += (at + shift) * block.share(parameters[first + i]);
            }
        }
        Some(whole)
    }
}

/// A block, with what it has beyond its ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) from: usize,
    pub(super) to: usize,
    /// Where it takes over from the one before, and where the next one takes over.
    ends: [Option<f64>; 2],
}

impl Block {
    /// How many blocks a fit with so many knot intervals has.
    pub(super) fn count(spans: usize) -> usize {
        (spans / BLOCK).max(1)
    }

    pub(super) fn new(index: usize, count: usize, spans: usize) -> Self {
        let edge = |i: usize| i * spans / count;
        let (first, last) = (index == 0, index + 1 == count);
        Self {
            from: edge(index) - if first { 0 } else { OVERLAP },
            to: edge(index + 1) + if last { 0 } else { OVERLAP },
            ends: [
                (!first).then(|| edge(index) as f64),
                (!last).then(|| edge(index + 1) as f64),
            ],
        }
    }

    /// What is fitted.
    pub(super) fn part(&self) -> Part {
        Part {
            spans: self.to - self.from,
            ends: self.ends.map(|end| end.is_none()),
        }
    }

    /// The share that the block has of the result at a parameter.
    pub(super) fn share(&self, u: f64) -> f64 {
        let [before, after] = self.ends.map(|end| end.map(|end| taken_over(u - end)));
        before.unwrap_or(1.0) - after.unwrap_or(0.0)
    }

    /// The parameter up to which no later block has a share; none after the last block.
    pub(super) fn alone_to(&self) -> Option<f64> {
        self.ends[1].map(|end| end - BLEND)
    }
}

/// The share of the next block beside an end: it rises from 0 to 1 with two derivatives.
fn taken_over(off: f64) -> f64 {
    let x = (0.5 + 0.5 * off / BLEND).clamp(0.0, 1.0);
    x * x * x * (10.0 + x * (6.0 * x - 15.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smooth::dense::fit::Balls;
    use crate::smooth::dense::places::size;

    /// A wave with two poses in a knot interval, in units of the balls.
    fn wave(count: usize) -> (Vec<SVector<f64, 3>>, Vec<f64>) {
        let at = |i: usize| 0.5 * i as f64;
        let place = |u: f64| SVector::<f64, 3>::new(8.0 * u, 60.0 * (0.1 * u).sin(), u.cos());
        (
            (0..count).map(|i| place(at(i))).collect(),
            (0..count).map(at).collect(),
        )
    }

    /// The curve in blocks is that of one fit, by a small part of the balls, and passes every pose.
    #[test]
    fn blocks_are_one_fit() {
        let (points, parameters) = wave(4 * BLOCK + 1);
        let radii = vec![0.96; points.len()];
        let orientation = Orientation::Along;
        let list = (&points[..], &parameters[..]);
        let blocks = Fit::in_blocks(list, (0.96, orientation)).unwrap();
        let balls = Balls { radii, orientation };
        let one = Fit::new(&points, &parameters, &balls).unwrap();
        assert_eq!(blocks.spans(), one.spans());
        let mut most = 0.0_f64;
        for (i, point) in points.iter().enumerate() {
            let passed = blocks.point(blocks.parameters[i]);
            assert!(size(&(passed - point)) <= 0.97, "pose {i}");
            most = most.max(size(&(passed - one.point(one.parameters[i]))));
        }
        assert!(most < 0.3, "{most}");
        assert!(size(&(blocks.point(0.0) - points[0])) < 1e-9);
        let end = parameters[parameters.len() - 1];
        assert!(size(&(blocks.point(end) - points[points.len() - 1])) < 1e-9);
    }

    /// The shares of two neighbours are one together.
    #[test]
    fn shares_are_one_together() {
        let blocks: Vec<_> = (0..3).map(|i| Block::new(i, 3, 1300)).collect();
        for k in 0..13_000 {
            let u = 0.1 * f64::from(k);
            let sum: f64 = blocks.iter().map(|block| block.share(u)).sum();
            assert!((sum - 1.0).abs() < 1e-15, "{sum} at {u}");
        }
    }
}
