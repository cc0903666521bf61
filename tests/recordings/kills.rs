//! A kill -9 loses a moment at most.

use std::path::Path;
use std::time::{Duration, Instant};

use crate::canter::canter;
use crate::{PROGRAM, arm, engine, send};
use ipc::Observer;

/// Most that a kill may cost (s).
const MOST_S: f64 = 1.0;

/// Records, kills the engine after `life_ms` in the middle of a program, recovers the file. Gives the
/// seconds that were published and that the file lacks at its end.
fn lost_by_a_kill(folder: &Path, name: &str, program: &str, life_ms: u64) -> (f64, f64) {
    let file = folder.join(format!("{name}.mcap"));
    let record = format!("--record={}", file.display());
    let arm = arm(name);
    let mut engine = engine(&arm, &[record]);
    let observer = Observer::open(&system_tests::domain::arm(&arm)).unwrap();
    let _program = send(&arm, program);
    let (end, mut last) = (Instant::now() + Duration::from_millis(life_ms), 0);
    while Instant::now() < end {
        while let Some(setpoint) = observer.next_setpoint() {
            last = setpoint.tick;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    engine.0.kill().unwrap();
    engine.0.wait().unwrap();
    while let Some(setpoint) = observer.next_setpoint() {
        last = setpoint.tick;
    }
    let part = folder.join(format!("{name}.mcap.part"));
    let recorded = recorder::read(&part).unwrap();
    assert!(recorded.cut.is_some() && !recorded.damaged);
    let ran = canter(["record", "--recover", &part.display().to_string()]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let whole = recorder::read(&file).unwrap();
    assert_eq!(whole.cut, None);
    assert_eq!(whole.samples, recorded.samples);
    assert_eq!(whole.programs, recorded.programs);
    let recovered = whole.samples.last().map_or(0, |sample| sample.tick);
    (last as f64 * 1e-3, (last - recovered) as f64 * 1e-3)
}

/// The file that was being written is read after a kill, up to the last second.
pub(crate) fn a_kill_loses_a_moment_at_most() {
    let folder = tempfile::tempdir().unwrap();
    for (number, life_ms) in [(0, 1900), (1, 2650), (2, 3100)] {
        let name = format!("killed{number}");
        let (lived, lost) = lost_by_a_kill(folder.path(), &name, PROGRAM, life_ms);
        println!("killed after {lived:.3} s: {lost:.3} s are missing");
        assert!(lost < MOST_S, "{lost} s of {lived} s are missing");
    }
}

/// A slow straight move, and behind it a list that takes longer to plan than the move takes.
fn long_thought() -> String {
    let turn = "{0,0,-1}, {1,0,0}";
    let mut text = format!(
        "InitCanon()\nSetIntermediatePointTolerance(1)\nSetAbsoluteSpeed(20)\n\
         MoveTo({{{{400, -200, 300}}, {turn}}})\nMoveStraightTo({{{{400, 0, 300}}, {turn}}})\nMoveSmoothlyTo({{\n"
    );
    for k in 1..=2500_u32 {
        let angle = f64::from(k) * 0.05;
        let (x, y) = (340.0 + 60.0 * angle.cos(), 60.0 * angle.sin());
        let z = 300.0 + 0.02 * f64::from(k) + 3.0 * (7.0 * angle).sin();
        let end = if k == 2500 { "" } else { "," };
        text += &format!("{{{{{x:.3}, {y:.3}, {z:.3}}}, {turn}}}{end}\n");
    }
    text + "}, 2500)\nEndCanon(0)\n"
}

/// The planner may think for as long as it wants: what moves meanwhile is written.
pub(crate) fn a_busy_planner_keeps_nothing_back() {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("long_thought.canon");
    std::fs::write(&program, long_thought()).unwrap();
    let program = program.display().to_string();
    let (lived, lost) = lost_by_a_kill(folder.path(), "busy", &program, 6000);
    println!("killed after {lived:.3} s while the planner thought: {lost:.3} s are missing");
    assert!(lost < MOST_S, "{lost} s of {lived} s are missing");
}

/// The same fifty times, at other moments.
pub(crate) fn fifty_kills_lose_a_moment_each() {
    let folder = tempfile::tempdir().unwrap();
    let mut worst = 0.0_f64;
    for number in 0..50_u64 {
        let life_ms = 1300 + number * 7919 % 3000;
        let name = format!("kill{number}");
        let (lived, lost) = lost_by_a_kill(folder.path(), &name, PROGRAM, life_ms);
        println!("kill {number} after {lived:.3} s: {lost:.3} s are missing");
        worst = worst.max(lost);
    }
    println!("at most {worst:.3} s are missing");
    assert!(worst < MOST_S, "{worst} s are missing");
}
