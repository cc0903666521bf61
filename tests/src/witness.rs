//! Checks what the driver sends to the robot, in every period.

use std::fmt::Write as _;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;

use driver_kit::{About, Command, Measured, Measurement, Reference, Robot};
use ipc::{ToolCommand, ToolFeedback};

/// How many numbers a witness writes.
const WORDS: usize = 6;

/// The worst references that a robot got, over all joints and periods.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Worst {
    /// How far beyond its range a joint was sent (rad).
    pub beyond: f64,
    /// Speed as a share of the limit.
    pub speed: f64,
    /// Acceleration as a share of the limit.
    pub acceleration: f64,
    /// Change of the acceleration in a period as a share of what the jerk limit allows.
    pub jerk: f64,
    /// Distance of a position from the value that the speeds before and after give, as a fraction
    /// of what the jerk limit allows (a twelfth of jerk times period cubed, and 1e-8 rad of
    /// rounding).
    pub step: f64,
    /// How far from its last reference at rest a session began (rad).
    pub begin: f64,
}

impl Worst {
    /// The worse of both, quantity by quantity.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        let (a, b) = (self.words(), other.words());
        Self::of(core::array::from_fn(|word| a[word].max(b[word])))
    }

    /// Whether every limit was kept, but for rounding.
    pub fn is_within_limits(&self) -> bool {
        let most = 1.0 + 1e-6;
        self.beyond <= 1e-6
            && [self.speed, self.acceleration, self.jerk, self.step]
                .iter()
                .all(|share| *share <= most)
            && self.begin <= 1e-3
    }

    fn words(&self) -> [f64; WORDS] {
        [
            self.beyond,
            self.speed,
            self.acceleration,
            self.jerk,
            self.step,
            self.begin,
        ]
    }

    fn of([beyond, speed, acceleration, jerk, step, begin]: [f64; WORDS]) -> Self {
        Self {
            beyond,
            speed,
            acceleration,
            jerk,
            step,
            begin,
        }
    }

    /// Reads what a witness wrote, also one that was killed.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn read(path: &Path) -> io::Result<Self> {
        let text = std::fs::read_to_string(path)?;
        let mut words = [0.0; WORDS];
        for (word, text) in words.iter_mut().zip(text.split_whitespace()) {
            *word = text.parse().unwrap_or(f64::INFINITY);
        }
        Ok(Self::of(words))
    }
}

/// A robot whose references are checked before they are passed on. A new worst value is written at
/// once, so that a kill loses nothing.
#[derive(Debug)]
pub struct Witness<R> {
    robot: R,
    about: About,
    last: Vec<Reference>,
    worst: Worst,
    file: File,
}

impl<R: Robot> Witness<R> {
    /// A witness of `robot` that writes to `path`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn new(mut robot: R, path: &Path) -> io::Result<Self> {
        let about = robot.about();
        let mut measured = vec![Measured::default(); about.joints()];
        robot.measure(&mut measured);
        let last = measured.iter().map(|at| Reference::rest(at.position));
        Ok(Self {
            last: last.collect(),
            robot,
            about,
            worst: Worst::default(),
            file: File::create(path)?,
        })
    }

    /// How bad a period of one joint is.
    fn judge(&self, joint: usize, now: Reference, period: f64) -> Worst {
        let (about, before) = (&self.about, self.last[joint]);
        let moved = now.position - before.position;
        let outside = (now.position - about.upper[joint]).max(about.lower[joint] - now.position);
        let rests = |at: Reference| at.velocity == 0.0 && at.acceleration == 0.0;
        if rests(before) && rests(now) {
            // A session begins where the arm was measured.
            return Worst {
                beyond: outside.max(0.0),
                begin: moved.abs(),
                ..Worst::default()
            };
        }
        let most = about.jerk[joint] * period;
        let off = (moved - (before.velocity + now.velocity) / 2.0 * period).abs();
        Worst {
            beyond: outside.max(0.0),
            speed: now.velocity.abs() / about.velocity[joint],
            acceleration: now.acceleration.abs() / about.acceleration[joint],
            jerk: (now.acceleration - before.acceleration).abs() / most,
            step: off / (most * period * period / 12.0 + 1e-8),
            begin: 0.0,
        }
    }

    fn write(&mut self) {
        let mut text = String::new();
        for word in self.worst.words() {
            // Writing to a text cannot fail.
            let _ = write!(text, "{word:<24.16e} ");
        }
        // A full disk must not stop the robot; the test finds the file empty.
        let _ = self.file.write_all_at(text.as_bytes(), 0);
    }
}

impl<R: Robot> Robot for Witness<R> {
    fn about(&self) -> About {
        self.about.clone()
    }

    fn measure(&mut self, joints: &mut [Measured]) -> Measurement {
        self.robot.measure(joints)
    }

    fn follow(&mut self, command: &Command<'_>) {
        let (joints, period) = (command.joints, command.period);
        let found = joints
            .iter()
            .enumerate()
            .map(|(joint, now)| self.judge(joint, *now, period))
            .fold(self.worst, Worst::and);
        if found != self.worst {
            self.worst = found;
            self.write();
        }
        self.last.copy_from_slice(joints);
        self.robot.follow(command);
    }

    fn act(&mut self, tool: usize, order: &ToolCommand) {
        self.robot.act(tool, order);
    }

    fn tool(&self, tool: usize) -> ToolFeedback {
        self.robot.tool(tool)
    }
}
