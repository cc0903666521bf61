//! State-to-state moves, smooth paths through tolerance balls, path timing.
