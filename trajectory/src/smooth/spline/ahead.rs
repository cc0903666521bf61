//! What the bounds of a place that goes forward add to the Newton system.

use super::forward::Forward;
use super::iterate::Iterate;
use super::newton::System;
use super::problem::{Point, Problem};

impl<const D: usize> Problem<D> {
    /// What the place covers at its greatest speed in one knot interval, m.
    pub(super) fn stride(&self, z: f64) -> f64 {
        self.groups[0].caps[0] * self.spacing(z)
    }

    /// How far forward the place goes at each of these bounds, in strides.
    pub(super) fn ahead<'a>(&'a self, point: &'a Point<D>) -> impl Iterator<Item = f64> + 'a {
        let stride = self.stride(point.z);
        let all = self.forward.iter();
        all.map(move |forward| forward.ahead(&point.control) / stride)
    }
}

impl<const D: usize, const B: usize> System<D, B> {
    /// Adds the bounds of a place that goes forward.
    pub(super) fn forward(&mut self, at: &Iterate<'_, D>) {
        let (problem, z) = (at.problem, at.point.z);
        let steep = if at.shifts.is_none() { 1.0 } else { 0.0 };
        let stride = problem.stride(z);
        let all = problem.forward.iter().zip(problem.ahead(at.point));
        for ((forward, ahead), behind) in all.zip(&at.room.forward) {
            let slack = (ahead + behind) * stride;
            let slides = forward
                .ends()
                .filter_map(|(k, sign)| Some((at.slides.get(k)?, sign)));
            let slides = slides.map(|(slide, sign)| sign * forward.share(slide));
            // How the slack changes with `z`.
            let rise = behind * stride / (3.0 * z) + slides.sum::<f64>();
            let bend = -2.0 * behind * stride / (9.0 * z * z);
            self.gradient_z -= steep * rise / slack;
            self.hessian_z += (rise / slack).powi(2) - bend / slack;
            self.ends(forward, [steep, rise / slack], slack);
        }
    }

    /// Adds what one bound with a `slack` that rises by a share of it with `z` has of its control points.
    fn ends(&mut self, forward: &Forward, [steep, rise]: [f64; 2], slack: f64) {
        let free = self.sides.len() / D;
        let slope = forward.along.map(|x| x / slack);
        let row = |(k, sign)| Some((Self::free_row(free, k, 0)?, sign));
        let ends = || forward.ends().filter_map(row);
        for (row, sign) in ends() {
            for d in 0..3 {
                self.sides[row + d][0] -= steep * sign * slope[d];
                self.sides[row + d][1] += sign * slope[d] * rise;
            }
            for (other, with) in ends() {
                for (d, e) in (0..9).map(|i| (i / 3, i % 3)) {
                    // The band has the entries below the diagonal.
                    if let Some(below) = (other + d).checked_sub(row + e) {
                        self.band.columns[row + e][below] += sign * with * slope[d] * slope[e];
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::smooth::spline::corners::{along, corners};
    use crate::smooth::spline::problem::Room;
    use crate::smooth::spline::project::project;
    use crate::smooth::spline::start;
    use crate::smooth::spline::stretch::Stretch;

    /// Corners whose place goes forward only, an end that moves so fast (m/s), and a first iterate.
    fn problem(speed: f64) -> (Problem<6>, Point<6>) {
        let mut problem = corners();
        let mut point = start::first(&mut problem, None, start::KNOTS_PER_RAMP);
        if speed > 0.0 {
            let moving = [0.0, speed, 0.0, 0.0, 0.0, speed];
            let end = problem.vertices[problem.vertices.len() - 1];
            problem.finish = Some([end, moving, [0.0; 6], [0.0; 6]]);
        }
        problem.pin(&mut point);
        project(&problem, &mut point, None, 20);
        let stretch = Stretch {
            vertices: &BTreeSet::from([0, 2]),
            nearer: &BTreeSet::from([2]),
            backwards: false,
            both: true,
        };
        problem.go_forward(&point, &stretch);
        (problem, point)
    }

    /// With bounds that hold and with bounds that are widened the barrier falls along the Newton step as its decrement says, and
    /// is curved so.
    fn check<const B: usize>(speed: f64, back: bool) {
        let (mut problem, point) = problem(speed);
        if back {
            for forward in &mut problem.forward {
                forward.along = forward.along.map(|x| -x);
            }
        }
        let room = Room::new(&problem, &point);
        assert_eq!(room.forward.len(), problem.forward.len());
        assert!(room.forward.iter().any(|behind| Forward::is_tight(*behind)) || back);
        assert!(room.forward.iter().any(|behind| *behind > 0.0) || !back);
        let weight = problem.parameter(&point) / point.z;
        let step = System::<6, B>::new(&point).step(&problem, &point, &room, weight);
        let step = step.unwrap();
        let value = along((&problem, &room), (&point, &step), weight);
        let wide = 1e-4;
        let (before, here, after) = (value(-wide), value(0.0), value(wide));
        let slope = (before - after) / (2.0 * wide) / step.decrement;
        assert!((slope - 1.0).abs() < 1e-3, "{speed} {back}: {slope}");
        let bend = (before + after - 2.0 * here) / (wide * wide) / step.decrement;
        assert!((bend - 1.0).abs() < 0.05, "{speed} {back}: {bend}");
    }

    #[test]
    fn the_barrier_falls_along_the_step_as_its_decrement_says() {
        for back in [false, true] {
            check::<20>(0.0, back);
            check::<36>(0.0, back);
            check::<20>(0.01, back);
            check::<36>(0.01, back);
        }
    }
}
