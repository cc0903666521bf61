//! The parameter of a better fit: about the time at which each pose is passed.
//!
//! Least change of curvature over time is least jerk, so the next curve bends less where it is
//! fast.

use super::curve::Curve;
use crate::ToolCurve;

/// Samples of a law in one ramp of the acceleration.
const SAMPLES: usize = 8;
/// Least number of knots of a fit.
const FEWEST: f64 = 8.0;

/// A map from the parameter of a curve to one that runs about like the time of its law.
#[derive(Clone, Debug)]
pub(super) struct TimeParameter {
    /// Values of the curve's parameter, ascending.
    from: Vec<f64>,
    /// The new parameter there.
    to: Vec<f64>,
}

impl TimeParameter {
    /// From a curve and its law, which takes `total` (s) and gives the parameter at a time, averaged over a ramp of the acceleration, `ramp` (s), with so many
    /// knots in one, but no more than so many times those of the curve. From either end, where the law rests, to the first place where it is fastest, the
    /// speed of that place counts: a curve whose parameter rests would have no direction.
    pub(super) fn new<const D: usize>(
        curve: &Curve<D>,
        (law, total): (impl Fn(f64) -> f64, f64),
        ramp: f64,
        [knots, most]: [f64; 2],
    ) -> Self {
        let half = SAMPLES / 2;
        let steps = (SAMPLES as f64 * total / ramp)
            .ceil()
            .max(4.0 * half as f64) as usize;
        let step = total / steps as f64;
        let from: Vec<f64> = (0..=steps).map(|k| law(k as f64 * step)).collect();
        let mut way = vec![0.0];
        let mut before = curve.fit.point(0.0);
        for (k, u) in from.iter().enumerate().skip(1) {
            let point = curve.fit.point(*u);
            way.push(way[k - 1] + (point - before).norm());
            before = point;
        }
        let mean = |k: usize| {
            let (low, high) = (k.saturating_sub(half), (k + half).min(steps));
            (way[high] - way[low]) / ((high - low) as f64 * step)
        };
        let mut speed: Vec<f64> = (0..=steps).map(mean).collect();
        level_start(&mut speed);
        speed.reverse();
        level_start(&mut speed);
        speed.reverse();
        let mut to = vec![0.0];
        for k in 0..steps {
            let slow = 0.5 * (1.0 / speed[k] + 1.0 / speed[k + 1]);
            to.push(to[k] + (way[k + 1] - way[k]) * slow);
        }
        let whole = (knots * to[steps] / ramp).min(most * curve.end());
        let whole = whole.round().max(FEWEST);
        let scale = whole / to[steps];
        to.iter_mut().for_each(|x| *x *= scale);
        to[steps] = whole;
        Self { from, to }
    }

    /// The new parameters of ascending old ones.
    pub(super) fn map(&self, parameters: &[f64]) -> Vec<f64> {
        let mut moved = parameters.to_vec();
        self.change(&mut moved);
        moved
    }

    /// Puts the new parameters in the place of ascending old ones.
    pub(super) fn change(&self, parameters: &mut [f64]) {
        let last = self.from.len() - 1;
        let mut k = 0;
        for u in &mut *parameters {
            while k + 1 < last && self.from[k + 1] < *u {
                k += 1;
            }
            let share = (*u - self.from[k]) / (self.from[k + 1] - self.from[k]).max(1e-300);
            *u = self.to[k] + share.clamp(0.0, 1.0) * (self.to[k + 1] - self.to[k]);
        }
        if let Some(end) = parameters.last_mut() {
            *end = self.to[last];
        }
    }
}

/// Gives all places before the first one that is faster than the next the speed of that one.
fn level_start(speed: &mut [f64]) {
    let top = speed.windows(2).position(|pair| pair[1] <= pair[0]);
    let top = top.unwrap_or(speed.len() - 1);
    let fastest = speed[top];
    speed[..top].fill(fastest);
}
