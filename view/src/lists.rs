//! Lists of poses and the motions through them, to be looked at one after the other.

use serde_json::{Value, json};

/// A list of poses and the motion through it.
#[derive(Clone, Debug)]
pub struct PoseList {
    /// Its name.
    pub name: String,
    /// Where the poses are, the start first (m).
    pub poses: Vec<[f64; 3]>,
    /// Radius of the ball about each intermediate pose (m).
    pub tolerance_m: f64,
    /// Largest speed of the controlled point (m/s).
    pub speed_m_s: f64,
    /// The motion, or why there is none.
    pub motion: Result<ListMotion, String>,
}

/// A motion through a list of poses.
#[derive(Clone, Debug)]
pub struct ListMotion {
    /// Its time (s).
    pub duration_s: f64,
    /// No motion through the list is shorter (s).
    pub lower_bound_s: f64,
    /// Time with a stop at each pose (s).
    pub stop_s: Option<f64>,
    /// Time between two points (s).
    pub step_s: f64,
    /// The controlled point (m).
    pub points: Vec<[f64; 3]>,
    /// Positions, velocities and accelerations of the joints (rad, m; per s, s²) at the points; empty
    /// without an arm.
    pub joints: Vec<[Vec<f64>; 3]>,
    /// The passes of the intermediate poses: index in the list, deviation (m), time (s).
    pub passes: Vec<(usize, f64, f64)>,
    /// Which limit decides the speed: its name, from when, until when (s).
    pub active: Vec<(String, f64, f64)>,
}

/// The table of all lists.
pub(crate) fn table(lists: &[PoseList]) -> Value {
    let row = |list: &PoseList| {
        let motion = list.motion.as_ref().ok();
        json!({
            "name": list.name,
            "poses": list.poses.len(),
            "tolerance_m": list.tolerance_m,
            "motion_s": motion.map(|motion| motion.duration_s),
            "stop_s": motion.and_then(|motion| motion.stop_s),
            "reason": list.motion.as_ref().err(),
        })
    };
    json!({"is": "lists", "lists": lists.iter().map(row).collect::<Vec<_>>()})
}

/// One list as the page draws a planned program: with one command.
pub(crate) fn drawn(lists: &[PoseList], index: usize) -> Result<Value, String> {
    let list = lists
        .get(index)
        .ok_or_else(|| format!("there are {} lists, no number {index}", lists.len()))?;
    let motion = list.motion.as_ref().map_err(Clone::clone)?;
    let span = |(limit, start, end): &(String, f64, f64)| json!({"limit": limit, "start_s": start, "end_s": end});
    let pass = |(index, deviation, time): &(usize, f64, f64)| {
        json!({"index": index, "deviation_m": deviation, "tolerance_m": list.tolerance_m,
            "time_s": time})
    };
    let certificate = json!({
        "duration_s": motion.duration_s,
        "lower_bound_s": motion.lower_bound_s,
        "active": motion.active.iter().map(span).collect::<Vec<_>>(),
        "poses": motion.passes.iter().map(pass).collect::<Vec<_>>(),
        "limits": [],
        "corridor_m": list.tolerance_m,
    });
    let of_joints = |kind: usize| -> Vec<&Vec<f64>> {
        motion.joints.iter().map(|lists| &lists[kind]).collect()
    };
    Ok(json!({
        "is": "preview",
        "name": list.name,
        "ok": true,
        "list": index,
        "speed_m_s": list.speed_m_s,
        "stop_s": motion.stop_s,
        "duration_s": motion.duration_s,
        "commands": [{
            "index": 0, "line": 0, "name": list.name, "start_s": 0.0,
            "duration_s": motion.duration_s, "certificate": certificate,
            "poses": list.poses.get(1..).unwrap_or_default(),
        }],
        "path": {
            "step_s": motion.step_s,
            "points": motion.points,
            "joints": of_joints(0),
            "velocities": of_joints(1),
            "accelerations": of_joints(2),
            "commands": vec![0; motion.points.len()],
        },
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_given_one_by_one() {
        let motion = ListMotion {
            duration_s: 0.2,
            lower_bound_s: 0.1,
            stop_s: Some(0.3),
            step_s: 0.1,
            points: vec![[0.0; 3], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]],
            joints: Vec::new(),
            passes: vec![(1, 0.001, 0.1)],
            active: vec![("tool speed".to_owned(), 0.0, 0.2)],
        };
        let list = |motion| PoseList {
            name: "line".to_owned(),
            poses: vec![[0.0; 3], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]],
            tolerance_m: 0.002,
            speed_m_s: 0.5,
            motion,
        };
        let lists = [list(Ok(motion)), list(Err("out of reach".to_owned()))];
        let table = table(&lists);
        assert_eq!(table["lists"][0]["motion_s"], 0.2);
        assert_eq!(table["lists"][1]["reason"], "out of reach");
        let seen = drawn(&lists, 0).unwrap();
        assert_eq!(
            seen["commands"][0]["certificate"]["active"][0]["limit"],
            "tool speed"
        );
        assert_eq!(seen["commands"][0]["poses"][0][0], 0.1);
        assert_eq!(seen["path"]["joints"].as_array().unwrap().len(), 0);
        assert_eq!(drawn(&lists, 1).unwrap_err(), "out of reach");
        assert!(drawn(&lists, 2).unwrap_err().contains("2 lists"));
    }
}
