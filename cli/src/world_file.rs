//! Opens worlds that users name: a database, or a workstation file.

use std::path::{Path, PathBuf};

use plan::PlanError;
use plan::world::{Durability, Model, Reader, Writer, import_json, import_nist, import_toml};
use tempfile::TempDir;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::input;

/// Reads a workstation file (TOML, JSON, NIST's XML) or a database, by its extension.
pub(crate) fn load(path: &Path) -> Result<Model, Failure> {
    let unreadable = |error: plan::PlanError| {
        Failure::new(
            Exit::Unreadable,
            anyhow::anyhow!("{}: {error}", path.display()),
        )
    };
    let Some(import) = importer(path) else {
        input::unreadable(&path.display().to_string(), input::check_regular(path))?;
        return Reader::open(path)
            .and_then(|reader| reader.model())
            .map_err(unreadable);
    };
    import(&input::text(path)?).map_err(unreadable)
}

type Importer = fn(&str) -> Result<Model, PlanError>;

/// How a workstation file of this name is read; none for a database.
fn importer(path: &Path) -> Option<Importer> {
    match path.extension()?.to_str()? {
        "toml" => Some(import_toml),
        "json" => Some(import_json),
        "xml" => Some(import_nist),
        _ => None,
    }
}

/// Whether the name is that of a workstation file.
pub(crate) fn is_workstation_file(path: &Path) -> bool {
    importer(path).is_some()
}

/// The exit code for an error of a world or a plan.
pub(crate) fn refused(error: PlanError) -> Failure {
    let exit = match error {
        PlanError::Database(_)
        | PlanError::File { .. }
        | PlanError::Lost { .. }
        | PlanError::Schema { .. }
        | PlanError::Stored { .. } => Exit::Unreadable,
        _ => Exit::Refused,
    };
    Failure::new(exit, error)
}

/// A database for one run.
pub(crate) struct Database {
    /// Where it is.
    pub(crate) path: PathBuf,
    /// The folder of a copy that goes away.
    _folder: Option<TempDir>,
}

impl Database {
    /// The database itself, or a copy if `copy` is wanted or `world` is a file: in the new file
    /// `keep`, or in a temporary one. The last run of a database is copied as well.
    ///
    /// # Errors
    /// [`Exit::Unreadable`]: no such world, or a file of the name `keep` exists. [`Exit::Refused`]:
    /// another process writes the database.
    pub(crate) fn open(
        world: &Path,
        copy: bool,
        keep: Option<&Path>,
    ) -> Result<(Self, Writer), Failure> {
        let unreadable = |error| Failure::new(Exit::Unreadable, error);
        if !(copy || keep.is_some() || is_workstation_file(world)) {
            if !world.exists() {
                let missing = anyhow::anyhow!("{}: there is no such database", world.display());
                return Err(unreadable(missing));
            }
            let (path, _folder) = (world.to_owned(), None);
            let writer = Writer::open(&path, Durability::Full).map_err(refused)?;
            return Ok((Self { path, _folder }, writer));
        }
        let (path, _folder) = if let Some(keep) = keep {
            if keep.exists() {
                let there = anyhow::anyhow!("{}: there is such a file already", keep.display());
                return Err(unreadable(there));
            }
            (keep.to_owned(), None)
        } else {
            let folder = tempfile::Builder::new().prefix("canter-").tempdir()?;
            (folder.path().join("world.db"), Some(folder))
        };
        let writer = copied(world, &path)?;
        Ok((Self { path, _folder }, writer))
    }
}

/// A new database with the world, and the last run, of another or of a workstation file.
fn copied(world: &Path, path: &Path) -> Result<Writer, Failure> {
    let unreadable = |error: PlanError| Failure::new(Exit::Unreadable, error);
    let (model, run) = if is_workstation_file(world) {
        (load(world)?, None)
    } else {
        input::unreadable(&world.display().to_string(), input::check_regular(world))?;
        let reader = Reader::open(world).map_err(unreadable)?;
        reader.snapshot().map_err(unreadable)?
    };
    let mut writer = Writer::open(path, Durability::Process).map_err(unreadable)?;
    writer.replace(&model).map_err(unreadable)?;
    if let Some(run) = run {
        let id = writer.begin_run(&run).map_err(unreadable)?;
        let change = Some((id, run.state.as_str(), run.outcome.as_deref()));
        writer.commit(&[], change).map_err(unreadable)?;
    }
    Ok(writer)
}
