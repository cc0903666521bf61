//! Balls that are passed where the place alone says, in one band for all coordinates: their passing time is
//! replaced by what it is of the control points.

use super::ball::{Ball, Lead};
use super::balls::dot;
use super::newton::System;

/// What one control point has in the ball: its weight, and by how much the passing time falls with it.
struct Share<const D: usize> {
    weight: f64,
    falls: [f64; D],
}

impl<const D: usize> Share<D> {
    /// That of control point `i` of five.
    fn of(ball: &Ball<D>, lead: &Lead, i: usize) -> Self {
        let mut falls = [0.0; D];
        falls[..3].copy_from_slice(&lead.falls[i]);
        Self {
            weight: ball.weights[i],
            falls,
        }
    }

    /// The linear form of the ball with this `side` and this slope along the passing time.
    fn side(&self, side: &[f64; D], slope: f64) -> [f64; D] {
        std::array::from_fn(|d| self.weight * side[d] - slope * self.falls[d])
    }
}

impl<const D: usize, const B: usize> System<D, B> {
    /// Adds a ball whose passing time is tied to the place.
    pub(super) fn add_led(&mut self, ball: &Ball<D>, lead: &Lead, slides: &[[f64; D]]) {
        let free = self.sides.len() / D;
        let shares: [Share<D>; 5] = std::array::from_fn(|i| Share::of(ball, lead, i));
        // How the ball and its passing time move with `z`.
        let (mut border, mut late) = ([0.0; D], 0.0);
        if let Some(slide) = &ball.slide {
            let earlier = lead.fall(&slides[ball.first..]);
            let (own, along) = (ball.times(slide), dot(&ball.bent, slide));
            border = std::array::from_fn(|d| own[d] - earlier * ball.bent[d]);
            late = along - earlier * ball.stiff;
            self.gradient_z += dot(&ball.gradient, slide) - earlier * ball.slope;
            self.hessian_z += dot(&border, slide) - earlier * late;
        }
        for (j, other) in shares.iter().enumerate() {
            let column = (ball.first + j).checked_sub(4);
            let Some(column) = column.filter(|k| *k < free) else {
                continue;
            };
            let sides = &mut self.sides[column * D..(column + 1) * D];
            let all = [(&ball.gradient, ball.slope), (&border, late)];
            for (g, (side, slope)) in all.into_iter().enumerate() {
                for (to, x) in sides.iter_mut().zip(other.side(side, slope)) {
                    to[g] += x;
                }
            }
            for b in 0..D {
                let mut unit = [0.0; D];
                unit[b] = other.weight;
                let own = ball.times(&unit);
                let fall = other.falls[b];
                let side: [f64; D] = std::array::from_fn(|a| own[a] - fall * ball.bent[a]);
                let slope = other.weight * ball.bent[b] - fall * ball.stiff;
                let entries = &mut self.band.columns[column * D + b];
                let rows = shares[j..].iter().map(|share| share.side(&side, slope));
                for (back, row) in rows.enumerate().take(free - column) {
                    let from = if back == 0 { b } else { 0 };
                    for (a, x) in row.iter().enumerate().skip(from) {
                        entries[back * D + a - b] += x;
                    }
                }
            }
        }
    }
}
