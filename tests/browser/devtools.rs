//! A browser that is driven over its debugging protocol.
//!
//! # Source
//! Chrome DevTools Protocol, domains Page, Runtime, Input, Target, Emulation and Log.

use std::fs;
use std::net::TcpStream;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

/// How long a test waits for something that must come.
const PATIENCE: Duration = Duration::from_secs(90);

/// Names under which the browser is installed.
const NAMES: [&str; 3] = ["chromium-headless-shell", "chromium", "chromium-browser"];

/// The browser of this machine, if there is one.
pub(crate) fn installed() -> Option<&'static str> {
    NAMES.into_iter().find(|name| {
        let path = std::env::var_os("PATH").unwrap_or_default();
        std::env::split_paths(&path).any(|folder| folder.join(name).is_file())
    })
}

/// A running browser, with a folder of its own.
pub(crate) struct Browser {
    pub(crate) child: Child,
    port: u16,
    folder: tempfile::TempDir,
}

impl Drop for Browser {
    fn drop(&mut self) {
        // A browser is a family of processes: the whole group goes.
        #[expect(unsafe_code, reason = "the standard library can only kill one process")]
        // SAFETY: the group is that of our child, which was not waited for; the call takes numbers.
        let _ = unsafe { libc::kill(-self.child.id().cast_signed(), libc::SIGKILL) };
        let _ = self.child.wait();
    }
}

impl Browser {
    pub(crate) fn start() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let child = Command::new(installed().unwrap())
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-quic",
                "--no-first-run",
                "--disable-background-networking",
                "--disable-component-update",
                "--disable-sync",
                "--disable-dev-shm-usage",
                "--use-gl=angle",
                "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader",
                "--remote-debugging-port=0",
                "about:blank",
            ])
            .arg(format!("--user-data-dir={}", folder.path().display()))
            .process_group(0)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let port = port_of(folder.path());
        Self {
            child,
            port,
            folder,
        }
    }

    /// A new tab that shows a page, `size` pixels large.
    pub(crate) fn open(&self, address: &str, size: [u32; 2]) -> Tab {
        let text = fs::read_to_string(self.folder.path().join("DevToolsActivePort")).unwrap();
        let path = text.lines().nth(1).unwrap();
        let mut whole = Tab::connect(self.port, path);
        let target = whole.call("Target.createTarget", json!({"url": "about:blank"}));
        let id = target["targetId"].as_str().unwrap();
        let mut tab = Tab::connect(self.port, &format!("/devtools/page/{id}"));
        for domain in ["Runtime.enable", "Log.enable", "Page.enable"] {
            tab.call(domain, json!({}));
        }
        tab.resize(size);
        tab.call("Page.navigate", json!({"url": address}));
        tab
    }
}

/// The port that the browser has written into its folder.
fn port_of(folder: &Path) -> u16 {
    let end = Instant::now() + PATIENCE;
    loop {
        let text = fs::read_to_string(folder.join("DevToolsActivePort")).unwrap_or_default();
        if text.lines().count() > 1 {
            return text.lines().next().unwrap().parse().unwrap();
        }
        assert!(Instant::now() < end, "the browser does not start");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// A tab.
pub(crate) struct Tab {
    socket: WebSocket<TcpStream>,
    number: u64,
    /// What the page said that it should not: warnings, errors, exceptions.
    pub(crate) complaints: Vec<String>,
}

impl Tab {
    fn connect(port: u16, path: &str) -> Self {
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let address = format!("ws://127.0.0.1:{port}{path}");
        let (socket, _) = tungstenite::client(address, stream).unwrap();
        Self {
            socket,
            number: 0,
            complaints: Vec::new(),
        }
    }

    /// Calls a method and gives its result.
    pub(crate) fn call(&mut self, method: &str, params: Value) -> Value {
        self.number += 1;
        let number = self.number;
        let text = json!({"id": number, "method": method, "params": params}).to_string();
        self.socket.send(Message::Text(text.into())).unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else {
                continue;
            };
            let message: Value = serde_json::from_str(text.as_str()).unwrap();
            if message["id"] == number {
                assert!(message["error"].is_null(), "{method}: {message}");
                return message["result"].clone();
            }
            self.take(&message);
        }
    }

    fn take(&mut self, message: &Value) {
        let params = &message["params"];
        let said = match message["method"].as_str().unwrap_or_default() {
            "Runtime.consoleAPICalled" => {
                let kind = params["type"].as_str().unwrap_or_default();
                ["warning", "error", "assert"]
                    .contains(&kind)
                    .then(|| params.to_string())
            }
            "Runtime.exceptionThrown" => Some(params.to_string()),
            "Log.entryAdded" => {
                let level = params["entry"]["level"].as_str().unwrap_or_default();
                ["warning", "error"]
                    .contains(&level)
                    .then(|| params.to_string())
            }
            _ => None,
        };
        // What the software that draws in place of a graphics card says of itself.
        self.complaints.extend(said.filter(|text| {
            !text.contains("GPU stall due to ReadPixels")
                && !text.contains("Automatic fallback to software")
        }));
    }

    /// The value of an expression in the page; promises are waited for.
    pub(crate) fn eval(&mut self, script: &str) -> Value {
        let params = json!({"expression": script, "awaitPromise": true, "returnByValue": true});
        let result = self.call("Runtime.evaluate", params);
        assert!(result["exceptionDetails"].is_null(), "{script}: {result}");
        result["result"]["value"].clone()
    }

    /// A number of the page.
    pub(crate) fn number(&mut self, script: &str) -> f64 {
        let value = self.eval(script);
        value
            .as_f64()
            .unwrap_or_else(|| panic!("{script}: {value}"))
    }

    /// Waits until an expression is true.
    pub(crate) fn wait(&mut self, script: &str) {
        let end = Instant::now() + PATIENCE;
        while self.eval(&format!("Boolean({script})")) != true {
            if Instant::now() >= end {
                let notes = self.eval("document.querySelector('#notes')?.innerText");
                let state = self.eval("document.querySelector('#state')?.innerText");
                panic!(
                    "{script} did not come about: {state} {notes} {:?}",
                    self.complaints
                );
            }
            std::thread::sleep(Duration::from_millis(40));
        }
    }

    pub(crate) fn click(&mut self, selector: &str) {
        self.eval(&format!("document.querySelector({selector:?}).click()"));
    }

    /// Moves, presses or releases the pointer on the middle of an element.
    pub(crate) fn pointer(&mut self, kind: &str, selector: &str) {
        let place = self.eval(&format!(
            "(() => {{ const b = document.querySelector({selector:?}).getBoundingClientRect(); \
             return [b.x + b.width / 2, b.y + b.height / 2]; }})()"
        ));
        let pressed = i32::from(kind != "mouseReleased");
        let params = json!({"type": kind, "x": place[0], "y": place[1], "button": "left",
            "buttons": pressed, "clickCount": 1});
        self.call("Input.dispatchMouseEvent", params);
    }

    /// Chooses a file in an element for files.
    pub(crate) fn choose(&mut self, selector: &str, file: &Path) {
        let root = self.call("DOM.getDocument", json!({}))["root"]["nodeId"].clone();
        let found = self.call(
            "DOM.querySelector",
            json!({"nodeId": root, "selector": selector}),
        );
        let params = json!({"nodeId": found["nodeId"], "files": [file]});
        self.call("DOM.setFileInputFiles", params);
    }

    /// Another size of the tab (pixels).
    pub(crate) fn resize(&mut self, [width, height]: [u32; 2]) {
        self.call(
            "Emulation.setDeviceMetricsOverride",
            json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": false}),
        );
    }

    /// Minimises the window of the tab, or shows it again: the browser takes focus and visibility.
    pub(crate) fn minimise(&mut self, minimised: bool) {
        let window = self.call("Browser.getWindowForTarget", json!({}))["windowId"].clone();
        let state = if minimised { "minimized" } else { "normal" };
        let params = json!({"windowId": window, "bounds": {"windowState": state}});
        self.call("Browser.setWindowBounds", params);
    }

    /// Freezes the tab as a browser does with those in the background, or wakes it.
    pub(crate) fn freeze(&mut self, frozen: bool) {
        let state = if frozen { "frozen" } else { "active" };
        self.call("Page.setWebLifecycleState", json!({"state": state}));
    }

    /// Presses or releases the space bar.
    pub(crate) fn space(&mut self, kind: &str) {
        let params =
            json!({"type": kind, "code": "Space", "key": " ", "windowsVirtualKeyCode": 32});
        self.call("Input.dispatchKeyEvent", params);
    }

    /// What the tab shows, as PNG.
    pub(crate) fn picture(&mut self) -> Vec<u8> {
        let shot = self.call("Page.captureScreenshot", json!({"format": "png"}));
        decode(shot["data"].as_str().unwrap())
    }

    pub(crate) fn dark(&mut self, dark: bool) {
        let value = if dark { "dark" } else { "light" };
        self.eval(&format!("localStorage.setItem('canter theme', '{value}')"));
        let now = self.eval("document.documentElement.dataset.theme");
        if now != value {
            self.click("#theme");
        }
    }
}

/// Bytes from base 64.
fn decode(text: &str) -> Vec<u8> {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digit = |byte: u8| DIGITS.iter().position(|digit| *digit == byte);
    let (mut bytes, mut word, mut bits) = (Vec::new(), 0_u32, 0);
    for value in text.bytes().filter_map(digit) {
        word = word << 6 | value as u32;
        bits += 6;
        if bits >= 8 {
            bits -= 8;
            bytes.push((word >> bits) as u8);
        }
    }
    bytes
}
