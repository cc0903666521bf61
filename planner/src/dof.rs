//! Calls generic code with a joint count that is known only at run time.

/// Runs the body with the constant `N` equal to the first argument, 1 to 8.
///
/// A robot with another count is refused when it is loaded, so the last arm
/// states a broken invariant. Where this is compiled for tests, the body is compiled for 6 and 7
/// joints only, as the shipped arms have them: each count costs several seconds.
#[macro_export]
macro_rules! with_dof {
    ($dof:expr, $n:ident => $body:expr) => {
        match $dof {
            #[cfg(not(test))]
            1 => {
                const $n: usize = 1;
                $body
            }
            #[cfg(not(test))]
            2 => {
                const $n: usize = 2;
                $body
            }
            #[cfg(not(test))]
            3 => {
                const $n: usize = 3;
                $body
            }
            #[cfg(not(test))]
            4 => {
                const $n: usize = 4;
                $body
            }
            #[cfg(not(test))]
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
            #[cfg(not(test))]
            8 => {
                const $n: usize = 8;
                $body
            }
            other => unreachable!("a robot of {other} joints is refused when it is loaded"),
        }
    };
}
