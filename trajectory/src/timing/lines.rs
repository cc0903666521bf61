//! The rows of a problem with their states, slot by slot in memory order.

use super::block::Lane;
use super::problem::{Basis, Problem};
use super::state::{ConstraintRow, Norm, State};

/// The remaining rows of a problem, with their states.
pub(super) struct Lines<'a> {
    problem: &'a Problem,
    acceleration: (&'a [[Lane; 2]], &'a mut [ConstraintRow]),
    jerk: (&'a [[Lane; 3]], &'a mut [ConstraintRow]),
    norm_acceleration: (&'a [[Lane; 3]], &'a mut [Norm]),
    norm_jerk: (&'a [[Lane; 6]], &'a mut [Norm]),
}

/// The rows of a slot of values.
pub(super) struct Values<'a> {
    pub joints: (&'a [[Lane; 2]], &'a mut [ConstraintRow]),
    pub tools: (&'a [[Lane; 3]], &'a mut [Norm]),
}

/// The rows of a jerk slot.
pub(super) struct Jerks<'a> {
    pub joints: (&'a [[Lane; 3]], &'a mut [ConstraintRow]),
    pub tools: (&'a [[Lane; 6]], &'a mut [Norm]),
}

/// What a block has besides its rows: how the law follows from the unknowns, share in the time and
/// cap at both slots of values, and the states of the caps.
type Block<'a> = (&'a Basis, &'a [[Lane; 2]; 2], &'a mut [ConstraintRow; 2]);

/// Takes the next rows of a list.
#[inline(always)]
fn next<'a, T, U>(list: &mut (&'a [T], &'a mut [U]), count: usize) -> (&'a [T], &'a mut [U]) {
    let (lines, states) = std::mem::take(list);
    let (line, lines) = lines.split_at(count.min(lines.len()));
    let (state, states) = states.split_at_mut(count.min(states.len()));
    *list = (lines, states);
    (line, state)
}

impl<'a> Lines<'a> {
    /// All rows from the first on, and the blocks that they stand in.
    #[inline(always)]
    pub(super) fn all(
        problem: &'a Problem,
        state: &'a mut State,
    ) -> (Self, impl Iterator<Item = Block<'a>>) {
        let lines = Self {
            problem,
            acceleration: (&problem.acceleration, &mut state.acceleration),
            jerk: (&problem.jerk, &mut state.jerk),
            norm_acceleration: (&problem.norm_acceleration, &mut state.norm_acceleration),
            norm_jerk: (&problem.norm_jerk, &mut state.norm_jerk),
        };
        let blocks = problem.basis.iter().zip(&problem.value);
        let blocks = blocks.zip(&mut state.cap);
        (
            lines,
            blocks.map(|((basis, value), cap)| (basis, value, cap)),
        )
    }

    /// The next slot of values.
    #[inline(always)]
    pub(super) fn values(&mut self) -> Values<'a> {
        Values {
            joints: next(&mut self.acceleration, self.problem.joints),
            tools: next(&mut self.norm_acceleration, self.problem.tool_accelerations),
        }
    }

    /// The next jerk slot.
    #[inline(always)]
    pub(super) fn jerks(&mut self) -> Jerks<'a> {
        Jerks {
            joints: next(&mut self.jerk, self.problem.joints),
            tools: next(&mut self.norm_jerk, self.problem.tool_jerks),
        }
    }
}
