//! Passing times that stay unknowns of a Newton system, behind its band.
//!
//! A ball couples position and orientation only through the time of its pass. With that time as an
//! unknown the band falls into one for each, half as wide, which takes a quarter of the work.

use super::band::{Band, PANEL};

/// Unknown passing times: columns beside the band, one for each.
#[derive(Clone, Debug)]
pub(super) struct Passes {
    /// The columns, one behind the other, each with room after it.
    columns: Vec<f64>,
    /// Length of each with its room.
    length: usize,
    /// Where the numbers of each column begin, in the part of each group.
    first: Vec<[usize; 2]>,
    /// The diagonal, and what couples the times with `z`.
    stiff: Vec<f64>,
    drawn: Vec<f64>,
    /// Slopes along the times.
    slopes: Vec<f64>,
}

/// What is left for `z` when all else is eliminated, and the values of the rest.
pub(super) struct Eliminated {
    /// By how much the curvature along `z` falls.
    pub(super) bent: f64,
    /// By how much its slope falls.
    pub(super) cross: f64,
    /// The passing times, without `z` and for each unit of it.
    times: Vec<[f64; 2]>,
}

impl Passes {
    /// Room for `count` passing times beside a band of `size` rows and `room` zeros after it.
    pub(super) fn new(count: usize, size: usize, room: usize) -> Self {
        let length = size + room;
        Self {
            columns: Vec::with_capacity(count * length),
            length,
            first: Vec::with_capacity(count),
            stiff: Vec::with_capacity(count),
            drawn: Vec::with_capacity(count),
            slopes: Vec::with_capacity(count),
        }
    }

    /// Removes all.
    pub(super) fn clear(&mut self) {
        self.columns.clear();
        self.first.clear();
        self.stiff.clear();
        self.drawn.clear();
        self.slopes.clear();
    }

    /// Adds one with its diagonal, what couples it with `z`, and its slope; its column, all zero.
    pub(super) fn push(
        &mut self,
        first: [usize; 2],
        stiff: f64,
        [drawn, slope]: [f64; 2],
    ) -> &mut [f64] {
        let start = self.columns.len();
        self.columns.resize(start + self.length, 0.0);
        self.first.push(first);
        self.stiff.push(stiff);
        self.drawn.push(drawn);
        self.slopes.push(slope);
        &mut self.columns[start..]
    }

    /// Eliminates the band, then the times. `along` and `border` are the gradient and the column of
    /// `z`, already multiplied by the inverse of the band's factor. `None` if the system is not
    /// positive definite.
    ///
    /// # Source
    /// G. Golub, C. Van Loan, "Matrix Computations", 4th edition 2013, 4.2.5 and 4.3.5.
    pub(super) fn eliminate<const B: usize>(
        &mut self,
        band: &Band<B>,
        [along, border]: [&[f64]; 2],
    ) -> Option<Eliminated> {
        let (count, size, half) = (self.stiff.len(), band.columns.len(), band.columns.len() / 2);
        let [along, border] = [&along[..size], &border[..size]];
        for (column, [first, second]) in self.columns.chunks_mut(self.length).zip(&self.first) {
            // Rows of the second part that stand in the last panel of the first are done with it.
            let next = half.next_multiple_of(PANEL);
            band.lower([&mut *column], *first..half);
            band.lower([column], next.max(*second)..size);
        }
        let column = |i: usize| &self.columns[i * self.length..][..size];
        let mut matrix = vec![0.0; count * count];
        let mut times = Vec::with_capacity(count);
        for i in 0..count {
            for j in 0..=i {
                let [a, b] = [0, 1].map(|g| self.first[i][g].max(self.first[j][g]));
                let both = dot(&column(i)[a..half], &column(j)[a..half])
                    + dot(&column(i)[b.max(half)..], &column(j)[b.max(half)..]);
                matrix[i * count + j] = -both;
            }
            matrix[i * count + i] += self.stiff[i];
            let pull = dot(column(i), along) - self.slopes[i];
            times.push([pull, self.drawn[i] - dot(column(i), border)]);
        }
        factor(&mut matrix, count)?;
        lower(&matrix, &mut times);
        let cross = times.iter().map(|[pull, drawn]| pull * drawn).sum::<f64>();
        let bent = times.iter().map(|[_, drawn]| drawn * drawn).sum::<f64>();
        upper(&matrix, &mut times);
        Some(Eliminated {
            bent: bent + dot(border, border),
            cross: dot(border, along) - cross,
            times,
        })
    }

    /// Adds the columns times the passing times for a step `z` to `step`.
    pub(super) fn take(&self, eliminated: &Eliminated, z: f64, step: &mut [f64]) {
        let columns = self.columns.chunks(self.length);
        for (column, [time, each]) in columns.zip(&eliminated.times) {
            let time = time - each * z;
            for (to, x) in step.iter_mut().zip(column) {
                *to -= x * time;
            }
        }
    }
}

/// The sum of products, four at a time.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (left, right) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest = left.remainder().iter().zip(right.remainder());
    let rest: f64 = rest.map(|(a, b)| a * b).sum();
    for (a, b) in left.zip(right) {
        for l in 0..4 {
            sums[l] += a[l] * b[l];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// Cholesky factor of a small matrix, of which the lower half is used.
fn factor(matrix: &mut [f64], count: usize) -> Option<()> {
    for i in 0..count {
        for j in 0..=i {
            let (own, other) = (&matrix[i * count..][..j], &matrix[j * count..][..j]);
            let value =
                matrix[i * count + j] - own.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
            matrix[i * count + j] = if i > j {
                value / matrix[j * count + j]
            } else if value > 0.0 {
                value.sqrt()
            } else {
                return None;
            };
        }
    }
    Some(())
}

/// Solves with the factor, for two right-hand sides.
fn lower(matrix: &[f64], x: &mut [[f64; 2]]) {
    let count = x.len();
    for i in 0..count {
        for j in 0..i {
            let (factor, known) = (matrix[i * count + j], x[j]);
            x[i] = [x[i][0] - factor * known[0], x[i][1] - factor * known[1]];
        }
        x[i] = x[i].map(|x| x / matrix[i * count + i]);
    }
}

/// Solves with the transposed factor.
fn upper(matrix: &[f64], x: &mut [[f64; 2]]) {
    let count = x.len();
    for i in (0..count).rev() {
        for j in i + 1..count {
            let (factor, known) = (matrix[j * count + i], x[j]);
            x[i] = [x[i][0] - factor * known[0], x[i][1] - factor * known[1]];
        }
        x[i] = x[i].map(|x| x / matrix[i * count + i]);
    }
}
