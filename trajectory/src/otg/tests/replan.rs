//! Planning again on the way.
