//! A servo drive after CiA 402: its states, and a motor that follows.

use super::dictionary::Dictionary;

/// Error codes.
const FOLLOWING: u16 = 0x8611;
const BUS: u16 = 0x7500;

/// A limit of the motor's own stop (counts/s²), by a scale.
const BRAKE: f64 = 20.0;

/// Substeps of the motor's motion (s).
const STEP: f64 = 2.5e-4;

/// States, by the bits of the statusword.
const FAULT: u16 = 0x08;
const REACTION: u16 = 0x0F;
const DISABLED: u16 = 0x40;
const READY: u16 = 0x21;
const ON: u16 = 0x23;
const ENABLED: u16 = 0x27;

/// Largest values that the drive was told (rad/s², rad/s³), since the last look.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Peaks {
    pub(super) acceleration: f64,
    pub(super) jerk: f64,
}

/// A drive and its motor.
pub(super) struct Servo {
    /// Counts per rad of the joint.
    pub(super) scale: f64,
    /// Bandwidth of the motor (rad/s).
    pub(super) bandwidth: f64,
    state: u16,
    control: u16,
    pub(super) mode: u8,
    pub(super) error: u16,
    /// The last targets (counts), the newest first; the motor moves to the newest over a cycle.
    targets: [f64; 4],
    taken: usize,
    taken_ns: u64,
    position: f64,
    speed: f64,
    now_ns: u64,
    /// How long the following error is beyond its window (s).
    beyond: f64,
    pub(super) peaks: Peaks,
    /// Resets of faults.
    pub(super) resets: u32,
}

impl Servo {
    pub(super) fn new(scale: f64, position: f64) -> Self {
        Self {
            scale,
            bandwidth: 400.0,
            state: DISABLED,
            control: 0,
            mode: 0,
            error: 0,
            targets: [position; 4],
            taken: 0,
            taken_ns: 0,
            position,
            speed: 0.0,
            now_ns: 0,
            beyond: 0.0,
            peaks: Peaks::default(),
            resets: 0,
        }
    }

    pub(super) fn counts(&self) -> i32 {
        self.position.round() as i32
    }

    /// The statusword; bit 13 tells a following error.
    pub(super) fn status(&self) -> u16 {
        let remote = 0x0200;
        let follows = u16::from(self.error == FOLLOWING) << 13;
        self.state | remote | follows
    }

    /// Whether the motor stands.
    pub(super) fn rests(&self) -> bool {
        (self.speed / self.scale).abs() < 1e-3
    }

    pub(super) fn is_enabled(&self) -> bool {
        self.state == ENABLED
    }

    /// A fault from outside.
    pub(super) fn fail(&mut self, error: u16) {
        self.error = error;
        self.state = REACTION;
    }

    /// No process data any more; in operation that is a fault.
    pub(super) fn lose_bus(&mut self, watchdog: bool) {
        if watchdog && self.state == ENABLED {
            self.fail(BUS);
        } else if self.state != FAULT && self.state != REACTION {
            self.state = DISABLED;
        }
    }

    /// The process data of a cycle.
    pub(super) fn take(&mut self, control: u16, target: i32, mode: u8, objects: &Dictionary) {
        self.mode = mode;
        let edge = control & 0x80 != 0 && self.control & 0x80 == 0;
        self.control = control;
        let before = self.state;
        self.state = match (self.state, control & 0x0F) {
            (FAULT, _) if edge => {
                self.error = 0;
                self.resets += 1;
                DISABLED
            }
            (DISABLED, 0x06) => READY,
            (READY, 0x07) => ON,
            (ON, 0x0F) if mode == 8 => ENABLED,
            (ENABLED, 0x07) => ON,
            (ON | ENABLED, 0x06) => READY,
            (READY | ON | ENABLED, word) if word & 0x02 == 0 => DISABLED,
            (state, _) => state,
        };
        let target = f64::from(target);
        if before != ENABLED {
            self.targets = [target; 4];
            self.taken = 0;
        }
        self.targets.rotate_right(1);
        self.targets[0] = target;
        self.taken_ns = self.now_ns;
        if self.state == ENABLED {
            self.taken += 1;
            if self.taken > 4 {
                self.note(cycle(objects));
            }
        }
    }

    /// Notes what the targets of the last cycles mean.
    fn note(&mut self, cycle: f64) {
        let [a, b, c, d] = self.targets.map(|target| target / self.scale);
        let acceleration = (a - 2.0 * b + c) / (cycle * cycle);
        let jerk = (a - 3.0 * b + 3.0 * c - d) / (cycle * cycle * cycle);
        self.peaks.acceleration = self.peaks.acceleration.max(acceleration.abs());
        self.peaks.jerk = self.peaks.jerk.max(jerk.abs());
    }

    /// Time goes on.
    pub(super) fn go_on(&mut self, now: u64, objects: &Dictionary) {
        if self.now_ns == 0 {
            self.now_ns = now;
        }
        let cycle = cycle(objects);
        let window = f64::from(objects.value(0x6065, 0));
        let patience = f64::from(objects.value(0x6066, 0)) * 1e-3;
        while now.saturating_sub(self.now_ns) as f64 * 1e-9 >= STEP {
            self.now_ns += (STEP * 1e9) as u64;
            let since = self.now_ns.saturating_sub(self.taken_ns) as f64 * 1e-9;
            let share = (since / cycle).clamp(0.0, 1.0);
            let wanted = self.targets[1] + (self.targets[0] - self.targets[1]) * share;
            let moving = if share < 1.0 {
                (self.targets[0] - self.targets[1]) / cycle
            } else {
                0.0
            };
            self.step(wanted, moving);
            let far = self.state == ENABLED && (wanted - self.position).abs() > window;
            self.beyond = if far { self.beyond + STEP } else { 0.0 };
            if self.beyond > patience {
                self.fail(FOLLOWING);
            }
        }
    }

    /// A substep of the motor.
    fn step(&mut self, wanted: f64, moving: f64) {
        if self.state == ENABLED {
            let w = self.bandwidth;
            let force = w * w * (wanted - self.position) + 2.0 * w * (moving - self.speed);
            self.speed += force * STEP;
        } else {
            let most = BRAKE * self.scale.abs() * STEP;
            self.speed -= self.speed.clamp(-most, most);
            if self.state == REACTION && self.speed == 0.0 {
                self.state = FAULT;
            }
        }
        self.position += self.speed * STEP;
    }
}

/// The interpolation time (s).
fn cycle(objects: &Dictionary) -> f64 {
    let exponent = (objects.value(0x60C2, 2) as u8).cast_signed();
    f64::from(objects.value(0x60C2, 1)) * 10_f64.powi(i32::from(exponent))
}
