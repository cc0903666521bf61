//! The world of a workstation as boxes for the live view.

use std::path::{Path, PathBuf};

use plan::run::{Outcome, State};
use plan::world::{Class, Model, Reader, StoredRun};
use view::{ReadWorld, World, WorldObject};

use crate::failure::Failure;
use crate::world_file;

/// Reads a world again and again: a database as it changes, a workstation file as it is.
///
/// # Errors
/// It cannot be read.
pub(crate) fn reader(path: &Path) -> Result<ReadWorld, Failure> {
    let first = world_file::load(path)?;
    if world_file::is_workstation_file(path) {
        let world = boxes(&first, None);
        return Ok(Box::new(move || Some(world.clone())));
    }
    let path: PathBuf = path.to_owned();
    Ok(Box::new(move || {
        // A database that another process writes is read at the next time.
        let (model, run) = Reader::open(&path).ok()?.snapshot().ok()?;
        Some(boxes(&model, run))
    }))
}

fn boxes(model: &Model, run: Option<StoredRun>) -> World {
    let drawn = |object: &plan::world::Object| {
        // The arm is drawn by its URDF.
        if object.class.is_a(Class::Robot) {
            return None;
        }
        let shape = model.shape(object)?;
        let pose = model.workstation_from(object.id).ok()?;
        let (place, turn) = (pose.translation, pose.rotation);
        Some(WorldObject {
            name: object.name.clone(),
            class: object.class.name().to_owned(),
            pose: [place.x, place.y, place.z, turn.w, turn.i, turn.j, turn.k],
            size: [shape.length, shape.width, shape.height],
        })
    };
    World {
        objects: model.objects().filter_map(drawn).collect(),
        plan: run.map(|run| words(&run)),
    }
}

/// Where a plan is, in one sentence.
fn words(run: &StoredRun) -> String {
    let state = serde_json::from_str::<State>(&run.state);
    let done = state.map(|state| state.counters).unwrap_or_default();
    let outcome = run.outcome.as_ref().map(|text| serde_json::from_str(text));
    let now = match (outcome, &run.under_way) {
        (Some(Ok(Outcome::Failed { reason, .. })), _) => format!("failed: {reason}"),
        (Some(_), _) => "ended".to_owned(),
        (None, Some(step)) => step.clone(),
        (None, None) => "between two steps".to_owned(),
    };
    format!(
        "plan {}: {now}; done: {} statements, {} kits, {} errands of the factotum",
        run.plan, done.statements, done.kits, done.factotum_calls
    )
}
