//! How far and how long a search goes.

/// How far and how long the iteration goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Most Newton steps.
    pub(crate) steps: usize,
    /// Steps after which an iterate that still needs widened bounds is given up.
    pub(crate) search: usize,
    /// A start in motion that breaks limits is made feasible by widening them
    /// with `z`, over this many times the spans that the look-ahead needs;
    /// `None`: by narrowing limits from where the start is.
    pub(crate) spread: Option<f64>,
    /// Relative gap of `z` at which to end; the time is off by a third of it.
    pub(crate) gap: f64,
    /// Longest useful time (s): an iterate is given up if its optimum is above it.
    pub(crate) most: f64,
    /// Whether a search between two ends in motion goes on where they hold it.
    pub(crate) onward: bool,
    /// By how much a pose may be seen beside its vertex at the end, in radii of its ball.
    pub(crate) aimed: f64,
}
