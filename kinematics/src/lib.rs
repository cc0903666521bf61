//! Forward and inverse kinematics of serial arms from URDF.
//!
//! The crate never moves anything, keeps no global state and touches no file:
//! text in, numbers out. All quantities are SI (m, rad); every pose is named by
//! its frames, so `base_from_flange` maps flange coordinates to base ones.
//!
//! | module | what |
//! |---|---|
//! | [`urdf`] | reads a URDF, checks it, finds the chain of joints from root to tip |
//! | [`chain`] | [`Chain`]: flat data of a serial arm; forward kinematics, Jacobian and its derivative |
//! | `dynamics` | [`Dynamics`]: the efforts of the joints that a motion needs |
//! | [`ik`] | [`Solver`]: joint positions for a pose; all branches, or why there is none |
//! | [`follow`](mod@follow) | joint path of a whole tool path, with derivatives, or where it breaks |
//! | `motion` | the tool's motion when the joints move: derivatives, and bounds of them |
//! | [`measure`] | manipulability, singular values, condition number |
//! | [`reach`] | how far the arm reaches |

pub mod chain;
mod dynamics;
pub mod follow;
pub mod ik;
mod inertia;
mod links;
pub mod measure;
mod motion;
pub mod reach;
pub mod urdf;

pub use chain::Chain;
pub use dynamics::Dynamics;
pub use follow::{FollowCause, FollowError, FollowOptions, FollowPoint, TwistPoint, follow};
pub use ik::{Branches, Goal, IkFailure, IkReport, Solution, Solver};
pub use inertia::Inertia;
pub use motion::{ToolGrowth, ToolMotion};
pub use urdf::{Model, UrdfError};
