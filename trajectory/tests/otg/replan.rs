//! Planning again during the motion.

use measure::{Ends, Problems};
use trajectory::otg::{Otg, Problem, Running};

use super::{Kind, draw};

/// What planning again every period did.
#[derive(Debug, Default)]
struct Tally {
    plans: usize,
    failed: usize,
    slower: usize,
    latest: f64,
}

impl Tally {
    fn add(&mut self, later: Option<f64>) {
        self.plans += 1;
        match later {
            Some(later) => {
                self.slower += usize::from(later > 1e-6);
                self.latest = self.latest.max(later);
            }
            None => self.failed += 1,
        }
    }
}

/// Plans each motion again from its state every `period` seconds, until it should arrive.
fn stateless<const N: usize>(seed: u64, ends: Ends, kind: Kind, motions: usize, tally: &mut Tally) {
    let period = 0.001;
    let mut problems = Problems::new(seed, ends);
    for _ in 0..motions {
        let Problem {
            start,
            target,
            limits,
            options,
        } = draw::<N>(&mut problems, kind);
        let mut motion = Otg::plan(&start, &target, &limits, &options).unwrap();
        for _ in 0..(motion.duration() / period) as usize {
            let state = motion.sample(period).into();
            let rest = (motion.duration() - period).max(0.0);
            let next = Otg::plan(&state, &target, &limits, &options).ok();
            tally.add(next.map(|next| next.duration() - rest));
            match next {
                Some(next) => motion = next,
                None => break,
            }
        }
    }
}

/// The same through [`Running`], which keeps the better of the old and the new plan.
fn guarded<const N: usize>(seed: u64, ends: Ends, kind: Kind, motions: usize, tally: &mut Tally) {
    let period = 0.001;
    let mut problems = Problems::new(seed, ends);
    for _ in 0..motions {
        let problem = draw::<N>(&mut problems, kind);
        let mut running = Running::new(problem).unwrap();
        while running.remaining() > 0.0 {
            running.advance(period);
            let rest = running.remaining();
            let later = running.replan(&problem).ok();
            tally.add(later.map(|_| running.remaining() - rest));
            if later.is_none() {
                break;
            }
        }
    }
}

/// Motions of each kind, planned again each millisecond: without and with the guard.
fn all(motions: usize) -> (Tally, Tally) {
    let (mut plain, mut kept) = (Tally::default(), Tally::default());
    for (seed, ends) in [(1, Ends::Moving), (2, Ends::Stopping), (3, Ends::Resting)] {
        stateless::<1>(seed, ends, Kind::Plain, 6 * motions, &mut plain);
        stateless::<7>(seed, ends, Kind::Asymmetric, motions, &mut plain);
        guarded::<1>(seed, ends, Kind::Plain, 6 * motions, &mut kept);
        guarded::<7>(seed, ends, Kind::Asymmetric, motions, &mut kept);
    }
    println!("stateless {plain:?}\nguarded {kept:?}");
    (plain, kept)
}

#[test]
fn own_states_never_fail_nor_slow_down() {
    let (plain, kept) = all(5);
    assert_eq!((kept.failed, kept.slower), (0, 0), "{kept:?}");
    assert_eq!(plain.failed, 0, "{plain:?}");
    assert!(plain.slower * 10_000 <= plain.plans, "{plain:?}");
}

/// The long run: 1e7 plans of each kind.
#[test]
#[ignore = "takes minutes"]
fn own_states_never_fail_nor_slow_down_at_length() {
    let (plain, kept) = all(90);
    assert_eq!((kept.failed, kept.slower), (0, 0), "{kept:?}");
    assert_eq!(plain.failed, 0, "{plain:?}");
    assert!(plain.slower * 10_000 <= plain.plans, "{plain:?}");
}
