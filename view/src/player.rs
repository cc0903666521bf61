//! A recording that is played.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, sleep};
use std::time::{Duration, Instant};

use recorder::{Recorded, Sample};
use serde_json::{Value, json};

use crate::ViewError;
use crate::blocks::{Packer, Row};
use crate::preview::{Detail, Draft, preview};
use crate::scene;
use crate::source::Board;

/// How often a block goes out.
const BLOCK: Duration = Duration::from_millis(16);

/// How much before the place that was chosen is sent, so that the plots have something (s).
const BEFORE_S: f64 = 10.0;

/// Rows of one block at most.
const ROWS: usize = 500;

/// Where the player is.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Time since the beginning of the recording (s).
    at_s: f64,
    speed: f64,
    plays: bool,
    /// Grows by one with each jump.
    jumps: u64,
}

/// The time controls of a recording, for every page.
#[derive(Clone, Debug)]
pub(crate) struct Player {
    place: Arc<Mutex<Place>>,
    duration_s: f64,
}

impl Player {
    fn place(&self) -> MutexGuard<'_, Place> {
        self.place.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Goes to a time (s).
    pub(crate) fn seek(&self, at_s: f64) {
        let mut place = self.place();
        place.at_s = at_s.clamp(0.0, self.duration_s);
        place.jumps += 1;
    }

    /// Plays or stands, at a share of the recorded speed.
    pub(crate) fn play(&self, plays: bool, speed: f64) {
        let mut place = self.place();
        // Who plays at the end wants to see it again.
        if plays && place.at_s >= self.duration_s {
            place.at_s = 0.0;
            place.jumps += 1;
        }
        place.plays = plays;
        place.speed = speed.clamp(0.01, 16.0);
    }
}

/// Starts to play a recording.
///
/// # Errors
/// The recording's robot cannot be read, or there is no thread.
pub(crate) fn start(
    recorded: Recorded,
    board: &Arc<Board>,
    ends: &Arc<AtomicBool>,
) -> Result<Player, ViewError> {
    let head = &recorded.head;
    let robot = planner::robot::parse(&head.robot, &head.urdf, &head.robot_toml)?;
    board.set_robot(&scene::robot(&robot, &head.arm, head.period_ns));
    let period_s = head.period_ns as f64 * 1e-9;
    let span = recorded.samples.last().map_or(0, |last| last.tick) - first_tick(&recorded);
    let player = Player {
        place: Arc::new(Mutex::new(Place {
            at_s: 0.0,
            speed: 1.0,
            plays: true,
            jumps: 1,
        })),
        duration_s: span as f64 * period_s,
    };
    if let Some(program) = recorded.programs.last()
        && let Ok(program) = serde_json::from_str::<Value>(program)
    {
        let word = |name: &str| program[name].as_str().unwrap_or_default().to_owned();
        let start = program["start"].as_array();
        let draft = Draft {
            name: word("name"),
            form: word("form"),
            text: word("text"),
            start: start.map(|list| list.iter().filter_map(Value::as_f64).collect()),
            default_length: word("default_length"),
            rate_hz: (1.0 / period_s).round(),
            detail: Detail::Picture,
        };
        board.set_program(&program);
        board.set_preview(&preview(&robot, &draft));
    }
    for note in &recorded.notes {
        if let Ok(value) = serde_json::from_str(&note.json) {
            board.add_note(value);
        }
    }
    let film = Film {
        recorded,
        board: Arc::clone(board),
        player: player.clone(),
        period_s,
    };
    let stop = Arc::clone(ends);
    Builder::new()
        .name("view player".to_owned())
        .spawn(move || film.run(&stop))
        .map_err(|cause| ViewError::Thread {
            cause: cause.to_string(),
        })?;
    Ok(player)
}

fn first_tick(recorded: &Recorded) -> u64 {
    recorded.samples.first().map_or(0, |first| first.tick)
}

/// The thread that plays.
struct Film {
    recorded: Recorded,
    board: Arc<Board>,
    player: Player,
    period_s: f64,
}

impl Film {
    fn run(&self, ends: &AtomicBool) {
        let joints = self.recorded.head.joints.len();
        let mut packer = Packer::new(joints, self.recorded.head.period_ns);
        let (mut next, mut jumps) = (0, 0);
        let mut last = Instant::now();
        while !ends.load(Ordering::Acquire) {
            let passed = last.elapsed().as_secs_f64();
            last = Instant::now();
            let place = self.advance(passed);
            if place.jumps != jumps {
                jumps = place.jumps;
                next = self.index_at(place.at_s - BEFORE_S);
            }
            let until = self.index_at(place.at_s);
            let rows = self.recorded.samples.get(next..=until).unwrap_or_default();
            for (index, sample) in rows.iter().enumerate() {
                let number = (next + index) as u64;
                let full = packer.push(&row(sample, number, joints));
                let cut = (index % ROWS == ROWS - 1).then(|| packer.take()).flatten();
                for block in full.into_iter().chain(cut) {
                    self.board.blocks.push(block);
                }
            }
            if !rows.is_empty() {
                next = until + 1;
                if let Some(block) = packer.take() {
                    self.board.blocks.push(block);
                }
            }
            self.tell(&place, until);
            sleep(BLOCK);
        }
    }

    fn advance(&self, passed: f64) -> Place {
        let mut place = self.player.place();
        if place.plays {
            place.at_s += passed * place.speed;
            if place.at_s >= self.player.duration_s {
                place.at_s = self.player.duration_s;
                place.plays = false;
            }
        }
        *place
    }

    /// The sample at a time.
    fn index_at(&self, at_s: f64) -> usize {
        let tick = first_tick(&self.recorded) + (at_s.max(0.0) / self.period_s).round() as u64;
        let after = self
            .recorded
            .samples
            .partition_point(|sample| sample.tick <= tick);
        after.saturating_sub(1)
    }

    fn tell(&self, place: &Place, index: usize) {
        let head = &self.recorded.head;
        let Some(sample) = self.recorded.samples.get(index) else {
            return;
        };
        let joints = head.joints.len();
        let [x, y, z, qw, qx, qy, qz] = sample.tool;
        self.board.set_status(&json!({
            "is": "status",
            "engine": true,
            "replay": {
                "at_s": place.at_s,
                "duration_s": self.player.duration_s,
                "speed": place.speed,
                "plays": place.plays,
            },
            "status": {
                "arm": head.arm, "robot": head.robot, "driver": head.driver, "state": "replay",
                "time_scaling": sample.time_scaling,
                "joints": sample.measured.get(..joints),
                "setpoint": sample.position.get(..joints),
                "position_m": [x, y, z],
                "orientation_wxyz": [qw, qx, qy, qz],
                "command_id": sample.command,
            },
        }));
    }
}

fn row(sample: &Sample, number: u64, joints: usize) -> Row {
    let list = |values: &[f64]| values.iter().take(joints).copied().collect();
    let [x, y, z, ..] = sample.tool;
    Row {
        tick: sample.tick,
        sequence: number,
        command: sample.command,
        path_time: sample.path_time,
        time_scaling: sample.time_scaling,
        late_us: 0.0,
        joints: [
            list(&sample.position),
            list(&sample.velocity),
            list(&sample.acceleration),
            list(&sample.measured),
        ],
        point: [x, y, z],
    }
}
