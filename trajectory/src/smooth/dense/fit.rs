//! A uniform quintic B-spline, and the balls that it has to pass.

use nalgebra::SVector;

use super::basis::{self, ORDER};

/// Where the orientation of a curve counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Orientation {
    /// All along the list, where the curve is nearest in place and orientation together.
    Along,
    /// At the poses only, where the curve is nearest in place, which is where they are passed.
    AtPoses,
}

/// The balls that a curve has to pass.
#[derive(Clone, Debug)]
pub(super) struct Balls {
    /// Radius for each point, as a share of the tolerance.
    pub(super) radii: Vec<f64>,
    pub(super) orientation: Orientation,
}

/// A uniform quintic B-spline over `0 ..= spans()`.
#[derive(Clone, Debug)]
pub(super) struct Fit<const D: usize> {
    pub(super) control: Vec<SVector<f64, D>>,
    /// Parameter at which each point of the list is passed.
    pub(super) parameters: Vec<f64>,
}

impl<const D: usize> Fit<D> {
    /// Number of knot intervals.
    pub(super) fn spans(&self) -> usize {
        self.control.len() + 1 - ORDER
    }

    /// First control point of the span at `at`, and the share of the span.
    pub(super) fn locate(&self, at: f64) -> (usize, f64) {
        let span = (at.max(0.0) as usize).min(self.spans() - 1);
        (span, (at - span as f64).clamp(0.0, 1.0))
    }

    /// Sum of the control points of a span.
    pub(super) fn sum(&self, span: usize, weights: [f64; ORDER]) -> SVector<f64, D> {
        let mut sum = SVector::zeros();
        for (c, w) in self.control[span..span + ORDER].iter().zip(weights) {
            sum += c * w;
        }
        sum
    }

    /// The point at a parameter.
    pub(super) fn point(&self, at: f64) -> SVector<f64, D> {
        let (span, x) = self.locate(at);
        self.sum(span, basis::value(x))
    }

    /// The point at a parameter and its three derivatives.
    pub(super) fn derivatives(&self, at: f64) -> [SVector<f64, D>; 4] {
        let (span, x) = self.locate(at);
        [
            basis::value(x),
            basis::first(x),
            basis::second(x),
            basis::third(x),
        ]
        .map(|weights| self.sum(span, weights))
    }
}
