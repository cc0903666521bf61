//! A smooth move that takes the planner long.

use std::f64::consts::TAU;

/// `MoveSmoothlyTo` along circles of 60 mm radius in front of an ur5e, downwards, with 40 poses per
/// turn. It begins at (400, `y`, 400) mm and turns towards y = 0.
pub fn smooth_list(poses: usize, y: f64) -> String {
    let mut text = "SetIntermediatePointTolerance(5)\nMoveSmoothlyTo({\n".to_owned();
    for index in 0..poses {
        let turn = index as f64 / 40.0 * TAU;
        let up = 400.0 - 80.0 * index as f64 / poses as f64;
        let comma = if index + 1 == poses { "" } else { "," };
        text.push_str(&format!(
            "{{{{{:.3}, {:.3}, {up:.3}}}, {{0,0,-1}}, {{1,1,0}}}}{comma}\n",
            400.0 + 60.0 * turn.sin(),
            y - 60.0 * y.signum() * (1.0 - turn.cos()),
        ));
    }
    text.push_str(&format!("}}, {poses})\n"));
    text
}
