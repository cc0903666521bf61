//! Which limit decides the speed of a move, and when.

use serde::Serialize;
use trajectory::timing::Limit;

/// A limit used to this share is active.
pub(super) const ACTIVE: f64 = 0.98;

/// An interval of the move in which one limit is active.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ActiveLimit {
    /// Name of the limit: `tool speed`, `velocity of elbow`, ...
    pub limit: String,
    /// From when after the start of the move, s.
    pub start_s: f64,
    /// Until when, s.
    pub end_s: f64,
}

/// The name of a limit for display, with the name of its joint.
pub(super) fn name(limit: Limit, joints: &[String]) -> String {
    let named = |quantity: &str, joint: usize| match joints.get(joint) {
        Some(name) => format!("{quantity} of {name}"),
        None => limit.to_string(),
    };
    match limit {
        Limit::JointVelocity(joint) => named("velocity", joint),
        Limit::JointAcceleration(joint) => named("acceleration", joint),
        Limit::JointJerk(joint) => named("jerk", joint),
        other => other.to_string(),
    }
}
