//! The computation of one period.

use std::hint::black_box;
use std::time::Instant;

use nalgebra::SVector;
use realtime::{Cycle, Demand, JointLimits, Piece, Sample, Segment, StopCategory};

use crate::statistics::summary;

/// Cost of the cycle when nothing changes and when everything changes.
pub(crate) fn governor() {
    let seven = |value: f64| SVector::<f64, 7>::from_element(value);
    let limits = JointLimits {
        lower: seven(-9.0),
        upper: seven(9.0),
        velocity: seven(3.1),
        acceleration: seven(15.0),
        jerk: seven(200.0),
        ends: None,
    };
    let mut cycle = Box::new(Cycle::<7, 512>::new(seven(0.0), limits, 0.001));
    let (from, to) = (Sample::rest(seven(0.0)), Sample::rest(seven(0.5)));
    let there = Segment {
        piece: Piece::hermite(0.98, &from, &to),
        command: 0,
        last: true,
    };
    let back = Segment {
        piece: Piece::hermite(0.98, &to, &from),
        command: 1,
        last: true,
    };
    for (name, changing) in [("steady", false), ("under changing overrides", true)] {
        let mut times = Vec::new();
        for tick in 0..40_000_u32 {
            if cycle.is_idle() {
                cycle.push(&there);
                cycle.push(&back);
            }
            let demand = match tick / 200 % 4 {
                1 if changing => Demand::Run(0.2),
                2 if changing => Demand::Stop(StopCategory::Fast),
                _ => Demand::Run(1.0),
            };
            let start = Instant::now();
            black_box(cycle.step(black_box(demand)));
            times.push(start.elapsed().as_nanos() as u64);
        }
        times.sort_unstable();
        println!("cycle of 7 joints, {name}: {}", summary(&times));
    }
}
