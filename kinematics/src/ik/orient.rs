//! Three rotations that turn one orientation into another, for four branches at once.

use super::six::dot;
use super::subproblems::{
    Angle, Held, Pair, TrigEquation, Vec4, angle_of, angles_of, last_turn_to, turn_to,
};
use simd::{F4, Four, Mask};
use std::f64::consts::PI;

/// What three rotations must reach: the third axis goes to `axis`, and `spin`, perpendicular to it,
/// to `spun`.
#[derive(Clone, Copy)]
pub(crate) struct AxisGoal<A: Four> {
    pub(crate) axis: Vec4<A>,
    pub(crate) spun: Vec4<A>,
    pub(crate) spin: [f64; 3],
}

/// Rotations about three axes whose product reaches the goal. If the first and third axis coincide, the first angle is held.
/// Also returns both solutions for the middle one. The sine and cosine of the last rotation may
/// have any length.
#[inline(always)]
pub(crate) fn orient<A: Four>(
    [first, middle, last]: [[f64; 3]; 3],
    goal: AxisGoal<A>,
    sign: [f64; 4],
    hold: [Held; 3],
) -> ([Angle<A>; 3], Pair<A>) {
    let AxisGoal { axis, spun, spin } = goal;
    let a = axis.0[0].build();
    let level = axis.along(first);
    let wave = TrigEquation::of(Vec4::splat(a, first), middle, Vec4::splat(a, last), level);
    // If the middle axis is perpendicular to both, the discriminant is the squared sine between
    // first axis and target; computed from their product, it is exact when small.
    let tilts = if square([first, middle, last]) {
        let across = Vec4::splat(a, first).cross(axis);
        let one = F4::splat(a, 1.0);
        wave.with_rest(across.dot(across), one, one, 1e-12)
    } else {
        wave.solve(1e-12)
    };
    let tilt = tilts.pick(sign, hold[1]);
    let tilted = Vec4::splat(a, last).turned(middle, tilt);
    let swing = turn_to(tilted, axis, first, hold[0]);
    let left = spun.turned(first, swing.back()).turned(middle, tilt.back());
    let roll = last_turn_to(Vec4::splat(a, spin), left, last, hold[2]);
    ([swing, tilt, roll], tilts)
}

/// Whether the middle axis is perpendicular to both others.
#[inline(always)]
fn square([first, middle, last]: [[f64; 3]; 3]) -> bool {
    dot(first, middle).abs() < 1e-12 && dot(middle, last).abs() < 1e-12
}

/// Both solutions of [`orient`] as angles (rad), each with whether it is real.
#[inline(always)]
pub(crate) fn orient_both<A: Four>(
    axes: [[f64; 3]; 3],
    goal: AxisGoal<A>,
    hold: [Held; 3],
) -> [([F4<A>; 3], Mask<A>); 2] {
    let (turns, tilts) = orient(axes, goal, [1.0; 4], hold);
    let first = angles_of(turns);
    if square(axes) {
        // Half a turn of the outer two and the middle one mirrored is the same.
        let half = F4::splat(first[0].build(), PI);
        let tilt = angle_of(tilts.pick([-1.0; 4], hold[1]));
        let swing = first[0] - half.signed(first[0]);
        let second = [swing, tilt, first[2] - half.signed(first[2])];
        return [(first, tilts.real), (second, tilts.real)];
    }
    let (turns, other) = orient(axes, goal, [-1.0; 4], hold);
    [(first, tilts.real), (angles_of(turns), other.real)]
}
