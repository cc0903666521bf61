//! The terms of limits and corridors in the Newton system, four at a time.

use simd::{F4, Four, LANES, Mask, Op};

use super::basis::{AT_KNOT, AT_MIDDLE, FIRST, SECOND, THIRD};
use super::coordinates::Coordinates;
use super::iterate::Iterate;

/// Diagonals of blocks, the main one with them: a term has five control points at most.
pub(super) const WIDE: usize = 5;

/// Numbers of a symmetric matrix, and where each entry is among them.
const ENTRIES: usize = 6;
pub(super) const ENTRY: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// Gradient, border and Hessian of the terms of one group, each number by control point: so the sums of four
/// neighbouring control points are made at once.
pub(super) struct Norms {
    values: Vec<f64>,
    length: usize,
    /// Sums of what the terms add to the slope along `z` and to its curvature.
    pub(super) along_z: [f64; 2],
}

impl Norms {
    /// Room for so many control points.
    pub(super) fn new(count: usize) -> Self {
        let length = count + 2 * LANES;
        Self {
            values: vec![0.0; (6 + WIDE * ENTRIES) * length],
            length,
            along_z: [0.0; 2],
        }
    }

    fn clear(&mut self) {
        self.values.fill(0.0);
        self.along_z = [0.0; 2];
    }

    /// Gradient and border of a coordinate of a control point.
    pub(super) fn side(&self, k: usize, d: usize) -> [f64; 2] {
        [0, 1].map(|m| self.values[(3 * m + d) * self.length + k])
    }

    /// The block of a control point and of the one `back` before it.
    pub(super) fn block(&self, k: usize, back: usize) -> [f64; ENTRIES] {
        let first = 6 + back * ENTRIES;
        std::array::from_fn(|entry| self.values[(first + entry) * self.length + k])
    }

    /// Adds to a number of the control points from `k` on.
    #[inline(always)]
    fn add<S: Four>(&mut self, number: usize, k: usize, value: F4<S>) {
        let to = &mut self.values[number * self.length + k..][..LANES];
        if let Some(to) = to.first_chunk_mut() {
            (F4::load(value.build(), &*to) + value).store(to);
        }
    }

    /// Adds four terms, each in the weighted sum of the control points from `k` on, the next from the one after.
    #[inline(always)]
    fn add_terms<S: Four, const M: usize>(&mut self, terms: &Terms<S>, w: &[f64; M], k: usize) {
        for i in 0..M {
            for d in 0..3 {
                self.add(d, k + i, terms.gradient[d] * w[i]);
                self.add(3 + d, k + i, terms.border[d] * w[i]);
            }
            for j in 0..=i {
                for entry in 0..ENTRIES {
                    let number = 6 + (i - j) * ENTRIES + entry;
                    self.add(number, k + i, terms.hessian[entry] * (w[i] * w[j]));
                }
            }
        }
    }
}

/// Four terms.
struct Terms<S: Four> {
    gradient: [F4<S>; 3],
    border: [F4<S>; 3],
    hessian: [F4<S>; ENTRIES],
}

/// The matrix `diagonal I + scale y y^T`.
#[inline(always)]
fn outer<S: Four>([x, y, z]: [F4<S>; 3], diagonal: F4<S>, scale: F4<S>) -> [F4<S>; ENTRIES] {
    let (sx, sy, sz) = (scale * x, scale * y, scale * z);
    [
        sx * x + diagonal,
        sx * y,
        sx * z,
        sy * y + diagonal,
        sy * z,
        sz * z + diagonal,
    ]
}

#[inline(always)]
fn dot<S: Four>(a: [F4<S>; 3], b: [F4<S>; 3]) -> F4<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A symmetric matrix times a vector.
#[inline(always)]
fn times<S: Four>(h: &[F4<S>; ENTRIES], [x, y, z]: [F4<S>; 3]) -> [F4<S>; 3] {
    [
        h[0] * x + h[1] * y + h[2] * z,
        h[1] * x + h[3] * y + h[4] * z,
        h[2] * x + h[4] * y + h[5] * z,
    ]
}

/// Computes the terms of one group of an iterate.
pub(super) struct Sum<'a, const D: usize> {
    pub(super) at: &'a Iterate<'a, D>,
    pub(super) coordinates: &'a Coordinates,
    /// How the control points move with `z`, if some do.
    pub(super) moves: Option<&'a Coordinates>,
    pub(super) g: usize,
    pub(super) norms: &'a mut Norms,
}

impl<const D: usize> Op for Sum<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<S: Four>(mut self, simd: S) {
        self.norms.clear();
        let mut along = [F4::splat(simd, 0.0); 2];
        self.limits(simd, &mut along);
        if self.at.problem.groups[self.g].width.is_finite() {
            self.corridor(simd, &mut along);
        }
        self.norms.along_z = [along[0].sum(), along[1].sum()];
    }
}

impl<const D: usize> Sum<'_, D> {
    /// Speed, acceleration and jerk.
    #[inline(always)]
    fn limits<S: Four>(&mut self, simd: S, along: &mut [F4<S>; 2]) {
        let Self { at, g, .. } = *self;
        let last = at.point.control.len() - 1;
        let cap = |k: usize| at.problem.cap(g, k, at.point.z, at.room);
        let caps = [cap(1), cap(2), cap(3)];
        let mut k = 0;
        while k < last {
            let [first, second, third] = self.coordinates.differences(simd, g, k);
            let moves = self.moves.filter(|_| k < LANES || !at.slides.is_empty());
            let [one, two, three] = match moves {
                Some(moves) => {
                    let [one, two, three] = moves.differences(simd, g, k);
                    [Some(one), Some(two), Some(three)]
                }
                None => [None; 3],
            };
            let (speeds, accelerations, jerks) = (
                norm(first, &caps[0], one, (held(simd, k, last), &mut *along)),
                norm(
                    second,
                    &caps[1],
                    two,
                    (held(simd, k + 1, last), &mut *along),
                ),
                norm(
                    third,
                    &caps[2],
                    three,
                    (held(simd, k + 2, last), &mut *along),
                ),
            );
            self.norms.add_terms(&speeds, &FIRST, k);
            self.norms.add_terms(&accelerations, &SECOND, k);
            self.norms.add_terms(&jerks, &THIRD, k);
            k += LANES;
        }
    }

    /// Corridor samples: at knots, and in the middles of spans.
    #[inline(always)]
    fn corridor<S: Four>(&mut self, simd: S, along: &mut [F4<S>; 2]) {
        let (at, g) = (self.at, self.g);
        let spans = at.point.spans();
        let mut k = 0;
        while k < spans {
            let places = self.coordinates.samples(simd, g, k);
            let moves = self.moves.filter(|_| !at.slides.is_empty());
            let slides = match moves {
                Some(moves) => {
                    let [knots, middles] = moves.samples(simd, g, k);
                    [Some(knots), Some(middles)]
                }
                None => [None; 2],
            };
            for half in 0..2 {
                let slide = slides[half];
                let feet = self.feet(places[half], 2 * k + half);
                let valid = held(simd, k, spans);
                let terms = away(&feet, slide, (valid, &mut *along));
                if half == 0 {
                    self.norms.add_terms(&terms, &AT_KNOT, k);
                } else {
                    self.norms.add_terms(&terms, &AT_MIDDLE, k);
                }
            }
            k += LANES;
        }
    }

    /// The nearest points of the path to the corridor samples `first` and every second after it.
    #[inline(always)]
    fn feet<S: Four>(&self, places: [F4<S>; 3], first: usize) -> Feet<S> {
        let (simd, problem, room, g) = (places[0].build(), self.at.problem, self.at.room, self.g);
        let last = room.legs.len() - 1;
        let sample = |l: usize| (first + 2 * l).min(last);
        let width = |l: usize| room.widths[g][sample(l)];
        let width = F4::new(simd, [width(0), width(1), width(2), width(3)]);
        let leg = |l: usize| room.legs[sample(l)];
        let legs = [leg(0), leg(1), leg(2), leg(3)];
        if legs[1] == legs[0] && legs[2] == legs[0] && legs[3] == legs[0] {
            let way = problem.way(legs[0], g);
            if let Some(offset) = way.beside(places) {
                let [x, y, z] = way.direction();
                let slide = [F4::splat(simd, x), F4::splat(simd, y), F4::splat(simd, z)];
                return Feet {
                    offset,
                    slide,
                    width,
                };
            }
        }
        let [x, y, z] = [places[0].array(), places[1].array(), places[2].array()];
        let (mut offsets, mut slides) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for l in 0..LANES {
            let foot = problem.nearest(&[x[l], y[l], z[l]], legs[l], g);
            let slide = problem.slide(&foot, g);
            for d in 0..3 {
                (offsets[d][l], slides[d][l]) = (foot.offset[d], slide[d]);
            }
        }
        Feet {
            offset: vector(simd, &offsets),
            slide: vector(simd, &slides),
            width,
        }
    }
}

#[inline(always)]
fn vector<S: Four>(simd: S, v: &[[f64; LANES]; 3]) -> [F4<S>; 3] {
    [
        F4::new(simd, v[0]),
        F4::new(simd, v[1]),
        F4::new(simd, v[2]),
    ]
}

/// Which of four terms from `k` on are below `end`; nothing if all are.
#[inline(always)]
fn held<S: Four>(simd: S, k: usize, end: usize) -> Option<Mask<S>> {
    if k + LANES <= end {
        return None;
    }
    let at = |l: usize| (k + l) as f64;
    let at = F4::new(simd, [at(0), at(1), at(2), at(3)]);
    Some(at.le(F4::splat(simd, end as f64 - 1.0)))
}

/// Four nearest points of the path.
struct Feet<S: Four> {
    /// Offset from them, and the direction in which they move along the path; zero at a corner.
    offset: [F4<S>; 3],
    slide: [F4<S>; 3],
    /// Half width of the corridor.
    width: F4<S>,
}

/// One over slacks; zero where there is no term.
#[inline(always)]
fn inverse<S: Four>(slack: F4<S>, valid: Option<Mask<S>>) -> F4<S> {
    let inverse = slack.inverse();
    match valid {
        Some(valid) => valid.select(inverse, F4::splat(slack.build(), 0.0)),
        None => inverse,
    }
}

/// Terms `-log(R(z)^2 - |y|^2)`, `y` a difference of control points, which perhaps moves with `z`.
#[inline(always)]
fn norm<S: Four>(
    y: [F4<S>; 3],
    [r, r1, r2]: &[f64; 3],
    slide: Option<[F4<S>; 3]>,
    (valid, along): (Option<Mask<S>>, &mut [F4<S>; 2]),
) -> Terms<S> {
    let simd = y[0].build();
    let slack = inverse(F4::splat(simd, r * r) - dot(y, y), valid);
    let twice = slack * 2.0;
    let gradient = [y[0] * twice, y[1] * twice, y[2] * twice];
    let hessian = outer(y, twice, twice * twice);
    let cross = twice * twice * (-r * r1);
    let mut border = [y[0] * cross, y[1] * cross, y[2] * cross];
    let steep = twice * (r * r1);
    along[0] = along[0] - steep;
    along[1] += steep * steep - twice * (r1 * r1 + r * r2);
    if let Some(slide) = slide {
        let bent = times(&hessian, slide);
        along[0] += dot(gradient, slide);
        along[1] += dot(slide, border) * 2.0 + dot(slide, bent);
        border = [
            border[0] + bent[0],
            border[1] + bent[1],
            border[2] + bent[2],
        ];
    }
    Terms {
        gradient,
        border,
        hessian,
    }
}

/// Terms of corridor samples, which perhaps move with `z`.
#[inline(always)]
fn away<S: Four>(
    feet: &Feet<S>,
    slide: Option<[F4<S>; 3]>,
    (valid, along): (Option<Mask<S>>, &mut [F4<S>; 2]),
) -> Terms<S> {
    let y = feet.offset;
    let simd = y[0].build();
    let slack = inverse(feet.width * feet.width - dot(y, y), valid);
    let twice = slack * 2.0;
    let zero = F4::splat(simd, 0.0);
    let mut hessian = outer(y, twice, twice * twice);
    // The nearest point moves along the path: there is no curvature in that direction.
    let free = outer(feet.slide, zero, twice);
    for entry in 0..ENTRIES {
        hessian[entry] = hessian[entry] - free[entry];
    }
    let gradient = [y[0] * twice, y[1] * twice, y[2] * twice];
    let mut border = [zero; 3];
    if let Some(slide) = slide {
        border = times(&hessian, slide);
        along[0] += dot(gradient, slide);
        along[1] += dot(slide, border);
    }
    Terms {
        gradient,
        border,
        hessian,
    }
}
