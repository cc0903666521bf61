use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use plan::finding::Severity;
use plan::run::{Outcome, State};
use plan::world::{Durability, Model, ObjectId, Reader, Writer, check, export_json, export_toml};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::{output, world_file};

/// The world model: what is where in the workstation
#[derive(Args, Debug)]
pub(crate) struct World {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Show the objects, each below what it is located relative to, and the last run of a plan
    Show {
        /// Database, or workstation file (.toml, .json, .xml)
        world: PathBuf,
    },
    /// Check that the world is consistent
    Check {
        /// Database, or workstation file (.toml, .json, .xml)
        world: PathBuf,
        /// Print the findings as JSON
        #[arg(long)]
        json: bool,
    },
    /// Make a database from a workstation file, or replace the world in it; its runs are deleted
    Import {
        /// Workstation file: .toml, .json, or NIST's .xml
        file: PathBuf,
        /// The database
        database: PathBuf,
    },
    /// Print the world as TOML
    Export {
        /// Database, or workstation file (.toml, .json, .xml)
        world: PathBuf,
        /// As JSON
        #[arg(long)]
        json: bool,
    },
}

impl World {
    /// Does what was asked for.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        match &self.what {
            What::Show { world } => {
                show(&world_file::load(world)?)?;
                tell_run(world)
            }
            What::Check { world, json } => report(&world_file::load(world)?, *json),
            What::Import { file, database } => {
                let model = world_file::load(file)?;
                let mut writer =
                    Writer::open(database, Durability::Full).map_err(world_file::refused)?;
                writer.replace(&model).map_err(world_file::refused)?;
                let objects = model.objects().count();
                output::note(&format!("{objects} objects in {}", database.display()));
                Ok(Exit::Done)
            }
            What::Export { world, json } => {
                let model = world_file::load(world)?;
                let text = if *json {
                    export_json(&model)
                } else {
                    export_toml(&model)
                };
                let text = text.map_err(|error| Failure::new(Exit::Unreadable, error))?;
                io::stdout().lock().write_all(text.as_bytes())?;
                Ok(Exit::Done)
            }
        }
    }
}

fn show(model: &Model) -> Result<Exit, Failure> {
    let workstation = model
        .workstation()
        .map_err(|error| Failure::new(Exit::Refused, error))?;
    let mut out = BufWriter::new(io::stdout().lock());
    let mut open: Vec<(ObjectId, usize)> = vec![(workstation.id, 0)];
    while let Some((id, depth)) = open.pop() {
        let Ok(object) = model.object(id) else {
            continue;
        };
        let place = match model.workstation_from(id) {
            Ok(pose) => {
                let t = pose.translation;
                format!("({:.1}, {:.1}, {:.1}) mm", t.x * 1e3, t.y * 1e3, t.z * 1e3)
            }
            Err(_) => format!("{} it", object.location.relation.name()),
        };
        let sku = object
            .sku()
            .map(|sku| format!(" {sku}"))
            .unwrap_or_default();
        let indent = depth * 2;
        writeln!(
            out,
            "{:indent$}{} [{}{sku}] {place}",
            "", object.name, object.class
        )?;
        let mut children: Vec<_> = model
            .children(id)
            .map(|child| (child.id, depth + 1))
            .collect();
        children.reverse();
        open.extend(children);
    }
    out.flush()?;
    Ok(Exit::Done)
}

/// Prints the last run of a plan in a database: how far it came, or how it ended.
fn tell_run(world: &Path) -> Result<Exit, Failure> {
    let unreadable = |error| Failure::new(Exit::Unreadable, error);
    if world_file::is_workstation_file(world) {
        return Ok(Exit::Done);
    }
    let reader = Reader::open(world).map_err(unreadable)?;
    let Some(run) = reader.last_run().map_err(unreadable)? else {
        return Ok(Exit::Done);
    };
    let mut out = io::stdout().lock();
    let state = serde_json::from_str::<State>(&run.state).ok();
    let (statements, kits) = state.map_or((0, 0), |state| {
        (state.counters.statements, state.counters.kits)
    });
    write!(
        out,
        "\nlast run: plan {}, {statements} statements, {kits} kits",
        run.plan
    )?;
    let outcome = run.outcome.map(|text| serde_json::from_str(&text));
    match (outcome, run.under_way) {
        (Some(Ok(Outcome::Failed { code, reason })), _) => {
            writeln!(out, "; failed: {reason} (EndCanon({code}))")?;
        }
        (Some(_), _) => writeln!(out, "; ended")?,
        (None, Some(step)) => writeln!(out, "; not ended, {step} was not finished")?,
        (None, None) => writeln!(out, "; not ended")?,
    }
    Ok(Exit::Done)
}

fn report(model: &Model, json: bool) -> Result<Exit, Failure> {
    let concerns = check(model);
    let bad = concerns
        .iter()
        .any(|concern| concern.severity == Severity::Error);
    if json {
        let list: Vec<_> = concerns
            .iter()
            .map(|c| {
                serde_json::json!({"severity": c.severity, "code": c.code, "subject": c.subject, "message": c.message})
            })
            .collect();
        output::json(&serde_json::json!({"consistent": !bad, "concerns": list}))?;
    } else {
        let mut out = io::stdout().lock();
        for concern in &concerns {
            let severity = if concern.severity == Severity::Error {
                "error"
            } else {
                "warning"
            };
            writeln!(out, "{severity}: {}: {}", concern.subject, concern.message)?;
        }
        let verdict = if bad { "not consistent" } else { "consistent" };
        writeln!(out, "{} objects, {verdict}", model.objects().count())?;
    }
    Ok(if bad { Exit::Refused } else { Exit::Done })
}
