//! Import of NIST's kitting workstation files (XML of 2013).

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Isometry3;
use roxmltree::{Document, Node};

use super::object::DesignPart;
use super::place::from_axes;
use super::{
    BoxVolume, Change, Class, Design, Location, Model, Object, ObjectId, Relation, Scalar, Shape,
    Sku, Units,
};
use crate::PlanError;

/// Deepest nesting of objects that is followed.
const DEEPEST: usize = 32;

/// Reads a workstation from NIST's XML form (`KittingWorkstation` as root element).
///
/// Objects may be nested; the reference object is the one that the file names. A kit of the file is
/// a [`Class::KitInstance`], the robot's end effector moves to the robot, and so on. Elements that
/// the model has no place for (points' names, descriptions of locations) are left out.
///
/// # Errors
/// [`PlanError::Import`] with line and column of the element that cannot be understood.
///
/// # Source
/// NIST kittingWorkstation.xsd, 2013, as used by the instance files of the kitting viewer.
pub fn import_nist(text: &str) -> Result<Model, PlanError> {
    let document = Document::parse(text).map_err(|e| PlanError::Import(e.to_string()))?;
    let root = document.root_element();
    if root.tag_name().name() != "KittingWorkstation" {
        return Err(fail(
            root,
            "expected KittingWorkstation as the root element",
        ));
    }
    let units = Units {
        length: text_of(root, "LengthUnit").unwrap_or("meter").into(),
        angle: text_of(root, "AngleUnit").unwrap_or("degree").into(),
        weight: text_of(root, "WeightUnit").unwrap_or("kilogram").into(),
    };
    let metres = units
        .metres()
        .ok_or_else(|| fail(root, "unknown length unit"))?;
    if units.radians().is_none() {
        return Err(fail(root, "unknown angle unit"));
    }
    let mut import = Import {
        model: Model {
            units,
            next: 1,
            ..Model::default()
        },
        metres,
        places: Vec::new(),
    };
    import.descriptions(root)?;
    import.object(root, Class::KittingWorkstation, None, 0)?;
    import.place_all()?;
    Ok(import.model)
}

fn fail(node: Node<'_, '_>, why: impl std::fmt::Display) -> PlanError {
    let at = node.document().text_pos_at(node.range().start);
    let name = node.tag_name().name();
    PlanError::Import(format!("line {}, column {}, {name}: {why}", at.row, at.col))
}

/// A description whose name another has.
fn twice(node: Node<'_, '_>) -> PlanError {
    let name = text_of(node, "Name").unwrap_or_default();
    fail(node, format!("there is another {name}"))
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children()
        .find(|child| child.tag_name().name() == name)
}

fn text_of<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    child(node, name)
        .and_then(|child| child.text())
        .map(str::trim)
        .filter(|text| !text.is_empty())
}

fn number_of(node: Node<'_, '_>, name: &str) -> Result<Option<f64>, PlanError> {
    let Some(text) = text_of(node, name) else {
        return Ok(None);
    };
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(Some(number)),
        _ => Err(fail(node, format!("{name} is not a number: {text}"))),
    }
}

fn vector(node: Node<'_, '_>, name: &str, parts: [&str; 3]) -> Result<[f64; 3], PlanError> {
    let element = child(node, name).ok_or_else(|| fail(node, format!("no {name}")))?;
    let mut vector = [0.0; 3];
    for (value, part) in vector.iter_mut().zip(parts) {
        *value = number_of(element, part)?.ok_or_else(|| fail(element, format!("no {part}")))?;
    }
    Ok(vector)
}

/// Class of an element, from its type attribute or its name.
fn class_of(node: Node<'_, '_>) -> Option<Class> {
    let kind = node
        .attributes()
        .find(|a| a.name() == "type")
        .map(|a| a.value());
    let name = kind.map_or(node.tag_name().name(), |kind| kind.trim_end_matches("Type"));
    match name {
        "Base" | "OtherObstacle" | "Object" => Some(Class::SolidObject),
        "Sku" | "KitDesign" => None,
        "HumanSafeArea" => None,
        name => name.parse().ok(),
    }
}

struct Import {
    model: Model,
    metres: f64,
    places: Vec<Placed>,
}

/// A location that is resolved when all names are known.
struct Placed {
    id: ObjectId,
    parent: Option<ObjectId>,
    reference: Option<String>,
    relation: Relation,
    pose: Isometry3<f64>,
    name: String,
}

impl Import {
    fn pose(&self, node: Node<'_, '_>) -> Result<Isometry3<f64>, PlanError> {
        let point = vector(node, "Point", ["X", "Y", "Z"])?.map(|c| c * self.metres);
        let x_axis = vector(node, "XAxis", ["I", "J", "K"])?;
        let z_axis = vector(node, "ZAxis", ["I", "J", "K"])?;
        from_axes(point, x_axis, z_axis).map_err(|why| fail(node, why))
    }

    fn shape(&self, node: Node<'_, '_>) -> Result<Option<Shape>, PlanError> {
        let Some(shape) = child(node, "InternalShape") else {
            return Ok(None);
        };
        let size = |name: &str| -> Result<f64, PlanError> {
            let size = number_of(shape, name)?.ok_or_else(|| fail(shape, format!("no {name}")))?;
            Ok(size * self.metres)
        };
        let has_top = text_of(shape, "HasTop") != Some("false");
        if child(shape, "Length").is_none() {
            return Ok(None);
        }
        let (length, width, height) = (size("Length")?, size("Width")?, size("Height")?);
        let known = Shape {
            length,
            width,
            height,
            has_top,
        };
        known.check().map_err(|why| fail(shape, why))?;
        Ok(Some(known))
    }

    fn descriptions(&mut self, root: Node<'_, '_>) -> Result<(), PlanError> {
        let mut skus = BTreeMap::new();
        let mut designs = BTreeMap::new();
        for node in root.children().filter(Node::is_element) {
            let name = text_of(node, "Name").map(str::to_owned);
            match (node.tag_name().name(), name) {
                ("Sku", Some(id)) => {
                    let effectors = node
                        .children()
                        .filter(|child| child.tag_name().name() == "EndEffectorName")
                        .filter_map(|child| child.text())
                        .map(|text| text.trim().to_owned())
                        .collect();
                    let sku = Sku {
                        id: id.clone(),
                        description: text_of(node, "Description").unwrap_or_default().into(),
                        shape: self.shape(node)?,
                        weight: number_of(node, "Weight")?,
                        effectors,
                        grasp: child(node, "GraspPose").map(|g| self.pose(g)).transpose()?,
                    };
                    sku.check().map_err(|why| fail(node, why))?;
                    if skus.insert(id, sku).is_some() {
                        return Err(twice(node));
                    }
                }
                ("KitDesign", Some(id)) => {
                    let tray_sku = text_of(node, "KitTraySkuName").unwrap_or_default().into();
                    let mut design = Design {
                        id: id.clone(),
                        tray_sku,
                        parts: Vec::new(),
                    };
                    for part in node
                        .children()
                        .filter(|c| c.tag_name().name() == "PartRefAndPose")
                    {
                        let sku =
                            text_of(part, "SkuName").ok_or_else(|| fail(part, "no SkuName"))?;
                        design.parts.push(DesignPart {
                            sku: sku.into(),
                            pose: self.pose(part)?,
                        });
                    }
                    if designs.insert(id, design).is_some() {
                        return Err(twice(node));
                    }
                }
                _ => {}
            }
        }
        self.model.skus = Arc::new(skus);
        self.model.designs = Arc::new(designs);
        Ok(())
    }

    /// Adds the object of this element and those nested in it.
    fn object(
        &mut self,
        node: Node<'_, '_>,
        class: Class,
        parent: Option<ObjectId>,
        depth: usize,
    ) -> Result<(), PlanError> {
        if depth > DEEPEST {
            return Err(fail(node, "nested too deep"));
        }
        let name = text_of(node, "Name")
            .ok_or_else(|| fail(node, "no Name"))?
            .to_owned();
        let id = self.model.fresh();
        let own = Location {
            reference: id,
            relation: Relation::Pose,
            pose: Isometry3::identity(),
        };
        let mut object = Object::new(id, name.clone(), class, own);
        self.properties(node, &mut object)?;
        self.model
            .apply(&Change::Create(object))
            .map_err(|error| fail(node, error))?;
        let mut placed = Placed {
            id,
            parent,
            reference: None,
            relation: Relation::In,
            pose: Isometry3::identity(),
            name,
        };
        if let Some(location) = child(node, "PrimaryLocation") {
            self.place(location, &mut placed)?;
        }
        self.places.push(placed);
        if class == Class::Robot {
            self.volumes(node, id)?;
        }
        for nested in node.children().filter(Node::is_element) {
            if child(nested, "PrimaryLocation").is_some()
                && let Some(class) = class_of(nested)
            {
                self.object(nested, class, Some(id), depth + 1)?;
            }
        }
        Ok(())
    }

    /// Reads where an object is.
    fn place(&self, location: Node<'_, '_>, placed: &mut Placed) -> Result<(), PlanError> {
        let kind = location
            .attributes()
            .find(|a| a.name() == "type")
            .map_or("", |a| a.value());
        placed.relation = match kind {
            "PoseLocationInType" => Relation::PoseIn,
            "PoseLocationOnType" => Relation::PoseOn,
            "RelativeLocationInType" => Relation::In,
            "RelativeLocationOnType" => Relation::On,
            _ => Relation::Pose,
        };
        if placed.relation.has_pose() {
            placed.pose = self.pose(location)?;
        }
        placed.reference = text_of(location, "RefObjectName").map(str::to_owned);
        Ok(())
    }

    fn properties(&self, node: Node<'_, '_>, object: &mut Object) -> Result<(), PlanError> {
        let class = object.class;
        let mut set = |name: &str, value: Scalar| {
            if super::class::stored_property(class, name).is_some() {
                object.properties.insert(name.to_owned(), value);
            }
        };
        let text = |element: &str| text_of(node, element).map(|t| Scalar::Text(t.to_owned()));
        let sku = text("SkuName")
            .or_else(|| text("DesignName"))
            .or_else(|| text("KitDesignName"));
        if let (Some(property), Some(value)) = (class.sku_property(), sku.clone()) {
            set(property, value);
        }
        if let (Some(property), Some(value)) = (class.serial_property(), text("SerialNumber")) {
            set(property, value);
        }
        for (element, property) in [
            ("Description", "hasEndEffector_Description"),
            ("Description", "hasRobot_Description"),
            ("PartSkuName", "hasPartsTray_PartSkuRef"),
            ("PartSkuName", "hasBin_PartSkuRef"),
            ("KitDesignName", "hasLargeBoxWithKits_KitDesignRef"),
        ] {
            text(element)
                .into_iter()
                .for_each(|value| set(property, value));
        }
        if let Some(truth) = text_of(node, "Finished") {
            set("isKitInstance_Finished", Scalar::Truth(truth == "true"));
        }
        for (element, property, factor) in [
            ("Weight", "hasEndEffector_Weight", 1.0),
            ("MaximumLoadWeight", "hasEffector_MaximumLoadWeight", 1.0),
            ("MaximumLoadWeight", "hasRobot_MaximumLoadWeight", 1.0),
            ("CupDiameter", "hasVacuumEffector_CupDiameter", self.metres),
            ("Length", "hasVacuumEffector_Length", self.metres),
            ("PartQuantity", "hasPartsTray_PartQuantity", 1.0),
            ("PartQuantity", "hasBin_PartQuantity", 1.0),
            ("Capacity", "hasLargeBoxWithKits_Capacity", 1.0),
        ] {
            if let Some(number) = number_of(node, element)? {
                set(property, Scalar::Number(number * factor));
            }
        }
        if let Some(shape) = self.shape(node)? {
            set("hasShape_Length", Scalar::Number(shape.length));
            set("hasShape_Width", Scalar::Number(shape.width));
            set("hasShape_Height", Scalar::Number(shape.height));
            set("hasShape_HasTop", Scalar::Truth(shape.has_top));
        }
        Ok(())
    }

    fn volumes(&mut self, node: Node<'_, '_>, robot: ObjectId) -> Result<(), PlanError> {
        for volume in node
            .children()
            .filter(|c| c.tag_name().name() == "WorkVolume")
        {
            let corner = |name: &str| vector(volume, name, ["X", "Y", "Z"]);
            let scale = |corner: [f64; 3]| corner.map(|c| c * self.metres);
            let (minimum, maximum) = (
                scale(corner("MinimumPoint")?),
                scale(corner("MaximumPoint")?),
            );
            Arc::make_mut(&mut self.model.volumes).push(BoxVolume {
                robot,
                minimum,
                maximum,
            });
        }
        Ok(())
    }

    fn place_all(&mut self) -> Result<(), PlanError> {
        for placed in std::mem::take(&mut self.places) {
            let Placed {
                id,
                parent,
                relation,
                pose,
                name,
                ..
            } = placed;
            let reference = match placed.reference {
                Some(reference) => self.model.named(&reference).map(|o| o.id),
                None => parent,
            };
            let Some(reference) = reference else {
                let why = format!("{name} is located relative to an object that is not there");
                return Err(PlanError::Import(why));
            };
            if parent.is_none() {
                continue;
            }
            let location = Location {
                reference,
                relation,
                pose,
            };
            self.model.apply(&Change::Place {
                object: id,
                location,
            })?;
        }
        self.model.workstation()?;
        Ok(())
    }
}
