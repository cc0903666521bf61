//! Where the search of a spline has ended.

/// Most coordinates of a search.
const WIDEST: usize = 7;

/// Weights, times 16, of three neighbouring control points in two that take their place on knots at half the distance.
const EARLIER: [f64; 3] = [5.0, 10.0, 1.0];
const LATER: [f64; 3] = [1.0, 10.0, 5.0];

/// Where a search for an arm has ended: another one may go on from there.
#[derive(Clone, Debug, PartialEq)]
pub struct Seed {
    /// Coordinates that are used.
    pub(super) coordinates: usize,
    pub(super) control: Vec<[f64; WIDEST]>,
    /// Where the motion sees the poses.
    pub(super) vertices: Vec<[f64; WIDEST]>,
    /// Times of the passes, in knots.
    pub(super) crossings: Vec<f64>,
    /// Knot spacing, s.
    pub(super) spacing: f64,
}

impl Seed {
    /// Points of a search, which need not use all coordinates.
    pub(super) fn widened<const D: usize>(points: &[[f64; D]]) -> Vec<[f64; WIDEST]> {
        let wide = |c: &[f64; D]| std::array::from_fn(|d| c.get(d).copied().unwrap_or(0.0));
        points.iter().map(wide).collect()
    }

    /// Only those coordinates that a search uses.
    pub(super) fn used<const D: usize>(points: &[[f64; WIDEST]]) -> Vec<[f64; D]> {
        let used = |c: &[f64; WIDEST]| std::array::from_fn(|d| c[d]);
        points.iter().map(used).collect()
    }

    /// Whether it is one of a search in so many coordinates through so many poses.
    pub(super) fn fits(&self, coordinates: usize, poses: usize) -> bool {
        self.coordinates == coordinates && self.vertices.len() == poses
    }

    /// The same spline on knots at half the distance.
    ///
    /// # Source
    /// J. M. Lane, R. F. Riesenfeld, "A theoretical development for the computer generation and display of piecewise
    /// polynomial surfaces", 1980 (subdivision of uniform splines).
    pub(super) fn refined(&self) -> Self {
        let between = |near: &[[f64; WIDEST]]| {
            let mix = |weights: [f64; 3]| {
                std::array::from_fn(|d| (0..3).map(|i| weights[i] / 16.0 * near[i][d]).sum())
            };
            [mix(EARLIER), mix(LATER)]
        };
        Self {
            control: self.control.windows(3).flat_map(between).collect(),
            crossings: self.crossings.iter().map(|time| 2.0 * time).collect(),
            spacing: 0.5 * self.spacing,
            ..self.clone()
        }
    }

    /// The last coordinate of the control points.
    pub(super) fn last_coordinate(&self) -> Vec<f64> {
        let last = self.coordinates - 1;
        self.control.iter().map(|c| c[last]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::poly::quartic;
    use crate::smooth::spline::power;

    /// Half the distance of knots changes no place of the spline, and control points that rest at an end still do.
    #[test]
    fn a_refined_spline_is_the_same() {
        let number = |k: usize, d: usize| (1.7 * k as f64 + 2.3 * d as f64).sin();
        let control = |k: usize| std::array::from_fn(|d| number(k.clamp(3, 12), d));
        let seed = Seed {
            coordinates: WIDEST,
            control: (0..16).map(control).collect(),
            vertices: Vec::new(),
            crossings: vec![2.25, 7.5],
            spacing: 0.1,
        };
        let fine = seed.refined();
        assert_eq!(fine.control.len() - 4, 2 * (seed.control.len() - 4));
        assert_eq!(fine.crossings, [4.5, 15.0]);
        let at = |seed: &Seed, time: f64, d: usize| -> f64 {
            let span = (time / seed.spacing) as usize;
            let five = std::array::from_fn(|i| seed.control[span + i][d]);
            quartic(
                &power(&five, seed.spacing),
                time - span as f64 * seed.spacing,
            )[0]
        };
        for k in 0..119 {
            let time = 0.01 * f64::from(k) + 0.003;
            for d in 0..WIDEST {
                let off = at(&fine, time, d) - at(&seed, time, d);
                assert!(off.abs() < 1e-13, "{time} {d}: {off}");
            }
        }
        let (first, last) = (seed.control[0], seed.control[15]);
        let near =
            |a: &[f64; WIDEST], b: &[f64; WIDEST]| (0..WIDEST).all(|d| (a[d] - b[d]).abs() < 1e-15);
        assert!(fine.control[..4].iter().all(|c| near(c, &first)));
        assert!(
            fine.control[fine.control.len() - 4..]
                .iter()
                .all(|c| near(c, &last))
        );
    }
}
