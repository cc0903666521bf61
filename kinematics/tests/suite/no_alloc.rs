//! Kinematics does not use the heap; the allocator of these tests counts the calls of each thread.
#![allow(unsafe_code, reason = "a counting allocator has to be one")]

use kinematics::{Solver, urdf};
use nalgebra::{Isometry3, SVector, Vector3};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::hint::black_box;

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

fn solver<const N: usize>(name: &str) -> Solver<N> {
    let path = format!("{}/../robots/{name}/robot.urdf", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    Solver::new(urdf::read(&text, None).unwrap().chain().unwrap())
}

fn heap_of<const N: usize>(name: &str) -> u64 {
    let solver = solver::<N>(name);
    let q = SVector::<f64, N>::from_fn(|i, _| {
        0.4 * solver.chain().lower()[i] + 0.6 * solver.chain().upper()[i]
    });
    let far = Isometry3::translation(9.0, 0.0, 0.0);
    counted(|| {
        for _ in 0..100 {
            let (pose, _) = black_box(solver.chain().jacobian(&q));
            black_box(solver.chain().jacobian_derivative(&q, &q));
            black_box(solver.solve_all(&pose));
            let _ = black_box(solver.nearest(&pose, &q.add_scalar(0.01)));
            let _ = black_box(solver.solve(&pose));
            black_box(kinematics::measure::dexterity(solver.chain(), &q));
        }
        assert!(solver.solve(&far).is_err());
    })
}

#[test]
fn nothing_is_allocated() {
    assert_eq!(
        counted(|| drop(black_box(vec![Vector3::<f64>::zeros()]))),
        1,
        "the counter counts"
    );
    assert_eq!(heap_of::<6>("ur5e"), 0);
    assert_eq!(heap_of::<6>("irb120"), 0);
    assert_eq!(heap_of::<6>("gantry"), 0);
    assert_eq!(heap_of::<7>("iiwa14"), 0);
    assert_eq!(heap_of::<7>("panda"), 0);
}
