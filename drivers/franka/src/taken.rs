//! The commands that a controller took, and how it goes on by itself where one is missing.

use driver_kit::Reference;

use crate::JOINTS;

/// The controller commands something else than it was told from this difference on (rad). Its states are single
/// precision; a command of this difference is the next one of a slow motion.
const ELSEWHERE: f64 = 3e-6;

/// Largest error of a number in single precision, as a share of it, and what is added for a number near zero.
const SINGLE: f64 = 6e-8;
const SMALL: f64 = 1e-9;

/// How many commands are kept: those that may be on their way, because an older state of the controller is no other
/// command.
const KEPT: usize = 12;

/// So many commands may have been lost on their way before the driver knows it, and so many cycles are looked through: the
/// controller ends the motion after 20.
const LOST: usize = 6;
const CYCLES: usize = 24;

/// What the controller commands at its next cycles as far as it is known: what was sent, and what it made of it by
/// itself. It goes on with constant acceleration (libfranka, "Packet Handling").
#[derive(Clone, Debug, Default)]
pub struct Taken {
    commands: [[f64; JOINTS]; KEPT],
    count: usize,
}

impl Taken {
    /// How many commands there were.
    pub fn count(&self) -> usize {
        self.count
    }

    /// A command was sent (rad).
    pub fn push(&mut self, command: [f64; JOINTS]) {
        self.commands[self.count % KEPT] = command;
        self.count += 1;
    }

    /// Whether the controller commands something that it was told (rad).
    pub fn knows(&self, commanded: &[f64; JOINTS]) -> bool {
        let known = self.commands.iter().take(self.count);
        known
            .into_iter()
            .any(|told| apart(told, commanded) <= ELSEWHERE)
    }

    /// Whether it commands what it made by itself of a command (rad), and nothing that it was told: an answer is missing.
    pub fn misses(&self, commanded: &[f64; JOINTS], period: f64) -> bool {
        let known = self.commands.iter().take(self.count);
        let told = known
            .into_iter()
            .any(|told| rounding(told, commanded) <= 1.0);
        !told && self.clone().went_on(commanded, period).is_some()
    }

    /// Where the controller went by itself, `period` (s) a cycle, when it says that it commands `commanded` (rad): from the
    /// newest command from which it comes there. Positions are exact: the single precision of a state alone
    /// would be a step of 0.1 rad/s² in the next command. Nothing if no command leads there.
    pub fn went_on(
        &mut self,
        commanded: &[f64; JOINTS],
        period: f64,
    ) -> Option<[Reference; JOINTS]> {
        let lost = LOST.min(self.count.min(KEPT).saturating_sub(2));
        for back in 0..lost {
            let mut way = self.way(back);
            let mut best: Option<(f64, usize)> = None;
            for cycle in 1..=CYCLES {
                way = step(way);
                let error = rounding(&way.map(|[at, _, _]| at), commanded);
                if best.is_none_or(|(least, _)| error < least) {
                    best = Some((error, cycle));
                }
            }
            let Some((_, cycles)) = best.filter(|(error, _)| *error <= 1.0) else {
                continue;
            };
            let mut way = self.way(back);
            // The commands after that one were not taken.
            self.count -= back;
            for _ in 0..cycles {
                way = step(way);
                self.push(way.map(|[at, _, _]| at));
            }
            return Some(way.map(|[position, moved, bent]| Reference {
                position,
                // At the end of the cycle; the difference is that of its middle.
                velocity: (moved + bent / 2.0) / period,
                acceleration: bent / (period * period),
            }));
        }
        None
    }

    /// Each joint at the command so many before the last: position, its first and its second difference (rad).
    fn way(&self, back: usize) -> [[f64; 3]; JOINTS] {
        let at = |before: usize| &self.commands[(self.count - 1 - back - before) % KEPT];
        let (now, last, older) = (at(0), at(1), at(2));
        core::array::from_fn(|joint| {
            let moved = now[joint] - last[joint];
            [now[joint], moved, moved - (last[joint] - older[joint])]
        })
    }
}

/// One cycle with constant acceleration.
fn step(way: [[f64; 3]; JOINTS]) -> [[f64; 3]; JOINTS] {
    way.map(|[position, moved, bent]| [position + moved + bent, moved + bent, bent])
}

/// The largest difference of a joint from what a state shows, over the largest that single precision makes.
fn rounding(one: &[f64; JOINTS], shown: &[f64; JOINTS]) -> f64 {
    let pairs = one.iter().zip(shown);
    pairs
        .map(|(a, b)| (a - b).abs() / (SINGLE * b.abs() + SMALL))
        .fold(0.0, f64::max)
}

/// The largest difference of a joint (rad).
fn apart(one: &[f64; JOINTS], other: &[f64; JOINTS]) -> f64 {
    let pairs = one.iter().zip(other);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
