//! State to state: the fastest jerk-limited move between two states of motion.
//!
//! [`Otg::plan`] takes `N` joints from any position, velocity and acceleration to any other, under
//! limits on velocity, acceleration and jerk, and returns a [`Motion`]: plain data of fixed size,
//! sampled at any time. Neither planning nor sampling allocates, so both may run in every control
//! cycle; [`Running`] does that, and the arrival never becomes later by it. [`Audit`] checks a
//! motion from its pieces alone.
//!
//! ```
//! use nalgebra::vector;
//! use trajectory::otg::{Limits, Options, Otg, State};
//!
//! let limits = Limits::symmetric(vector![2.0, 2.0], vector![8.0, 8.0], vector![80.0, 80.0]);
//! let start = State { velocity: vector![0.5, 0.0], ..State::rest(vector![0.0, 1.0]) };
//! let target = State::rest(vector![1.0, -1.0]);
//! let motion = Otg::plan(&start, &target, &limits, &Options::default())?;
//! assert_eq!(motion.sample(0.0).velocity, start.velocity);
//! assert_eq!(motion.sample(motion.duration()).position, target.position);
//! # Ok::<(), trajectory::otg::OtgError>(())
//! ```
//!
//! # How it works
//!
//! Each joint is first put into units in which its acceleration and jerk limits are 1 (`joint`). A
//! start that breaks limits is braked (`brake`). For a given duration the displacements that a
//! joint can reach form an interval; both its ends have a closed form (`extremal`). So the joint
//! can arrive after that duration exactly if its distance lies in the interval. Then a weighted
//! mean of the two extreme profiles keeps every limit and ends at the target (`axis`): no root
//! finding is needed for a given duration. The search for the shortest common duration (`duration`)
//! starts from that of the slowest joint; every joint raises it to its next possible duration until
//! all agree. Only there roots are found, by Newton's method between bounds. A joint whose mean
//! profile would leave its position range gets the profile with one constant velocity (`direct`).
//!
//! # Source
//! The closed forms are derived in `extremal` from Pontryagin's principle; problem and benchmark
//! are those of L. Berscheid, T. Kröger, "Jerk-limited Real-time Trajectory Generation with
//! Arbitrary Target States", RSS 2021.

mod audit;
mod axis;
mod brake;
mod check;
mod direct;
mod duration;
mod error;
mod extent;
mod extremal;
mod joint;
mod limits;
mod line;
mod motion;
mod options;
mod plan;
mod problem;
mod profile;
mod running;
mod state;
mod velocity_problem;

pub use audit::Audit;
pub use error::OtgError;
pub use limits::Limits;
pub use motion::Motion;
pub use options::{Interface, Options, Synchronisation};
pub use problem::Problem;
pub use running::Running;
pub use state::State;

/// Plans moves from state to state.
#[derive(Clone, Copy, Debug)]
pub struct Otg;

impl Otg {
    /// Plans the fastest move from `start` to `target` within `limits` (`N` joints, SI), of the
    /// kind that `options` ask for. It does not allocate.
    ///
    /// Where jerk is not limited, accelerations of start and target are not used. A start beyond
    /// limits is braked first, as fast as possible. Positions are kept between their limits, which
    /// are widened to contain the start.
    ///
    /// To plan again in every cycle from the present state, use [`Running`]: it keeps the rest of
    /// the running move as a candidate. Without it, rounding of the state makes three of 100 000
    /// such plans arrive later than the move they replace.
    ///
    /// # Errors
    /// [`OtgError::NotFinite`], [`OtgError::BadLimit`] or [`OtgError::BadOption`] for unusable
    /// numbers; [`OtgError::TargetBeyondLimit`] for a target that breaks a limit;
    /// [`OtgError::PositionLimit`] if no profile of the fastest duration stays inside the position
    /// limits; [`OtgError::NotStraight`] if a straight line was asked for and does not exist;
    /// [`OtgError::OutOfRange`] if durations leave the range of floating point.
    pub fn plan<const N: usize>(
        start: &State<N>,
        target: &State<N>,
        limits: &Limits<N>,
        options: &Options<N>,
    ) -> Result<Motion<N>, OtgError> {
        plan::plan(start, target, limits, options)
    }
}
