//! Motion past a rest that begins before what goes before has ended: the end of one part and the begin of the next
//! at the same time, one added to the other.
//!
//! To its rest a motion brakes with falling acceleration, and from it it goes on with rising acceleration. Where
//! the way turns back by 120 degrees or more, the two jerks together are no larger than one of them, so no limit is
//! exceeded. The way is cut off by no more than `J d^3 / 24`, with the jerk `J` and the time `d` in which both parts
//! move.

use nalgebra::{Isometry3, UnitQuaternion};

use super::span::{Span, Turn};

/// Shortest part of an overlap, s: less is rounding.
const SHORTEST: f64 = 1e-9;

/// The spans of two motions at the same time: the first ends at rest in the pose `corner` when the second, which
/// begins there at rest, takes its last step. Both take the same time and start at the time 0.
pub(super) fn overlapped(before: &[Span], after: &[Span], corner: &Isometry3<f64>) -> Vec<Span> {
    let ends = |spans: &[Span]| spans.iter().map(Span::end).collect::<Vec<_>>();
    let mut cuts = [ends(before), ends(after)].concat();
    cuts.sort_by(f64::total_cmp);
    let whole = before.last().map_or(0.0, Span::end);
    let mut spans: Vec<Span> = Vec::with_capacity(cuts.len());
    let mut from = 0.0;
    for cut in cuts {
        let to = if cut > whole - SHORTEST { whole } else { cut };
        if to - from < SHORTEST {
            continue;
        }
        let at = |spans: &[Span]| {
            let middle = 0.5 * (from + to);
            let at = spans.partition_point(|span| span.end() <= middle);
            spans.get(at).map(|span| Span {
                duration: to - from,
                ..span.part(from, to)
            })
        };
        if let Some((one, other)) = at(before).zip(at(after)) {
            spans.push(Span {
                start: from,
                ..both(one, other, corner)
            });
        }
        from = to;
    }
    spans
}

/// Two motions at the same time, seen from the pose at which the first ends and the second begins.
fn both(one: Span, other: Span, corner: &Isometry3<f64>) -> Span {
    let mut point = one.point;
    for (sum, more) in point.iter_mut().zip(other.point) {
        *sum += more;
    }
    point[0] -= corner.translation.vector;
    // `exp(a) * moved = moved * exp(inverse moved * a)`, so all turns stand behind one base.
    let moved: UnitQuaternion<f64> = corner.rotation.inverse() * other.base;
    let first = one.turns.iter().map(|turn| Turn {
        axis: moved.inverse() * turn.axis,
        angle: turn.angle,
    });
    Span {
        point,
        base: one.base * moved,
        turns: first.chain(other.turns.iter().copied()).collect(),
        ..one
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smooth::SmoothOptions;
    use crate::smooth::certificate::certify;
    use crate::smooth::exact_stop;
    use crate::{ToolLimits, ToolPoint};
    use approx::assert_relative_eq;
    use nalgebra::Vector3;

    const JERK: f64 = 100.0;

    fn limits() -> ToolLimits {
        ToolLimits {
            speed: 0.5,
            acceleration: 5.0,
            jerk: JERK,
            angular_speed: 3.0,
            angular_acceleration: 30.0,
            angular_jerk: 600.0,
        }
    }

    /// The last or the first moments of a straight leg, from the time 0 on.
    fn part(leg: &[Span], from: f64, to: f64) -> Vec<Span> {
        let parts = leg.iter().map(|span| Span {
            start: span.start.max(from) - from,
            ..span.part(from, to)
        });
        parts.filter(|span| span.duration > 0.0).collect()
    }

    /// A corner that turns back by `angle`, with 20 ms in which both legs move.
    fn corner(angle: f64) -> (Isometry3<f64>, [Vec<Span>; 2], Vec<Span>) {
        let there = Isometry3::new(Vector3::new(0.1, 0.2, 0.0), Vector3::new(0.1, 0.3, 0.0));
        let turned = |way: Vector3<f64>, turn: Vector3<f64>| {
            Isometry3::new(there.translation.vector - way * 0.1, Vector3::zeros())
                * Isometry3::rotation(turn)
        };
        let back = Vector3::new(angle.cos(), angle.sin(), 0.0);
        let [first, last] = [
            turned(Vector3::x(), Vector3::new(0.0, 0.1, 0.2)),
            turned(back, Vector3::new(0.2, 0.0, 0.1)),
        ];
        let [to, from] =
            [[first, there], [there, last]].map(|leg| exact_stop::plan(&leg, &limits()));
        let end = to.last().map_or(0.0, Span::end);
        let parts = [part(&to, end - 0.02, end), part(&from, 0.0, 0.02)];
        let spans = overlapped(&parts[0], &parts[1], &there);
        (there, parts, spans)
    }

    /// It begins and ends in the states of its parts, and does not jump between.
    #[test]
    fn it_joins_both_parts() {
        let (_, parts, spans) = corner(0.4);
        let same = |one: ToolPoint, other: ToolPoint| {
            assert_relative_eq!(one.pose, other.pose, epsilon = 1e-12);
            for k in 0..2 {
                assert_relative_eq!(one.linear[k], other.linear[k], epsilon = 1e-9);
                assert_relative_eq!(one.angular[k], other.angular[k], epsilon = 1e-9);
            }
        };
        let ends = |spans: &[Span]| {
            let (first, last) = (&spans[0], &spans[spans.len() - 1]);
            [first.at(0.0), last.at(last.duration)]
        };
        same(ends(&spans)[0], ends(&parts[0])[0]);
        same(ends(&spans)[1], ends(&parts[1])[1]);
        for pair in spans.windows(2) {
            same(pair[0].at(pair[0].duration), pair[1].at(0.0));
        }
        assert_relative_eq!(spans[spans.len() - 1].end(), 0.02, epsilon = 1e-12);
    }

    /// A way that turns back by 135 degrees is passed within all limits, and cut off by no more than said; one
    /// with a right angle exceeds the jerk.
    #[test]
    fn sharp_corners_are_passed_within_limits() {
        let options = SmoothOptions::new(1e-3, limits());
        for (angle, within) in [(0.0, true), (0.78, true), (1.6, false)] {
            let (there, _, spans) = corner(angle);
            let worst = certify(&spans, &[there, there], &options).0.worst_limit();
            assert_eq!(worst <= 1.0 + 1e-9, within, "{angle}: {worst}");
            let near = (0..=200).map(|k| {
                let time = 1e-4 * f64::from(k);
                let at = spans.partition_point(|span| span.start <= time) - 1;
                let off = spans[at].motion(time - spans[at].start)[0] - there.translation.vector;
                off.norm()
            });
            let near = near.fold(f64::INFINITY, f64::min);
            let bound = JERK * 0.02_f64.powi(3) / 24.0;
            assert!(near <= bound * (1.0 + 1e-9), "{angle}: {near} of {bound}");
        }
    }
}
