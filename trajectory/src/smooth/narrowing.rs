//! Bounds that are narrowed by what a motion exceeded.

use super::certificate::{Certificate, Peak};
use super::crossing::Crossing;
use super::options::SmoothOptions;
use super::shares::Shares;
use crate::{ToolLimits, ToolPoint};

/// Factor on what the ends of a motion have of a limit, below which no limit is narrowed.
const AT_END: f64 = 1.0 + 1e-3;

/// The greatest ratio of a quantity to its bound.
pub(super) fn broken(certificate: &Certificate, crossings: &[Crossing]) -> f64 {
    let bounds = [certificate.corridor.ratio, certificate.worst_limit()];
    bounds
        .into_iter()
        .chain(crossings.iter().flat_map(Crossing::in_tolerances))
        .fold(0.0, f64::max)
}

/// Narrows the options by what a motion exceeded.
pub(super) fn narrow(
    options: &mut SmoothOptions,
    certificate: &Certificate,
    crossings: &[Crossing],
    coupled: bool,
) {
    if certificate.corridor.ratio > 1.0 {
        options.corridor = Some(options.corridor() * beside(certificate.corridor.ratio));
    }
    let (mut far, mut turned) = (1.0_f64, 1.0_f64);
    for crossing in crossings.iter().filter(|crossing| !crossing.holds()) {
        let [place, turn] = crossing.in_tolerances();
        (far, turned) = (far.max(place), turned.max(turn));
    }
    if turned > 1.0 && coupled {
        options.angular_tolerance = Some(options.angular_tolerance() * within(turned));
    } else {
        // An orientation that follows the path cuts corners as the path does.
        far = far.max(turned);
    }
    options.tolerance *= within(far);
    let over = certificate.worst_limit();
    if over > 1.0 {
        let share = 0.99 / over.min(4.0);
        options.limits = options.limits.scaled(share, share);
    }
}

/// The share of a tolerance within which a pose is searched for that was missed by so many of them.
fn within(missed: f64) -> f64 {
    if missed > 1.0 {
        0.9 / missed.min(10.0)
    } else {
        1.0
    }
}

/// The share of a corridor within which a motion is searched for that was outside of it by a factor.
fn beside(outside: f64) -> f64 {
    if outside > 1.0 {
        0.98 / outside.min(4.0)
    } else {
        1.0
    }
}

/// Narrows the corridor along the legs where a motion leaves it, and along no others; `outside` is its distance from each leg over
/// the half width, by the pose at the end of the leg.
pub(super) fn narrow_legs(shares: &mut Shares, outside: &[f64]) {
    for (to, outside) in outside.iter().enumerate() {
        if *outside > 1.0 {
            shares.narrow_leg(to, beside(*outside));
        }
    }
}

/// Narrows the balls of the poses that a motion misses, and no others: less of the tolerance of all poses would make it slower
/// everywhere.
pub(super) fn narrow_missed(shares: &mut Shares, crossings: &[Crossing], coupled: bool) {
    let missed = crossings.iter().enumerate();
    for (i, crossing) in missed.filter(|(_, crossing)| !crossing.holds()) {
        let [far, turned] = crossing.in_tolerances();
        let over = if coupled {
            [far, turned]
        } else {
            // An orientation that follows the path cuts corners as the path does.
            [far.max(turned), 1.0]
        };
        shares.narrow(i, over.map(within));
    }
}

/// The limits of a motion between two states, without a share of those that it exceeded. None is below what the
/// states have: no motion would keep it.
pub(super) fn between(
    limits: &ToolLimits,
    certificate: &Certificate,
    ends: [&ToolPoint; 2],
) -> ToolLimits {
    let lower = |limit: f64, peak: Peak, rate: fn(&ToolPoint) -> f64| {
        let least = ends.into_iter().map(rate).fold(0.0, f64::max);
        if peak.ratio > 1.0 {
            (limit * 0.99 / peak.ratio.min(4.0)).max(limit.min(AT_END * least))
        } else {
            limit
        }
    };
    ToolLimits {
        speed: lower(limits.speed, certificate.speed, |end| end.linear[0].norm()),
        acceleration: lower(limits.acceleration, certificate.acceleration, |end| {
            end.linear[1].norm()
        }),
        jerk: lower(limits.jerk, certificate.jerk, |end| end.linear[2].norm()),
        angular_speed: lower(limits.angular_speed, certificate.angular_speed, |end| {
            end.angular[0].norm()
        }),
        angular_acceleration: lower(
            limits.angular_acceleration,
            certificate.angular_acceleration,
            |end| end.angular[1].norm(),
        ),
        angular_jerk: lower(limits.angular_jerk, certificate.angular_jerk, |end| {
            end.angular[2].norm()
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pass that is off by so many tolerances.
    fn pass(far: f64, turned: f64) -> Crossing {
        Crossing {
            index: 1,
            time: 0.0,
            deviation: 1e-3 * far,
            tolerance: 1e-3,
            angle: 1e-2 * turned,
            angular_tolerance: 1e-2,
        }
    }

    /// Only the corridor along legs that are left is narrowed, twice if they are left twice.
    #[test]
    fn only_the_corridor_that_is_left_is_narrowed() {
        let outside = [0.0, 0.99, 1.4, 1.0, 40.0];
        for times in [1, 2] {
            let mut shares = Shares::default();
            for _ in 0..times {
                narrow_legs(&mut shares, &outside);
            }
            for (to, expected) in [1.0_f64, 1.0, 0.7, 1.0, 0.245, 1.0].into_iter().enumerate() {
                let got = shares.leg(to, 0);
                assert!((got - expected.powi(times)).abs() < 1e-12, "{to}: {got}");
            }
        }
    }

    /// Only the balls of poses that are missed are narrowed, twice if they are missed twice; where an orientation follows, those of
    /// the place.
    #[test]
    fn only_what_is_missed_is_narrowed() {
        let passes = [pass(0.9, 0.2), pass(0.5, 2.0), pass(1.5, 20.0)];
        let check = |coupled: bool, times: i32, expected: [[f64; 2]; 4]| {
            let mut shares = Shares::default();
            for _ in 0..times {
                narrow_missed(&mut shares, &passes, coupled);
            }
            for (i, expected) in expected.iter().enumerate() {
                for (part, expected) in expected.iter().enumerate() {
                    let got = shares.ball(i, part);
                    assert!(
                        (got - expected.powi(times)).abs() < 1e-12,
                        "{i} {part}: {got}"
                    );
                }
            }
        };
        for times in [1, 2] {
            check(
                true,
                times,
                [[1.0, 1.0], [1.0, 0.45], [0.6, 0.09], [1.0, 1.0]],
            );
            check(
                false,
                times,
                [[1.0, 1.0], [0.45, 1.0], [0.09, 1.0], [1.0, 1.0]],
            );
        }
    }
}
