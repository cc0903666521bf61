//! A part of a fitted curve, made from the poses of its list.

use nalgebra::Isometry3;

use super::fitted::FittedCurve;
use super::moved::Moved;
use super::open::Open;
use crate::{ToolCurve, ToolPoint};

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
    /// The begin of a curve, made from the poses after the start; `None` where it cannot be fitted.
    #[must_use]
    pub fn begin(curve: &FittedCurve, poses: &[Isometry3<f64>]) -> Option<Self> {
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
        let pose = match curve.moved.as_ref() {
            Some(Moved { given, .. }) => given[passed.min(given.len() - 1)],
            None => passed,
        };
        with!(&mut self.kind, open => open.forget(from, pose));
    }

    /// Parameter at which each pose is passed that is neither the start nor the last, from the one
    /// after the first `passed` of them to the last that is made.
    #[must_use]
    pub fn passes(&self, curve: &FittedCurve, passed: usize) -> Vec<f64> {
        with!(&self.kind, open => match curve.moved.as_ref() {
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
        with!(&self.kind, open => open.curve.at(u))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ToolLimits;
    use crate::smooth::SmoothOptions;
    use nalgebra::{UnitQuaternion, Vector3};

    /// A list that turns by no more than an arm is off at its start is fitted as one that does not turn, and its curve
    /// meets both ends.
    #[test]
    fn a_start_that_is_off_is_met() {
        let at = |i: i32| 0.002 * f64::from(i);
        let mut poses: Vec<_> = (0..500)
            .map(|i| Isometry3::translation(0.1 * at(i).cos(), 0.1 * at(i).sin(), 0.0))
            .collect();
        let limits = ToolLimits {
            speed: 0.5,
            acceleration: 5.0,
            jerk: 100.0,
            angular_speed: 2.0,
            angular_acceleration: 20.0,
            angular_jerk: 400.0,
        };
        let options = SmoothOptions::new(1e-4, limits);
        poses[0].rotation = UnitQuaternion::from_scaled_axis(Vector3::new(3e-10, 0.0, -1e-10));
        let curve = FittedCurve::all(&poses[0], &poses[1..], &options)
            .next()
            .unwrap();
        assert!(!curve.turning);
        let end = curve.end();
        let mut part = FittedPart::begin(&curve, &poses[1..]).unwrap();
        assert!(part.cover(&curve, &poses[1..], end) && part.check());
        let curve = part;
        for (u, pose) in [(0.0, poses[0]), (end, poses[499])] {
            let turned = (curve.at(u).pose.rotation.inverse() * pose.rotation).scaled_axis();
            assert!(turned.norm() < 1e-15, "{turned}");
        }
        let (u, d) = (0.3 * end, 1e-3 * end);
        let [before, here, after] = [u - d, u, u + d].map(|u| curve.at(u));
        let rate = (before.pose.rotation.inverse() * after.pose.rotation).scaled_axis() / (2.0 * d);
        let off = (rate - here.angular[0]).norm();
        assert!(
            off < 1e-5 * here.angular[0].norm(),
            "{rate} {}",
            here.angular[0]
        );
        poses[0].rotation = UnitQuaternion::from_scaled_axis(Vector3::x() * 1e-4);
        let curve = FittedCurve::all(&poses[0], &poses[1..], &options)
            .next()
            .unwrap();
        assert!(curve.turning);
    }
}
