//! A curve fitted through a long dense list, for callers that make its time law themselves, part by
//! part.

use std::borrow::Cow;

use nalgebra::{Isometry3, SVector, Vector3};

use super::chords::Chords;
use super::curve::Curve;
use super::fit::{Fit, Orientation};
use super::places::Units;
use super::profile::Profile;
use super::section::{DENSITIES, FIT_KNOTS, ORIENTATIONS, scaled};
use super::time_parameter::TimeParameter;
use super::{TURNING, are_dense, is_limited, moved};
use crate::line::{Line, body_turn};
use crate::smooth::exact_stop;
use crate::smooth::options::SmoothOptions;
use crate::{Path, ToolCurve, ToolLimits, ToolPoint};

/// Radius of the balls of the fit, as a share of the tolerance, and the largest share that the check
/// of the curve accepts: the rest is for what follows the curve.
const AIM: f64 = 0.96;
const KEPT: f64 = 0.98;
/// An angle (rad) by which an arm may be off where it rests, and the share of the angular tolerance that this may be: a list
/// that turns by no more is fitted as one that does not turn.
const OFF: f64 = 1e-9;
const OFF_SHARE: f64 = 0.01;
/// Parts of a knot interval in which the distance from the legs is bounded.
const PARTS: f64 = 8.0;

/// A smooth curve from the first pose of a long dense list to the last, without times: it passes all
/// poses between them in order within 0.98 of the tolerances, and stays within 0.98 of the corridor.
/// That is known of the whole curve before anything moves along it.
///
/// As a [`ToolCurve`] its parameter is of no meaning; its derivatives are continuous up to the
/// fourth.
#[derive(Clone, Debug)]
pub struct FittedCurve {
    kind: Kind,
    /// Parameter at which each pose between the ends is passed.
    passes: Vec<f64>,
    corridor_ratio: f64,
    exact_stop: f64,
}

/// A curve of places, or of places and orientations.
#[derive(Clone, Debug)]
enum Kind {
    Places(Curve<3>),
    Turns(Curve<7>),
}

impl FittedCurve {
    /// The curve through a list, the first pose of which is the start. `None` where another way of
    /// planning may be better or is needed: a list that is short or not dense all along, a way that
    /// turns back, a tolerance that shows each corner, a fit that fails.
    ///
    /// ```
    /// use nalgebra::Isometry3;
    /// use trajectory::{ToolCurve, ToolLimits, smooth::{FittedCurve, SmoothOptions}};
    /// let limits = ToolLimits { speed: 0.5, acceleration: 5.0, jerk: 100.0, ..ToolLimits::UNLIMITED };
    /// let at = |i: i32| 0.002 * f64::from(i);
    /// let poses: Vec<_> = (0..500)
    ///     .map(|i| Isometry3::translation(0.1 * at(i).cos(), 0.1 * at(i).sin(), 0.0))
    ///     .collect();
    /// let curve = FittedCurve::new(&poses, &SmoothOptions::new(1e-4, limits)).unwrap();
    /// let passed = curve.at(curve.passes()[99]).pose;
    /// let missed = passed.translation.vector - poses[100].translation.vector;
    /// assert!(missed.norm() < 1e-4);
    /// ```
    #[must_use]
    pub fn new(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Option<Self> {
        options.check(poses).ok()?;
        let options = &options.finite();
        let mut list = moved(poses);
        if !is_limited(options) || !are_dense(&list, options) {
            return None;
        }
        if let Cow::Owned(list) = &mut list {
            // The last pose is met exactly, also if it repeats one before it by rounding.
            *list.last_mut()? = poses[poses.len() - 1];
        }
        let units = Units::new(options);
        let slight = slight_turn(&list, options);
        let turning = slight.is_none() && list.windows(2).any(TURNING);
        let (kind, parameters, corridor_ratio) = if turning {
            let mut laid = Laid::<7>::new(&list, units, &options.limits)?;
            let parameters = std::mem::take(&mut laid.curve.fit.parameters);
            (Kind::Turns(laid.curve), parameters, laid.far)
        } else {
            let mut laid = Laid::<3>::new(&list, units, &options.limits)?;
            let parameters = std::mem::take(&mut laid.curve.fit.parameters);
            let curve = laid.curve.turned(slight.unwrap_or_default());
            (Kind::Places(curve), parameters, laid.far)
        };
        Some(Self {
            kind,
            passes: passes(poses, &list, parameters),
            corridor_ratio: corridor_ratio * units.length / options.corridor(),
            exact_stop: exact_stop::duration(poses, &options.limits),
        })
    }

    /// Parameter at which each pose between the first and the last is passed, in order.
    #[must_use]
    pub fn passes(&self) -> &[f64] {
        &self.passes
    }

    /// Bound of the distance from the legs between the poses over the corridor's half width.
    #[must_use]
    pub fn corridor_ratio(&self) -> f64 {
        self.corridor_ratio
    }

    /// Time the motion would take with a stop at each pose, s.
    #[must_use]
    pub fn exact_stop(&self) -> f64 {
        self.exact_stop
    }
}

impl ToolCurve for FittedCurve {
    fn end(&self) -> f64 {
        match &self.kind {
            Kind::Places(curve) => curve.end(),
            Kind::Turns(curve) => curve.end(),
        }
    }

    fn knots(&self) -> Vec<f64> {
        match &self.kind {
            Kind::Places(curve) => curve.knots().to_vec(),
            Kind::Turns(curve) => curve.knots().to_vec(),
        }
    }

    fn at(&self, u: f64) -> ToolPoint {
        match &self.kind {
            Kind::Places(curve) => curve.tool_at(u),
            Kind::Turns(curve) => curve.tool_at(u),
        }
    }
}

/// The curve through a list that is checked at every place, and its greatest distance from the legs
/// in balls.
struct Laid<const D: usize> {
    curve: Curve<D>,
    far: f64,
}

impl<const D: usize> Laid<D> {
    /// `None` if the list needs another way of planning.
    fn new(poses: &[Isometry3<f64>], units: Units, limits: &ToolLimits) -> Option<Self> {
        let points = units.points::<D>(poses);
        let parameters = {
            let chords = Chords::new(&points);
            if !chords.turning_points(&points).is_empty() || chords.shows_corners(&points) {
                return None;
            }
            chords.parameters(&points)
        };
        let laying = Laying {
            points,
            parameters,
            units,
            start: poses[0],
            limits: *limits,
        };
        let ways = ORIENTATIONS.map(|way| DENSITIES.map(|density| (density, way)));
        let fitting = |(_, way): &(f64, Orientation)| D > 3 || *way == Orientation::Along;
        let mut ways = ways.into_iter().flatten().filter(fitting);
        ways.find_map(|(density, way)| laying.laid(density, way))
    }
}

/// What a curve is laid through.
struct Laying<const D: usize> {
    points: Vec<SVector<f64, D>>,
    /// Parameters along the chords.
    parameters: Vec<f64>,
    units: Units,
    start: Isometry3<f64>,
    limits: ToolLimits,
}

impl<const D: usize> Laying<D> {
    /// A curve with so many times the knots: over the time that a first one takes, or else that one.
    fn laid(&self, density: f64, way: Orientation) -> Option<Laid<D>> {
        let first = self.along_chords(density, way)?;
        // The first one is not held beside the other: it is seldom wanted again.
        self.over_time(first, density, way)
            .or_else(|| self.checked(self.along_chords(density, way)?))
    }

    /// A fit over the chords.
    fn along_chords(&self, density: f64, way: Orientation) -> Option<Fit<D>> {
        let parameters = scaled(&self.parameters, density);
        Fit::in_blocks((&self.points, &parameters), (AIM, way))
    }

    /// A curve over the time that another one takes bends less where it is fast.
    fn over_time(&self, fit: Fit<D>, density: f64, way: Orientation) -> Option<Laid<D>> {
        let mut curve = self.curve(fit);
        let mut parameters = std::mem::take(&mut curve.fit.parameters);
        let limits = &self.limits;
        let profile = Profile::new(&curve, limits);
        let timed = (|time| profile.parameter(time), profile.duration());
        let ramp = limits.acceleration / limits.jerk;
        TimeParameter::new(&curve, timed, ramp, density * FIT_KNOTS).change(&mut parameters);
        drop((curve, profile));
        let fit = Fit::in_blocks((&self.points, &parameters), (AIM, way))?;
        self.checked(fit)
    }

    /// A curve that passes everywhere as it should.
    fn checked(&self, fit: Fit<D>) -> Option<Laid<D>> {
        let far = off_legs(&fit, &self.points);
        let good = passes_all(&fit, &self.points) && far <= KEPT;
        good.then(|| Laid {
            curve: self.curve(fit),
            far,
        })
    }

    fn curve(&self, fit: Fit<D>) -> Curve<D> {
        Curve::new(fit, self.units, &self.start)
    }
}

/// Whether a fit passes all points in order within their balls.
fn passes_all<const D: usize>(fit: &Fit<D>, points: &[SVector<f64, D>]) -> bool {
    let ordered = fit.parameters.windows(2).all(|pair| pair[0] <= pair[1]);
    let near = |(at, point): (&f64, &SVector<f64, D>)| {
        let off = fit.point(*at) - point;
        super::places::size(&off) <= KEPT
    };
    ordered && fit.parameters.iter().zip(points).all(near)
}

/// A bound of the distance in place of a fit from the leg that it is on, everywhere.
///
/// Between two places the curve is no farther from the chord over them than an eighth of the square
/// of their distance in the parameter times the largest second derivative, and a chord is no farther
/// from a leg than its ends are. The second derivative is a cubic spline whose control points are the
/// second differences of those of the curve, so none is larger than these.
fn off_legs<const D: usize>(fit: &Fit<D>, points: &[SVector<f64, D>]) -> f64 {
    let place = |point: &SVector<f64, D>| Vector3::new(point[0], point[1], point[2]);
    let bends: Vec<f64> = fit
        .control
        .windows(3)
        .map(|c| place(&(c[0] - c[1] * 2.0 + c[2])).norm())
        .collect();
    let bend = |span: usize| bends[span..span + 4].iter().copied().fold(0.0, f64::max);
    let mut most = 0.0_f64;
    for (leg, at) in points.windows(2).zip(fit.parameters.windows(2)) {
        let (from, way) = (place(&leg[0]), place(&(leg[1] - leg[0])));
        let square = way.norm_squared().max(1e-300);
        let off = |u: f64| {
            let gap = place(&fit.point(u)) - from;
            (gap - way * (gap.dot(&way) / square).clamp(0.0, 1.0)).norm()
        };
        let mut start = at[0];
        let mut before = off(start);
        while start < at[1] {
            // No part reaches over a knot.
            let end = (((start * PARTS).floor() + 1.0) / PARTS).min(at[1]);
            let span = (start as usize).min(fit.spans() - 1);
            let step = end - start;
            let after = off(end);
            most = most.max(before.max(after) + step * step / 8.0 * bend(span));
            (start, before) = (end, after);
        }
    }
    if most.is_nan() { f64::INFINITY } else { most }
}

/// The turn (rotation vector, rad, axes of the first pose) from the first pose to the last of a list in which no pose is
/// turned from the first by more than an arm may be off there.
fn slight_turn(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Option<Vector3<f64>> {
    let most = OFF.min(OFF_SHARE * options.angular_tolerance());
    let turn = |pose: &Isometry3<f64>| body_turn(&poses[0].rotation, &pose.rotation);
    let still = poses.iter().all(|pose| turn(pose).norm() <= most);
    still.then(|| poses.last().map_or(Vector3::zeros(), turn))
}

/// The parameter of each pose between the ends of a list, of which `list` has those that differ from
/// the one before and more between them.
fn passes(poses: &[Isometry3<f64>], list: &[Isometry3<f64>], mut parameters: Vec<f64>) -> Vec<f64> {
    if list == poses {
        parameters.remove(0);
        parameters.pop();
        return parameters;
    }
    let (mut kept, mut at) = (poses[0], 0);
    let mut passes = Vec::with_capacity(poses.len());
    for pose in &poses[1..poses.len().max(2) - 1] {
        if !Line::new(kept, *pose).is_still() {
            kept = *pose;
            at += 1;
            while at + 1 < list.len() && list[at] != kept {
                at += 1;
            }
        }
        passes.push(parameters[at]);
    }
    passes
}

#[cfg(test)]
mod tests {
    use super::*;
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
        let curve = FittedCurve::new(&poses, &options).unwrap();
        assert!(matches!(curve.kind, Kind::Places(_)));
        for (u, pose) in [(0.0, poses[0]), (curve.end(), poses[499])] {
            let turned = (curve.at(u).pose.rotation.inverse() * pose.rotation).scaled_axis();
            assert!(turned.norm() < 1e-15, "{turned}");
        }
        let (u, d) = (0.3 * curve.end(), 1e-3 * curve.end());
        let [before, here, after] = [u - d, u, u + d].map(|u| curve.at(u));
        let rate = (before.pose.rotation.inverse() * after.pose.rotation).scaled_axis() / (2.0 * d);
        let off = (rate - here.angular[0]).norm();
        assert!(
            off < 1e-5 * here.angular[0].norm(),
            "{rate} {}",
            here.angular[0]
        );
        poses[0].rotation = UnitQuaternion::from_scaled_axis(Vector3::x() * 1e-4);
        let curve = FittedCurve::new(&poses, &options).unwrap();
        assert!(matches!(curve.kind, Kind::Turns(_)));
    }
}
