//! The thread that gets the robot ready: power, brakes, protective stops, the program.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::sleep;
use std::time::{Duration, Instant};

use driver_kit::Outputs;
use ipc::{Payload, bytes_of, text_of};
use rtrb::{Consumer, Producer};

use crate::dashboard::Dashboard;
use crate::primary::Primary;
use crate::program::{self, Program};
use crate::snapshot::{Alarm, Connection, Modes, Notice, Wish};
use crate::{Delivery, UrOptions, words};

/// Time between two looks.
const LOOK: Duration = Duration::from_millis(5);

/// A command of the dashboard is not repeated before this time.
const REPEAT: Duration = Duration::from_secs(2);

/// How long a program that was sent may take to connect.
const CONNECT: Duration = Duration::from_secs(5);

/// A request to get ready.
struct Request {
    number: u32,
    /// Whether the robot takes programs from outside; none if it was not asked yet.
    remote: Option<bool>,
    /// When the program was sent.
    sent: Option<Instant>,
    /// The program has connected.
    done: bool,
}

/// What comes next for a request.
enum Next {
    Wait(String),
    Refuse(String),
    Done,
}

/// Everything that the thread owns.
pub(crate) struct ControlThread {
    options: UrOptions,
    modes: Arc<Modes>,
    wishes: Consumer<Wish>,
    notices: Producer<Notice>,
    connections: Producer<Connection>,
    alarms: Producer<Alarm>,
    listener: TcpListener,
    /// Where the node on the pendant asks for the program.
    pendant: Option<TcpListener>,
    dashboard: Option<Dashboard>,
    primary: Option<Primary>,
    last_command: Option<(&'static str, Instant)>,
    request: Option<Request>,
    /// The program on the robot is ours.
    ours: bool,
    /// What the controller said about the program that did not start.
    said: Option<String>,
    payload: Option<Payload>,
    outputs: Option<Outputs>,
}

/// The ends of the rings to the other threads.
pub(crate) struct Rings {
    pub(crate) wishes: Consumer<Wish>,
    pub(crate) notices: Producer<Notice>,
    pub(crate) connections: Producer<Connection>,
    pub(crate) alarms: Producer<Alarm>,
}

impl ControlThread {
    /// Opens the ports on which this machine waits.
    ///
    /// # Errors
    /// A port that is taken, with its name.
    pub(crate) fn new(
        options: UrOptions,
        modes: Arc<Modes>,
        rings: Rings,
    ) -> Result<Self, (String, io::Error)> {
        let open = |port: u16| {
            let listener = TcpListener::bind((Ipv4Addr::UNSPECIFIED, port));
            listener
                .and_then(|listener| listener.set_nonblocking(true).map(|()| listener))
                .map_err(|error| (format!("0.0.0.0:{port}"), error))
        };
        let listener = open(options.port)?;
        let pendant = match options.delivery {
            Delivery::Send => None,
            Delivery::Pendant { port } => Some(open(port)?),
        };
        Ok(Self {
            options,
            modes,
            wishes: rings.wishes,
            notices: rings.notices,
            connections: rings.connections,
            alarms: rings.alarms,
            listener,
            pendant,
            dashboard: None,
            primary: None,
            last_command: None,
            request: None,
            ours: false,
            said: None,
            payload: None,
            outputs: None,
        })
    }

    /// Until the driver ends.
    pub(crate) fn run(mut self) {
        while !self.modes.stop.load(Ordering::Relaxed) {
            self.take_wishes();
            self.read_alarms();
            self.serve_pendant();
            self.tell_robot();
            if let Some(mut request) = self.request.take() {
                if !request.done {
                    let next = self.advance(&mut request);
                    self.notice(&mut request, next);
                }
                self.request = Some(request);
            }
            sleep(LOOK);
        }
    }

    fn take_wishes(&mut self) {
        while let Ok(wish) = self.wishes.pop() {
            match wish {
                Wish::Begin(number) => {
                    self.modes.ending.store(false, Ordering::Relaxed);
                    self.said = None;
                    self.request = Some(Request {
                        number,
                        remote: None,
                        sent: None,
                        done: false,
                    });
                }
                Wish::End => {
                    self.modes.ending.store(true, Ordering::Relaxed);
                    self.request = None;
                    self.dashboard = None;
                }
                Wish::Carry(payload) => self.payload = Some(payload),
                Wish::Set(outputs) => {
                    let before = self.outputs.unwrap_or_default();
                    self.outputs = Some(both(&before, &outputs));
                }
            }
        }
    }

    fn notice(&mut self, request: &mut Request, next: Next) {
        let (refused, reason) = match next {
            Next::Wait(reason) => (false, reason),
            Next::Refuse(reason) => (true, reason),
            Next::Done => (false, "the program has started".to_owned()),
        };
        request.done |= refused;
        // A full ring has a kit that does not ask.
        let _ = self.notices.push(Notice {
            number: request.number,
            refused,
            reason: bytes_of(&reason),
        });
    }

    /// One step towards an arm that follows.
    fn advance(&mut self, request: &mut Request) -> Next {
        if !self.modes.connected.load(Ordering::Relaxed) {
            return Next::Wait("the controller sends no states".to_owned());
        }
        if request.remote.is_none() {
            request.remote = Some(self.is_remote());
        }
        if request.remote == Some(false) && self.options.delivery == Delivery::Send {
            return Next::Refuse(
                "the robot is in local control: switch to remote control on the pendant".to_owned(),
            );
        }
        if let Some(next) = self.make_safe() {
            return next;
        }
        if let Some(next) = self.release_brakes() {
            return next;
        }
        self.start(request)
    }

    /// Whether the robot takes programs and commands from outside. Only an e-Series robot can say so.
    fn is_remote(&mut self) -> bool {
        let answer = self.ask("is in remote control").unwrap_or_default();
        !answer.eq_ignore_ascii_case("false")
    }

    /// Unlocks a protective stop; refuses what only the operator can do.
    fn make_safe(&mut self) -> Option<Next> {
        let mode = self.modes.safety.load(Ordering::Relaxed);
        match mode {
            mode if words::is_safe(mode) => None,
            words::PROTECTIVE_STOP => {
                let unlock = "unlock protective stop";
                if !self.may_repeat(unlock) {
                    return Some(Next::Wait("unlocking the protective stop".to_owned()));
                }
                let _ = self.ask("close safety popup");
                Some(match self.command(unlock) {
                    Ok(answer) => Next::Wait(format!("unlocking the protective stop: {answer}")),
                    Err(reason) => Next::Refuse(format!("protective stop; {reason}")),
                })
            }
            mode => Some(Next::Refuse(words::safety(mode).to_owned())),
        }
    }

    /// Switches on, and opens the brakes.
    fn release_brakes(&mut self) -> Option<Next> {
        let mode = self.modes.robot.load(Ordering::Relaxed);
        let command = match mode {
            words::RUNNING => return None,
            words::POWER_OFF => "power on",
            words::IDLE => "brake release",
            1 | 6 => return Some(Next::Refuse(words::robot(mode).to_owned())),
            _ => return Some(Next::Wait(words::robot(mode).to_owned())),
        };
        if !self.may_repeat(command) {
            return Some(Next::Wait(format!("{}: {command}", words::robot(mode))));
        }
        Some(match self.command(command) {
            Ok(answer) => Next::Wait(format!("{command}: {answer}")),
            Err(reason) => Next::Refuse(format!("{}; {reason}", words::robot(mode))),
        })
    }

    /// Starts the program, and waits until it connects.
    fn start(&mut self, request: &mut Request) -> Next {
        let runtime = self.modes.runtime.load(Ordering::Relaxed);
        let sends = self.options.delivery == Delivery::Send;
        if sends && request.sent.is_none() && runtime != words::STOPPED {
            return self.end_other();
        }
        if let Some(sent) = request.sent {
            return match self.accept() {
                true => {
                    request.done = true;
                    Next::Done
                }
                false if sends && sent.elapsed() > CONNECT => Next::Refuse(self.why_silent()),
                false => Next::Wait("waiting for the program on the robot".to_owned()),
            };
        }
        // What waited on the port belongs to an earlier program.
        while self.listener.accept().is_ok() {}
        request.sent = Some(Instant::now());
        if !sends {
            return Next::Wait("start the program on the pendant".to_owned());
        }
        let sent = self.connect_primary().and_then(|()| {
            let text = self.text()?;
            self.primary
                .as_mut()
                .map_or(Ok(()), |primary| primary.send(&text))
        });
        match sent {
            Ok(()) => Next::Wait("the program was sent".to_owned()),
            Err(error) => {
                self.primary = None;
                Next::Refuse(format!("the program cannot be sent to port 30001: {error}"))
            }
        }
    }

    /// A program runs already: ours is ended, another one is not.
    fn end_other(&mut self) -> Next {
        if !self.ours {
            return Next::Refuse(
                "another program runs on the robot: stop it on the pendant".to_owned(),
            );
        }
        if self.may_repeat("stop") {
            // Ours also ends by itself.
            let _ = self.command("stop");
        }
        Next::Wait("the last program ends".to_owned())
    }

    /// Takes the connection of the program.
    fn accept(&mut self) -> bool {
        let Ok((stream, _)) = self.listener.accept() else {
            return false;
        };
        let ready = stream
            .set_nodelay(true)
            .and_then(|()| stream.set_nonblocking(true));
        self.ours = true;
        ready.is_ok() && self.connections.push(Connection { stream }).is_ok()
    }

    fn why_silent(&self) -> String {
        match &self.said {
            Some(said) => format!("the program did not start: {said}"),
            None => match self.port() {
                Ok(port) => format!(
                    "the program did not connect to {}:{port} of this machine: is there a firewall?",
                    self.host()
                ),
                Err(error) => error.to_string(),
            },
        }
    }

    /// The program for the robot.
    fn text(&self) -> io::Result<String> {
        let program = Program {
            host: &self.host(),
            port: self.port()?,
            lookahead: self.options.lookahead,
            gain: self.options.gain,
        };
        Ok(program.text())
    }

    fn host(&self) -> String {
        let local = Ipv4Addr::from_bits(self.modes.local.load(Ordering::Relaxed));
        self.options.host.clone().unwrap_or(local.to_string())
    }

    fn port(&self) -> io::Result<u16> {
        Ok(self.listener.local_addr()?.port())
    }

    fn connect_primary(&mut self) -> io::Result<()> {
        if self.primary.is_none() {
            self.primary = Some(Primary::connect(&self.options.address)?);
        }
        Ok(())
    }

    /// Passes on what the controller says about errors.
    fn read_alarms(&mut self) {
        let Some(primary) = &mut self.primary else {
            return;
        };
        match primary.alarms() {
            Ok(alarms) => {
                for alarm in alarms {
                    self.said = Some(text_of(&alarm.text));
                    // A full ring has enough of them.
                    let _ = self.alarms.push(alarm);
                }
            }
            Err(_) => self.primary = None,
        }
    }

    /// Gives the program to the node on the pendant that asks for it.
    fn serve_pendant(&mut self) {
        let Some(listener) = &self.pendant else {
            return;
        };
        let Ok((mut stream, _)) = listener.accept() else {
            return;
        };
        let patience = Some(Duration::from_millis(500));
        let served = stream
            .set_nonblocking(false)
            .and_then(|()| stream.set_read_timeout(patience))
            .and_then(|()| stream.read(&mut [0; 64]))
            .and_then(|_| stream.write_all(self.text()?.as_bytes()));
        // A node that has gone asks again.
        let _ = served;
    }

    /// Sends payload and outputs: programs that run beside the other one.
    fn tell_robot(&mut self) {
        if self.payload.is_none() && self.outputs.is_none() {
            return;
        }
        if self.connect_primary().is_err() {
            return;
        }
        let version = self.modes.version();
        let payload = self.payload.take();
        let texts = [
            payload.map(|payload| program::payload(&payload, version)),
            self.outputs
                .take()
                .map(|outputs| program::outputs(&outputs)),
        ];
        for text in texts.into_iter().flatten() {
            let sent = self.primary.as_mut().map(|primary| primary.send(&text));
            if sent.is_some_and(|sent| sent.is_err()) {
                self.primary = None;
            }
        }
    }

    fn may_repeat(&self, command: &str) -> bool {
        let last = self.last_command.filter(|(last, _)| *last == command);
        last.is_none_or(|(_, at)| at.elapsed() > REPEAT)
    }

    /// A command of the dashboard, and its answer.
    fn command(&mut self, command: &'static str) -> Result<String, String> {
        self.last_command = Some((command, Instant::now()));
        self.ask(command)
            .map_err(|error| format!("no dashboard at {}: {error}", self.options.address))
    }

    fn ask(&mut self, command: &str) -> io::Result<String> {
        let mut dashboard = match self.dashboard.take() {
            Some(dashboard) => dashboard,
            None => Dashboard::connect(&self.options.address)?,
        };
        let answer = dashboard.ask(command)?;
        self.dashboard = Some(dashboard);
        Ok(answer)
    }
}

/// Outputs that were asked for one after the other.
fn both(first: &Outputs, second: &Outputs) -> Outputs {
    let mut both = *second;
    both.digital |= first.digital & !second.digital_mask;
    both.digital_mask |= first.digital_mask;
    both.analogue_mask |= first.analogue_mask;
    let values = both.analogue.iter_mut().zip(first.analogue);
    for (number, (value, earlier)) in values.enumerate() {
        if second.analogue_mask >> number & 1 == 0 {
            *value = earlier;
        }
    }
    both
}
