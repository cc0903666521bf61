//! State-to-state moves, smooth paths through tolerance balls, path timing.

pub mod limits;
pub mod line;
pub mod path;
