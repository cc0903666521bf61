//! Checks whether the world is consistent.

use super::class::{Kind, stored_property};
use super::{Class, Model, Object, Scalar};
use crate::finding::Severity;

/// Something wrong (or odd) about the world.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Concern {
    /// An error makes the world inconsistent; a warning does not.
    pub severity: Severity,
    /// Name of the rule.
    pub code: &'static str,
    /// The object, unit or design it is about.
    pub subject: String,
    /// What is wrong.
    pub message: String,
}

/// Checks the world: chains, names, classes, references to stock units and designs, what tools hold,
/// contents of composites, quantities, overlaps. A consistent world gives no error.
#[must_use]
pub fn check(model: &Model) -> Vec<Concern> {
    let mut concerns = Concerns { found: Vec::new() };
    if let Err(error) = model.workstation() {
        concerns.error("workstation", "world", error.to_string());
        return concerns.found;
    }
    if model.units.metres().is_none() || model.units.radians().is_none() {
        let message = format!(
            "unknown unit {} or {}",
            model.units.length, model.units.angle
        );
        concerns.error("units", "world", message);
    }
    let mut names = std::collections::BTreeSet::new();
    for object in model.objects() {
        if !names.insert(object.name.as_str()) {
            concerns.error("name", &object.name, "two objects have this name".into());
        }
        check_chain(model, object, &mut concerns);
        check_properties(model, object, &mut concerns);
        check_contents(model, object, &mut concerns);
    }
    check_descriptions(model, &mut concerns);
    check_singletons(model, &mut concerns);
    check_overlaps(model, &mut concerns);
    concerns.found
}

struct Concerns {
    found: Vec<Concern>,
}

impl Concerns {
    fn error(&mut self, code: &'static str, subject: &str, message: String) {
        let subject = subject.to_owned();
        self.found.push(Concern {
            severity: Severity::Error,
            code,
            subject,
            message,
        });
    }

    fn warning(&mut self, code: &'static str, subject: &str, message: String) {
        let subject = subject.to_owned();
        self.found.push(Concern {
            severity: Severity::Warning,
            code,
            subject,
            message,
        });
    }
}

fn check_chain(model: &Model, object: &Object, concerns: &mut Concerns) {
    let workstation = model.workstation().map(|w| w.id).unwrap_or_default();
    let own = object.location.reference == object.id;
    if own != (object.class == Class::KittingWorkstation) {
        let message = "only the workstation is located relative to itself".into();
        concerns.error("chain", &object.name, message);
    } else if !own && !model.is_within(object.id, workstation) {
        let message = "its location chain does not end at the workstation".into();
        concerns.error("chain", &object.name, message);
    }
}

fn check_properties(model: &Model, object: &Object, concerns: &mut Concerns) {
    for name in object.properties.keys() {
        if stored_property(object.class, name).is_none() {
            let message = format!("a {} has no property {name}", object.class);
            concerns.error("property", &object.name, message);
        }
    }
    for (name, value) in &object.properties {
        let length = stored_property(object.class, name) == Some(Kind::Length);
        if length && matches!(value, Scalar::Number(number) if *number < 0.0) {
            concerns.error("size", &object.name, format!("{name} is negative"));
        }
    }
    let Some(property) = object.class.sku_property() else {
        return;
    };
    let Some(id) = object.sku() else {
        if object.class != Class::PartsTray {
            concerns.error("sku", &object.name, format!("{property} is missing"));
        }
        return;
    };
    let known = match object.class {
        Class::KitInstance => model.design(id).is_some(),
        _ => model.sku(id).is_some(),
    };
    if !known {
        concerns.error(
            "sku",
            &object.name,
            format!("{property} is {id}, which has no description"),
        );
    }
}

fn check_contents(model: &Model, object: &Object, concerns: &mut Concerns) {
    let number = |class: Class| {
        model
            .children(object.id)
            .filter(|c| c.class.is_a(class))
            .count()
    };
    let one = |class: Class, concerns: &mut Concerns| {
        let found = number(class);
        if found != 1 {
            let message = format!("a {} needs one {class}, there are {found}", object.class);
            concerns.error("contents", &object.name, message);
        }
    };
    let at_most = |class: Class, most: usize, concerns: &mut Concerns| {
        let found = number(class);
        if found > most {
            let message = format!("{found} of class {class} where {most} fit");
            concerns.error("contents", &object.name, message);
        }
    };
    match object.class {
        Class::KitInstance => one(Class::KitTray, concerns),
        Class::PartsTrayWithParts => one(Class::PartsTray, concerns),
        Class::LargeBoxWithEmptyKitTrays => one(Class::LargeContainer, concerns),
        Class::LargeBoxWithKits => one(Class::LargeContainer, concerns),
        Class::Robot | Class::EndEffectorHolder => at_most(Class::EndEffector, 1, concerns),
        class if class.is_a(Class::EndEffector) => at_most(Class::SolidObject, 1, concerns),
        _ => {}
    }
    check_kit(model, object, concerns);
    let capacity = object
        .number("hasLargeContainer_Capacity")
        .or_else(|| object.number("hasLargeBoxWithKits_Capacity"));
    let contents = number(Class::KitTray) + number(Class::KitInstance);
    if let Some(capacity) = capacity
        && contents as f64 > capacity
    {
        let message = format!("{contents} in it where {capacity} fit");
        concerns.error("capacity", &object.name, message);
    }
}

/// A finished kit holds exactly the parts of its design, in a tray of the right kind.
fn check_kit(model: &Model, object: &Object, concerns: &mut Concerns) {
    let finished = object.properties.get("isKitInstance_Finished");
    if object.class != Class::KitInstance || finished != Some(&Scalar::Truth(true)) {
        return;
    }
    let Some(design) = object.sku().and_then(|id| model.design(id)) else {
        return;
    };
    let count = |sku: &str| design.parts.iter().filter(|part| part.sku == sku).count();
    for part in &design.parts {
        let (found, wanted) = (model.count(object.id, &part.sku, 1), count(&part.sku));
        if found != wanted {
            let message = format!("finished with {found} {} instead of {wanted}", part.sku);
            concerns.error("kit", &object.name, message);
        }
    }
    let tray = model
        .children(object.id)
        .find(|child| child.class == Class::KitTray);
    if tray.and_then(Object::sku) != Some(design.tray_sku.as_str()) {
        let message = format!("its tray is not a {}", design.tray_sku);
        concerns.error("kit", &object.name, message);
    }
}

fn check_descriptions(model: &Model, concerns: &mut Concerns) {
    for design in model.designs() {
        for sku in design
            .parts
            .iter()
            .map(|part| &part.sku)
            .chain([&design.tray_sku])
        {
            if model.sku(sku).is_none() {
                let message = format!("it uses {sku}, which is not in the library");
                concerns.error("design", &design.id, message);
            }
        }
    }
    for sku in model.skus() {
        for effector in &sku.effectors {
            let known = model
                .named(effector)
                .is_some_and(|o| o.class.is_a(Class::EndEffector));
            if !known {
                let message = format!("it names the end effector {effector}, which is not here");
                concerns.warning("effector", &sku.id, message);
            }
        }
    }
}

fn check_singletons(model: &Model, concerns: &mut Concerns) {
    for class in [Class::KittingWorkstation, Class::Robot] {
        let found = model
            .objects()
            .filter(|object| object.class == class)
            .count();
        if found > 1 {
            concerns.error(
                "single",
                class.name(),
                format!("{found} of them where one is allowed"),
            );
        }
    }
}

/// Kits and trays that lie in one another; parts of a kit that overlap.
fn check_overlaps(model: &Model, concerns: &mut Concerns) {
    let movable = |object: &&Object| {
        matches!(
            object.class,
            Class::KitInstance | Class::Part | Class::PartsTrayWithParts
        ) || (object.class == Class::KitTray && model.composite_of(object.id).is_none())
    };
    let boxes: Vec<_> = model
        .objects()
        .filter(movable)
        .filter_map(|object| Some((object, model.bounds(object.id).ok()??)))
        .collect();
    for (index, (one, bounds)) in boxes.iter().enumerate() {
        for (other, others) in boxes.iter().skip(index + 1) {
            if one.location.reference == other.location.reference && bounds.overlaps(others, 1e-4) {
                let message = format!("it is in the same place as {}", other.name);
                concerns.warning("overlap", &one.name, message);
            }
        }
    }
}
