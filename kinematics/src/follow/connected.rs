//! Whether the joints can follow a path of the tool at all, by the closed form of an arm.
//!
//! The closed form gives every joint position at a pose, for each value of its free parameter. From
//! place to place along the path those are kept that are near one that can be reached. Where none is
//! left, no null-space motion helps.

use super::trace::Task;
use nalgebra::{Isometry3, SVector};
use std::f64::consts::TAU;

/// Values of the free parameter over its range.
const VALUES: usize = 64;
/// Finer values for each of these.
const FINE: usize = 8;
/// Most finer values from one place to the next.
const SWING: usize = 8 * FINE;
/// Largest difference of a joint from one place to the next, rad or m.
const CHANGE: f64 = 1.6;
/// A path with more points is looked at in every second of them.
const MANY: usize = 64;

/// A joint position within the limits, and the value of its free parameter in finer values.
#[derive(Clone, Copy)]
struct Place<const N: usize> {
    value: usize,
    q: SVector<f64, N>,
}

/// Whether no joint path within the limits follows the path of the tool from `start`. False where
/// the arm has no exact closed form with a free parameter.
pub(super) fn is_cut<const N: usize>(task: &Task<'_, N>, start: &SVector<f64, N>) -> bool {
    let Some(fraction) = task.solver.free_fraction(start) else {
        return false;
    };
    let value = (fraction * (VALUES * FINE) as f64) as usize;
    let mut before = vec![Place { value, q: *start }];
    let step = if task.grid.len() > MANY { 2 } else { 1 };
    let ahead = task.grid.iter().skip(step).step_by(step);
    for &u in ahead.chain(task.grid.last()) {
        before = after(task, &before, u);
        if before.is_empty() {
            return true;
        }
    }
    false
}

/// The joint positions at `u` that are near those `before`: at all values of the free parameter, and at the
/// finer ones about those from which none of these leads on.
fn after<const N: usize>(task: &Task<'_, N>, before: &[Place<N>], u: f64) -> Vec<Place<N>> {
    let mut layer = Layer {
        task,
        before,
        pose: (task.tool)(u).pose,
        places: Vec::with_capacity(before.len() + 8),
        near: Vec::with_capacity(before.len()),
    };
    for k in 0..VALUES {
        layer.look(k * FINE + FINE / 2);
    }
    let coarse = layer.places.len();
    let mut looked = [false; VALUES * FINE];
    for place in before {
        let mut found = layer.places[..coarse].iter();
        let beside = |next: &Place<N>| apart(next.value, place.value) <= FINE;
        if found.any(|next| beside(next) && is_close(task, &next.q, &place.q)) {
            continue;
        }
        for value in place.value.saturating_sub(FINE)..(place.value + FINE).min(VALUES * FINE) {
            if !looked[value] {
                looked[value] = true;
                layer.look(value);
            }
        }
    }
    layer.places
}

/// The joint positions at a place of the path, found so far.
struct Layer<'a, const N: usize> {
    task: &'a Task<'a, N>,
    before: &'a [Place<N>],
    pose: Isometry3<f64>,
    places: Vec<Place<N>>,
    near: Vec<&'a Place<N>>,
}

impl<const N: usize> Layer<'_, N> {
    /// Adds those at a value of the free parameter.
    fn look(&mut self, value: usize) {
        let Self { task, near, .. } = self;
        near.clear();
        let within = |place: &&Place<N>| apart(place.value, value) <= SWING;
        near.extend(self.before.iter().filter(within));
        let Some(first) = near.first() else { return };
        let fraction = (value as f64 + 0.5) / (VALUES * FINE) as f64;
        let branches = task.solver.inside_at(&self.pose, fraction, &first.q);
        let close = |q: &SVector<f64, N>| near.iter().any(|place| is_close(task, &place.q, q));
        let found = branches.filter(close);
        self.places.extend(found.map(|q| Place { value, q }));
    }
}

/// Finer values between two values of the free parameter, whose range may be a whole turn.
fn apart(a: usize, b: usize) -> usize {
    let d = a.abs_diff(b);
    d.min((VALUES * FINE).saturating_sub(d))
}

/// Whether no joint differs by more than [`CHANGE`]; whole turns do not count for joints that can make
/// them.
fn is_close<const N: usize>(task: &Task<'_, N>, a: &SVector<f64, N>, b: &SVector<f64, N>) -> bool {
    let chain = task.solver.chain();
    (0..N).all(|i| {
        let d = a[i] - b[i];
        let turns = !chain.prismatic()[i] && chain.upper()[i] - chain.lower()[i] >= TAU;
        let d = if turns {
            d - TAU * (d / TAU).round()
        } else {
            d
        };
        d.abs() <= CHANGE
    })
}

#[cfg(test)]
mod tests {
    use super::super::{FollowOptions, TwistPoint};
    use super::*;
    use crate::ik::{Restarts, Solver};
    use crate::urdf;
    use nalgebra::Vector3;

    fn cut(
        solver: &Solver<7>,
        start: &SVector<f64, 7>,
        pose: &dyn Fn(f64) -> Isometry3<f64>,
    ) -> bool {
        let tool = |u: f64| TwistPoint {
            pose: pose(u),
            linear: [Vector3::zeros(); 3],
            angular: [Vector3::zeros(); 3],
        };
        let grid: Vec<f64> = (0..=50).map(|i| f64::from(i) / 50.0).collect();
        let task = Task {
            solver,
            tool: &tool,
            grid: &grid,
            options: &FollowOptions::default(),
        };
        is_cut(&task, start)
    }

    /// What joints within the limits do is never cut; a path out of reach always is.
    #[test]
    fn paths_of_joints_are_not_cut() {
        let text = include_str!("../../../robots/panda/robot.urdf");
        let chain = urdf::read(text, None).unwrap().chain::<7>().unwrap();
        let (solver, places) = (Solver::new(chain), Restarts::new(&chain));
        for index in 0..60 {
            let (start, end) = (places.at(index), places.at(index + 60));
            let joints = |u: f64| start.lerp(&end, 0.4 * u);
            assert!(
                !cut(&solver, &start, &|u| chain.forward(&joints(u))),
                "{index}"
            );
            let away = |u: f64| {
                let mut pose = chain.forward(&start);
                pose.translation.vector.x += 2.5 * u;
                pose
            };
            assert!(cut(&solver, &start, &away), "{index}");
        }
    }
}
