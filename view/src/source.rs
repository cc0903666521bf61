//! What is shown.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ipc::Arm;
use planner::robot::Robot;
use recorder::Recorded;
use serde_json::{Value, json};

use crate::blocks::Blocks;
use crate::live_periods::LivePeriods;
use crate::{PoseList, World};

/// What is shown.
#[derive(Debug)]
pub enum Source {
    /// A running arm.
    Arm(Arm),
    /// A recording, and the robot's folder where its meshes are.
    Recording {
        /// All that the file has.
        recorded: Box<Recorded>,
        /// The folder; without it an arm of meshes is not drawn.
        folder: Option<PathBuf>,
    },
    /// A program that is planned and not executed: name, form (`text` or `json`), text.
    Program {
        /// The robot.
        robot: Box<Robot>,
        /// Name, form and text.
        program: [String; 3],
    },
    /// Lists of poses with the motions through them.
    Lists {
        /// The robot that they were planned for; none for a tool without an arm.
        robot: Option<Box<Robot>>,
        /// The lists.
        lists: Vec<PoseList>,
    },
}

/// A text for all pages, with a number that grows when it changes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Posted {
    pub(crate) number: u64,
    pub(crate) text: Arc<str>,
}

/// What all pages see.
#[derive(Debug, Default)]
pub(crate) struct Board {
    pub(crate) blocks: Blocks,
    /// Every period, for viewers of other programs.
    pub(crate) periods: LivePeriods,
    /// The robot, with its URDF.
    robot: Mutex<Posted>,
    /// Where the session is.
    status: Mutex<Posted>,
    /// The program with its text.
    program: Mutex<Posted>,
    /// What stands in the workstation.
    world: Mutex<Posted>,
    /// The table of lists of poses.
    lists: Mutex<Posted>,
    /// The same program, planned.
    preview: Mutex<Posted>,
    /// What happened, the last few hundred.
    notes: Mutex<(u64, Vec<Value>)>,
}

/// The notes that a page gets when it comes.
const KEPT_NOTES: usize = 200;

fn locked<T>(value: &Mutex<T>) -> MutexGuard<'_, T> {
    value.lock().unwrap_or_else(PoisonError::into_inner)
}

fn post(place: &Mutex<Posted>, value: &Value) {
    let text: Arc<str> = value.to_string().into();
    let mut posted = locked(place);
    if posted.text != text {
        posted.number += 1;
        posted.text = text;
    }
}

impl Board {
    pub(crate) fn set_robot(&self, robot: &Value) {
        post(&self.robot, &json!({"is": "robot", "robot": robot}));
    }

    pub(crate) fn set_status(&self, status: &Value) {
        post(&self.status, status);
    }

    pub(crate) fn set_world(&self, world: &World) {
        post(&self.world, &json!({"is": "world", "world": world}));
    }

    pub(crate) fn set_program(&self, program: &Value) {
        post(&self.program, &json!({"is": "program", "program": program}));
    }

    pub(crate) fn set_lists(&self, table: &Value) {
        post(&self.lists, table);
    }

    pub(crate) fn set_preview(&self, preview: &Value) {
        post(&self.preview, preview);
    }

    /// Adds something that happened.
    pub(crate) fn add_note(&self, note: Value) {
        let mut notes = locked(&self.notes);
        notes.0 += 1;
        let number = notes.0;
        notes.1.push(json!({"number": number, "note": note}));
        if notes.1.len() > KEPT_NOTES {
            notes.1.remove(0);
        }
    }

    /// The texts that changed since a page saw them.
    pub(crate) fn fresh(&self, seen: &mut Seen) -> Vec<Arc<str>> {
        let mut texts = Vec::new();
        let places = [
            (&self.robot, &mut seen.robot),
            (&self.status, &mut seen.status),
            (&self.world, &mut seen.world),
            (&self.program, &mut seen.program),
            (&self.lists, &mut seen.lists),
            (&self.preview, &mut seen.preview),
        ];
        for (place, seen) in places {
            let posted = locked(place).clone();
            if posted.number > *seen {
                *seen = posted.number;
                texts.push(posted.text);
            }
        }
        let notes = locked(&self.notes);
        if notes.0 > seen.notes {
            let after = |note: &&Value| note["number"].as_u64() > Some(seen.notes);
            let later: Vec<&Value> = notes.1.iter().filter(after).collect();
            texts.push(json!({"is": "notes", "notes": later}).to_string().into());
            seen.notes = notes.0;
        }
        texts
    }
}

impl Seen {
    /// A page that comes now: it gets what is posted, and blocks from now on.
    pub(crate) fn from_now(board: &Board) -> Self {
        Self {
            blocks: board.blocks.count(),
            ..Self::default()
        }
    }
}

/// What a page has seen of the board.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    pub(crate) blocks: u64,
    robot: u64,
    status: u64,
    world: u64,
    program: u64,
    lists: u64,
    preview: u64,
    notes: u64,
}
