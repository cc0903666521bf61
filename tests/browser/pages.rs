//! What a person sees and does.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::time::Duration;

use crate::canter::canter;
use crate::devtools::{Browser, Tab};
use crate::scene::{Peer, Scene};
use system_tests::repository::root;
use system_tests::signal;

pub(crate) const SIZE: [u32; 2] = [1400, 860];

/// Waits until the page has the robot and periods come.
pub(crate) fn ready(tab: &mut Tab) {
    tab.wait("window.__view && __view.robot && __view.samples.count > 50");
}

pub(crate) fn take_hand(tab: &mut Tab) {
    tab.click("#hand");
    tab.wait("__view.pendant.has");
}

/// Renews a picture of the documentation where that is asked for.
pub(crate) fn keep(tab: &mut Tab, name: &str) {
    let picture = tab.picture();
    assert!(
        picture.len() < 300_000,
        "{name} has {} bytes",
        picture.len()
    );
    assert!(picture.starts_with(b"\x89PNG"));
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(root().join("docs/pictures").join(name), picture).unwrap();
    }
}

/// The page opens without a word in the console, its address loses the token, and the arm of the
/// picture is where the engine says: by its joints, by the controlled point, and in pixels.
pub(crate) fn the_arm_stands_where_the_engine_says() {
    let scene = Scene::start("stands");
    let browser = Browser::start();
    let mut tab = browser.open(&scene.hand, SIZE);
    ready(&mut tab);
    let opened = tab.number("__view.opened");
    println!("the arm is drawn {opened:.0} ms after the page was asked for");
    assert_eq!(tab.eval("location.hash + location.pathname"), "/");
    let status = scene.status();
    for axis in 0..3 {
        let engine = status["position_m"][axis].as_f64().unwrap();
        let page = tab.number(&format!("__view.stage.robot.point().getComponent({axis})"));
        assert!((engine - page).abs() < 1e-3, "axis {axis}: {engine} {page}");
    }
    for joint in 0..6 {
        let engine = status["joints"][joint].as_f64().unwrap();
        let page = tab.number(&format!("__view.samples.newestJoints(true)[{joint}]"));
        assert!(
            (engine - page).abs() < 1e-4,
            "joint {joint}: {engine} {page}"
        );
    }
    // The arm is drawn: without it, other pixels are there.
    let lost = tab.number("__view.samples.lost");
    let shown = tab.eval("document.querySelector('#losses').textContent");
    assert!(
        shown.as_str().unwrap().contains(" lost, "),
        "{shown}, {lost} lost"
    );
    let count = "(() => { const s = __view.stage; const g = s.renderer.getContext(); \
        const read = () => { s.dirty = true; s.draw(); const b = new Uint8Array(4 * g.drawingBufferWidth * g.drawingBufferHeight); \
        g.readPixels(0, 0, g.drawingBufferWidth, g.drawingBufferHeight, g.RGBA, g.UNSIGNED_BYTE, b); return b; }; \
        const a = read(); s.robot.root.visible = false; const b = read(); s.robot.root.visible = true; s.dirty = true; \
        let n = 0; for (let k = 0; k < a.length; k += 4) n += a[k] !== b[k] || a[k + 1] !== b[k + 1]; return n; })()";
    let pixels = tab.number(count);
    assert!(pixels > 3000.0, "{pixels} pixels of arm");
    assert!(tab.complaints.is_empty(), "{:#?}", tab.complaints);
}

/// Load, plan, preview, run, override, pause, resume, stop, fault, recover: all from the page. The
/// pictures of the documentation are taken on the way.
pub(crate) fn a_program_is_led_from_the_page() {
    let scene = Scene::start("cell/arm");
    let browser = Browser::start();
    let mut tab = browser.open(&scene.hand, SIZE);
    ready(&mut tab);
    take_hand(&mut tab);
    // A fault of the program has its place on the page, and moves nothing.
    let folder = tempfile::tempdir().unwrap();
    let wrong = folder.path().join("wrong.canon");
    let text = "InitCanon()\nSetRelativeSpeed(50)\nMoveTo({{9000, 0, 0}, {0,0,-1}, {1,0,0}})\nEndCanon(0)\n";
    std::fs::write(&wrong, text).unwrap();
    tab.choose("#file", &wrong);
    tab.wait("document.querySelector('#findings button')?.textContent.startsWith('3:')");
    // A browser reads no path with two dots.
    let example = root().join("examples/pick_and_place.canon");
    tab.choose("#file", &example.canonicalize().unwrap());
    tab.wait("__view.program.plan && __view.stage.planned && __view.stage.planned.count > 100");
    tab.wait("!document.querySelector('#findings button')");
    assert_eq!(
        tab.eval("document.querySelector('#program-name').textContent"),
        "pick_and_place.canon"
    );
    tab.click("#run");
    tab.wait("!__view.status.idle && __view.program.line > 0");
    // The smooth move of line 25, in both colours and on a tablet.
    tab.wait("__view.program.line === 25 && document.querySelector('#certificate .why')");
    tab.dark(false);
    keep(&mut tab, "view_light.png");
    tab.dark(true);
    tab.click("[data-tab=commands]");
    tab.click("[data-layer=corridor]");
    std::thread::sleep(Duration::from_millis(300));
    keep(&mut tab, "view_dark.png");
    tab.resize([820, 1180]);
    std::thread::sleep(Duration::from_millis(300));
    keep(&mut tab, "view_tablet.png");
    tab.resize(SIZE);
    tab.wait("__view.status.idle");
    lead(&mut tab);
    // The engine stands still for longer than the watchdog: a fault, with its words on the page.
    signal::send(&scene.engine.child, libc::SIGSTOP);
    std::thread::sleep(Duration::from_millis(700));
    signal::send(&scene.engine.child, libc::SIGCONT);
    tab.wait("__view.status.fault && document.querySelector('#state').dataset.kind === 'fault'");
    tab.wait("document.querySelector('#state').textContent.includes('.mcap')");
    tab.click("#recover");
    tab.wait("!__view.status.fault");
    assert!(tab.complaints.is_empty(), "{:#?}", tab.complaints);
}

/// Runs the program of the page again, slower, and stops it in every way.
fn lead(tab: &mut Tab) {
    tab.eval("(() => { const o = document.querySelector('#override'); o.value = 30; o.dispatchEvent(new Event('input')); })()");
    tab.click("#run");
    tab.wait("!__view.status.idle && Math.abs(__view.status.time_scaling - 0.3) < 0.02");
    tab.click("#pause");
    tab.wait("__view.status.held && __view.status.time_scaling === 0");
    tab.click("#resume");
    tab.wait("!__view.status.held");
    tab.click("#stop");
    tab.wait("__view.status.held");
    tab.click("#abort");
    tab.wait("__view.status.idle");
    tab.click("#resume");
    tab.wait("!__view.status.held");
    tab.eval("(() => { const o = document.querySelector('#override'); o.value = 100; o.dispatchEvent(new Event('input')); })()");
}

/// In single step each command waits for the button; then all go on.
pub(crate) fn a_program_goes_step_by_step() {
    let scene = Scene::start("steps");
    let browser = Browser::start();
    let mut tab = browser.open(&scene.hand, SIZE);
    ready(&mut tab);
    take_hand(&mut tab);
    tab.eval("__view.program.set('steps.canon', 'InitCanon()\\nDwell(0.2)\\nDwell(0.3)\\nMessage(\"end\")\\nEndCanon(0)\\n'); __view.program.edited = true; 0");
    let done = |tab: &mut Tab, count: usize| {
        tab.wait(&format!(
            "[...document.querySelectorAll('#notes li')].filter((note) => note.textContent.endsWith(' done')).length === {count}"
        ));
        tab.wait("document.querySelector('#state').textContent === 'waits for Step'");
    };
    for count in 1..=3 {
        tab.click("#step-on");
        done(&mut tab, count);
        std::thread::sleep(Duration::from_millis(300));
        done(&mut tab, count);
    }
    assert_eq!(
        tab.eval("document.querySelector('#run').textContent"),
        "Continue"
    );
    tab.click("#run");
    tab.wait("__view.status.idle && __view.status.state === 'ended'");
    assert!(tab.complaints.is_empty(), "{:#?}", tab.complaints);
}

/// While the plots are frozen, the picture shows where the arm was, and says so.
pub(crate) fn the_past_is_looked_at() {
    let scene = Scene::start("past");
    let browser = Browser::start();
    let mut tab = browser.open(&scene.hand, SIZE);
    ready(&mut tab);
    take_hand(&mut tab);
    let jog = "__view.act.ask({ do: 'step', space: 'joint', speeds: [0.3, 0, 0, 0, 0, 0], distance: 0.3, sent_ms: performance.now() }).then((a) => a.ok)";
    let first = tab.number("__view.samples.newestJoints(true)[0]");
    assert_eq!(tab.eval(jog), true);
    tab.wait(&format!(
        "__view.samples.newestJoints(true)[0] > {first} + 0.29 && __view.status.idle"
    ));
    tab.click("#freeze");
    tab.eval(
        "(() => { __view.plots.end = __view.samples.tick(20); __view.plots.cursor = null; })()",
    );
    tab.wait("!document.querySelector('#past').hidden && document.querySelector('#past').textContent.includes('s ago')");
    // The picture has the joint where it was.
    tab.wait(&format!("Math.abs(2 * Math.asin(__view.stage.robot.joints[0].moving.quaternion.z) - ({first})) < 0.01"));
    tab.click("#freeze");
    tab.wait("document.querySelector('#past').hidden");
    let csv = tab.eval("__view.plots.csv()");
    let text = csv.as_str().unwrap();
    assert!(
        text.starts_with("t_s,J1 (% of limit)") && text.lines().count() > 100,
        "{text:.200}"
    );
    assert!(tab.complaints.is_empty(), "{:#?}", tab.complaints);
}

/// Stops every process of the browser: its parts that go on know nothing of what is held.
pub(crate) fn stall(browser: &Browser) {
    signal::send(&browser.child, libc::SIGSTOP);
    for process in family(browser.child.id()) {
        send(process, libc::SIGSTOP);
    }
}

/// Lets them go on, so that they can be ended.
pub(crate) fn resume(browser: &Browser) {
    for process in family(browser.child.id()) {
        send(process, libc::SIGCONT);
    }
    signal::send(&browser.child, libc::SIGCONT);
}

fn send(process: u32, number: i32) {
    #[expect(
        unsafe_code,
        reason = "the standard library can only kill its own children"
    )]
    // SAFETY: the call takes numbers only; a process that is gone is an error that nobody needs.
    let _ = unsafe { libc::kill(process.cast_signed(), number) };
}

/// The processes below one, by /proc.
fn family(parent: u32) -> Vec<u32> {
    let mut found = Vec::new();
    let listed = std::fs::read_dir("/proc").unwrap().flatten();
    let numbers: Vec<u32> = listed
        .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
        .collect();
    let parent_of = |process: u32| -> Option<u32> {
        let text = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
        text.rsplit(')')
            .next()?
            .split_whitespace()
            .nth(1)?
            .parse()
            .ok()
    };
    for process in numbers {
        let mut above = parent_of(process);
        while let Some(number) = above.filter(|number| *number > 1) {
            if number == parent {
                found.push(process);
                break;
            }
            above = parent_of(number);
        }
    }
    found
}

/// One page has the hand; the other watches, may stop the arm, and gets the hand when it is free.
pub(crate) fn two_pages_fight_for_the_hand() {
    let scene = Scene::start("fight");
    let browser = Browser::start();
    let mut first = browser.open(&scene.hand, SIZE);
    let mut second = browser.open(&scene.hand, SIZE);
    let mut watcher = browser.open(&scene.watch, SIZE);
    for tab in [&mut first, &mut second, &mut watcher] {
        ready(tab);
    }
    take_hand(&mut first);
    second.wait("document.querySelector('#hand').disabled");
    let refused = second.eval("__view.act.ask({ do: 'take' }).then((a) => a.message)");
    assert!(
        refused.as_str().unwrap().contains("another page"),
        "{refused}"
    );
    let jog = "__view.act.ask({ do: 'jog', space: 'joint', speeds: [0.1, 0, 0, 0, 0, 0], sent_ms: performance.now() }).then((a) => a.ok)";
    assert_eq!(second.eval(jog), false);
    assert_eq!(
        watcher.eval("__view.act.ask({ do: 'take' }).then((a) => a.ok)"),
        false
    );
    assert_eq!(watcher.eval(jog), false);
    let own = "__view.act.ask({ do: 'run', name: 'x', program: 'InitCanon()' }).then((a) => a.ok)";
    assert_eq!(watcher.eval(own), false);
    assert_eq!(first.eval(jog), true);
    // Everybody stops the arm.
    watcher.click("#stop");
    // The jog's time runs out meanwhile, and the arm is held all the same.
    first.wait("__view.status.held && __view.status.idle");
    first.click("#resume");
    first.wait("!__view.status.held");
    // The hand goes with its page.
    first.call("Page.navigate", serde_json::json!({"url": "about:blank"}));
    second.wait("!document.querySelector('#hand').disabled");
    take_hand(&mut second);
    assert!(second.complaints.is_empty(), "{:#?}", second.complaints);
}

/// A page of another port of this machine, with the right token even, gets nothing.
pub(crate) fn a_page_of_another_origin_gets_nothing() {
    let scene = Scene::start("origin");
    let (port, token) = (
        scene.port(),
        scene.hand.rsplit('#').next().unwrap().to_owned(),
    );
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("http://{}/", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let _ = stream.read(&mut [0; 4096]);
            let body = "<!doctype html><link rel=icon href=data:,><title>evil</title>";
            let _ = write!(
                stream,
                "HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
                body.len()
            );
        }
    });
    let browser = Browser::start();
    let mut tab = browser.open(&address, SIZE);
    tab.wait("document.title === 'evil'");
    let socket = format!(
        "new Promise((done) => {{ const s = new WebSocket('ws://127.0.0.1:{port}/live', ['canter', 'token.{token}']); \
         s.onopen = () => done('open'); s.onerror = () => done('refused'); }})"
    );
    assert_eq!(tab.eval(&socket), "refused");
    let fetched =
        format!("fetch('http://127.0.0.1:{port}/main.js').then(() => 'read', () => 'refused')");
    assert_eq!(tab.eval(&fetched), "refused");
    // The view's own page with the same token is let in.
    let mut own = browser.open(&scene.hand, SIZE);
    ready(&mut own);
}

/// A recording is shown in the same page, with time controls.
pub(crate) fn a_recording_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    let record = format!("--record={}", file.display());
    let arm = format!("browser{}/replay", std::process::id());
    let ran = canter([
        "run",
        "examples/pick_and_place.canon",
        "--robot",
        "ur5e",
        "--lock-step",
        "--arm",
        &arm,
        &record,
    ]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let shown = file.display().to_string();
    let mut replay = Peer::start(&["replay", &shown, "--port", "0"]);
    let address = replay.line("http://");
    let browser = Browser::start();
    let mut tab = browser.open(&address, SIZE);
    ready(&mut tab);
    tab.click("#play");
    tab.eval("__view.act.ask({ do: 'seek', at: 2.5 }).then((a) => a.ok)");
    tab.wait("Math.abs(Number(document.querySelector('#seek').value) - 2.5) < 0.01");
    let recorded = recorder::read(&file).unwrap();
    let wanted = recorded.samples[0].tick + 2500;
    let sample = recorded
        .samples
        .iter()
        .find(|sample| sample.tick == wanted)
        .unwrap();
    tab.wait(&format!("__view.samples.lastTick === {wanted}"));
    for axis in 0..3 {
        // The picture shows what was measured.
        tab.wait(&format!(
            "Math.abs(__view.stage.robot.point().getComponent({axis}) - ({})) < 1e-3",
            sample.measured_tool[axis]
        ));
    }
    assert_eq!(tab.eval("document.querySelector('#pendant').hidden"), true);
    keep(&mut tab, "view_replay.png");
    assert!(tab.complaints.is_empty(), "{:#?}", tab.complaints);
}
