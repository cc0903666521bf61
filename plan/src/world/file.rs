//! A workstation as TOML or JSON, in the workstation's own units.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Isometry3, Translation3};
use serde::{Deserialize, Serialize};

use super::class::{Kind, stored_property};
use super::object::DesignPart;
use super::place::{from_axes, from_roll_pitch_yaw};
use super::{
    BoxVolume, Change, Class, Design, Location, Model, Object, ObjectId, Relation, Scalar, Shape,
    Sku, Units,
};
use crate::PlanError;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    units: Units,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    arm: Option<Place>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    sku: Vec<SkuEntry>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    design: Vec<DesignEntry>,
    object: Vec<ObjectEntry>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    volume: Vec<VolumeEntry>,
}

/// A pose in files: a point and either roll, pitch, yaw or two axes.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Place {
    point: [f64; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rpy: Option<[f64; 3]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    x_axis: Option<[f64; 3]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    z_axis: Option<[f64; 3]>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ShapeEntry {
    length: f64,
    width: f64,
    height: f64,
    #[serde(default = "yes")]
    has_top: bool,
}

fn yes() -> bool {
    true
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SkuEntry {
    id: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    description: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    weight: Option<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    end_effectors: Vec<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    shape: Option<ShapeEntry>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    grasp: Option<Place>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DesignEntry {
    id: String,
    tray: String,
    #[serde(default)]
    part: Vec<PartEntry>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PartEntry {
    sku: String,
    pose: Place,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ObjectEntry {
    name: String,
    class: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reference: Option<String>,
    #[serde(default = "pose_relation", skip_serializing_if = "is_pose_relation")]
    relation: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pose: Option<Place>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    properties: BTreeMap<String, Scalar>,
}

fn pose_relation() -> String {
    "pose".into()
}

fn is_pose_relation(relation: &String) -> bool {
    relation == "pose"
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct VolumeEntry {
    robot: String,
    minimum: [f64; 3],
    maximum: [f64; 3],
}

/// Reads a workstation from TOML.
///
/// # Errors
/// [`PlanError::Import`] with line and column, or with the object and what is wrong with it.
pub fn import_toml(text: &str) -> Result<Model, PlanError> {
    let file: File = toml::from_str(text).map_err(|e| PlanError::Import(e.to_string()))?;
    model_of(file)
}

/// Reads a workstation from JSON.
///
/// # Errors
/// As [`import_toml`].
pub fn import_json(text: &str) -> Result<Model, PlanError> {
    let file: File = serde_json::from_str(text).map_err(|e| PlanError::Import(e.to_string()))?;
    model_of(file)
}

/// Writes the world as TOML that [`import_toml`] reads.
///
/// # Errors
/// [`PlanError::Import`] for an unknown unit or a reference to a missing object.
pub fn export_toml(model: &Model) -> Result<String, PlanError> {
    toml::to_string(&file_of(model)?).map_err(|e| PlanError::Import(e.to_string()))
}

/// Writes the world as JSON that [`import_json`] reads.
///
/// # Errors
/// As [`export_toml`].
pub fn export_json(model: &Model) -> Result<String, PlanError> {
    serde_json::to_string_pretty(&file_of(model)?).map_err(|e| PlanError::Import(e.to_string()))
}

/// Factors from the units of a file to metres and radians.
#[derive(Clone, Copy)]
struct Factors {
    metres: f64,
    radians: f64,
}

fn factors(units: &Units) -> Result<Factors, PlanError> {
    let bad = |kind: &str, unit: &str| PlanError::Import(format!("unknown {kind} unit {unit}"));
    Ok(Factors {
        metres: units.metres().ok_or_else(|| bad("length", &units.length))?,
        radians: units.radians().ok_or_else(|| bad("angle", &units.angle))?,
    })
}

fn pose_in(place: &Place, f: Factors, whose: &str) -> Result<Isometry3<f64>, PlanError> {
    let point = place.point.map(|c| c * f.metres);
    let fail = |why: String| PlanError::Import(format!("pose of {whose}: {why}"));
    match (place.rpy, place.x_axis, place.z_axis) {
        (rpy, None, None) => {
            let [roll, pitch, yaw] = rpy.unwrap_or_default().map(|a| a * f.radians);
            let rotation = from_roll_pitch_yaw(roll, pitch, yaw);
            let pose = Isometry3::from_parts(Translation3::from(point), rotation);
            let finite = pose.translation.vector.iter().all(|c| c.is_finite())
                && pose.rotation.coords.iter().all(|c| c.is_finite());
            if finite {
                Ok(pose)
            } else {
                Err(fail("it is not finite".into()))
            }
        }
        (None, Some(x_axis), Some(z_axis)) => from_axes(point, x_axis, z_axis).map_err(fail),
        _ => Err(fail("give rpy, or x_axis and z_axis, or neither".into())),
    }
}

/// Twelve significant digits: conversions of units leave no rounding errors in files.
fn tidy(value: f64) -> f64 {
    let rounded = format!("{value:.11e}").parse().unwrap_or(value);
    if rounded == 0.0 { 0.0 } else { rounded }
}

fn place_of(pose: &Isometry3<f64>, f: Factors) -> Place {
    let t = &pose.translation;
    let point = [t.x, t.y, t.z].map(|c| tidy(c / f.metres));
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    let rpy = [roll, pitch, yaw].map(|a| tidy(a / f.radians));
    let plain = pose.rotation.angle() == 0.0;
    Place {
        point,
        rpy: (!plain).then_some(rpy),
        x_axis: None,
        z_axis: None,
    }
}

fn model_of(file: File) -> Result<Model, PlanError> {
    let f = factors(&file.units)?;
    let mut model = Model {
        units: file.units,
        next: 1,
        ..Model::default()
    };
    model.arm = file
        .arm
        .as_ref()
        .map(|arm| pose_in(arm, f, "arm"))
        .transpose()?;
    let mut skus = BTreeMap::new();
    for entry in file.sku {
        let sku = sku_in(entry, f)?;
        let id = sku.id.clone();
        if skus.insert(id.clone(), sku).is_some() {
            return Err(PlanError::DuplicateName(id));
        }
    }
    model.skus = Arc::new(skus);
    let mut designs = BTreeMap::new();
    for entry in file.design {
        let mut design = Design {
            id: entry.id,
            tray_sku: entry.tray,
            parts: Vec::new(),
        };
        for part in entry.part {
            let pose = pose_in(&part.pose, f, &design.id)?;
            design.parts.push(DesignPart {
                sku: part.sku,
                pose,
            });
        }
        let id = design.id.clone();
        if designs.insert(id.clone(), design).is_some() {
            return Err(PlanError::DuplicateName(id));
        }
    }
    model.designs = Arc::new(designs);
    add_objects(&mut model, file.object, f)?;
    let volumes = volumes_in(&model, file.volume, f)?;
    model.volumes = Arc::new(volumes);
    model.workstation()?;
    Ok(model)
}

fn volumes_in(
    model: &Model,
    entries: Vec<VolumeEntry>,
    f: Factors,
) -> Result<Vec<BoxVolume>, PlanError> {
    let mut volumes = Vec::new();
    for entry in entries {
        let robot = model
            .named(&entry.robot)
            .ok_or_else(|| PlanError::NoObject(entry.robot))?
            .id;
        let corner = |corner: [f64; 3]| corner.map(|c| c * f.metres);
        let (minimum, maximum) = (corner(entry.minimum), corner(entry.maximum));
        if !minimum.iter().chain(&maximum).all(|c| c.is_finite()) {
            let robot = &model.object(robot)?.name;
            return Err(PlanError::Import(format!(
                "volume of {robot}: it is not finite"
            )));
        }
        volumes.push(BoxVolume {
            robot,
            minimum,
            maximum,
        });
    }
    Ok(volumes)
}

fn sku_in(entry: SkuEntry, f: Factors) -> Result<Sku, PlanError> {
    let grasp = entry
        .grasp
        .as_ref()
        .map(|grasp| pose_in(grasp, f, &entry.id))
        .transpose()?;
    let shape = entry.shape.map(|shape| Shape {
        length: shape.length * f.metres,
        width: shape.width * f.metres,
        height: shape.height * f.metres,
        has_top: shape.has_top,
    });
    let sku = Sku {
        id: entry.id,
        description: entry.description,
        shape,
        weight: entry.weight,
        effectors: entry.end_effectors,
        grasp,
    };
    sku.check().map_err(PlanError::Import)?;
    Ok(sku)
}

/// Two passes, because an object may refer to one that comes later.
fn add_objects(model: &mut Model, entries: Vec<ObjectEntry>, f: Factors) -> Result<(), PlanError> {
    let mut places: Vec<(ObjectId, Option<String>, Relation, Isometry3<f64>)> = Vec::new();
    for entry in entries {
        let class: Class = entry
            .class
            .parse()
            .map_err(|why| PlanError::Import(format!("object {}: {why}", entry.name)))?;
        let relation = Relation::from_name(&entry.relation).ok_or_else(|| {
            PlanError::Import(format!(
                "object {}: unknown relation {}",
                entry.name, entry.relation
            ))
        })?;
        let pose = match &entry.pose {
            Some(place) => pose_in(place, f, &entry.name)?,
            None => Isometry3::identity(),
        };
        let id = model.fresh();
        let own = Location {
            reference: id,
            relation: Relation::Pose,
            pose: Isometry3::identity(),
        };
        let mut object = Object::new(id, entry.name, class, own);
        for (name, value) in entry.properties {
            let value = scalar_in(&object, &name, value, f)?;
            object.properties.insert(name, value);
        }
        model.apply(&Change::Create(object))?;
        places.push((id, entry.reference, relation, pose));
    }
    for (id, reference, relation, pose) in places {
        let object = model.object(id)?;
        let (name, class) = (object.name.clone(), object.class);
        let Some(reference) = reference else {
            if class == Class::KittingWorkstation {
                continue;
            }
            return Err(PlanError::Import(format!("object {name} has no reference")));
        };
        let known = model.named(&reference).map(|object| object.id);
        let reference = known.ok_or(PlanError::NoObject(reference))?;
        if reference == id && class == Class::KittingWorkstation {
            continue;
        }
        let location = Location {
            reference,
            relation,
            pose,
        };
        model.apply(&Change::Place {
            object: id,
            location,
        })?;
    }
    Ok(())
}

fn scalar_in(object: &Object, name: &str, value: Scalar, f: Factors) -> Result<Scalar, PlanError> {
    let kind = stored_property(object.class, name).ok_or_else(|| {
        PlanError::Import(format!(
            "{}: a {} has no property {name}",
            object.name, object.class
        ))
    })?;
    match (kind, value) {
        (Kind::Length, Scalar::Number(number)) if number.is_finite() => {
            Ok(Scalar::Number(number * f.metres))
        }
        (Kind::Number | Kind::Weight, Scalar::Number(number)) if number.is_finite() => {
            Ok(Scalar::Number(number))
        }
        (Kind::Text, Scalar::Text(text)) => Ok(Scalar::Text(text)),
        (Kind::Truth, Scalar::Truth(truth)) => Ok(Scalar::Truth(truth)),
        (kind, value) => Err(PlanError::Import(format!(
            "{}.{name}: expected a {kind:?}, got {value:?}",
            object.name
        ))),
    }
}

fn file_of(model: &Model) -> Result<File, PlanError> {
    let f = factors(&model.units)?;
    let mut object = Vec::new();
    for item in model.objects() {
        object.push(object_of(model, item, f)?);
    }
    let mut volume = Vec::new();
    for item in model.volumes() {
        let corner = |corner: [f64; 3]| corner.map(|c| tidy(c / f.metres));
        volume.push(VolumeEntry {
            robot: model.object(item.robot)?.name.clone(),
            minimum: corner(item.minimum),
            maximum: corner(item.maximum),
        });
    }
    let design = |design: &Design| DesignEntry {
        id: design.id.clone(),
        tray: design.tray_sku.clone(),
        part: design
            .parts
            .iter()
            .map(|part| PartEntry {
                sku: part.sku.clone(),
                pose: place_of(&part.pose, f),
            })
            .collect(),
    };
    Ok(File {
        units: model.units.clone(),
        arm: model.arm.as_ref().map(|arm| place_of(arm, f)),
        sku: model.skus().map(|sku| sku_of(sku, f)).collect(),
        design: model.designs().map(design).collect(),
        object,
        volume,
    })
}

fn sku_of(sku: &Sku, f: Factors) -> SkuEntry {
    SkuEntry {
        id: sku.id.clone(),
        description: sku.description.clone(),
        weight: sku.weight,
        end_effectors: sku.effectors.clone(),
        shape: sku.shape.map(|shape| ShapeEntry {
            length: tidy(shape.length / f.metres),
            width: tidy(shape.width / f.metres),
            height: tidy(shape.height / f.metres),
            has_top: shape.has_top,
        }),
        grasp: sku.grasp.as_ref().map(|grasp| place_of(grasp, f)),
    }
}

fn object_of(model: &Model, object: &Object, f: Factors) -> Result<ObjectEntry, PlanError> {
    let location = &object.location;
    let own = location.reference == object.id;
    let reference = if own {
        None
    } else {
        Some(model.object(location.reference)?.name.clone())
    };
    let pose = (!own && location.relation.has_pose()).then(|| place_of(&location.pose, f));
    let properties = object.properties.iter().map(|(name, value)| {
        let is_length = stored_property(object.class, name) == Some(Kind::Length);
        let value = match value {
            Scalar::Number(number) if is_length => Scalar::Number(tidy(number / f.metres)),
            other => other.clone(),
        };
        (name.clone(), value)
    });
    Ok(ObjectEntry {
        name: object.name.clone(),
        class: object.class.name().to_owned(),
        reference,
        relation: location.relation.name().to_owned(),
        pose,
        properties: properties.collect(),
    })
}
