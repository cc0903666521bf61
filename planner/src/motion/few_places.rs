//! A curve of the tool of which few places are looked at.

use trajectory::{ToolCurve, ToolPoint};

/// Most knots that are kept.
const MOST: usize = 128;

/// A curve of the tool that has few of its knots, for a look at the time that joints need along it.
pub(super) struct FewPlaces<'a> {
    curve: &'a dyn ToolCurve,
    knots: Vec<f64>,
}

impl<'a> FewPlaces<'a> {
    /// The curve with one in so many of its knots.
    pub(super) fn new(curve: &'a dyn ToolCurve) -> Self {
        let all = curve.knots();
        let step = all.len().div_ceil(MOST).max(1);
        let knots = all.into_iter().step_by(step).collect();
        Self { curve, knots }
    }
}

impl ToolCurve for FewPlaces<'_> {
    fn end(&self) -> f64 {
        self.curve.end()
    }

    fn knots(&self) -> Vec<f64> {
        self.knots.clone()
    }

    fn at(&self, u: f64) -> ToolPoint {
        self.curve.at(u)
    }
}
