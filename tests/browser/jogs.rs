//! A jog ends with every doubt: how long and how far it goes on is measured.

use std::time::Duration;

use crate::devtools::{Browser, Tab};
use crate::pages::{SIZE, ready, resume, stall, take_hand};
use crate::relay::Relay;
use crate::scene::Scene;
use crate::watcher::{Stop, Watcher, now};

/// Whether the arm moves, by what the engine published.
const MOVES: &str = "__view.samples.count > 0 && [0, 1, 2, 3, 4, 5].some((k) => \
    Math.abs(__view.samples.at(__view.samples.count - 1, 7 + 6 + k)) > 0.005)";

/// One way in which whoever holds a button is lost: its name, what makes it happen in the page, and
/// the reason that the page then gives.
const WAYS: [(&str, &str, &str); 11] = [
    ("pointer released", "", "released"),
    ("key released", "", "released"),
    (
        "pointer cancelled",
        "window.dispatchEvent(new PointerEvent('pointercancel', { pointerId: __view.pendant.held.pointer }))",
        "the pointer was lost",
    ),
    (
        "another element takes the focus",
        "document.querySelector('#text').focus()",
        "the button lost the focus",
    ),
    (
        "window loses the focus",
        "window.dispatchEvent(new Event('blur'))",
        "the window lost the focus",
    ),
    (
        "tab hidden",
        "Object.defineProperty(document, 'hidden', { value: true, configurable: true }); \
         document.dispatchEvent(new Event('visibilitychange')); delete document.hidden; 0",
        "the tab is hidden",
    ),
    (
        "menu opened",
        "window.dispatchEvent(new Event('contextmenu'))",
        "a menu came",
    ),
    (
        "mode changed",
        "document.querySelector('[data-space=tool]').click()",
        "another mode",
    ),
    (
        "socket closed",
        "__view.act.link.socket.close()",
        "the connection is lost",
    ),
    ("socket stands still", "", "the link stands still"),
    ("browser stands still", "", ""),
];

/// Every way in which whoever holds a button can be lost ends the jog; what was held back by a link
/// that stood still moves nothing when it arrives.
pub(crate) fn a_jog_ends_with_every_doubt() {
    let scene = Scene::start("jog");
    let relay = Relay::to(scene.port());
    let watcher = Watcher::start(&scene.arm);
    let browser = Browser::start();
    let mut tab = browser.open(&relay.address(&scene.hand), SIZE);
    ready(&mut tab);
    take_hand(&mut tab);
    tab.eval("(() => { const s = document.querySelector('#jog-speed'); s.value = 10; s.dispatchEvent(new Event('input')); })()");
    println!("| a jog of 100 mm/s along x ends by | after, ms | went on, mm |");
    println!("|---|---|---|");
    for (index, (way, script, reason)) in WAYS.into_iter().enumerate() {
        let button = format!("[data-jog='0:{}']", if index % 2 == 0 { 1 } else { -1 });
        tab.click("[data-space=workstation]");
        hold(&mut tab, &button, way == "key released");
        let event = now();
        match way {
            "pointer released" => tab.pointer("mouseReleased", &button),
            "key released" => tab.space("keyUp"),
            "socket stands still" => relay.stand(true),
            "browser stands still" => stall(&browser),
            _ => {
                tab.eval(script);
            }
        }
        let Stop { after_ms, went_mm } = watcher.rest(event);
        println!("| {way} | {after_ms:.0} | {went_mm:.1} |");
        assert!(went_mm < 500.0, "{way}: {went_mm} mm");
        if way == "browser stands still" {
            break;
        }
        // On a machine under load an answer may be late just then: that ends it as well.
        let ended = tab.eval("__view.pendant.ended");
        assert!(
            ended == reason || ended == "the link stands still",
            "{way}: {ended}"
        );
        let rested = now();
        relay.stand(false);
        tab.pointer("mouseReleased", &button);
        std::thread::sleep(Duration::from_millis(400));
        assert!(!watcher.moved_since(rested), "{way}: it moved again");
        recover(&mut tab);
    }
    assert!(tab.complaints.is_empty(), "{:#?}", tab.complaints);
    resume(&browser);
}

/// Holds a button until the arm has its speed: the worst moment. On a machine under load a beat may
/// come late and end the jog: then it begins again.
fn hold(tab: &mut Tab, button: &str, by_key: bool) {
    for _ in 0..20 {
        begin(tab, button, by_key);
        std::thread::sleep(Duration::from_millis(300));
        if tab.eval("__view.pendant.held !== null") == true && tab.eval(MOVES) == true {
            return;
        }
        if by_key {
            tab.space("keyUp");
        } else {
            tab.pointer("mouseReleased", button);
        }
        std::thread::sleep(Duration::from_millis(500));
    }
    panic!("no jog goes on for 0.3 s");
}

/// Holds a button until the arm moves, or until the jog has ended.
fn begin(tab: &mut Tab, button: &str, by_key: bool) {
    tab.wait(&format!(
        "document.querySelector(\"{button}\") && !document.querySelector(\"{button}\").disabled"
    ));
    if by_key {
        tab.eval(&format!("document.querySelector(\"{button}\").focus()"));
        tab.space("keyDown");
    } else {
        tab.pointer("mousePressed", button);
    }
    tab.wait(&format!("({MOVES}) || __view.pendant.held === null"));
}

/// Takes the hand again where the link was lost.
fn recover(tab: &mut Tab) {
    tab.wait("__view.act.link.isOpen && __view.pendant.page > 0 && !document.querySelector('#hand').disabled");
    if tab.eval("__view.pendant.has") != true {
        take_hand(tab);
    }
}

/// Steps have their length, a taught pose is reached by holding, and letting go on the way stops.
pub(crate) fn steps_and_taught_poses() {
    let scene = Scene::start("poses");
    let watcher = Watcher::start(&scene.arm);
    let browser = Browser::start();
    let mut tab = browser.open(&scene.hand, SIZE);
    ready(&mut tab);
    take_hand(&mut tab);
    let choose = |tab: &mut Tab, step: &str| {
        tab.eval(&format!(
            "(() => {{ const s = document.querySelector('#step'); s.value = '{step}'; s.dispatchEvent(new Event('change')); }})()"
        ));
    };
    let place = |scene: &Scene| {
        scene.status()["setpoint"]
            .as_array()
            .unwrap()
            .iter()
            .map(|value| value.as_f64().unwrap())
            .collect::<Vec<f64>>()
    };
    tab.click("[data-tab=taught]");
    tab.eval("document.querySelector('#pose-name').value = 'start'; document.querySelector('#pose-form').requestSubmit()");
    let home = place(&scene);
    // A step of ten degrees with a joint, by the key; then one of 10 mm down.
    choose(&mut tab, "10");
    tab.eval("document.querySelector(\"[data-jog='0:1']\").focus()");
    let event = now();
    tab.space("keyDown");
    tab.space("keyUp");
    tab.wait(&format!("__view.status.setpoint[0] - ({}) > 0.1", home[0]));
    watcher.rest(event);
    let turned = place(&scene)[0] - home[0];
    assert!((turned - 10_f64.to_radians()).abs() < 1e-9, "{turned} rad");
    tab.click("[data-space=workstation]");
    let before = scene.status()["position_m"][2].as_f64().unwrap();
    let event = now();
    tab.pointer("mousePressed", "[data-jog='2:-1']");
    tab.pointer("mouseReleased", "[data-jog='2:-1']");
    tab.wait(&format!(
        "__view.status.position_m[2] - ({before}) < -0.005"
    ));
    watcher.rest(event);
    let down = scene.status()["position_m"][2].as_f64().unwrap() - before;
    assert!((down + 0.01).abs() < 1e-4, "{down} m");
    // To the taught pose by holding: let go on the way, it stops; held on, it arrives.
    choose(&mut tab, "0");
    let slow = "(() => { const s = document.querySelector('#jog-speed'); s.value = 2; s.dispatchEvent(new Event('input')); })()";
    tab.eval(slow);
    tab.wait("document.querySelector('[data-go=start]')");
    hold(&mut tab, "[data-go=start]", false);
    let event = now();
    tab.pointer("mouseReleased", "[data-go=start]");
    let Stop { after_ms, went_mm } = watcher.rest(event);
    println!(
        "holding to a pose ends {after_ms:.0} ms and {went_mm:.1} mm after the button is let go"
    );
    assert!(
        (place(&scene)[0] - home[0]).abs() > 1e-4,
        "it went on to the pose"
    );
    tab.eval(&slow.replace("= 2", "= 20"));
    let reached = "[...document.querySelectorAll('#notes li')].some((note) => note.textContent.includes('the pose is reached'))";
    while tab.eval(reached) != true {
        begin(&mut tab, "[data-go=start]", false);
        tab.wait("__view.pendant.held === null");
        tab.pointer("mouseReleased", "[data-go=start]");
    }
    let there = place(&scene);
    assert!(
        there.iter().zip(&home).all(|(a, b)| (a - b).abs() < 1e-9),
        "{there:?}"
    );
    // Taught into the program, behind the cursor and in its line.
    tab.eval("__view.program.set('taught.canon', 'InitCanon()\\n'); __view.program.text.setSelectionRange(3, 3)");
    tab.click("#teach");
    tab.wait("/^InitCanon\\(\\)\\nMoveTo\\(\\{\\{.*\\}\\}\\)\\n$/.test(__view.program.text.value)");
    tab.eval("__view.program.text.value = 'InitCanon()\\nMoveStraightTo({{1, 2, 3}, {0,0,-1}, {1,0,0}})'; __view.program.text.setSelectionRange(20, 20)");
    tab.click("#replace");
    let text = tab.eval("__view.program.text.value");
    let line = text.as_str().unwrap().lines().nth(1).unwrap().to_owned();
    assert!(
        line.starts_with("MoveStraightTo({{") && !line.contains("{1, 2, 3}"),
        "{line}"
    );
    assert!(tab.complaints.is_empty(), "{:#?}", tab.complaints);
}

/// A gamepad moves the arm while its shoulder button is held, and no longer.
pub(crate) fn a_gamepad_needs_its_enabling_button() {
    let scene = Scene::start("gamepad");
    let watcher = Watcher::start(&scene.arm);
    let browser = Browser::start();
    let mut tab = browser.open(&scene.hand, SIZE);
    ready(&mut tab);
    take_hand(&mut tab);
    // No gamepad can be plugged into a headless browser: the page sees this one.
    tab.eval("window.pad = { connected: true, axes: [0, 0, 0, 0], buttons: Array.from({ length: 8 }, () => ({ pressed: false })) }; \
        navigator.getGamepads = () => [window.pad]; document.hasFocus = () => true; 0");
    tab.click("[data-space=workstation]");
    let set = |tab: &mut Tab, axes: &str, pressed: bool| {
        tab.eval(&format!(
            "pad.axes = {axes}; pad.buttons[5].pressed = {pressed}; 0"
        ));
    };
    let rested = now();
    set(&mut tab, "[0, -1, 0, 0]", false);
    std::thread::sleep(Duration::from_millis(400));
    assert!(
        !watcher.moved_since(rested),
        "it moves without the enabling button"
    );
    // The stick goes back first, then both.
    set(&mut tab, "[0, 0, 0, 0]", true);
    std::thread::sleep(Duration::from_millis(300));
    set(&mut tab, "[0, -1, 0, 0]", true);
    tab.wait(MOVES);
    let event = now();
    set(&mut tab, "[0, -1, 0, 0]", false);
    let Stop { after_ms, went_mm } = watcher.rest(event);
    println!(
        "a gamepad's jog ends {after_ms:.0} ms and {went_mm:.1} mm after its button is let go"
    );
    // Two directions at once are a doubt.
    set(&mut tab, "[0, 0, 0, 0]", true);
    std::thread::sleep(Duration::from_millis(300));
    let rested = now();
    set(&mut tab, "[1, -1, 0, 0]", true);
    std::thread::sleep(Duration::from_millis(400));
    assert!(!watcher.moved_since(rested));
    assert!(tab.complaints.is_empty(), "{:#?}", tab.complaints);
}
