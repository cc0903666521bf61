use std::fmt;

use measure::Trial;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::de::{self, Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::Value;
use trajectory::ToolLimits;

/// Pose lists to be passed smoothly, as a file gives them: an object with `cases`, by name.
#[derive(Debug, serde::Deserialize)]
pub(super) struct Suite {
    /// The cases in the order of the file.
    pub(super) cases: Cases,
}

/// Cases with their names; each can have an error without the others.
#[derive(Debug)]
pub(super) struct Cases(pub(super) Vec<(String, Value)>);

impl<'de> Deserialize<'de> for Cases {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder;
        impl<'de> Visitor<'de> for InOrder {
            type Value = Cases;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object with a case for each name")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Cases, A::Error> {
                let mut cases: Vec<(String, Value)> = Vec::new();
                while let Some((name, case)) = map.next_entry::<String, Value>()? {
                    if cases.iter().any(|(known, _)| *known == name) {
                        return Err(de::Error::custom(format!("case {name:?} is there twice")));
                    }
                    cases.push((name, case));
                }
                Ok(Cases(cases))
            }
        }
        deserializer.deserialize_map(InOrder)
    }
}

/// One case as it stands in the file; lengths in mm.
#[derive(Debug, serde::Deserialize)]
struct Case {
    #[serde(rename = "P")]
    places: Vec<[f64; 3]>,
    #[serde(rename = "Q", default)]
    turns: Option<Vec<[f64; 4]>>,
    #[serde(rename = "tol")]
    tolerance: f64,
    #[serde(rename = "V")]
    speed: f64,
    #[serde(rename = "A")]
    acceleration: f64,
    #[serde(rename = "J")]
    jerk: f64,
}

const MM: f64 = 1e-3;

/// A case as a motion to be planned, or why it is invalid.
pub(super) fn trial(case: &Value) -> Result<Trial, String> {
    let case: Case = serde_json::from_value(case.clone())
        .map_err(|error| format!("the case cannot be read: {error}"))?;
    if !(case.tolerance.is_finite() && case.tolerance >= 0.0) {
        return Err(format!("tol is {}, expected 0 or more mm", case.tolerance));
    }
    for (name, value) in [
        ("V", case.speed),
        ("A", case.acceleration),
        ("J", case.jerk),
    ] {
        if !(value.is_finite() && value > 0.0) {
            return Err(format!("{name} is {value}, expected more than 0"));
        }
    }
    Ok(Trial {
        poses: poses(&case)?,
        tolerance: case.tolerance * MM,
        limits: ToolLimits {
            speed: case.speed * MM,
            acceleration: case.acceleration * MM,
            jerk: case.jerk * MM,
            ..ToolLimits::UNLIMITED
        },
    })
}

fn poses(case: &Case) -> Result<Vec<Isometry3<f64>>, String> {
    let count = case.places.len();
    if let Some(turns) = case.turns.as_ref().filter(|turns| turns.len() != count) {
        return Err(format!(
            "{count} positions but {} orientations",
            turns.len()
        ));
    }
    let mut poses = Vec::with_capacity(count);
    for (index, [x, y, z]) in case.places.iter().enumerate() {
        let turn = match case.turns.as_ref().and_then(|turns| turns.get(index)) {
            Some([w, i, j, k]) => {
                let turn = Quaternion::new(*w, *i, *j, *k);
                if (turn.norm() - 1.0).abs() > 1e-3 {
                    let length = turn.norm();
                    return Err(format!("quaternion {index} has length {length}, not 1"));
                }
                UnitQuaternion::from_quaternion(turn)
            }
            None => UnitQuaternion::identity(),
        };
        let place = Translation3::new(x * MM, y * MM, z * MM);
        poses.push(Isometry3::from_parts(place, turn));
    }
    Ok(poses)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_keep_their_order_and_faults_stay_with_their_case() {
        let text = r#"{"about": "x", "cases": {
            "z": {"P": [[0,0,0],[100,0,0]], "Q": null, "tol": 1, "V": 500, "A": 5000, "J": 1e5},
            "a": {"P": [[0,0]], "tol": 1, "V": 500, "A": 5000, "J": 1e5},
            "b": {"P": [[0,0,0]], "tol": -1, "V": 500, "A": 5000, "J": 1e5},
            "c": {"P": [[0,0,0]], "Q": [[2,0,0,0]], "tol": 1, "V": 500, "A": 5000, "J": 1e5}}}"#;
        let suite: Suite = serde_json::from_str(text).unwrap();
        let names: Vec<_> = suite.cases.0.iter().map(|case| case.0.as_str()).collect();
        assert_eq!(names, ["z", "a", "b", "c"]);
        let trials: Vec<_> = suite.cases.0.iter().map(|case| trial(&case.1)).collect();
        let first = trials[0].as_ref().unwrap();
        assert_eq!(first.poses[1].translation.x, 0.1);
        assert_eq!(first.limits.jerk, 100.0);
        assert!(trials[1].as_ref().unwrap_err().contains("cannot be read"));
        assert!(trials[2].as_ref().unwrap_err().contains("tol is -1"));
        assert!(trials[3].as_ref().unwrap_err().contains("length 2"));
    }
}
