//! The claims of a certificate that a planned motion may break.

use thiserror::Error;

/// Which claim failed, with its numbers. Pieces are counted from 0, poses from 1.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// A joint position jumps between two pieces, or from the start.
    #[error("piece {piece} begins {jump:.1e} away from the position of the arm")]
    Position {
        /// The piece that begins elsewhere.
        piece: usize,
        /// Largest jump of a joint, rad or m.
        jump: f64,
    },
    /// The velocity of a joint jumps between two pieces, or from rest.
    #[error("the velocity jumps by {jump:.1e} at piece {piece}")]
    Velocity {
        /// The piece that begins with another velocity.
        piece: usize,
        /// Largest jump of a joint, rad/s or m/s.
        jump: f64,
    },
    /// The motion does not end at rest.
    #[error("it ends at a velocity of {speed:.1e}")]
    NotAtRest {
        /// Largest velocity of a joint, rad/s or m/s.
        speed: f64,
    },
    /// A limit may be exceeded.
    #[error("{limit} is {ratio:.6} times its limit at {time_s:.4} s")]
    Limit {
        /// Name of the limit.
        limit: String,
        /// Bound of the quantity over its limit.
        ratio: f64,
        /// When, s.
        time_s: f64,
    },
    /// An intermediate pose is not passed within its tolerances after the one before it.
    #[error(
        "pose {pose} is not passed in order within {:.4} mm and {tolerance_rad:.4} rad: {:.4} mm and {angle_rad:.4} rad at {time_s:.4} s",
        .tolerance_m * 1e3, .deviation_m * 1e3
    )]
    Pass {
        /// Which pose.
        pose: usize,
        /// Distance at the pass, m.
        deviation_m: f64,
        /// Tolerance, m.
        tolerance_m: f64,
        /// Angle at the pass, rad.
        angle_rad: f64,
        /// Largest angle allowed, rad.
        tolerance_rad: f64,
        /// When, s.
        time_s: f64,
    },
    /// The number of passes is not the number of intermediate poses.
    #[error("{passed} of {poses} intermediate poses are passed")]
    Passes {
        /// Intermediate poses of the command.
        poses: usize,
        /// Passes found.
        passed: usize,
    },
    /// The controlled point leaves the legs between the poses by more than the tolerance.
    #[error("it is {:.4} mm from the legs, {:.4} mm are allowed", .off_m * 1e3, .allowed_m * 1e3)]
    Corridor {
        /// Bound of the distance, m.
        off_m: f64,
        /// Largest distance allowed, m.
        allowed_m: f64,
    },
    /// A straight line is not straight.
    #[error("the straight line bends by {:.5} mm, {:.5} mm are allowed", .off_m * 1e3, .allowed_m * 1e3)]
    Straightness {
        /// Bound of the distance from the line, m.
        off_m: f64,
        /// Largest distance allowed, m.
        allowed_m: f64,
    },
    /// A screw leaves its helix.
    #[error("the helix is left by {:.5} mm, {:.5} mm are allowed", .off_m * 1e3, .allowed_m * 1e3)]
    Helix {
        /// Largest distance found, m.
        off_m: f64,
        /// Largest distance allowed, m.
        allowed_m: f64,
    },
    /// The motion does not end in the last pose.
    #[error("it ends {:.6} mm and {angle_rad:.1e} rad off", .off_m * 1e3)]
    End {
        /// Distance from the last pose, m.
        off_m: f64,
        /// Angle from the last pose, rad.
        angle_rad: f64,
    },
    /// A joint goes beyond its range.
    #[error("a joint goes {beyond:.3e} beyond its position limit")]
    Range {
        /// How far, rad or m.
        beyond: f64,
    },
}
