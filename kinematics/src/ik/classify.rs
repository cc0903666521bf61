//! Which closed form an arm has, from its axes at q = 0.

use super::six::{Placing, Shape, Six};
use super::swivel::Swivel;
use crate::links::ScrewAxis;
use nalgebra::Vector3;

/// How far the axes may be from a family's structure.
#[derive(Clone, Copy, Debug)]
struct Tolerance {
    /// m.
    length: f64,
    /// Sine of an angle.
    angle: f64,
    /// Squared relative error that counts as rounding in the closed form.
    slack: f64,
}

/// The axes have the structure up to rounding: the closed form is exact.
const EXACT: Tolerance = Tolerance {
    length: 1e-10,
    angle: 1e-10,
    slack: 1e-12,
};
/// The axes have the structure up to calibration errors: the closed form is the seed of a polish.
const CALIBRATED: Tolerance = Tolerance {
    length: 4e-3,
    angle: 0.012,
    slack: 8e-2,
};

/// A closed form with at most one redundant joint.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Form {
    /// Six joints.
    Six(Six),
    /// Seven joints, closed for the other six when the last is given.
    Last(Six, ScrewAxis),
    /// Seven joints, closed for the other six when the first is given.
    First(Six, ScrewAxis),
    /// Seven joints, closed for a given angle of the elbow about the line from shoulder to wrist.
    Swivel(Swivel),
}

/// A closed form, and whether it is exact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Class {
    pub(crate) form: Form,
    pub(crate) exact: bool,
}

/// The closed form of an arm with these axes, if it has one.
pub(crate) fn classify(lines: &[ScrewAxis]) -> Option<Class> {
    [(EXACT, true), (CALIBRATED, false)]
        .into_iter()
        .find_map(|(tolerance, exact)| form(lines, tolerance).map(|form| Class { form, exact }))
}

fn form(lines: &[ScrewAxis], tolerance: Tolerance) -> Option<Form> {
    match *lines {
        [a, b, c, d, e, f] => Some(Form::Six(six(&[a, b, c, d, e, f], tolerance)?)),
        [a, b, c, d, e, f, g] => {
            let shoulder = concurrent([a, b, c], tolerance);
            let wrist = concurrent([e, f, g], tolerance);
            if let (Some(shoulder), Some(wrist)) = (shoulder, wrist) {
                return Some(Form::Swivel(Swivel::new(
                    &[a, b, c, d, e, f, g],
                    shoulder,
                    wrist,
                    tolerance.slack,
                )));
            }
            if let Some(six) = six(&[a, b, c, d, e, f], tolerance) {
                return Some(Form::Last(six, g));
            }
            six(&[b, c, d, e, f, g], tolerance).map(|six| Form::First(six, a))
        }
        _ => None,
    }
}

/// The shape of six axes, forwards or backwards, with the axes moved exactly into it.
fn six(lines: &[ScrewAxis; 6], tolerance: Tolerance) -> Option<Six> {
    [false, true].into_iter().find_map(|reversed| {
        let mut lines = *lines;
        if reversed {
            lines.reverse();
        }
        let shape = wrist(&mut lines, tolerance).or_else(|| parallels(&mut lines, tolerance))?;
        Some(Six::new(lines, shape, reversed, tolerance.slack))
    })
}

fn wrist(lines: &mut [ScrewAxis; 6], tolerance: Tolerance) -> Option<Shape> {
    let [a, b, c, d, e, f] = *lines;
    let point = concurrent([d, e, f], tolerance)?;
    let placing = if parallel(&b, &c, tolerance) && !parallel(&a, &b, tolerance) {
        align(&mut lines[1..3]);
        Placing::Parallel
    } else {
        Placing::Meeting(meeting(&a, &b, tolerance)?)
    };
    for line in &mut lines[3..] {
        line.p = point;
    }
    Some(Shape::Wrist(point, placing))
}

fn parallels(lines: &mut [ScrewAxis; 6], tolerance: Tolerance) -> Option<Shape> {
    let [a, b, c, d, e, f] = *lines;
    let three = parallel(&b, &c, tolerance) && parallel(&c, &d, tolerance);
    if !three || parallel(&a, &b, tolerance) || parallel(&d, &e, tolerance) {
        return None;
    }
    let point = meeting(&e, &f, tolerance)?;
    align(&mut lines[1..4]);
    (lines[4].p, lines[5].p) = (point, point);
    Some(Shape::Parallels(point))
}

fn vector(v: [f64; 3]) -> Vector3<f64> {
    Vector3::from(v)
}

/// Gives parallel axes their mean direction; each keeps its sign.
fn align(lines: &mut [ScrewAxis]) {
    let Some(first) = lines.first().map(|line| vector(line.h)) else {
        return;
    };
    let sum: Vector3<f64> = lines
        .iter()
        .map(|line| vector(line.h) * vector(line.h).dot(&first).signum())
        .sum();
    let mean = sum.normalize();
    for line in lines {
        line.h = (mean * vector(line.h).dot(&first).signum()).into();
    }
}

fn parallel(a: &ScrewAxis, b: &ScrewAxis, tolerance: Tolerance) -> bool {
    vector(a.h).cross(&vector(b.h)).norm() <= tolerance.angle
}

/// The point in which two axes meet.
fn meeting(a: &ScrewAxis, b: &ScrewAxis, tolerance: Tolerance) -> Option<[f64; 3]> {
    let (ha, hb) = (vector(a.h), vector(b.h));
    let n = ha.cross(&hb);
    // Nearly parallel axes have no well-defined intersection.
    if n.norm() < 0.1 {
        return None;
    }
    let d = vector(b.p) - vector(a.p);
    let square = n.norm_squared();
    let on_a = vector(a.p) + ha * (d.cross(&hb).dot(&n) / square);
    let on_b = vector(b.p) + hb * (d.cross(&ha).dot(&n) / square);
    ((on_a - on_b).norm() <= tolerance.length).then(|| ((on_a + on_b) * 0.5).into())
}

/// The point in which three consecutive axes meet.
fn concurrent([a, b, c]: [ScrewAxis; 3], tolerance: Tolerance) -> Option<[f64; 3]> {
    let first = meeting(&a, &b, tolerance)?;
    let second = meeting(&b, &c, tolerance)?;
    let distance = (vector(first) - vector(second)).norm();
    (distance <= tolerance.length).then(|| ((vector(first) + vector(second)) * 0.5).into())
}
