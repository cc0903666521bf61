//! Reading the world database.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use rusqlite::{Connection, OpenFlags, Row};

use super::object::DesignPart;
use super::stored_run::{StoredRun, last_run};
use super::{
    BoxVolume, Class, Design, Location, Model, Object, ObjectId, Relation, Scalar, Shape, Sku,
    Units, schema,
};
use crate::PlanError;

/// A read-only connection to the world database: what the interpreter gets.
///
/// The connection is opened read-only and the type has no method that writes.
#[derive(Debug)]
pub struct Reader {
    connection: Connection,
}

impl Reader {
    /// Opens the database in `path`, which must exist.
    ///
    /// # Errors
    /// [`PlanError::Database`] or [`PlanError::Schema`].
    pub fn open(path: &Path) -> Result<Self, PlanError> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let connection = Connection::open_with_flags(path, flags)?;
        connection.pragma_update(None, "query_only", true)?;
        connection.busy_timeout(std::time::Duration::from_secs(5))?;
        let found = schema::version(&connection)?;
        schema::check_known(found)?;
        if found < schema::newest() {
            let what = format!("schema version {found} is old; open it once for writing");
            return Err(PlanError::Stored {
                place: "database".into(),
                what,
            });
        }
        Ok(Self { connection })
    }

    /// Reads the whole world, consistently.
    ///
    /// # Errors
    /// [`PlanError::Database`], or [`PlanError::Stored`] for contents that cannot be understood.
    pub fn model(&self) -> Result<Model, PlanError> {
        let transaction = self.connection.unchecked_transaction()?;
        load(&transaction)
    }

    /// The whole world and the latest run, both as of the same commit.
    ///
    /// # Errors
    /// As [`Reader::model`].
    pub fn snapshot(&self) -> Result<(Model, Option<StoredRun>), PlanError> {
        let transaction = self.connection.unchecked_transaction()?;
        Ok((load(&transaction)?, last_run(&transaction)?))
    }

    /// The latest run, or none.
    ///
    /// # Errors
    /// [`PlanError::Database`].
    pub fn last_run(&self) -> Result<Option<StoredRun>, PlanError> {
        last_run(&self.connection)
    }

    /// Number of the last commit; a model with the same number is up to date.
    ///
    /// # Errors
    /// [`PlanError::Database`].
    pub fn revision(&self) -> Result<i64, PlanError> {
        let mut statement = self
            .connection
            .prepare_cached("SELECT revision FROM workstation")?;
        Ok(statement.query_row([], |row| row.get(0))?)
    }
}

/// Loads everything through an open connection.
pub(crate) fn load(connection: &Connection) -> Result<Model, PlanError> {
    let mut model = Model::default();
    let row = connection.query_row(
        "SELECT length_unit, angle_unit, weight_unit, next_object, revision, arm FROM workstation",
        [],
        |row| {
            let units = Units {
                length: row.get(0)?,
                angle: row.get(1)?,
                weight: row.get(2)?,
            };
            Ok((
                units,
                row.get(3)?,
                row.get(4)?,
                row.get::<_, Option<String>>(5)?,
            ))
        },
    );
    match row {
        Ok((units, next, revision, arm)) => {
            (model.units, model.next, model.revision) = (units, next, revision);
            model.arm = arm.map(|text| pose_from_text(&text, "arm")).transpose()?;
        }
        Err(rusqlite::Error::QueryReturnedNoRows) => {
            return Err(PlanError::Missing(
                "workstation (the database is empty)".into(),
            ));
        }
        Err(error) => return Err(error.into()),
    }
    model.skus = Arc::new(load_skus(connection)?);
    model.designs = Arc::new(load_designs(connection)?);
    model.objects = load_objects(connection)?;
    model.volumes = Arc::new(load_volumes(connection)?);
    Ok(model)
}

fn load_skus(connection: &Connection) -> Result<BTreeMap<String, Sku>, PlanError> {
    let mut skus = BTreeMap::new();
    let mut statement = connection.prepare_cached(
        "SELECT id, description, length, width, height, has_top, weight, grasp FROM sku",
    )?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let shape = match (
            row.get(2)?,
            row.get(3)?,
            row.get(4)?,
            row.get::<_, Option<i64>>(5)?,
        ) {
            (Some(length), Some(width), Some(height), has_top) => Some(Shape {
                length,
                width,
                height,
                has_top: has_top != Some(0),
            }),
            _ => None,
        };
        let id: String = row.get(0)?;
        let grasp: Option<String> = row.get(7)?;
        let grasp = grasp.map(|text| pose_from_text(&text, &id)).transpose()?;
        let (description, weight) = (row.get(1)?, row.get(6)?);
        let sku = Sku {
            id: id.clone(),
            description,
            shape,
            weight,
            effectors: Vec::new(),
            grasp,
        };
        skus.insert(id, sku);
    }
    let mut statement = connection
        .prepare_cached("SELECT sku, effector FROM sku_effector ORDER BY sku, position")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        if let Some(sku) = skus.get_mut(&row.get::<_, String>(0)?) {
            sku.effectors.push(row.get(1)?);
        }
    }
    Ok(skus)
}

fn load_designs(connection: &Connection) -> Result<BTreeMap<String, Design>, PlanError> {
    let mut designs = BTreeMap::new();
    let mut statement = connection.prepare_cached("SELECT id, tray_sku FROM design")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let id: String = row.get(0)?;
        let design = Design {
            id: id.clone(),
            tray_sku: row.get(1)?,
            parts: Vec::new(),
        };
        designs.insert(id, design);
    }
    let mut statement = connection
        .prepare_cached("SELECT design, sku, pose FROM design_part ORDER BY design, position")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let id: String = row.get(0)?;
        let pose = pose_from_text(&row.get::<_, String>(2)?, &id)?;
        if let Some(design) = designs.get_mut(&id) {
            design.parts.push(DesignPart {
                sku: row.get(1)?,
                pose,
            });
        }
    }
    Ok(designs)
}

fn load_objects(connection: &Connection) -> Result<BTreeMap<ObjectId, Arc<Object>>, PlanError> {
    let mut objects = BTreeMap::new();
    let mut statement = connection
        .prepare_cached("SELECT id, name, class, reference, relation, pose FROM object")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let object = object_from_row(row)?;
        objects.insert(object.id, object);
    }
    let mut statement = connection.prepare_cached("SELECT object, name, value FROM property")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let Some(object) = objects.get_mut(&ObjectId(row.get(0)?)) else {
            continue;
        };
        let name: String = row.get(1)?;
        let value: Scalar =
            serde_json::from_str(&row.get::<_, String>(2)?).map_err(|error| PlanError::Stored {
                place: format!("{}.{name}", object.name),
                what: error.to_string(),
            })?;
        object.properties.insert(name, value);
    }
    Ok(objects
        .into_iter()
        .map(|(id, object)| (id, Arc::new(object)))
        .collect())
}

fn object_from_row(row: &Row<'_>) -> Result<Object, PlanError> {
    let id = ObjectId(row.get(0)?);
    let name: String = row.get(1)?;
    let stored = |what: String| PlanError::Stored {
        place: name.clone(),
        what,
    };
    let class: Class = row.get::<_, String>(2)?.parse().map_err(stored)?;
    let reference = ObjectId(row.get(3)?);
    let relation: String = row.get(4)?;
    let relation = Relation::from_name(&relation)
        .ok_or_else(|| stored(format!("unknown relation {relation}")))?;
    let pose = pose_from_text(&row.get::<_, String>(5)?, &name)?;
    Ok(Object::new(
        id,
        name.clone(),
        class,
        Location {
            reference,
            relation,
            pose,
        },
    ))
}

fn load_volumes(connection: &Connection) -> Result<Vec<BoxVolume>, PlanError> {
    let mut volumes = Vec::new();
    let mut statement = connection
        .prepare_cached("SELECT robot, minimum, maximum FROM volume ORDER BY robot, position")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let corner = |column: usize| -> Result<[f64; 3], PlanError> {
            let text: String = row.get(column)?;
            serde_json::from_str(&text).map_err(|error| PlanError::Stored {
                place: "volume".into(),
                what: error.to_string(),
            })
        };
        let (minimum, maximum) = (corner(1)?, corner(2)?);
        volumes.push(BoxVolume {
            robot: ObjectId(row.get(0)?),
            minimum,
            maximum,
        });
    }
    Ok(volumes)
}

/// A pose as stored: `x y z i j k w` (m, unit quaternion), exact to the last bit.
pub(crate) fn pose_to_text(pose: &Isometry3<f64>) -> String {
    let (t, r) = (&pose.translation, pose.rotation.quaternion());
    format!("{} {} {} {} {} {} {}", t.x, t.y, t.z, r.i, r.j, r.k, r.w)
}

/// The pose that [`pose_to_text`] wrote; `place` names it in the error.
pub(crate) fn pose_from_text(text: &str, place: &str) -> Result<Isometry3<f64>, PlanError> {
    let stored = || PlanError::Stored {
        place: place.to_owned(),
        what: format!("not a pose: {text}"),
    };
    let numbers: Vec<f64> = text
        .split(' ')
        .map(str::parse)
        .collect::<Result<_, _>>()
        .map_err(|_| stored())?;
    let [x, y, z, i, j, k, w] = numbers[..] else {
        return Err(stored());
    };
    let quaternion = Quaternion::new(w, i, j, k);
    let whole = quaternion.norm() + x.abs() + y.abs() + z.abs();
    if !whole.is_finite() || (quaternion.norm() - 1.0).abs() > 1e-6 {
        return Err(stored());
    }
    let rotation = UnitQuaternion::new_unchecked(quaternion);
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}
