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

/// Gradient, border and Hessian blocks of a control point, one number after the other.
const SUMS: usize = 6 + WIDE * ENTRIES;

/// Gradient, border and Hessian of the terms of one group, by control point.
pub(super) struct Norms {
    /// The numbers of four neighbouring control points.
    values: Vec<[[f64; LANES]; SUMS]>,
    terms: Window,
    /// Sums of what the terms add to the slope along `z` and to its curvature.
    pub(super) along_z: [f64; 2],
}

impl Norms {
    /// Room for so many control points.
    pub(super) fn new(count: usize) -> Self {
        Self {
            values: vec![[[0.0; LANES]; SUMS]; count.div_ceil(LANES)],
            terms: Window::default(),
            along_z: [0.0; 2],
        }
    }

    /// Gradient and border of a coordinate of a control point.
    #[inline(always)]
    pub(super) fn side(&self, k: usize, d: usize) -> [f64; 2] {
        let four = &self.values[k / LANES];
        [four[d][k % LANES], four[3 + d][k % LANES]]
    }

    /// The block of a control point and of the one `back` before it.
    #[inline(always)]
    pub(super) fn block(&self, k: usize, back: usize) -> [f64; ENTRIES] {
        let four = &self.values[k / LANES];
        let mut block = [0.0; ENTRIES];
        for (entry, to) in block.iter_mut().enumerate() {
            *to = four[6 + back * ENTRIES + entry][k % LANES];
        }
        block
    }
}

/// Numbers of a term: gradient, border, and entries of the Hessian.
const NUMBERS: usize = 6 + ENTRIES;
/// Terms that are made before they are added up, and room for those before them.
const MADE: usize = 32;
const ROOM: usize = LANES + MADE;
/// Speed, acceleration, jerk, corridor at knots and in the middles of spans.
const KINDS: usize = 5;

/// Terms of neighbouring control points by kind and number; the first four are the last ones of the window before. What
/// a control point has of all terms is added up at once, and no sum is read or written twice.
struct Window(Vec<[[f64; ROOM]; NUMBERS]>);

impl Default for Window {
    fn default() -> Self {
        Self(vec![[[0.0; ROOM]; NUMBERS]; KINDS])
    }
}

impl Window {
    /// Removes all terms.
    fn clear(&mut self) {
        self.0.fill([[0.0; ROOM]; NUMBERS]);
    }

    /// Makes the last four terms those before the next.
    fn go_on(&mut self) {
        for row in self.0.iter_mut().flatten() {
            row.copy_within(MADE.., 0);
        }
    }

    /// Sets four terms of a kind, of the control points from `l` on.
    #[inline(always)]
    fn set<S: Four>(&mut self, kind: usize, l: usize, terms: &Terms<S>) {
        let rows = &mut self.0[kind];
        for d in 0..3 {
            terms.gradient[d].put(&mut rows[d], LANES + l);
            terms.border[d].put(&mut rows[3 + d], LANES + l);
        }
        for entry in 0..ENTRIES {
            terms.hessian[entry].put(&mut rows[6 + entry], LANES + l);
        }
    }

    /// What all terms add to the four control points from `l` on.
    #[inline(always)]
    fn sums<S: Four>(&self, simd: S, l: usize, to: &mut [[f64; LANES]; SUMS]) {
        let [speeds, accelerations, jerks, knots, middles] = self.0.as_slice() else {
            return;
        };
        let zero = F4::splat(simd, 0.0);
        for number in 0..6 {
            let mut sum = zero;
            add_side(&mut sum, (&speeds[number], l), &FIRST);
            add_side(&mut sum, (&accelerations[number], l), &SECOND);
            add_side(&mut sum, (&jerks[number], l), &THIRD);
            add_side(&mut sum, (&knots[number], l), &KNOT);
            add_side(&mut sum, (&middles[number], l), &AT_MIDDLE);
            sum.store(&mut to[number]);
        }
        for entry in 0..ENTRIES {
            let (mut sums, number) = ([zero; WIDE], 6 + entry);
            add_blocks(&mut sums, (&speeds[number], l), &FIRST);
            add_blocks(&mut sums, (&accelerations[number], l), &SECOND);
            add_blocks(&mut sums, (&jerks[number], l), &THIRD);
            add_blocks(&mut sums, (&knots[number], l), &KNOT);
            add_blocks(&mut sums, (&middles[number], l), &AT_MIDDLE);
            for (back, sum) in sums.into_iter().enumerate() {
                sum.store(&mut to[6 + back * ENTRIES + entry]);
            }
        }
    }
}

/// The weights of the position at a knot that are not zero.
const KNOT: [f64; 4] = [AT_KNOT[0], AT_KNOT[1], AT_KNOT[2], AT_KNOT[3]];

/// A number of terms, as far as the control points from `l` on are in them: the terms that begin there, one before, and
/// so on.
#[inline(always)]
fn shifted<S: Four, const M: usize>(simd: S, (row, l): (&[f64; ROOM], usize)) -> [F4<S>; M] {
    let near: &[f64; 2 * LANES] = row[l..].first_chunk().unwrap_or(&[0.0; 2 * LANES]);
    let mut result = [F4::splat(simd, 0.0); M];
    for i in 0..M {
        result[i] = F4::load(simd, &near[LANES - i..]);
    }
    result
}

/// Adds to a number of four control points what the terms give that have them with these weights.
#[inline(always)]
fn add_side<S: Four, const M: usize>(sum: &mut F4<S>, row: (&[f64; ROOM], usize), w: &[f64; M]) {
    let terms: [F4<S>; M] = shifted(sum.build(), row);
    for i in 0..M {
        *sum += terms[i] * w[i];
    }
}

/// The same for an entry of the blocks of four control points with those before them.
#[inline(always)]
fn add_blocks<S: Four, const M: usize>(
    sums: &mut [F4<S>; WIDE],
    row: (&[f64; ROOM], usize),
    w: &[f64; M],
) {
    let terms: [F4<S>; M] = shifted(sums[0].build(), row);
    for i in 0..M {
        for j in 0..=i {
            sums[i - j] += terms[i] * (w[i] * w[j]);
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
        let mut along = [F4::splat(simd, 0.0); 2];
        let count = self.at.point.control.len();
        let tube = self.at.problem.groups[self.g].width.is_finite();
        self.norms.terms.clear();
        let mut first = 0;
        while first < count {
            let end = (first + MADE).min(count);
            let mut k = first;
            while k < end {
                self.limits(simd, (k, k - first), &mut along);
                if tube {
                    self.corridor(simd, (k, k - first), &mut along);
                }
                k += LANES;
            }
            let Norms { values, terms, .. } = &mut *self.norms;
            let fours = &mut values[first / LANES..end.div_ceil(LANES)];
            for (i, four) in fours.iter_mut().enumerate() {
                terms.sums(simd, LANES * i, four);
            }
            terms.go_on();
            first = end;
        }
        self.norms.along_z = [along[0].sum(), along[1].sum()];
    }
}

impl<const D: usize> Sum<'_, D> {
    /// Speed, acceleration and jerk of the control points from `k` on, which are terms from `l` on.
    #[inline(always)]
    fn limits<S: Four>(&mut self, simd: S, (k, l): (usize, usize), along: &mut [F4<S>; 2]) {
        let Self { at, g, .. } = *self;
        let last = at.point.control.len() - 1;
        let cap = |k: usize| at.problem.cap(g, k, at.point.z, at.room);
        let caps = [cap(1), cap(2), cap(3)];
        let [first, second, third] = self.coordinates.differences(simd, g, k);
        let moves = self.moves.filter(|_| k < LANES || !at.slides.is_empty());
        let [one, two, three] = match moves {
            Some(moves) => {
                let [one, two, three] = moves.differences(simd, g, k);
                [Some(one), Some(two), Some(three)]
            }
            None => [None; 3],
        };
        let speeds = norm(first, &caps[0], one, (held(simd, k, last), &mut *along));
        let valid = held(simd, k + 1, last);
        let accelerations = norm(second, &caps[1], two, (valid, &mut *along));
        let valid = held(simd, k + 2, last);
        let jerks = norm(third, &caps[2], three, (valid, &mut *along));
        self.norms.terms.set(0, l, &speeds);
        self.norms.terms.set(1, l, &accelerations);
        self.norms.terms.set(2, l, &jerks);
    }

    /// Corridor samples: at knots, and in the middles of spans.
    #[inline(always)]
    fn corridor<S: Four>(&mut self, simd: S, (k, l): (usize, usize), along: &mut [F4<S>; 2]) {
        let (at, g) = (self.at, self.g);
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
            let feet = self.feet(places[half], 2 * k + half);
            let valid = held(simd, k, at.point.spans());
            let terms = away(&feet, slides[half], (valid, &mut *along));
            self.norms.terms.set(3 + half, l, &terms);
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
