//! Worlds as users name them: a database, or a workstation file.

use std::path::{Path, PathBuf};

use plan::world::{Durability, Model, Reader, Writer, import_json, import_nist, import_toml};

use crate::exit::Exit;
use crate::failure::Failure;

/// Reads a workstation file (TOML, JSON, NIST's XML) or a database, by its extension.
pub(crate) fn load(path: &Path) -> Result<Model, Failure> {
    let unreadable = |error: plan::PlanError| {
        Failure::new(
            Exit::Unreadable,
            anyhow::anyhow!("{}: {error}", path.display()),
        )
    };
    let Some(import) = importer(path) else {
        return Reader::open(path)
            .and_then(|reader| reader.model())
            .map_err(unreadable);
    };
    import(&read(path)?).map_err(unreadable)
}

type Importer = fn(&str) -> Result<Model, plan::PlanError>;

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

/// The text of a file.
pub(crate) fn read(path: &Path) -> Result<String, Failure> {
    std::fs::read_to_string(path).map_err(|error| {
        Failure::new(
            Exit::Unreadable,
            anyhow::anyhow!("{}: {error}", path.display()),
        )
    })
}

/// A database for one run: its path and whether it is deleted afterwards.
pub(crate) struct Database {
    /// Where it is.
    pub(crate) path: PathBuf,
    temporary: bool,
}

impl Database {
    /// The database itself, or with `copy` a copy of the world in a new one that goes away.
    pub(crate) fn open(world: &Path, copy: bool) -> Result<(Self, Writer), Failure> {
        let temporary = copy || is_workstation_file(world);
        let path = if temporary {
            std::env::temp_dir().join(format!("canter-{}.db", std::process::id()))
        } else {
            world.to_owned()
        };
        let durability = if temporary {
            Durability::Process
        } else {
            Durability::Full
        };
        let unreadable = |error| Failure::new(Exit::Unreadable, error);
        if !temporary && !path.exists() {
            let missing = anyhow::anyhow!("{}: there is no such database", path.display());
            return Err(Failure::new(Exit::Unreadable, missing));
        }
        let model = temporary.then(|| load(world)).transpose()?;
        let database = Self { path, temporary };
        let mut writer = Writer::open(&database.path, durability).map_err(unreadable)?;
        if let Some(model) = model {
            writer.replace(&model).map_err(unreadable)?;
        }
        Ok((database, writer))
    }
}

impl Drop for Database {
    fn drop(&mut self) {
        if self.temporary {
            for ending in ["", "-wal", "-shm"] {
                // What cannot be deleted is in the folder for such things.
                let _ = std::fs::remove_file(format!("{}{ending}", self.path.display()));
            }
        }
    }
}
