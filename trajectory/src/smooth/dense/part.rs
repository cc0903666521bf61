//! A part of a fitted curve, made from the poses of its list.

use nalgebra::Isometry3;

use super::fitted::FittedCurve;
use super::moved::Moved;
use super::open::Open;
use crate::{Path, ToolCurve, ToolPoint};

/// The part of a [`FittedCurve`] that is at hand: it grows to the end of the curve, and is freed from its start.
///
/// As a [`ToolCurve`] it has the parameter of the whole curve, and is known where it was covered; its
/// derivatives are continuous up to the fourth.
#[derive(Clone, Debug)]
pub struct FittedPart {
    kind: Kind,
    spans: usize,
    corridor: f64,
}

/// A curve of places, or of places and orientations.
#[derive(Clone, Debug)]
enum Kind {
    Places(Open<3>),
    Turns(Open<7>),
}

/// The same for both kinds.
macro_rules! with {
    ($kind:expr, $open:ident => $value:expr) => {
        match $kind {
            Kind::Places($open) => $value,
            Kind::Turns($open) => $value,
        }
    };
}

impl FittedPart {
    pub(super) fn new(curve: &FittedCurve, poses: &[Isometry3<f64>]) -> Option<Self> {
        let kind = if curve.turning {
            Kind::Turns(Open::new(&curve.recipe, &curve.start))
        } else {
            Kind::Places(Open::new(&curve.recipe, &curve.start))
        };
        let mut part = Self {
            kind,
            spans: curve.recipe.marks.spans(),
            corridor: curve.corridor,
        };
        part.cover(curve, poses, 0.0).then_some(part)
    }

    /// Makes the curve up to a parameter, at least, with all poses that it passes there. The curve and the
    /// poses after its start are those of the begin. False where the curve cannot be made.
    #[must_use]
    pub fn cover(&mut self, curve: &FittedCurve, poses: &[Isometry3<f64>], to: f64) -> bool {
        let list = curve.list(poses);
        with!(&mut self.kind, open => open.cover(&curve.recipe, &list, to))
    }

    /// Whether all that was made so far passes the poses in order within 0.98 of the tolerances and stays
    /// within 0.98 of the corridor.
    #[must_use]
    pub fn check(&mut self) -> bool {
        with!(&mut self.kind, open => open.check())
    }

    /// Frees what was checked before a parameter.
    pub fn forget_checked(&mut self, from: f64) {
        with!(&mut self.kind, open => open.forget_checked(from));
    }

    /// Frees the curve before a parameter, and the passes of the first poses after the start.
    pub fn forget(&mut self, curve: &FittedCurve, (from, passed): (f64, usize)) {
        let pose = match curve.moved.as_deref() {
            Some(Moved { given, .. }) => given[passed.min(given.len() - 1)],
            None => passed,
        };
        with!(&mut self.kind, open => open.forget(from, pose));
    }

    /// Parameter at which each pose is passed that is neither the start nor the last, from the one
    /// after the first `passed` of them to the last that is made.
    #[must_use]
    pub fn passes(&self, curve: &FittedCurve, passed: usize) -> Vec<f64> {
        with!(&self.kind, open => match curve.moved.as_deref() {
            Some(Moved { given, .. }) => {
                let between = &given[..given.len() - 1];
                let made = between.iter().skip(passed + 1).take_while(|pose| **pose < open.passed);
                made.map(|pose| open.pass(*pose)).collect()
            }
            None => {
                let last = open.passed.min(curve.recipe.marks.len() - 1);
                (passed + 1..last).map(|pose| open.pass(pose)).collect()
            }
        })
    }

    /// Greatest bound so far of the distance from the legs between the poses over the corridor's half width.
    #[must_use]
    pub fn corridor_ratio(&self) -> f64 {
        with!(&self.kind, open => open.far()) / self.corridor
    }

    /// The tool at a parameter that was covered.
    #[must_use]
    pub fn tool(&self, u: f64) -> ToolPoint {
        with!(&self.kind, open => open.curve.tool_at(u))
    }
}

impl ToolCurve for FittedPart {
    fn end(&self) -> f64 {
        self.spans as f64
    }

    fn knots(&self) -> Vec<f64> {
        with!(&self.kind, open => open.knots(self.spans))
    }

    fn at(&self, u: f64) -> ToolPoint {
        self.tool(u)
    }
}
