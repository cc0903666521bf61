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

/// What the page says where a real loss of the focus ended a jog: the button notices it first.
const FOCUS: &str = "the button lost the focus|the window lost the focus";

/// The same where the browser takes focus, pointer and visibility in one go.
const AWAY: &str =
    "the button lost the focus|the window lost the focus|the pointer was lost|the tab is hidden";

/// What the page says where answers do not come.
const STANDS: &str = "the link stands still";

/// How often a jog is begun anew.
const ATTEMPTS: usize = 8;

/// One way in which whoever holds a button is lost: its name, what makes it happen in the page, and
/// the reason that the page then gives. Where no script makes it happen, the browser does.
const WAYS: [(&str, &str, &str); 12] = [
    ("pointer released", "", "released"),
    ("key released", "", "released"),
    (
        "pointer cancelled",
        "window.dispatchEvent(new PointerEvent('pointercancel', { pointerId: __view.pendant.held?.pointer }))",
        "the pointer was lost",
    ),
    (
        "another element takes the focus",
        "document.querySelector('#text').focus()",
        FOCUS,
    ),
    (
        "another document takes the focus of the window",
        "(() => { const other = document.createElement('iframe'); document.body.append(other); \
         other.contentWindow.focus(); })()",
        FOCUS,
    ),
    ("window minimised", "", AWAY),
    ("tab hidden and frozen", "", AWAY),
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
    ("socket stands still", "", STANDS),
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
    // A picture that is drawn without a graphics card takes the page's time: the jog is measured.
    tab.eval("__view.stage.draw = () => {}; 0");
    println!("| a jog of 100 mm/s along x ends by | after, ms | went on, mm |");
    println!("|---|---|---|");
    let scene = Ends {
        relay: &relay,
        watcher: &watcher,
        browser: &browser,
    };
    for (index, way) in WAYS.into_iter().enumerate() {
        // On a machine under load a jog can end by a late answer just before: it begins again.
        let begun = (0..ATTEMPTS).find_map(|attempt| scene.end(&mut tab, &way, index + attempt));
        match begun {
            Some(Stop { after_ms, went_mm }) => {
                println!("| {} | {after_ms:.0} | {went_mm:.1} |", way.0);
                assert!(went_mm < 500.0, "{}: {went_mm} mm", way.0);
            }
            None => println!("| {} | late answers had ended the jog each time | |", way.0),
        }
    }
    // Chromium since 156.0.8078.79 closes the socket of a tab that it freezes, and says so.
    tab.complaints
        .retain(|text| !text.contains("Page entered Back-Forward Cache"));
    assert!(tab.complaints.is_empty(), "{:#?}", tab.complaints);
    resume(&browser);
}

/// What ends jogs, and who watches.
struct Ends<'a> {
    relay: &'a Relay,
    watcher: &'a Watcher,
    browser: &'a Browser,
}

impl Ends<'_> {
    /// Jogs, and ends it this way; none where a late answer had ended it before.
    fn end(&self, tab: &mut Tab, way: &(&str, &str, &str), index: usize) -> Option<Stop> {
        let (way, script, reasons) = *way;
        tab.click("[data-space=workstation]");
        // There and back, so that the arm stays where it is free.
        let mut buttons = ["[data-jog='0:1']", "[data-jog='0:-1']"];
        buttons.rotate_left(index % 2);
        let button = hold(tab, buttons, way == "key released");
        let event = now();
        match way {
            "pointer released" => tab.pointer("mouseReleased", button),
            "key released" => tab.space("keyUp"),
            "window minimised" => tab.minimise(true),
            "tab hidden and frozen" => tab.freeze(true),
            "socket stands still" => self.relay.stand(true),
            "browser stands still" => stall(self.browser),
            _ => {
                tab.eval(script);
            }
        }
        let stop = self.watcher.rest(event);
        if way == "browser stands still" {
            return Some(stop);
        }
        let ended = tab.eval("__view.pendant.ended");
        let ended = ended.as_str().unwrap_or_default();
        let meant = reasons.split('|').any(|reason| reason == ended);
        assert!(
            meant || ended == STANDS || ended == "refused",
            "{way}: {ended}"
        );
        let rested = now();
        self.relay.stand(false);
        if way == "tab hidden and frozen" {
            tab.freeze(false);
            tab.minimise(true);
        }
        tab.minimise(false);
        tab.wait("document.visibilityState === 'visible'");
        tab.eval("document.querySelector('iframe')?.remove()");
        tab.pointer("mouseReleased", button);
        std::thread::sleep(Duration::from_millis(400));
        assert!(!self.watcher.moved_since(rested), "{way}: it moved again");
        recover(tab);
        meant.then_some(stop)
    }
}

/// Holds one of the buttons until the arm has its speed, the worst moment, and says which. On a machine under load a beat may
/// come late and end the jog: then it begins again.
fn hold<'a>(tab: &mut Tab, buttons: [&'a str; 2], by_key: bool) -> &'a str {
    for attempt in 0..40 {
        let button = buttons[attempt % 2];
        begin(tab, button, by_key);
        std::thread::sleep(Duration::from_millis(300));
        if tab.eval("__view.pendant.held !== null") == true && tab.eval(MOVES) == true {
            return button;
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
    hold(&mut tab, ["[data-go=start]"; 2], false);
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
