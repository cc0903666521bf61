//! Where a controller that lost commands has gone by itself.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use driver_franka::{JOINTS, Taken};

const PERIOD: f64 = 1e-3;

/// A motion at a cycle (rad): each joint swings, the first one with nearly 10 rad/s2.
fn at(cycle: usize) -> [f64; JOINTS] {
    core::array::from_fn(|joint| {
        let (place, t) = (joint as f64, cycle as f64 * PERIOD);
        2.0 - 0.4 * place + (1.1 - 0.1 * place) * (3.0 * t + place).sin()
    })
}

/// What a controller makes of the last three commands: constant acceleration, so many cycles.
fn extrapolated(cycle: usize, cycles: usize) -> Vec<[f64; JOINTS]> {
    let mut all = vec![at(cycle - 2), at(cycle - 1), at(cycle)];
    for _ in 0..cycles {
        let [older, last, now] = [3, 2, 1].map(|back| all[all.len() - back]);
        all.push(core::array::from_fn(|joint| {
            3.0 * now[joint] - 3.0 * last[joint] + older[joint]
        }));
    }
    all.split_off(3)
}

/// What a state shows: single precision.
fn shown(position: [f64; JOINTS]) -> [f64; JOINTS] {
    position.map(|value| f64::from(value as f32))
}

/// However many cycles were missed, and whether or not commands after the last one that was taken were on their way:
/// the next command after the place that is found is a motion without a step. With the positions of the
/// states alone the step is up to 0.12 rad/s2.
#[test]
fn the_next_command_is_no_step() {
    let mut worst = [0.0_f64; 2];
    for start in (3..2000).step_by(7) {
        for missed in 1..=8 {
            for lost in 0..3 {
                let mut taken = Taken::default();
                (0..=start + lost).for_each(|cycle| taken.push(at(cycle)));
                let way = extrapolated(start, missed);
                let seen = shown(way[missed - 1]);
                let found = taken.went_on(&seen, PERIOD).unwrap();
                for joint in 0..JOINTS {
                    let before = if missed > 1 {
                        way[missed - 2]
                    } else {
                        at(start)
                    };
                    let older = if missed > 2 {
                        way[missed - 3]
                    } else {
                        at(start + missed - 2)
                    };
                    // The next command at constant acceleration, as its controller would difference it.
                    let next = |position: f64| {
                        let found = &found[joint];
                        position
                            + found.velocity * PERIOD
                            + found.acceleration * PERIOD * PERIOD / 2.0
                    };
                    let last = way[missed - 1][joint];
                    let now = last - 2.0 * before[joint] + older[joint];
                    let step = |next: f64| {
                        ((next - 2.0 * last + before[joint]) - now).abs() / (PERIOD * PERIOD)
                    };
                    worst[0] = worst[0].max(step(next(found[joint].position)));
                    worst[1] = worst[1].max(step(next(seen[joint])));
                }
            }
        }
    }
    println!(
        "steps of {:.6} rad/s2; with the states alone {:.3}",
        worst[0], worst[1]
    );
    assert!(worst[0] < 1e-3 && worst[1] > 0.1, "{worst:?}");
}

/// What no command leads to is not explained.
#[test]
fn another_place_is_not_found() {
    let mut taken = Taken::default();
    (0..20).for_each(|cycle| taken.push(at(cycle)));
    let mut elsewhere = at(19);
    elsewhere[3] += 0.01;
    assert!(taken.went_on(&elsewhere, PERIOD).is_none());
    assert!(!taken.knows(&elsewhere) && taken.knows(&at(19)));
}

/// An answer that is missing is seen in the next state, where single precision shows it; an older state is no missing
/// answer.
#[test]
fn a_missing_answer_is_seen() {
    // A swing with 1350 rad/s3.
    let quick = |cycle: usize| -> [f64; JOINTS] {
        core::array::from_fn(|joint| {
            let (place, t) = (joint as f64, cycle as f64 * PERIOD);
            1.0 + 0.05 * (30.0 * t + place).sin()
        })
    };
    for start in (20..2000).step_by(7) {
        let mut taken = Taken::default();
        (0..=start + 1).for_each(|cycle| taken.push(quick(cycle)));
        let [older, last, now] = [2, 1, 0].map(|back| quick(start - back));
        let missing = core::array::from_fn(|joint| 3.0 * (now[joint] - last[joint]) + older[joint]);
        assert!(taken.misses(&shown(missing), PERIOD), "{start}");
        for cycle in start - 3..=start + 1 {
            assert!(!taken.misses(&shown(quick(cycle)), PERIOD), "{cycle}");
        }
    }
}
