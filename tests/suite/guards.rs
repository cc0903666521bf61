//! Guarded moves: a sensor stops the arm on its path within the limits, and the answer says how far
//! the arm may go on, how far it went, and the peak of the value.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use driver_sim::{Places, Wall};
use engine::session::{Note, RunSample, Session, SessionConfig};
use ipc::Clock;
use measure::Random;
use nalgebra::SVector;
use planner::dry_run::FailurePolicy;
use planner::robot::Robot;
use system_tests::driver_thread::{DriverThread, options_of};

/// Stiffness of the wall (N/m).
const STIFFNESS: f64 = 20_000.0;

/// Where every guarded move begins and would end (mm).
const ABOVE: f64 = 320.0;
const BELOW: f64 = 120.0;

/// A session in lock-step with a simulated arm over a table whose height can be set.
pub(crate) struct Cell {
    pub(crate) session: Session,
    height: Arc<AtomicU64>,
    _driver: DriverThread,
}

impl Cell {
    pub(crate) fn start(name: &str, policy: FailurePolicy) -> Self {
        let robot = planner::robot::load("ur5e").unwrap();
        let arm = system_tests::domain::arm(&format!("guard/{name}"));
        let height = Arc::new(AtomicU64::new(0.0_f64.to_bits()));
        let options = driver_sim::Options {
            wall: Some(table(&robot, &height)),
            ..options_of(&robot, &arm)
        };
        let driver = DriverThread::start(options);
        let mut config = SessionConfig::new(arm);
        config.clock = Clock::LockStep;
        config.record = true;
        config.on_refusal = policy;
        Self {
            session: Session::start(&robot, &config).unwrap(),
            height,
            _driver: driver,
        }
    }

    /// Moves the table to a height (mm).
    fn set_table(&self, height: f64) {
        self.height
            .store((height * 1e-3).to_bits(), Ordering::Release);
    }

    /// Executes commands; gives what was said until the last is over.
    pub(crate) fn execute(&self, text: &str) -> Vec<Note> {
        let read = crcl::text::read(text, &crcl::ReadOptions::default());
        assert!(!read.has_errors(), "{text}: {:?}", read.findings);
        let ids = self.session.submit(read.program.commands).unwrap();
        let last = *ids.last().unwrap();
        let mut notes = Vec::new();
        for _ in 0..900 {
            let note = self.session.note(Duration::from_millis(100));
            notes.extend(note.clone());
            match note {
                Some(Note::Done { id, .. }) if id == last => return notes,
                Some(Note::Refused { id, dropped, .. }) if id == last || dropped > 0 => {
                    return notes;
                }
                Some(Note::Faulted { .. } | Note::Closed) => return notes,
                _ => {}
            }
        }
        panic!("nothing ends: {notes:?}");
    }
}

impl Drop for Cell {
    fn drop(&mut self) {
        self.session.close();
    }
}

/// A level table at the height that is set (m). With a negative height nothing is known of the
/// distance below that height.
fn table(robot: &Robot, height: &Arc<AtomicU64>) -> Wall {
    let chain = robot.chain::<6>().unwrap();
    let chain = chain.with_tool(&robot.tooling().flange_from_tool());
    let height = Arc::clone(height);
    Wall {
        point: [0.0; 3],
        normal: [0.0, 0.0, 1.0],
        stiffness: STIFFNESS,
        places: Places::new(move |joints| {
            let pose = chain.forward(&SVector::from_column_slice(joints));
            let mut point: [f64; 3] = pose.translation.vector.into();
            let height = f64::from_bits(height.load(Ordering::Acquire));
            point[2] -= if height < 0.0 && point[2] < -height {
                f64::NAN
            } else {
                height
            };
            [point; 2]
        }),
    }
}

pub(crate) fn pose(z: f64) -> String {
    format!("{{{{420, 60, {z}}}, {{0, 0, -1}}, {{1, 0, 0}}}}")
}

fn guarded(notes: &[Note]) -> Vec<&Note> {
    let is = |note: &&Note| matches!(note, Note::Guarded { .. });
    notes.iter().filter(is).collect()
}

fn refusals(notes: &[Note]) -> Vec<String> {
    let why = |note: &Note| match note {
        Note::Refused { error, .. } => Some(error.message.clone()),
        _ => None,
    };
    notes.iter().filter_map(why).collect()
}

/// One guarded move: its table, its sensor, its limit.
struct Trial {
    height: f64,
    sensor: &'static str,
    kind: &'static str,
    limit: f64,
    speed: f64,
    acceleration: f64,
}

impl Trial {
    fn random(random: &mut Random) -> Self {
        let (sensor, kind, limit) = match random.between(0.0, 6.0) as u32 {
            0 => ("force", "OVER_MAX", random.between(1.0, 60.0)),
            1 => ("wrench.Fz", "OVER_MAX", random.between(1.0, 60.0)),
            2 => ("force", "INCREASE_OVER_LIMIT", random.between(1.0, 60.0)),
            3 => ("distance", "UNDER_MIN", random.between(-0.001, 0.02)),
            4 => (
                "distance",
                "DECREASE_BEYOND_LIMIT",
                random.between(0.001, 0.15),
            ),
            _ => ("digital_input_0", "OVER_MAX", 0.5),
        };
        Self {
            height: random.between(BELOW + 15.0, ABOVE - 25.0),
            sensor,
            kind,
            limit,
            speed: 10.0 * 50_f64.powf(random.between(0.0, 1.0)),
            acceleration: 100.0 * 30_f64.powf(random.between(0.0, 1.0)),
        }
    }

    /// Whether the guard trips where the tool is at `z` (m).
    fn trips(&self, z: f64) -> bool {
        let distance = z - self.height * 1e-3;
        let start = (ABOVE - self.height) * 1e-3;
        match self.kind {
            "UNDER_MIN" => distance < self.limit,
            "DECREASE_BEYOND_LIMIT" => start - distance > self.limit,
            _ if self.sensor == "digital_input_0" => distance < 0.0,
            _ => -distance * STIFFNESS > self.limit,
        }
    }

    fn run(&self, cell: &Cell) {
        cell.set_table(self.height);
        cell.execute(&format!(
            "SetRelativeSpeed(60)\nSetRelativeAcceleration(60)\nMoveTo({})",
            pose(ABOVE)
        ));
        drop(cell.session.samples());
        let notes = cell.execute(&format!(
            "SetAbsoluteSpeed({})\nSetAbsoluteAcceleration({})\nGuard({{\"{}\", \"{}\", {}}})\n\
             MoveStraightTo({})\nDwell(0.05)",
            self.speed,
            self.acceleration,
            self.sensor,
            self.kind,
            self.limit,
            pose(BELOW)
        ));
        assert_eq!(refusals(&notes), Vec::<String>::new());
        let said = guarded(&notes);
        let [
            Note::Guarded {
                id,
                sensor,
                peak,
                allowed_m,
                stopped_m,
                ..
            },
        ] = said.as_slice()
        else {
            panic!("{notes:?}");
        };
        assert_eq!(sensor, self.sensor);
        assert!(
            *stopped_m <= *allowed_m,
            "stopped in {stopped_m}, {allowed_m} stated, {} mm/s",
            self.speed
        );
        // A stop may wait where the plan itself is at a limit (decision 0060), but not for long.
        assert!(
            *allowed_m <= self.speed * 1e-3 * 0.3 + 1e-4,
            "{allowed_m} stated at {} mm/s",
            self.speed
        );
        self.judge(&cell.session.samples(), *id, [*peak, *allowed_m]);
    }

    /// The measured arm did what was said of it.
    fn judge(&self, samples: &[RunSample], id: u32, [peak, allowed]: [f64; 2]) {
        let height = |sample: &RunSample| sample.measured_pose.translation.vector.z;
        let first = samples.iter().position(|sample| self.trips(height(sample)));
        let after = &samples[first.expect("a sample that trips the guard")..];
        let way: f64 = after
            .windows(2)
            .map(|pair| (height(&pair[1]) - height(&pair[0])).abs())
            .sum();
        assert!(way <= allowed + 1e-6, "{way} m gone, {allowed} stated");
        let lowest = after.iter().map(height).fold(f64::INFINITY, f64::min);
        let deepest = self.height * 1e-3 - lowest;
        let expected = match self.sensor {
            "distance" => -deepest,
            "digital_input_0" => 1.0,
            _ => deepest * STIFFNESS,
        };
        assert!(
            // The measured arm may creep on by what counts as rest.
            (peak - expected).abs() < 0.2,
            "peak {peak}, {expected} seen"
        );
        for sample in samples.iter().filter(|sample| sample.command == id) {
            let point = sample.workstation_from_tool.translation.vector;
            let beside = (point.x - 0.42).hypot(point.y - 0.06);
            assert!(beside < 2e-5, "{beside} m beside the line");
        }
    }
}

/// Random speeds, tables and sensors: the arm never goes on farther than stated, on its line, and
/// the peak is that of the measured way. `CANTER_GUARDS=1000` runs as many.
#[test]
fn the_stop_is_within_what_was_stated() {
    let count = std::env::var("CANTER_GUARDS").map_or(25, |count| count.parse().unwrap());
    let cell = Cell::start("random", FailurePolicy::Abort);
    cell.execute("InitCanon()");
    let mut random = Random::new(14);
    for _ in 0..count {
        Trial::random(&mut random).run(&cell);
    }
}

/// Whether a guard that trips, or does not, is an error, is what the program says; after an error
/// the arm can go on, and a sensor that is not there moves nothing.
#[test]
fn a_guard_ends_as_the_program_says() {
    let cell = Cell::start("endings", FailurePolicy::Skip);
    cell.set_table(0.0);
    cell.execute(&format!(
        "InitCanon()\nSetRelativeSpeed(50)\nMoveTo({})",
        pose(ABOVE)
    ));
    let below = format!("MoveStraightTo({})", pose(ABOVE - 50.0));
    let above = format!("MoveStraightTo({})", pose(ABOVE));
    let go = |table: f64, guard: &str| {
        cell.set_table(table);
        cell.execute(&format!(
            "Guard({{\"force\", \"OVER_MAX\", 5{guard}}})\n{below}"
        ))
    };
    // Nothing in the way.
    assert!(refusals(&go(0.0, "")).is_empty());
    cell.execute(&above);
    let notes = go(0.0, ", \"RequireTrigger\"");
    assert!(refusals(&notes)[0].contains("has not tripped"), "{notes:?}");
    cell.execute(&above);
    // Something in the way.
    let notes = go(ABOVE - 20.0, ", \"RequireTrigger\"");
    assert!(
        refusals(&notes).is_empty() && guarded(&notes).len() == 1,
        "{notes:?}"
    );
    // It presses already: nothing moves at all.
    let before = cell.session.status().setpoint;
    let notes = cell.execute(&format!("Guard({{\"force\", \"OVER_MAX\", 5}})\n{below}"));
    assert_eq!(guarded(&notes).len(), 1, "{notes:?}");
    assert_eq!(before, cell.session.status().setpoint);
    cell.execute(&above);
    let notes = go(ABOVE - 20.0, ", \"ErrorOnTrigger\"");
    assert!(refusals(&notes)[0].contains("tripped at"), "{notes:?}");
    cell.execute(&above);
    // No such sensor.
    let before = cell.session.status().setpoint;
    let notes = cell.execute(&format!("Guard({{\"nothing\", \"OVER_MAX\", 5}})\n{below}"));
    assert!(
        refusals(&notes)[0].contains("no value of the sensor"),
        "{notes:?}"
    );
    assert_eq!(before, cell.session.status().setpoint);
    // A guard is for one command only, and one before Dwell ends the waiting.
    cell.set_table(ABOVE - 20.0);
    assert!(guarded(&cell.execute(&format!("{below}\nDwell(0.01)"))).is_empty());
    let notes = cell.execute("Guard({\"force\", \"OVER_MAX\", 5})\nDwell(1000)");
    assert_eq!(guarded(&notes).len(), 1, "{notes:?}");
}

/// A sensor that is lost on the way stops the arm on its path, and the command has failed.
#[test]
fn a_lost_sensor_ends_a_guarded_motion() {
    let cell = Cell::start("lost", FailurePolicy::Skip);
    cell.set_table(-(ABOVE - 60.0));
    let notes = cell.execute(&format!(
        "InitCanon()\nSetRelativeSpeed(50)\nMoveTo({})\nGuard({{\"distance\", \"UNDER_MIN\", 0}})\n\
         MoveStraightTo({})",
        pose(ABOVE),
        pose(BELOW)
    ));
    assert!(
        refusals(&notes)[0].contains("no value of the sensor"),
        "{notes:?}"
    );
    let [_, _, z] = cell.session.status().position_m;
    assert!(z * 1e3 < ABOVE - 60.0 && z * 1e3 > ABOVE - 120.0, "{z}");
    assert!(cell.session.status().fault.is_none());
}

/// A command behind a guarded one begins where the arm has stopped.
#[test]
fn the_program_goes_on_from_where_the_arm_stopped() {
    let cell = Cell::start("goes_on", FailurePolicy::Abort);
    cell.set_table(ABOVE - 40.0);
    let notes = cell.execute(&format!(
        "InitCanon()\nSetRelativeSpeed(50)\nMoveTo({})\nGuard({{\"force\", \"OVER_MAX\", 5}})\n\
         MoveStraightTo({})\nMoveStraightTo({})\nEndCanon(0)",
        pose(ABOVE),
        pose(BELOW),
        pose(ABOVE)
    ));
    assert_eq!(guarded(&notes).len(), 1, "{notes:?}");
    assert!(refusals(&notes).is_empty(), "{notes:?}");
    let [_, _, z] = cell.session.status().position_m;
    assert!((z * 1e3 - ABOVE).abs() < 0.5, "{z}");
}
