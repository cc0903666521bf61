//! How a small correction fades in over a motion.

/// The share of a correction that holds: it rises from 0 to 1 over a length as a cubic that is level at both ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fade {
    length: f64,
}

impl Fade {
    /// Over a length (s, or a unit of a parameter) above zero.
    pub(super) fn over(length: f64) -> Self {
        Self { length }
    }

    /// The share as a polynomial in what has passed since `start`.
    pub(super) fn since(self, start: f64) -> [f64; 5] {
        let rate = 1.0 / self.length;
        let x = start * rate;
        [
            x * x * (3.0 - 2.0 * x),
            6.0 * x * (1.0 - x) * rate,
            3.0 * (1.0 - 2.0 * x) * rate * rate,
            -2.0 * rate * rate * rate,
            0.0,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::poly::quartic;
    use approx::assert_relative_eq;

    /// From 0 to 1, level at both ends, and the same from wherever it is begun.
    #[test]
    fn it_rises_from_nothing_to_all() {
        let fade = Fade::over(2.5);
        let whole = fade.since(0.0);
        for (at, share) in [(0.0, 0.0), (1.25, 0.5), (2.5, 1.0)] {
            assert_relative_eq!(quartic(&whole, at)[0], share, epsilon = 1e-12);
        }
        for end in [0.0, 2.5] {
            assert_relative_eq!(quartic(&whole, end)[1], 0.0, epsilon = 1e-12);
        }
        for k in 0..4 {
            let later = quartic(&fade.since(0.7), 0.9)[k];
            assert_relative_eq!(later, quartic(&whole, 1.6)[k], epsilon = 1e-12);
        }
    }
}
