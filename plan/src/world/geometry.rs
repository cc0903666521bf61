//! Heights and supports, from the shapes of the objects.

use nalgebra::{Isometry3, Point3};

use super::place::pointing_down;
use super::{Class, Model, Object, ObjectId, Shape};
use crate::PlanError;

/// An axis-parallel box in the frame of the workstation (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub minimum: [f64; 3],
    /// Largest coordinates.
    pub maximum: [f64; 3],
}

impl Bounds {
    fn of(pose: &Isometry3<f64>, shape: Shape) -> Self {
        let mut bounds = Self {
            minimum: [f64::INFINITY; 3],
            maximum: [f64::NEG_INFINITY; 3],
        };
        let (x, y) = (shape.length / 2.0, shape.width / 2.0);
        for corner in 0..8 {
            let side = |bit: usize, half: f64| if corner & bit == 0 { -half } else { half };
            let z = if corner & 4 == 0 { 0.0 } else { shape.height };
            let point = pose * Point3::new(side(1, x), side(2, y), z);
            for axis in 0..3 {
                bounds.minimum[axis] = bounds.minimum[axis].min(point[axis]);
                bounds.maximum[axis] = bounds.maximum[axis].max(point[axis]);
            }
        }
        bounds
    }

    fn union(self, other: Self) -> Self {
        let mut both = self;
        for axis in 0..3 {
            both.minimum[axis] = both.minimum[axis].min(other.minimum[axis]);
            both.maximum[axis] = both.maximum[axis].max(other.maximum[axis]);
        }
        both
    }

    /// Whether the insides overlap by more than `slack` (m) along every axis.
    #[must_use]
    pub fn overlaps(&self, other: &Self, slack: f64) -> bool {
        (0..3).all(|axis| {
            self.minimum[axis] + slack < other.maximum[axis]
                && other.minimum[axis] + slack < self.maximum[axis]
        })
    }
}

/// Largest distance (m) above or below a surface at which an object counts as put on it.
const SUPPORT_SLACK: f64 = 0.01;

impl Model {
    /// The object's own box: its own shape, its box properties, or the shape of its stock unit.
    #[must_use]
    pub fn shape(&self, object: &Object) -> Option<Shape> {
        let own = |stem: &str| {
            Some(Shape {
                length: object.number(&format!("{stem}_Length"))?,
                width: object.number(&format!("{stem}_Width"))?,
                height: object.number(&format!("{stem}_Height"))?,
                has_top: object.properties.get("hasShape_HasTop")
                    != Some(&super::Scalar::Truth(false)),
            })
        };
        own("hasShape").or_else(|| own("hasBox")).or_else(|| {
            object
                .sku()
                .and_then(|sku| self.sku(sku))
                .and_then(|sku| sku.shape)
        })
    }

    /// Box around the object and all that is located relative to it; none without any shape.
    ///
    /// # Errors
    /// As [`Model::workstation_from`].
    pub fn bounds(&self, id: ObjectId) -> Result<Option<Bounds>, PlanError> {
        let mut all: Option<Bounds> = None;
        for member in self.subtree(id) {
            if let Some(shape) = self.shape(self.object(member)?) {
                let bounds = Bounds::of(&self.workstation_from(member)?, shape);
                all = Some(all.map_or(bounds, |all| all.union(bounds)));
            }
        }
        Ok(all)
    }

    /// Height (m) of the highest point of anything that is not the robot or on it.
    ///
    /// # Errors
    /// As [`Model::workstation_from`].
    pub fn highest(&self) -> Result<f64, PlanError> {
        let mut top = f64::NEG_INFINITY;
        for object in self.objects() {
            if object.class == Class::Robot
                || self
                    .robot()
                    .is_ok_and(|robot| self.is_within(object.id, robot.id))
            {
                continue;
            }
            let Some(shape) = self.shape(object) else {
                continue;
            };
            // An object whose place in a container is unknown is as high as the container.
            let Ok(pose) = self.workstation_from(object.id) else {
                continue;
            };
            top = top.max(Bounds::of(&pose, shape).maximum[2]);
        }
        Ok(if top.is_finite() { top } else { 0.0 })
    }

    /// Where a gripper takes the object: `object_from_tip` (m). The grasp of its stock unit (for a
    /// kit: of its tray), or else the middle of its top with the tool pointing down.
    ///
    /// # Errors
    /// As [`Model::workstation_from`].
    pub fn grasp(&self, id: ObjectId) -> Result<Isometry3<f64>, PlanError> {
        let object = self.object(id)?;
        let body = match object.class {
            Class::KitInstance => self.children(id).find(|c| c.class == Class::KitTray),
            Class::PartsTrayWithParts => self.children(id).find(|c| c.class == Class::PartsTray),
            _ => None,
        };
        let (body, object_from_body) = match body {
            Some(body) => (body, body.location.pose),
            None => (object, Isometry3::identity()),
        };
        let sku = body.sku().and_then(|sku| self.sku(sku));
        let body_from_tip = sku.and_then(|sku| sku.grasp).unwrap_or_else(|| {
            let height = self.shape(body).map_or(0.0, |shape| shape.height);
            Isometry3::from_parts([0.0, 0.0, height].into(), pointing_down())
        });
        Ok(object_from_body * body_from_tip)
    }

    /// What an object of `class` rests on when it is released with its origin at `point` (m, frame
    /// of the workstation): the vessel or surface right below, else the workstation.
    ///
    /// # Errors
    /// [`PlanError::Missing`] without a workstation.
    pub fn support(
        &self,
        class: Class,
        point: [f64; 3],
        moved: ObjectId,
    ) -> Result<ObjectId, PlanError> {
        let mut best: Option<(f64, f64, ObjectId)> = None;
        for object in self.objects() {
            let supports = match object.class {
                Class::WorkTable | Class::LargeContainer => true,
                Class::KitTray | Class::PartsTray | Class::PartsBin => class == Class::Part,
                _ => false,
            };
            if !supports || object.id == moved || self.is_within(object.id, moved) {
                continue;
            }
            let (Some(shape), Ok(pose)) = (self.shape(object), self.workstation_from(object.id))
            else {
                continue;
            };
            let local = pose.inverse_transform_point(&Point3::from(point));
            let inside = local.x.abs() <= shape.length / 2.0 + 1e-9
                && local.y.abs() <= shape.width / 2.0 + 1e-9
                && local.z >= -SUPPORT_SLACK
                && (local.z <= shape.height + SUPPORT_SLACK || !shape.has_top);
            let floor = pose.translation.z;
            let area = shape.length * shape.width;
            if inside && best.is_none_or(|(z, a, _)| (floor, -area) > (z, -a)) {
                best = Some((floor, area, object.id));
            }
        }
        let Some((_, _, id)) = best else {
            return Ok(self.workstation()?.id);
        };
        Ok(self.composite_of(id).unwrap_or(id))
    }

    /// The composite that this vessel is a component of.
    #[must_use]
    pub fn composite_of(&self, id: ObjectId) -> Option<ObjectId> {
        let reference = self.object(id).ok()?.location.reference;
        let owner = self.object(reference).ok()?;
        (owner.id != id && owner.class.is_composite()).then_some(owner.id)
    }

    /// Height (m, frame of the workstation) on which an object can rest in `container` at the given
    /// place without touching what is there already, or `floor` when the place is free. `pose` is
    /// `workstation_from_object` of the wanted place.
    ///
    /// # Errors
    /// As [`Model::workstation_from`].
    pub fn free_height(
        &self,
        container: ObjectId,
        pose: &Isometry3<f64>,
        object: ObjectId,
    ) -> Result<f64, PlanError> {
        let mut height = pose.translation.z;
        let shape = self.bounds(object)?;
        let Some(size) = shape else { return Ok(height) };
        let half = |axis: usize| (size.maximum[axis] - size.minimum[axis]) / 2.0;
        let (x, y) = (pose.translation.x, pose.translation.y);
        for other in self.children(container) {
            if other.id == object || other.class == Class::LargeContainer {
                continue;
            }
            let Some(bounds) = self.bounds(other.id)? else {
                continue;
            };
            let beside = x - half(0) + 1e-6 >= bounds.maximum[0]
                || x + half(0) - 1e-6 <= bounds.minimum[0]
                || y - half(1) + 1e-6 >= bounds.maximum[1]
                || y + half(1) - 1e-6 <= bounds.minimum[1];
            if !beside {
                height = height.max(bounds.maximum[2]);
            }
        }
        Ok(height)
    }
}
