//! How the corridor pulls the control points along where its legs move with the inner vertices.

use super::iterate::{Iterate, outer};
use super::newton::System;
use super::problem::{Foot, Problem, part, sample_weights, square};

impl<const D: usize, const B: usize> System<D, B> {
    /// Adds the slopes of the corridor that come from inner vertices which move.
    pub(super) fn legs(&mut self, at: &Iterate<'_, D>) {
        let Some(shifts) = at.shifts else {
            return;
        };
        for g in 0..Problem::<D>::GROUPS {
            let still = shifts.iter().all(|shift| part(shift, g) == [0.0; 3]);
            if still || !at.problem.groups[g].width.is_finite() {
                continue;
            }
            for k in 0..at.point.samples() {
                let foot = at
                    .problem
                    .nearest(&at.point.sample(k, g), at.room.legs[k], g);
                self.pull(at, (k, g), &foot, &moved(shifts, &foot, g));
            }
        }
    }

    /// Adds the slope of corridor sample `k` of group `g` when its nearest point of the path moves by so much.
    fn pull(&mut self, at: &Iterate<'_, D>, (k, g): (usize, usize), foot: &Foot, by: &[f64; 3]) {
        let width = at.room.widths[g][k];
        let slope = 2.0 / (width * width - square(&foot.offset));
        let bent = outer(&foot.offset, slope, slope * slope);
        // Along the leg the nearest point moves with the sample.
        let slide = at.problem.slide(foot, g);
        let along: f64 = (0..3).map(|d| slide[d] * by[d]).sum();
        let by: [f64; 3] = std::array::from_fn(|d| by[d] - along * slide[d]);
        let pull = bent.map(|row| (0..3).map(|d| -row[d] * by[d]).sum::<f64>());
        let free = self.sides.len() / D;
        let (first, weights) = sample_weights(k);
        for (i, weight) in weights.iter().enumerate() {
            if let Some(slide) = at.slides.get(first + i) {
                let own = part(slide, g);
                self.gradient_z += (0..3).map(|d| weight * pull[d] * own[d]).sum::<f64>();
            }
            if let Some(row) = Self::free_row(free, first + i, g) {
                for d in 0..3 {
                    self.sides[row + d][0] += weight * pull[d];
                }
            }
        }
    }
}

/// By how much a point of the path moves in group `g` when the inner vertices do.
fn moved<const D: usize>(shifts: &[[f64; D]], foot: &Foot, g: usize) -> [f64; 3] {
    let of = |vertex: Option<usize>| {
        let shift = vertex.and_then(|vertex| shifts.get(vertex));
        shift.map_or([0.0; 3], |shift| part(shift, g))
    };
    let (from, to) = (of(foot.leg.checked_sub(2)), of(foot.leg.checked_sub(1)));
    std::array::from_fn(|d| (1.0 - foot.share) * from[d] + foot.share * to[d])
}
