//! Options of a time law.

use crate::TimingError;

/// What the law does at an end of the path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Boundary {
    /// The path parameter rests: `du/dt = 0` while `q'(u)` is not zero.
    #[default]
    Rest,
    /// The joints rest because `q'(u) = 0` there; `du/dt` is free, up to the rate cap.
    Free,
    /// The path parameter moves as given, for example when a motion is planned again while it runs.
    /// Only at the start.
    Moving {
        /// `du/dt` (u/s), positive.
        rate: f64,
        /// `d²u/dt²` (u/s²).
        acceleration: f64,
    },
}

/// Options of a time law; the default is from rest to rest without a cap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimingOptions {
    /// How the motion starts.
    pub start: Boundary,
    /// How the motion ends.
    pub end: Boundary,
    /// Upper bound of `du/dt` (u/s).
    pub rate_cap: Option<f64>,
    /// Number of cells of the law; `None` chooses it from the duration and the path. At most forty
    /// are used for the time in which accelerations build up.
    pub cells: Option<usize>,
    /// Where `cells` is `None`: so many of the cells may be one where the law without jerk limits does not switch from
    /// one limit to another. That costs less, and up to about 0.05 % of the speed.
    pub widest: usize,
    /// Whether cells follow the accelerations of a long path too, in place of a fiftieth of its time at least, and are divided
    /// where limits are exceeded between their gridpoints. It costs about a third more, and is worth it for a law that is
    /// driven.
    pub fine: bool,
    /// Largest distance (rad) of a joint from the path between the knots of the motion.
    pub fit: f64,
    /// Relative gap of the duration at which the search stops.
    pub gap: f64,
    /// Share of every limit, below 1, that a law with a moving start leaves unused once it has moved
    /// for a fifth of its time. So another law can begin in a state of this one, although its grid is
    /// another one.
    pub reserve: f64,
}

impl Default for TimingOptions {
    fn default() -> Self {
        Self {
            start: Boundary::Rest,
            end: Boundary::Rest,
            rate_cap: None,
            cells: None,
            widest: 1,
            fine: false,
            fit: 1e-8,
            gap: 1e-3,
            reserve: 0.0,
        }
    }
}

impl TimingOptions {
    /// Checks that every number is positive and finite.
    ///
    /// # Errors
    /// [`TimingError::BadOption`] with the first that is not.
    pub fn check(&self) -> Result<(), TimingError> {
        let widest = ("widest", self.widest as f64);
        let mut rows = vec![("fit", self.fit), ("gap", self.gap), widest];
        rows.extend(self.rate_cap.map(|cap| ("rate_cap", cap)));
        rows.extend(self.cells.map(|cells| ("cells", cells as f64)));
        if let Boundary::Moving { rate, .. } = self.start {
            rows.push(("start rate", rate));
        }
        if !(0.0..1.0).contains(&self.reserve) {
            rows.push(("reserve", f64::NAN));
        }
        match rows
            .into_iter()
            .find(|(_, value)| !(*value > 0.0 && value.is_finite()))
        {
            Some((option, value)) => Err(TimingError::BadOption { option, value }),
            None => Ok(()),
        }
    }
}
