//! Four numbers at once: inner loops are compiled twice, with SIMD instructions for processors that
//! have them and for every processor. Both builds give the same bits, since neither fuses
//! multiplications and additions.

/// Numbers in an [`Four::F`].
pub(crate) const LANES: usize = 4;

/// What a build does with four numbers at once.
pub(crate) trait Four: Copy {
    /// Four numbers.
    type F: Copy;
    /// The first four numbers of a slice; zeros where it is shorter than that.
    fn load(self, x: &[f64]) -> Self::F;
    /// Writes them to the first four places of a slice that has them.
    fn store(self, x: Self::F, to: &mut [f64]);
    /// The same number four times.
    fn splat(self, x: f64) -> Self::F;
    /// `x + y`.
    fn add(self, x: Self::F, y: Self::F) -> Self::F;
    /// `x - y`.
    fn sub(self, x: Self::F, y: Self::F) -> Self::F;
    /// `x y`, number by number.
    fn mul(self, x: Self::F, y: Self::F) -> Self::F;
    /// `x / y`, number by number.
    fn div(self, x: Self::F, y: Self::F) -> Self::F;
    /// The square root of each number.
    fn sqrt(self, x: Self::F) -> Self::F;
    /// The larger of each pair; `y` if one of them is NaN.
    fn max(self, x: Self::F, y: Self::F) -> Self::F;
    /// The sum of the four.
    fn sum(self, x: Self::F) -> f64;
}

/// Which build to use, with the proof that the processor has it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wide(#[cfg(target_arch = "x86_64")] Option<pulp::x86::V3>);

/// A computation for both builds. `run` and all that it calls must be `#[inline(always)]`;
/// otherwise they use the plain instruction set.
pub(crate) trait Op {
    /// What it computes.
    type Output;
    /// Computes it.
    fn run<S: Four>(self, simd: S) -> Self::Output;
}

impl Wide {
    /// The best that this processor has.
    pub(crate) fn detect() -> Self {
        Self(
            #[cfg(target_arch = "x86_64")]
            pulp::x86::V3::try_new(),
        )
    }

    /// The build for every processor.
    #[cfg(test)]
    pub(crate) fn plain() -> Self {
        Self(
            #[cfg(target_arch = "x86_64")]
            None,
        )
    }

    /// Runs a computation in this build.
    #[inline(always)]
    pub(crate) fn run<O: Op>(self, op: O) -> O::Output {
        #[cfg(target_arch = "x86_64")]
        if let Some(simd) = self.0 {
            return simd.vectorize(Call(op, simd));
        }
        op.run(Plain)
    }
}

/// Four numbers as an array: every processor.
#[derive(Clone, Copy, Debug)]
struct Plain;

impl Four for Plain {
    type F = [f64; 4];

    #[inline(always)]
    fn load(self, x: &[f64]) -> [f64; 4] {
        x.first_chunk().copied().unwrap_or_default()
    }
    #[inline(always)]
    fn store(self, x: [f64; 4], to: &mut [f64]) {
        if let Some(to) = to.first_chunk_mut() {
            *to = x;
        }
    }
    #[inline(always)]
    fn splat(self, x: f64) -> [f64; 4] {
        [x; 4]
    }
    #[inline(always)]
    fn add(self, x: [f64; 4], y: [f64; 4]) -> [f64; 4] {
        [x[0] + y[0], x[1] + y[1], x[2] + y[2], x[3] + y[3]]
    }
    #[inline(always)]
    fn sub(self, x: [f64; 4], y: [f64; 4]) -> [f64; 4] {
        [x[0] - y[0], x[1] - y[1], x[2] - y[2], x[3] - y[3]]
    }
    #[inline(always)]
    fn mul(self, x: [f64; 4], y: [f64; 4]) -> [f64; 4] {
        [x[0] * y[0], x[1] * y[1], x[2] * y[2], x[3] * y[3]]
    }
    #[inline(always)]
    fn div(self, x: [f64; 4], y: [f64; 4]) -> [f64; 4] {
        [x[0] / y[0], x[1] / y[1], x[2] / y[2], x[3] / y[3]]
    }
    #[inline(always)]
    fn sqrt(self, x: [f64; 4]) -> [f64; 4] {
        x.map(f64::sqrt)
    }
    #[inline(always)]
    fn max(self, x: [f64; 4], y: [f64; 4]) -> [f64; 4] {
        let larger = |i: usize| if x[i] > y[i] { x[i] } else { y[i] };
        [larger(0), larger(1), larger(2), larger(3)]
    }
    #[inline(always)]
    fn sum(self, x: [f64; 4]) -> f64 {
        (x[0] + x[1]) + (x[2] + x[3])
    }
}

#[cfg(target_arch = "x86_64")]
impl Four for pulp::x86::V3 {
    type F = pulp::f64x4;

    #[inline(always)]
    fn load(self, x: &[f64]) -> pulp::f64x4 {
        pulp::cast(Plain.load(x))
    }
    #[inline(always)]
    fn store(self, x: pulp::f64x4, to: &mut [f64]) {
        Plain.store(pulp::cast(x), to);
    }
    #[inline(always)]
    fn splat(self, x: f64) -> pulp::f64x4 {
        self.splat_f64x4(x)
    }
    #[inline(always)]
    fn add(self, x: pulp::f64x4, y: pulp::f64x4) -> pulp::f64x4 {
        self.add_f64x4(x, y)
    }
    #[inline(always)]
    fn sub(self, x: pulp::f64x4, y: pulp::f64x4) -> pulp::f64x4 {
        self.sub_f64x4(x, y)
    }
    #[inline(always)]
    fn mul(self, x: pulp::f64x4, y: pulp::f64x4) -> pulp::f64x4 {
        self.mul_f64x4(x, y)
    }
    #[inline(always)]
    fn div(self, x: pulp::f64x4, y: pulp::f64x4) -> pulp::f64x4 {
        self.div_f64x4(x, y)
    }
    #[inline(always)]
    fn sqrt(self, x: pulp::f64x4) -> pulp::f64x4 {
        self.sqrt_f64x4(x)
    }
    #[inline(always)]
    fn max(self, x: pulp::f64x4, y: pulp::f64x4) -> pulp::f64x4 {
        self.max_f64x4(x, y)
    }
    #[inline(always)]
    fn sum(self, x: pulp::f64x4) -> f64 {
        Plain.sum(pulp::cast(x))
    }
}

/// Adapter for `pulp`, which compiles `call` with SIMD instructions.
#[cfg(target_arch = "x86_64")]
struct Call<O>(O, pulp::x86::V3);

#[cfg(target_arch = "x86_64")]
impl<O: Op> pulp::NullaryFnOnce for Call<O> {
    type Output = O::Output;

    #[inline(always)]
    fn call(self) -> O::Output {
        self.0.run(self.1)
    }
}
