//! Robot descriptions that are not shipped: classified, solved, or refused with a reason.
//!
//! `CANTER_URDFS` names a folder of URDF files, for example of the packages `example-robot-data`
//! and `pybullet`; without it there is nothing to test. Prints a table.

use crate::arms::Random;
use kinematics::{Solver, UrdfError, urdf};
use std::path::{Path, PathBuf};

/// URDF files under a folder, in order.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let Ok(entries) = std::fs::read_dir(folder) else {
        return found;
    };
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|end| end == "urdf") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Family, and how many of 100 reachable poses are solved from other seeds.
fn solved<const N: usize>(model: &kinematics::Model) -> Result<(&'static str, bool, u32), String> {
    let chain = model.chain::<N>().map_err(|error| error.to_string())?;
    let solver = Solver::new(chain);
    let mut random = Random(61);
    let mut count = 0;
    for _ in 0..100 {
        let pose = solver.chain().forward(&random.joints(&chain));
        let Ok(solution) = solver.nearest(&pose, &random.joints(&chain)) else {
            continue;
        };
        let (position, rotation) = solver.error(&pose, &solution.q);
        assert!(position < 1e-8 && rotation < 1e-8, "{position} {rotation}");
        assert!(chain.within_limits(&solution.q, 0.0));
        count += 1;
    }
    Ok((solver.family(), solver.is_exact(), count))
}

fn any(model: &kinematics::Model) -> Result<(&'static str, bool, u32), String> {
    match model.dof() {
        1 => solved::<1>(model),
        2 => solved::<2>(model),
        3 => solved::<3>(model),
        4 => solved::<4>(model),
        5 => solved::<5>(model),
        6 => solved::<6>(model),
        7 => solved::<7>(model),
        8 => solved::<8>(model),
        more => Err(format!("{more} joints; one to eight are solved")),
    }
}

#[test]
fn strange_arms_are_solved_or_refused() {
    let Some(folder) = std::env::var_os("CANTER_URDFS") else {
        return;
    };
    let all = files(Path::new(&folder));
    assert!(!all.is_empty(), "no URDF files in {}", folder.display());
    let mut arms = 0;
    for path in all {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let text = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
        let tips: Vec<Option<String>> = match urdf::read(&text, None) {
            Err(UrdfError::SeveralTips { tips, .. }) => {
                let names = tips.split(", ").map(|tip| tip.trim_matches('"'));
                names.map(|tip| Some(tip.to_owned())).collect()
            }
            _ => vec![None],
        };
        for tip in tips {
            let short = tip.as_deref().unwrap_or("");
            let answer = urdf::read(&text, tip.as_deref());
            let answer = answer.map_err(|error| error.to_string());
            match answer.and_then(|model| any(&model).map(|found| (model.dof(), found))) {
                Ok((joints, (family, exact, count))) => {
                    let near = if exact || family == "numeric" {
                        ""
                    } else {
                        ", near"
                    };
                    println!("{name} {short} | {joints} | {family}{near} | {count} of 100");
                    assert!(count >= 99, "{name} {short}: {count} of 100 solved");
                    arms += 1;
                }
                Err(reason) => {
                    assert!(!reason.is_empty(), "{name} is refused without a reason");
                    println!("{name} {short} | - | refused | {reason}");
                }
            }
        }
    }
    assert!(arms > 0, "nothing could be solved");
}
