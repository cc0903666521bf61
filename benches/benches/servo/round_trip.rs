//! Round trips of setpoint and state, and of plain messages of their sizes.

use std::time::{Duration, Instant};

use ipc::{AnsweringProbe, Arm, AskingProbe, DriverLink, EngineLink, Setpoint, State};

use crate::peer::Peer;
use crate::statistics::{median, quantile};
use crate::{N, ROUNDS, arm, named};

pub(crate) fn echo_probe(arm: &str, look: fn(&AnsweringProbe) -> Option<u64>) {
    let probe = AnsweringProbe::answering(&named(arm)).unwrap();
    loop {
        if let Some(number) = look(&probe) {
            probe.send(number);
        }
        std::hint::spin_loop();
    }
}

pub(crate) fn echo_link(arm: &str) {
    let link = DriverLink::open(&named(arm)).unwrap();
    loop {
        if let Some(setpoint) = link.next_setpoint()
            && setpoint.check(N).is_ok()
        {
            let setpoint_sequence = setpoint.sequence;
            link.send(&State {
                joints: N as u32,
                setpoint_sequence,
                ..State::default()
            });
        }
        std::hint::spin_loop();
    }
}

/// Round trips of a checked setpoint and state, alternating with those of plain messages of their
/// sizes: read as a whole, and with only one number read.
pub(crate) fn ping(ratios: &mut Vec<(String, f64)>) {
    let rounds: Vec<[Vec<u64>; 3]> = (0..ROUNDS)
        .map(|number| {
            let arm = arm(&format!("ping{number}"));
            [
                link_trips(&arm),
                probe_trips(&arm, "probe", AskingProbe::receive),
                probe_trips(&arm, "glance", AskingProbe::glance),
            ]
        })
        .collect();
    let middle = |of: &dyn Fn(&[Vec<u64>; 3]) -> f64| median(rounds.iter().map(of).collect());
    let at = |sorted: &[u64], share: f64| quantile(sorted, share) as f64;
    for (name, share) in [("p50", 0.5), ("p99", 0.99)] {
        println!(
            "round trip {name}: setpoint and state, checked {} ns; bare messages of their sizes, read \
             {} ns, glanced at {} ns",
            middle(&|[ours, _, _]| at(ours, share)),
            middle(&|[_, read, _]| at(read, share)),
            middle(&|[_, _, glance]| at(glance, share)),
        );
        let read = middle(&|[ours, read, _]| at(ours, share) / at(read, share));
        let glance = middle(&|[ours, _, glance]| at(ours, share) / at(glance, share));
        ratios.push((format!("iceoryx2-ping-{name}"), read));
        ratios.push((format!("iceoryx2-glance-{name}"), glance));
    }
}

/// Round trips of a round.
const TRIPS: u64 = 20_000;

fn probe_trips(arm: &Arm, peer: &str, look: fn(&AskingProbe) -> Option<u64>) -> Vec<u64> {
    let _probe = Peer::start(peer, arm);
    let probe = AskingProbe::asking(arm).unwrap();
    trips(TRIPS, |number| {
        probe.send(number);
        let end = Instant::now() + Duration::from_secs(1);
        while look(&probe) != Some(number) && Instant::now() < end {
            std::hint::spin_loop();
        }
    })
}

fn link_trips(arm: &Arm) -> Vec<u64> {
    let _link = Peer::start("link", arm);
    let link = EngineLink::open(arm).unwrap();
    let setpoint = Setpoint {
        joints: N as u32,
        period_ns: 1_000_000,
        watchdog_ns: 100_000_000,
        ..Setpoint::default()
    };
    trips(TRIPS, |sequence| {
        let mut next = setpoint;
        next.sequence = sequence;
        next.published_ns = scheduling::now_ns();
        link.send(&next);
        let end = Instant::now() + Duration::from_secs(1);
        loop {
            if let Some(state) = link.next_state()
                && state.check(N).is_ok()
                && state.setpoint_sequence == sequence
            {
                break;
            }
            if Instant::now() > end {
                break;
            }
            std::hint::spin_loop();
        }
    })
}

fn trips(count: u64, mut trip: impl FnMut(u64)) -> Vec<u64> {
    (1..200).for_each(&mut trip);
    let mut times: Vec<u64> = (200..200 + count)
        .map(|number| {
            let start = Instant::now();
            trip(number);
            start.elapsed().as_nanos() as u64
        })
        .collect();
    times.sort_unstable();
    times
}
