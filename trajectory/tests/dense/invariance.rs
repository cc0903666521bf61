//! The same list laid elsewhere, reversed, in other units, with further poses on its legs, with a little noise, or
//! with more tolerance: what may change of the time of its motion.
//!
//! `CANTER_LAW_LISTS=0..1000` says which random lists the ignored tests take, besides both suites:
//! `cargo nextest run --release --workspace --run-ignored only --no-capture -E 'test(over_many_lists)'`.

use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use trajectory::smooth::{Method, SmoothOptions, SmoothPlan, angular_tolerance, plan};
use trajectory::{ToolCurve, ToolLimits};

use crate::lists::{self, Random, suite};
use crate::sparse;

/// A list with a name, a tolerance and limits.
#[derive(Clone, Debug)]
struct List {
    name: String,
    poses: Vec<Isometry3<f64>>,
    tolerance: f64,
    angular_tolerance: f64,
    limits: ToolLimits,
}

impl List {
    fn new(name: &str, poses: Vec<Isometry3<f64>>, tolerance: f64) -> Self {
        Self {
            name: name.to_owned(),
            poses,
            tolerance,
            angular_tolerance: angular_tolerance(tolerance),
            limits: lists::limits(),
        }
    }

    /// The same within another tolerance (m), and the angular one that goes with it.
    fn within(&self, tolerance: f64) -> Self {
        Self {
            tolerance,
            angular_tolerance: angular_tolerance(tolerance),
            ..self.clone()
        }
    }

    /// Its motion, which is certified.
    fn plan(&self) -> SmoothPlan {
        let mut options = SmoothOptions::new(self.tolerance, self.limits);
        options.angular_tolerance = Some(self.angular_tolerance);
        let plan = plan(&self.poses, &options).unwrap();
        assert!(plan.certificate().holds(), "{}", self.name);
        plan
    }

    /// Duration of its motion, s.
    fn time(&self) -> f64 {
        self.plan().duration()
    }
}

/// The dense suite.
fn dense() -> impl Iterator<Item = List> {
    let lists = suite().into_iter();
    lists.map(|case| List::new(case.name, case.poses, case.tolerance))
}

/// Both suites.
fn suites() -> impl Iterator<Item = List> {
    let cases = sparse::cases().into_iter();
    dense().chain(cases.map(|(name, poses, tolerance, _)| List::new(name, poses, tolerance)))
}

/// Random lists of up to `most` poses, every other one with limits of rotation.
fn random(seeds: Range<u64>, most: f64) -> impl Iterator<Item = List> {
    seeds.map(move |seed| {
        let (poses, tolerance) = lists::random(seed, most);
        let mut list = List::new(&format!("random {seed}"), poses, tolerance);
        if seed % 2 == 1 {
            list.limits = lists::turning_limits();
        }
        list
    })
}

/// Both suites, and ten random lists.
fn all() -> impl Iterator<Item = List> {
    suites().chain(random(0..10, 600.0))
}

/// Both suites, and the random lists that are asked for, of up to `CANTER_LAW_POSES` (400) poses; only those
/// whose names contain `CANTER_LAW_NAME`.
fn many() -> impl Iterator<Item = List> {
    let given = |name, otherwise: &str| std::env::var(name).unwrap_or(otherwise.to_owned());
    let seeds = given("CANTER_LAW_LISTS", "0..1000");
    let (from, to) = seeds.split_once("..").unwrap();
    let most = given("CANTER_LAW_POSES", "400").parse().unwrap();
    let random = random(from.parse().unwrap()..to.parse().unwrap(), most);
    let name = given("CANTER_LAW_NAME", "");
    suites()
        .chain(random)
        .filter(move |list| list.name.contains(&name))
}

/// Laid elsewhere.
fn moved(list: &List, random: &mut Random) -> List {
    let frame = Isometry3::new(random.vector(1.0), random.vector(3.0));
    List {
        poses: list.poses.iter().map(|pose| frame * pose).collect(),
        ..list.clone()
    }
}

/// From its end to its start.
fn reversed(list: &List, _: &mut Random) -> List {
    List {
        poses: list.poses.iter().rev().copied().collect(),
        ..list.clone()
    }
}

/// In a unit of length that is 25.4 times as small.
fn in_other_units(list: &List, _: &mut Random) -> List {
    let scale = 25.4;
    let mut other = list.clone();
    for pose in &mut other.poses {
        pose.translation.vector *= scale;
    }
    other.tolerance *= scale;
    let limits = &mut other.limits;
    for limit in [
        &mut limits.speed,
        &mut limits.acceleration,
        &mut limits.jerk,
    ] {
        *limit *= scale;
    }
    other
}

/// With a pose in the middle of each leg.
fn split(list: &List, _: &mut Random) -> List {
    let mut poses = vec![list.poses[0]];
    for pair in list.poses.windows(2) {
        let middle = pair[0]
            .translation
            .vector
            .lerp(&pair[1].translation.vector, 0.5);
        let rotation = pair[0].rotation.slerp(&pair[1].rotation, 0.5);
        poses.push(Isometry3::from_parts(Translation3::from(middle), rotation));
        poses.push(pair[1]);
    }
    List {
        poses,
        ..list.clone()
    }
}

/// With noise of 1 % of the tolerance on the poses between the ends.
fn noisy(list: &List, random: &mut Random) -> List {
    let mut noisy = list.clone();
    let last = noisy.poses.len() - 1;
    for pose in &mut noisy.poses[1..last] {
        pose.translation.vector += random.vector(0.01 * list.tolerance / 3.0_f64.sqrt());
    }
    noisy
}

/// With the first pose off by as little as an arm is off where it rests: a list that closes is off at one end.
fn off_at_its_start(list: &List, random: &mut Random) -> List {
    let mut off = list.clone();
    let size = 10.0_f64.powf(random.between(-14.0, -10.0));
    let turn = UnitQuaternion::from_scaled_axis(random.vector(size));
    off.poses[0].translation.vector += random.vector(size);
    off.poses[0].rotation *= turn;
    off
}

/// What may change of a time: any difference of a share, or only a longer one.
#[derive(Clone, Copy, Debug)]
enum Bound {
    Change(f64),
    Longer(f64),
}

/// A function of each list, on all processors, in the order of the lists.
fn on_all<R: Send>(lists: &[List], run: impl Fn(&List) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            let Some(list) = lists.get(k) else {
                return done;
            };
            done.push((k, run(list)));
        }
    };
    let count = std::thread::available_parallelism().map_or(1, usize::from);
    let mut all: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..count.min(lists.len()))
            .map(|_| scope.spawn(work))
            .collect();
        let joined = threads.into_iter().map(|thread| thread.join().unwrap());
        joined.flatten().collect()
    });
    all.sort_by_key(|(k, _)| *k);
    all.into_iter().map(|(_, result)| result).collect()
}

/// The lists whose time changes by more than a bound, with the ratio; prints what was looked at, each that is broken, and
/// the worst.
fn broken(
    lists: impl Iterator<Item = List>,
    change: fn(&List, &mut Random) -> List,
    bound: Bound,
) -> Vec<String> {
    let lists: Vec<_> = lists.collect();
    let ratio = |list: &List| {
        // The same for a list whichever others there are.
        let seed = list
            .name
            .bytes()
            .fold(5, |sum, byte| 31 * (sum % 997) + u64::from(byte));
        change(list, &mut Random::new(seed)).time() / list.time()
    };
    let ratios = on_all(&lists, ratio);
    let far = |ratio: f64| match bound {
        Bound::Change(_) => (ratio - 1.0).abs(),
        Bound::Longer(_) => ratio - 1.0,
    };
    let (Bound::Change(share) | Bound::Longer(share)) = bound;
    let (mut worst, mut broken) = ((0.0, String::from("none")), Vec::new());
    for (list, ratio) in lists.iter().zip(ratios) {
        let text = format!("{} {ratio}", list.name);
        if far(ratio) > worst.0 {
            worst = (far(ratio), text.clone());
        }
        if far(ratio) > share {
            println!("broken: {text}");
            broken.push(text);
        }
    }
    println!(
        "pairs looked at: {}, broken ({bound:?}): {}, the worst: {}",
        lists.len(),
        broken.len(),
        worst.1
    );
    broken
}

/// By how much the time of the same list may change that is written in another way.
const SAME: Bound = Bound::Change(1e-6);
/// By how much poses on its legs may change it.
const SPLIT: Bound = Bound::Change(0.01);
/// What noise may cost.
const NOISY: Bound = Bound::Longer(0.01);

#[test]
fn rigid_motion_changes_nothing() {
    assert_eq!(broken(all(), moved, SAME), [""; 0]);
}

#[test]
fn reversal_changes_nothing() {
    assert_eq!(broken(all(), reversed, SAME), [""; 0]);
}

/// Before, a clover that closes took 2.55 in place of 1.51 s where its start was off by 1e-13 m, after 8 s of planning.
#[test]
fn a_start_that_is_off_changes_little() {
    let turning = |list| List {
        limits: lists::turning_limits(),
        ..list
    };
    assert_eq!(
        broken(dense().map(turning), off_at_its_start, SAME),
        [""; 0]
    );
    // List 7 has two motions 4 % apart, and the last bits say which one is found (decision 0180).
    let (seven, others): (Vec<_>, Vec<_>) = all().partition(|list| list.name == "random 7");
    assert_eq!(broken(others.into_iter(), off_at_its_start, NOISY), [""; 0]);
    let bound = Bound::Longer(0.05);
    assert_eq!(broken(seven.into_iter(), off_at_its_start, bound), [""; 0]);
}

/// A list that closes, but for what its start is off, begins and ends where it was given, to the last digits.
#[test]
fn ends_that_are_off_are_met() {
    let lists: Vec<_> = dense().filter(|list| list.name == "circle360").collect();
    for size in [1e-14, 1e-13, 1e-11, 1e-9, 1e-7] {
        let mut poses = lists[0].poses.clone();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.5, 0.7, -0.5) * size);
        poses[0].translation.vector += Vector3::new(-0.6, 0.8, 0.2) * size;
        poses[0].rotation *= turn;
        let plan = plan(&poses, &SmoothOptions::new(1e-4, lists::turning_limits())).unwrap();
        assert!(plan.certificate().holds(), "{size}");
        let ends = [
            (0.0, poses[0]),
            (plan.duration() * (1.0 - 1e-15), poses[poses.len() - 1]),
        ];
        for (time, pose) in ends {
            let there = plan.at(time);
            let off = (there.pose.translation.vector - pose.translation.vector).norm();
            let turned = (there.pose.rotation.inverse() * pose.rotation)
                .scaled_axis()
                .norm();
            assert!(
                off < 1e-15 && turned < 1e-13,
                "{size}: {off} m, {turned} rad"
            );
            let [velocity, acceleration, _] = there.linear;
            assert!(
                velocity.norm() < 1e-12 && acceleration.norm() < 1e-10,
                "{size}: {there:?}"
            );
        }
    }
}

#[test]
fn other_units_change_nothing() {
    assert_eq!(broken(all(), in_other_units, SAME), [""; 0]);
}

/// Lists of 100 to 400 poses at which laws were broken: noise cost up to 7 %, and poses on the legs up to 22 %; their
/// tolerances are 10 to 80 micrometres. List 2022 breaks them still (1.29 s; 1.38 s with poses on its legs, 1.36 s with noise;
/// 1.93 s before): a motion that the search finds misses such a pose.
fn hard() -> impl Iterator<Item = List> {
    [2000, 2005, 2006, 2011, 2018, 2019]
        .into_iter()
        .flat_map(|seed| random(seed..seed + 1, 400.0))
}

/// Lists of 100 to 300 poses whose motions miss poses on the legs by the angle: with such poses they took up to 28 % longer,
/// after five times as much planning. List 3025 breaks the law still: 1.653 s, and 1.762 s with poses on its legs, which most
/// motions miss that a search finds; before its angular rates were bounded closely it took 1.853 and 1.864 s.
fn turning() -> impl Iterator<Item = List> {
    [3004, 3022, 3025, 3042]
        .into_iter()
        .flat_map(|seed| random(seed..seed + 1, 300.0))
}

/// A list is planned through its corners, so poses on its legs change nothing, but where one of the motions misses
/// such a pose: orientations are turned to it then.
#[test]
fn splitting_legs_changes_nothing() {
    assert_eq!(broken(suites(), split, SAME), [""; 0]);
    let (missed, others): (Vec<_>, Vec<_>) = turning().partition(|list| list.name == "random 3025");
    assert_eq!(broken(others.into_iter(), split, SPLIT), [""; 0]);
    assert_eq!(broken(hard(), split, SPLIT), [""; 0]);
    for list in missed {
        let other = split(&list, &mut Random::new(1));
        let times = [list.time(), other.time()];
        assert!(times[0] < 1.67 && times[1] < 1.78, "{times:?}");
    }
}

#[test]
fn little_noise_costs_little() {
    // List 2006 takes 1.74 s, with noise 1.80 s, as another of its motions is found; it took 1.89 s (decision 0186).
    let (chaotic, others): (Vec<_>, Vec<_>) = hard().partition(|list| list.name == "random 2006");
    let others = suites().chain(others);
    assert_eq!(broken(others, noisy, NOISY), [""; 0]);
    let bound = Bound::Longer(0.05);
    assert_eq!(broken(chaotic.into_iter(), noisy, bound), [""; 0]);
}

/// Lists whose tolerance shows each corner took 1.38 to 1.68 times as long: their searches ended after too few steps with
/// knots too far apart, or missed poses by the angle only (list 306). Ended where they were, not going on from the fastest
/// law along their way, lists 2006, 2022 and 402 took 2.37, 1.40 and 2.81 s. Times (s) that they may take.
#[test]
fn a_search_from_a_motion_finds_a_faster_one() {
    for (seed, most) in [(2006, 1.95), (2022, 1.35), (306, 1.65), (402, 2.1)] {
        let list = random(seed..seed + 1, 400.0).next().unwrap();
        let time = list.time();
        assert!(time < most, "{seed}: {time} s");
    }
}

/// Where balls overlap, the first approach to a pose depends on the direction. This list is planned from its other end; its
/// searches looked at the passes from there only, so a motion of 1.28 s was the fastest one whose passes held.
#[test]
fn a_search_looks_at_passes_as_they_are_made() {
    let list = random(420..421, 400.0).next().unwrap();
    let time = list.within(128.0_f64.sqrt() * list.tolerance).time();
    assert!(time < 1.15, "{time} s");
}

/// Tolerances (m), each a factor above the one before, with the times of the motions (s).
fn sweep(list: &List, count: i32, factor: f64) -> Vec<(f64, f64)> {
    let tolerances = (0..count).map(|k| list.tolerance * factor.powi(k - count / 2));
    tolerances
        .map(|tolerance| (tolerance, list.within(tolerance).time()))
        .collect()
}

/// The largest ratio of a time to the least within a smaller tolerance.
fn slower_with_more(times: &[(f64, f64)]) -> f64 {
    let (mut least, mut worst) = (f64::INFINITY, 0.0_f64);
    for (_, time) in times {
        worst = worst.max(time / least);
        least = least.min(*time);
    }
    worst
}

/// A list with legs shorter than its tolerance took 2.2 % longer within more of it: no search started from its fit.
#[test]
fn short_legs_are_searched_too() {
    let list = random(3000..3001, 300.0).next().unwrap();
    let more = List {
        tolerance: 8.0 * list.tolerance,
        ..list
    };
    let times = sweep(&more, 8, 2.0_f64.sqrt());
    assert!(slower_with_more(&times) <= 1.001, "{times:?}");
}

/// From the tolerance of the suite on more is not slower, but for two thousandths that the search may
/// miss. Below it is, by up to 2 %: the fit is not an optimum.
#[test]
fn more_tolerance_is_not_slower() {
    for case in dense() {
        let more = List {
            tolerance: 4.0 * case.tolerance,
            ..case
        };
        let times = sweep(&more, 4, 2.0);
        assert!(
            slower_with_more(&times) <= 1.0 + 2e-3,
            "{} {times:?}",
            more.name
        );
    }
}

/// Within a sixteenth of its tolerance a dense list is fitted, too, and takes about as long as within all of it. Curves over few
/// knots or after two refits took up to 12 % longer there, or splines were planned for seconds.
#[test]
fn a_sixteenth_of_the_tolerance_is_fitted_as_well() {
    for case in dense() {
        let narrow = case.within(case.tolerance / 16.0).plan();
        assert_eq!(narrow.method(), Method::Fit, "{}", case.name);
        let (narrow, wide) = (narrow.duration(), case.time());
        assert!(
            narrow <= 1.005 * wide && wide <= 1.02 * narrow,
            "{} {narrow} {wide}",
            case.name
        );
    }
}

/// Nor on the sparse suite, but for two thousandths that a search may miss. Searches that ended after too few steps
/// made a spiral slower by up to 23 %.
#[test]
fn more_tolerance_is_not_slower_on_sparse_lists() {
    for (name, poses, tolerance, _) in sparse::cases() {
        let times = sweep(&List::new(name, poses, tolerance), 8, 2.0_f64.sqrt());
        assert!(slower_with_more(&times) <= 1.0 + 2e-3, "{name} {times:?}");
    }
}

/// A list whose curve was found at a second attempt only took half as long again within more tolerance.
#[test]
fn a_second_attempt_is_compared_with_less_tolerance() {
    let list = random(206..207, 400.0).next().unwrap();
    let less = List {
        tolerance: 1.281e-5,
        ..list
    };
    let times = sweep(&less, 2, 1.31);
    let [narrow, wide] = [0, 1].map(|k| times[k].1);
    assert!(wide <= 1.01 * narrow, "{times:?}");
}

/// Within more tolerance two lists took 4.7 and 9.1 % longer. The fit of one was taken as it was, as the bound of the time was
/// too low to tell that it was slow; no search started from the motions of the other within less of the tolerance.
#[test]
fn slow_motions_are_known_and_searched_from_within_less() {
    for (seed, from, to) in [(618, -1, 3), (610, 2, 3)] {
        let list = random(seed..seed + 1, 400.0).next().unwrap();
        let factor = 2.0_f64.sqrt();
        let count = to - from + 1;
        let middle = List {
            tolerance: list.tolerance * factor.powi(from + count / 2),
            ..list
        };
        let times = sweep(&middle, count, factor);
        assert!(slower_with_more(&times) <= 1.01, "{seed} {times:?}");
    }
}

/// Within more tolerance a list took up to 6.3 % longer: where its orientation follows the place it missed six of 357 poses, and
/// was planned again within a quarter to a sixth of the tolerance of all.
#[test]
fn few_missed_poses_do_not_narrow_all() {
    let list = random(616..617, 400.0).next().unwrap();
    let factor = 2.0_f64.sqrt();
    let less = List {
        tolerance: list.tolerance * factor.powi(-5),
        ..list
    };
    let times = sweep(&less, 3, factor);
    assert!(slower_with_more(&times) <= 1.001, "{times:?}");
}

/// A motion of 3.94 s was taken, and none faster within a tolerance a fourth as large: the place came back to a corner that it had
/// passed, which counts as the approach to the next pose. Now it goes forward only, in 2.68 s.
#[test]
fn the_place_does_not_come_back_to_a_corner() {
    let list = random(610..611, 400.0).next().unwrap();
    assert!(list.within(0.25 * list.tolerance).time() <= 3.0);
}

/// A motion of 3.77 s was taken: between its samples a search left the corridor along some of 144 legs, and was made again in a corridor
/// that was narrower along all of them. Narrower along those that were left, it goes on from where it ended, to 2.95 s.
#[test]
fn a_leg_that_is_left_does_not_narrow_the_others() {
    let list = random(859..860, 400.0).next().unwrap();
    assert!(list.within(0.125 * list.tolerance).time() <= 3.3);
}

/// A fit of 3.01 s was taken, as no spline within less of the tolerance was tried beside a fit: one of 2.15 s is found there.
#[test]
fn a_fit_far_from_the_bound_is_compared_with_splines_within_less() {
    let list = random(881..882, 400.0).next().unwrap();
    assert!(list.time() <= 2.4);
}

/// A spiral that ends in a tight bend took 4.02 s within 0.05 mm, 2 % longer than within 0.01 mm: over the time of a motion the bend had
/// too few knots, so the curve over the chords was kept. With more knots it takes 3.97 s.
#[test]
fn a_tight_bend_is_fitted_over_time_with_more_knots() {
    let place = |k: i32| {
        let share = f64::from(k) / 1500.0;
        let (turn, radius) = (8.0 * TAU * share, 0.0602 - 0.06 * share);
        Isometry3::translation(radius * turn.cos(), radius * turn.sin(), 0.0)
    };
    let list = List::new("spiral", (0..=1500).map(place).collect(), 1e-5);
    let [narrow, wide] = [1e-5, 5e-5].map(|tolerance| list.within(tolerance).time());
    assert!(wide <= 3.99 && wide <= 1.01 * narrow, "{narrow} {wide}");
}

#[test]
#[ignore = "takes hours of processor time"]
fn nothing_changes_over_many_lists() {
    let count: usize = [moved, reversed, in_other_units]
        .into_iter()
        .map(|change| broken(many(), change, SAME).len())
        .sum();
    assert_eq!(count, 0);
}

#[test]
#[ignore = "takes hours of processor time"]
fn little_changes_over_many_lists() {
    let split = broken(many(), split, SPLIT);
    let noisy = broken(many(), noisy, NOISY);
    assert_eq!((split.len(), noisy.len()), (0, 0));
}

/// 16 tolerances, each the square root of two times the one before, or `CANTER_LAW_FACTOR` times it; of each list all
/// pairs of a tolerance and a narrower one.
#[test]
#[ignore = "takes hours of processor time"]
fn more_tolerance_is_not_slower_over_many_lists() {
    let factor = std::env::var("CANTER_LAW_FACTOR").map_or(2.0_f64.sqrt(), |x| x.parse().unwrap());
    let lists: Vec<_> = many().collect();
    let sweeps = on_all(&lists, |list| sweep(list, 16, factor));
    let (mut pairs, mut over, mut lists_over) = (0, [0; 3], [0; 3]);
    let mut worst = (1.0, String::from("none"));
    for (list, times) in lists.iter().zip(sweeps) {
        for (k, (tolerance, time)) in times.iter().enumerate() {
            for (less, before) in &times[..k] {
                pairs += 1;
                let ratio = time / before;
                for (over, share) in over.iter_mut().zip(MORE) {
                    *over += usize::from(ratio > 1.0 + share);
                }
                let text = format!("{} {ratio} ({tolerance:.3e} m, {less:.3e} m)", list.name);
                if ratio > 1.0 + MORE[2] {
                    println!("broken: {text}");
                }
                if ratio > worst.0 {
                    worst = (ratio, text);
                }
            }
        }
        for (over, share) in lists_over.iter_mut().zip(MORE) {
            *over += usize::from(slower_with_more(&times) > 1.0 + share);
        }
    }
    println!(
        "pairs looked at: {pairs}, slower by more than {MORE:?}: {over:?}, the worst: {}",
        worst.1
    );
    println!("of {} lists: {lists_over:?}", lists.len());
    assert_eq!(over[2], 0);
}

/// Shares by which more tolerance is slower, which the long run counts.
const MORE: [f64; 3] = [1e-6, 1e-3, 1e-2];
