//! State-to-state planning and sampling do not use the heap; the allocator of this test counts the
//! calls.
#![allow(unsafe_code, reason = "a counting allocator has to be one")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::hint::black_box;

use measure::{Ends, Problems};
use trajectory::otg::{Interface, Otg, Problem, Running, Synchronisation};

struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the pointer came from `System.alloc` with this layout.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn counted(work: impl FnOnce()) -> u64 {
    let before = COUNT.get();
    work();
    COUNT.get() - before
}

fn plan_and_sample(problem: &Problem<7>) {
    let Problem {
        start,
        target,
        limits,
        options,
    } = problem;
    if let Ok(motion) = Otg::plan(start, target, limits, options) {
        for step in 0..10 {
            black_box(motion.sample(motion.duration() * f64::from(step) / 9.0));
        }
    }
    if let Ok(mut running) = Running::new(*problem) {
        black_box(running.advance(0.001));
        let _ = black_box(running.replan(problem));
    }
}

#[test]
fn otg_planning_and_sampling_do_not_allocate() {
    assert_eq!(
        counted(|| drop(black_box(vec![1.0]))),
        1,
        "the counter counts"
    );
    for ends in [Ends::Moving, Ends::Stopping, Ends::Resting] {
        let mut problems = Problems::new(3, ends);
        for index in 0..2000 {
            let mut problem = problems.draw::<7>();
            match index % 5 {
                1 => problem.options.interface = [Interface::Velocity; 7],
                2 => problem.options.synchronisation = Synchronisation::PhaseIfPossible,
                3 => problem.limits.jerk.fill(f64::INFINITY),
                4 => {
                    problem.limits.position_max.fill(12.0);
                    problem.limits.position_min.fill(-12.0);
                }
                _ => {}
            }
            assert_eq!(counted(|| plan_and_sample(&problem)), 0, "{ends:?} {index}");
        }
    }
}
