//! What was planned and does not move: a program, and lists of poses.

use std::time::Duration;

use crate::devtools::{Browser, Tab};
use crate::pages::{SIZE, keep};
use crate::scene::Peer;

/// Two lists, one that can be planned and one that cannot.
const LISTS: &str = r#"{"cases": {
    "corner": {"P": [[0,0,0],[100,0,0],[100,100,0]], "tol": 2, "V": 500, "A": 5000, "J": 100000},
    "far": {"P": [[0,0,0],[9000,0,0]], "tol": 2, "V": 500, "A": 5000, "J": 100000},
    "line": {"P": [[0,0,0],[200,0,0]], "tol": 2, "V": 250, "A": 5000, "J": 100000}}}"#;

/// Opens what `canter` shows with these words, and waits for a picture of it.
fn open(words: &[&str]) -> (Peer, Browser, Tab) {
    let mut shown = Peer::start(words);
    let address = shown.line("http://");
    let browser = Browser::start();
    let mut tab = browser.open(&address, SIZE);
    tab.wait("window.__view && __view.dry && __view.program.plan && __view.samples.count > 100");
    (shown, browser, tab)
}

/// Without an engine: the plan is played, its plots are drawn, the move of the cursor's line tells its
/// limits, and an edited program is planned again.
pub(crate) fn a_planned_program_is_shown() {
    let (_shown, _browser, mut tab) = open(&[
        "plan",
        "examples/pick_and_place.canon",
        "--robot",
        "ur5e",
        "--view",
    ]);
    // The plots have the whole plan, within the limits.
    let duration = tab.number("__view.program.plan.duration_s");
    let rows = tab.number("(__view.samples.count - 1) * __view.samples.period");
    assert!((rows - duration).abs() < 0.01, "{rows} s of {duration} s");
    let most = tab.number(
        "(() => { const [q] = __view.plots.all.filter((all) => all.title === 'Velocity'); let most = 0; \
         for (let row = 0; row < __view.samples.count; row += 1) for (let k = 0; k < 6; k += 1) \
         most = Math.max(most, Math.abs(q.value(row, k))); return most; })()",
    );
    assert!(most > 0.5 && most < 1.0001, "{most} of the limit");
    // Played to a time, the arm stands there.
    tab.eval("(() => { const s = document.querySelector('#seek'); s.value = 2.5; s.dispatchEvent(new Event('input')); })()");
    for axis in 0..3 {
        let away = tab.number(&format!(
            "Math.abs(__view.stage.robot.point().getComponent({axis}) - __view.program.plan.path.points[1250][{axis}])"
        ));
        assert!(away < 2e-3, "axis {axis}: {away} m");
    }
    // The cursor in line 25: the smooth move tells its limits and its poses.
    tab.eval("(() => { const t = __view.program.text; const at = t.value.split('\\n').slice(0, 25).join('\\n').length - 2; \
        t.focus(); t.setSelectionRange(at, at); t.dispatchEvent(new Event('keyup')); })()");
    tab.wait(
        "document.querySelector('#certificate').textContent.includes('line 25: MoveSmoothlyTo')",
    );
    assert!(tab.number("document.querySelectorAll('#certificate [data-limit]').length") > 1.0);
    // Another program is planned in its place.
    tab.eval("(() => { const t = __view.program.text; t.value = 'InitCanon()\\nDwell(1.5)\\nEndCanon(0)\\n'; t.dispatchEvent(new Event('input')); })()");
    tab.click("#plan");
    tab.wait(
        "Math.abs(__view.program.plan.duration_s - 1.5) < 1e-6 && __view.samples.count === 751",
    );
    assert!(tab.complaints.is_empty(), "{:#?}", tab.complaints);
}

/// `canter bench motion --view`: each list with its motion, with an arm and without.
pub(crate) fn lists_of_poses_are_shown() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lists.json");
    std::fs::write(&file, LISTS).unwrap();
    let file = file.display().to_string();
    for robot in [None, Some("ur5e")] {
        let mut words = vec!["bench", "motion", &file, "--view"];
        words.extend(robot.iter().flat_map(|name| ["--robot", name]));
        let (_shown, _browser, mut tab) = open(&words);
        let rows = tab.eval(
            "[...document.querySelectorAll('#lists button')].map((b) => [b.innerText, b.disabled])",
        );
        let far = rows[1][1] == true;
        assert_eq!(far, robot.is_some(), "{rows}");
        assert_eq!(rows[0][1], false);
        assert!(rows[0][0].as_str().unwrap().starts_with("corner"), "{rows}");
        assert!(tab.number("__view.stage.balls.count") == 1.0);
        assert!(tab.number("__view.stage.planned.count") > 50.0);
        tab.click("#lists li:nth-child(4) button");
        tab.wait("__view.lists.chosen === 2 && __view.program.plan.name === 'line'");
        let speed = tab.number(
            "(() => { const q = __view.plots.all.find((all) => all.title === 'Tool speed'); let most = 0; \
             for (let row = 1; row < __view.samples.count; row += 1) most = Math.max(most, q.value(row, 0)); return most; })()",
        );
        assert!(speed > 0.2 && speed < 0.2502, "{speed} m/s");
        if robot.is_none() {
            tab.click("#lists li:nth-child(2) button");
            tab.wait("__view.lists.chosen === 0 && __view.program.plan.name === 'corner'");
            tab.eval("(() => { const s = document.querySelector('#seek'); s.value = 0.3; s.dispatchEvent(new Event('input')); })()");
            std::thread::sleep(Duration::from_millis(300));
            keep(&mut tab, "view_lists.png");
        }
        tab.click("#play");
        tab.wait("__view.player.state.at_s > 0.05");
        assert!(tab.complaints.is_empty(), "{:#?}", tab.complaints);
    }
}
