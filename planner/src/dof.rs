//! Calls generic code with a joint count that is known only at run time.

/// Runs the body with the constant `N` equal to the first argument, 1 to 8.
///
/// A robot with another count is refused when it is loaded, so the last arm
/// states a broken invariant.
#[macro_export]
macro_rules! with_dof {
    ($dof:expr, $n:ident => $body:expr) => {
        match $dof {
            1 => {
                const $n: usize = 1;
                $body
            }
            2 => {
                const $n: usize = 2;
                $body
            }
            3 => {
                const $n: usize = 3;
                $body
            }
            4 => {
                const $n: usize = 4;
                $body
            }
            5 => {
                const $n: usize = 5;
                $body
            }
            6 => {
                const $n: usize = 6;
                $body
            }
            7 => {
                const $n: usize = 7;
                $body
            }
            8 => {
                const $n: usize = 8;
                $body
            }
            other => unreachable!("a robot of {other} joints is refused when it is loaded"),
        }
    };
}
