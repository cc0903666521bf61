//! What a long smooth move in windows needs beside its list does not grow with the list; the allocator of this test
//! counts the bytes.
#![allow(unsafe_code, reason = "a counting allocator has to be one")]
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::borrow::Cow;
use std::cell::Cell;
use std::f64::consts::TAU;

use nalgebra::{Isometry3, SVector, UnitQuaternion, Vector3};
use planner::controller::Controller;
use planner::motion::Planner;
use planner::robot::load;
use planner::task::{Move, Shape};

struct Counting;

thread_local! {
    /// Bytes that this thread has, and the most so far.
    static NOW: Cell<isize> = const { Cell::new(0) };
    static MOST: Cell<isize> = const { Cell::new(0) };
}

fn count(change: isize) {
    let _ = NOW.try_with(|now| {
        now.set(now.get() + change);
        let _ = MOST.try_with(|most| most.set(most.get().max(now.get())));
    });
}

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        // SAFETY: the pointer came from `System.alloc` with this layout.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A move along waves from the arm's pose, with poses one millimetre apart.
fn waves(planner: &Planner<6>, home: &SVector<f64, 6>, count: usize, turn: f64) -> Move {
    let start = planner.chain().forward(home);
    let at = |i: usize| {
        let a = TAU * i as f64 / 300.0;
        let way = Vector3::new(
            0.04 * (a.cos() - 1.0) + 0.03 * (0.37 * a).sin(),
            0.06 * a.sin(),
            0.02 * (0.21 * a).sin(),
        );
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), turn * (0.3 * a).sin());
        let place = start.translation.vector + way;
        Isometry3::from_parts(place.into(), start.rotation * turn)
    };
    Move {
        shape: Shape::Smooth,
        poses: (1..=count).map(at).collect(),
        tolerance: 1e-4,
        limits: load("ur5e").unwrap().motion_limits(),
    }
}

/// Most bytes beside the list while it is checked, and while it is driven.
fn bytes(planner: &Planner<6>, home: &SVector<f64, 6>, motion: &Move) -> [isize; 2] {
    let since = NOW.get();
    let most = || {
        let most = MOST.get() - since;
        MOST.set(NOW.get());
        most
    };
    MOST.set(since);
    let mut windowed = planner.windows(Cow::Borrowed(motion), home).unwrap();
    let checked = most();
    while !planner.window_of(&mut windowed).unwrap().last {
        windowed.forget();
    }
    [checked, most()]
}

/// Four times the poses need about as many bytes: more are only the place at which each is passed, in four bytes, and
/// the joints at the start of each stretch of 64 knots of the time law. `CANTER_POSES` asks for the figures of one list.
#[test]
fn memory_does_not_grow_with_the_list() {
    let robot = load("ur5e").unwrap();
    let controller = Controller::<6>::new(&robot, 1000.0, crcl::LengthUnit::default()).unwrap();
    let (planner, home) = (
        controller.planner(),
        SVector::from_column_slice(&robot.home),
    );
    let counts = match std::env::var("CANTER_POSES") {
        Ok(count) => vec![count.parse().unwrap()],
        Err(_) => vec![20_000, 80_000],
    };
    for turn in [0.0, 0.15] {
        let mut rows = Vec::new();
        for count in &counts {
            let motion = waves(planner, &home, *count, turn);
            let row = bytes(planner, &home, &motion);
            println!("{count} poses, turning by {turn}: {row:?} bytes");
            rows.push(row.map(|bytes| bytes as f64));
        }
        let [few, .., many] = &rows[..] else { continue };
        for (few, many) in few.iter().zip(many) {
            let each = (many - few) / (counts[1] - counts[0]) as f64;
            assert!(each < 6.0, "{each} bytes a pose");
        }
    }
}
