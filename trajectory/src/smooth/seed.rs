//! Where the search of a spline has ended.

/// Most coordinates of a search.
const WIDEST: usize = 7;

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

    /// The last coordinate of the control points.
    pub(super) fn last_coordinate(&self) -> Vec<f64> {
        let last = self.coordinates - 1;
        self.control.iter().map(|c| c[last]).collect()
    }
}
