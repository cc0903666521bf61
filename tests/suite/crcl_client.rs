//! A CRCL client made from the protocol alone: bytes on a socket, text that is searched.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::Stdio;
use std::time::{Duration, Instant};

use system_tests::killed::Killed;

use crate::canter::command;

/// How long a test waits for something that must come.
const PATIENCE: Duration = Duration::from_secs(90);

/// Starts `canter` with these arguments; gives the first line of its standard error that has this
/// text in it.
fn start(arguments: &[&str], text: &str) -> (Killed, String) {
    let mut child = command(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let peer = Killed(child);
    let mut all = String::new();
    loop {
        let mut line = String::new();
        assert!(
            stderr.read_line(&mut line).unwrap() > 0,
            "{arguments:?} ended: {all}"
        );
        all.push_str(&line);
        if line.contains(text) {
            // Read on, so that it has a reader for as long as it lives.
            std::thread::spawn(move || std::io::copy(&mut stderr, &mut std::io::sink()));
            return (peer, line);
        }
    }
}

/// Starts a server for an arm; gives where it listens.
fn serve(arm: &str, options: &[&str]) -> (Killed, SocketAddr) {
    let fixed = ["serve", "crcl", "--arm", arm, "--listen", "127.0.0.1:0"];
    let (server, line) = start(&[&fixed, options].concat(), "serving CRCL at");
    let address = line.trim().rsplit(' ').next().unwrap().parse().unwrap();
    (server, address)
}

/// An engine with a simulated arm, and a CRCL server before it.
pub(crate) struct Scene {
    address: SocketAddr,
    /// Name of the arm.
    pub(crate) arm: String,
    server: Option<Killed>,
    engine: Option<Killed>,
}

impl Scene {
    pub(crate) fn new(name: &str, options: &[&str]) -> Self {
        Self::with_engine(name, &[], options)
    }

    /// With options of the engine too.
    pub(crate) fn with_engine(name: &str, engine: &[&str], options: &[&str]) -> Self {
        let arm = format!("crcl{}/{name}", std::process::id());
        let fixed = ["engine", "--robot", "ur5e", "--arm", &arm];
        let (engine, _) = start(&[&fixed, engine].concat(), "engine of ur5e");
        let (server, address) = serve(&arm, options);
        Self {
            address,
            arm,
            server: Some(server),
            engine: Some(engine),
        }
    }

    /// Kills the engine.
    pub(crate) fn kill_engine(&mut self) {
        self.engine = None;
    }

    /// Kills the server, and starts another for the same arm.
    pub(crate) fn restart_server(&mut self) {
        self.server = None;
        let (server, address) = serve(&self.arm, &[]);
        self.server = Some(server);
        self.address = address;
    }

    /// Where the server listens.
    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }

    pub(crate) fn connect(&self) -> Connection {
        Connection::new(self.address)
    }
}

/// A status, as text.
#[derive(Clone, Debug)]
pub(crate) struct Answer(pub(crate) String);

impl Answer {
    /// The text of the first element of that name.
    pub(crate) fn text(&self, name: &str) -> Option<&str> {
        let start = self.0.find(&format!("<{name}>"))? + name.len() + 2;
        let end = self.0[start..].find(&format!("</{name}>"))?;
        Some(&self.0[start..start + end])
    }

    pub(crate) fn number(&self, name: &str) -> f64 {
        let text = self
            .text(name)
            .unwrap_or_else(|| panic!("no {name}: {}", self.0));
        text.parse().unwrap_or_else(|_| panic!("{name} is {text}"))
    }

    pub(crate) fn id(&self) -> i64 {
        self.number("CommandID") as i64
    }

    pub(crate) fn state(&self) -> &str {
        self.text("CommandState").unwrap()
    }

    pub(crate) fn why(&self) -> &str {
        self.text("StateDescription").unwrap_or_default()
    }

    pub(crate) fn point(&self) -> [f64; 3] {
        ["X", "Y", "Z"].map(|name| self.number(name))
    }

    /// What stands inside the pose of the status.
    pub(crate) fn pose(&self) -> String {
        self.text("Pose").unwrap().to_owned()
    }

    pub(crate) fn joints(&self) -> Vec<f64> {
        let parts = self.0.split("<JointPosition>").skip(1);
        parts
            .map(|part| part[..part.find('<').unwrap()].parse().unwrap())
            .collect()
    }
}

/// A connection to the server.
pub(crate) struct Connection {
    pub(crate) stream: TcpStream,
    buffer: Vec<u8>,
}

/// A command as a document.
pub(crate) fn document(kind: &str, id: i64, inside: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\"?><CRCLCommandInstance>\
         <CRCLCommand xsi:type=\"{kind}Type\" xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\">\
         <CommandID>{id}</CommandID>{inside}</CRCLCommand></CRCLCommandInstance>"
    )
}

/// A straight move to a pose with the orientation of `answer` and this point.
pub(crate) fn move_to(id: i64, answer: &Answer, point: [f64; 3]) -> String {
    let [x, y, z] = point;
    let pose = answer.pose();
    let axes = &pose[pose.find("</Point>").unwrap() + 8..];
    let inside = format!(
        "<MoveStraight>true</MoveStraight><EndPosition><Point><X>{x}</X><Y>{y}</Y><Z>{z}</Z></Point>\
         {axes}</EndPosition>"
    );
    document("MoveTo", id, &inside)
}

impl Connection {
    fn new(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_secs(20)))
            .unwrap();
        stream.set_nodelay(true).unwrap();
        Self {
            stream,
            buffer: Vec::new(),
        }
    }

    pub(crate) fn send(&mut self, text: &str) {
        self.stream.write_all(text.as_bytes()).unwrap();
    }

    /// The next status that comes.
    pub(crate) fn answer(&mut self) -> Answer {
        let end = b"</CRCLStatus>";
        loop {
            let found = self.buffer.windows(end.len()).position(|part| part == end);
            if let Some(at) = found {
                let rest = self.buffer.split_off(at + end.len());
                let text = String::from_utf8(std::mem::replace(&mut self.buffer, rest)).unwrap();
                assert!(text.starts_with("<?xml"), "{text}");
                assert!(text.len() < 4095, "{} bytes", text.len());
                return Answer(text);
            }
            let mut more = [0; 8192];
            let count = self.stream.read(&mut more).unwrap();
            assert!(count > 0, "the server closed the connection");
            self.buffer.extend_from_slice(&more[..count]);
        }
    }

    /// Whether the server closes the connection, whatever it says before.
    pub(crate) fn is_closed(&mut self) -> bool {
        let mut more = [0; 8192];
        loop {
            match self.stream.read(&mut more) {
                Ok(0) => return true,
                Ok(_) => {}
                Err(error) => return error.kind() == std::io::ErrorKind::ConnectionReset,
            }
        }
    }

    pub(crate) fn status(&mut self) -> Answer {
        self.send(&document("GetStatus", 1, ""));
        self.answer()
    }

    /// Asks until the command is done or failed.
    pub(crate) fn wait(&mut self, id: i64) -> Answer {
        let end = Instant::now() + PATIENCE;
        loop {
            let answer = self.status();
            if answer.id() == id && matches!(answer.state(), "CRCL_Done" | "CRCL_Error") {
                return answer;
            }
            assert!(Instant::now() < end, "{id} is not done: {}", answer.0);
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Sends a command and waits until it is done.
    pub(crate) fn done(&mut self, kind: &str, id: i64, inside: &str) -> Answer {
        self.send(&document(kind, id, inside));
        let answer = self.wait(id);
        assert_eq!(answer.state(), "CRCL_Done", "{kind}: {}", answer.0);
        answer
    }

    /// Sends a command and waits until it has failed.
    pub(crate) fn failed(&mut self, kind: &str, id: i64, inside: &str) -> Answer {
        self.send(&document(kind, id, inside));
        let answer = self.wait(id);
        assert_eq!(answer.state(), "CRCL_Error", "{kind}: {}", answer.0);
        assert!(!answer.why().is_empty(), "{kind}: {}", answer.0);
        answer
    }
}
