//! One connection: reads documents, obeys them, answers.

use std::io::ErrorKind;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use crcl::xml::{
    CommandState, Instance, Instruction, Meaning, Refusal, StopCondition, XmlCommand, read_instance,
};
use crcl::{Command, Pose};

use crate::arm::{Kind, Order};
use crate::blocks::Blocks;
use crate::cell::{Cell, ConnectionId, Inner, Last};
use crate::framing::{Frame, Frames, LONGEST_DOCUMENT};
use crate::report::Choice;
use crate::si::Units;
use crate::stopper::Stop;
use crate::tls::{Stream, TlsServer};

/// How long a client may take to read a status before it is cut off.
const SLOW: Duration = Duration::from_secs(2);

/// How often a silent connection looks whether the server ends.
const LOOK: Duration = Duration::from_millis(100);

/// How connections behave.
#[derive(Clone, Debug)]
pub(crate) struct Manners {
    /// Who may speak, where everything is encrypted.
    pub(crate) tls: Option<TlsServer>,
    /// The units of a connection that has not set its own.
    pub(crate) units: Units,
    /// Commands are executed one after the other instead of taking the place of each other.
    pub(crate) queue: bool,
    /// A status is sent this often, and GetStatus is not answered.
    pub(crate) push: Option<Duration>,
}

/// The ends that a connection gives its commands to.
#[derive(Clone, Debug)]
pub(crate) struct Ways {
    pub(crate) cell: Arc<Cell>,
    pub(crate) orders: Sender<Order>,
    pub(crate) stops: Sender<Stop>,
}

/// A connection on its way.
pub(crate) struct Connection {
    id: ConnectionId,
    ways: Ways,
    manners: Manners,
    choice: Choice,
    blocks: Blocks,
    /// What is told on this connection only, and until which command.
    private: Option<(u64, Last)>,
    stream: Box<dyn Stream>,
}

/// Why a connection ends.
pub(crate) type Ending = String;

impl Connection {
    /// A connection that has just been accepted.
    ///
    /// # Errors
    /// What the operating system refuses.
    pub(crate) fn new(
        id: ConnectionId,
        stream: TcpStream,
        ways: Ways,
        manners: &Manners,
    ) -> std::io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(SLOW))?;
        stream.set_read_timeout(Some(manners.push.map_or(LOOK, |push| push.min(LOOK))))?;
        let stream = match &manners.tls {
            Some(tls) => tls.wrap(stream)?,
            None => Box::new(stream),
        };
        Ok(Self {
            id,
            ways,
            manners: manners.clone(),
            choice: Choice::new(manners.units.of_connection()),
            blocks: Blocks::default(),
            private: None,
            stream,
        })
    }

    /// Serves until the client goes away, or is sent away; says why.
    pub(crate) fn run(&mut self, ends: &dyn Fn() -> bool) -> Ending {
        let mut frames = Frames::new(&["CRCLCommandInstance", "CRCLProgram"]);
        let mut buffer = vec![0; 64 << 10];
        let mut pushed = Instant::now();
        loop {
            if ends() {
                return "the server ends".to_owned();
            }
            if let Some(period) = self.manners.push
                && pushed.elapsed() >= period
            {
                pushed = Instant::now();
                if let Err(ending) = self.answer() {
                    return ending;
                }
            }
            let count = match self.stream.read(&mut buffer) {
                Ok(0) => return "the client closed it".to_owned(),
                Ok(count) => count,
                Err(error) if is_timeout(&error) => continue,
                Err(error) => return error.to_string(),
            };
            frames.push(buffer.get(..count).unwrap_or_default());
            for frame in frames.by_ref() {
                if let Err(ending) = self.take(frame) {
                    return ending;
                }
            }
        }
    }

    fn take(&mut self, frame: Frame) -> Result<(), Ending> {
        match frame {
            Frame::Document(bytes) => match read(&bytes) {
                Ok(instance) => return self.obey(instance),
                Err(why) => self.complain(&why),
            },
            Frame::Garbage(count) => {
                self.complain(&format!("{count} bytes belong to no document"));
            }
            Frame::TooLong => {
                let why = format!("a document has at most {LONGEST_DOCUMENT} bytes");
                self.complain(&why);
                // The last words; who does not read them is sent away all the same.
                self.answer()?;
                return Err(why);
            }
        }
        Ok(())
    }

    /// Tells this connection about something that is no command.
    fn complain(&mut self, why: &str) {
        let inner = self.ways.cell.lock();
        let last = Last {
            state: CommandState::Error,
            description: Some(why.to_owned()),
            ..inner.last.clone()
        };
        self.private = Some((inner.serial, last));
    }

    /// Sends a status in one piece.
    fn answer(&mut self) -> Result<(), Ending> {
        let text = {
            let mut inner = self.ways.cell.lock();
            let number = inner.next_status();
            if self
                .private
                .as_ref()
                .is_some_and(|(until, _)| *until != inner.serial)
            {
                self.private = None;
            }
            let last = self.private.as_ref().map_or(&inner.last, |(_, last)| last);
            self.choice.write(
                last,
                number,
                &inner.picture,
                (&inner.parameters, &inner.guards),
            )
        };
        let sent = self.stream.write_all(text.as_bytes());
        match sent.and_then(|()| self.stream.flush()) {
            Ok(()) => Ok(()),
            Err(error) if is_timeout(&error) => {
                let limit = SLOW.as_secs();
                Err(format!("the client read nothing for {limit} s"))
            }
            Err(error) => Err(error.to_string()),
        }
    }

    fn obey(&mut self, instance: Instance) -> Result<(), Ending> {
        match &instance.instruction.command {
            XmlCommand::GetStatus => {
                return match self.manners.push {
                    None => self.answer(),
                    Some(_) => Ok(()),
                };
            }
            XmlCommand::StopMotion(condition) => {
                let fast = *condition != StopCondition::Normal;
                self.stop(&instance, fast);
            }
            _ => {
                self.private = None;
                let cell = Arc::clone(&self.ways.cell);
                let mut inner = cell.lock();
                self.command(&mut inner, &instance);
            }
        }
        Ok(())
    }

    fn stop(&mut self, instance: &Instance, fast: bool) {
        self.private = None;
        let serial = {
            let mut inner = self.ways.cell.lock();
            inner.epoch += 1;
            inner.begin(self.id, Last::new(instance, CommandState::Working))
        };
        // The thread that stops ends with the server.
        let _ = self.ways.stops.send(Stop {
            serial: Some(serial),
            fast,
        });
    }

    /// A command that is no stop: settings of the connection, or something for the engine.
    fn command(&mut self, inner: &mut Inner, instance: &Instance) {
        let command = &instance.instruction.command;
        let repeated = match command {
            XmlCommand::ConfigureStatusReport(_) => {
                let id = instance.instruction.id;
                let before = inner.configured.replace((id, self.id));
                before.is_some_and(|(last, other)| last == id && other != self.id)
            }
            _ => false,
        };
        if let Err(why) = allowed(inner, command).and_then(|()| guardable(&instance.instruction)) {
            // NIST's pendant repeats the choice of its reports on a connection that only looks.
            if !repeated {
                self.end(inner, instance, CommandState::Error, Some(why));
            }
            return;
        }
        if let Some(result) = self.own_setting(inner, command) {
            match result {
                Ok(()) if repeated => {}
                Ok(()) => self.end(inner, instance, CommandState::Done, None),
                Err(why) => self.end(inner, instance, CommandState::Error, Some(why)),
            }
            return;
        }
        if inner.is_working() && inner.owner != self.id {
            let why = format!("connection {} commands the arm", inner.owner);
            return self.end(inner, instance, CommandState::Error, Some(why));
        }
        if let Some(Err(why)) = inner.parameters.set(command) {
            return self.end(inner, instance, CommandState::Error, Some(why));
        }
        match self.order(inner, &instance.instruction) {
            Ok(None) => self.end(inner, instance, CommandState::Done, None),
            Ok(Some(order)) => self.give(inner, instance, order),
            Err(why) => {
                let serial = inner.begin(self.id, Last::new(instance, CommandState::Working));
                inner.fail(serial, &why);
            }
        }
    }

    /// Says what became of a command that is over at once: to everybody, or to this connection
    /// only while a command of another is under way.
    fn end(
        &mut self,
        inner: &mut Inner,
        instance: &Instance,
        state: CommandState,
        description: Option<String>,
    ) {
        let last = Last {
            description,
            ..Last::new(instance, state)
        };
        if inner.is_working() && inner.owner != self.id {
            self.private = Some((inner.serial, last));
        } else {
            inner.begin(self.id, last);
        }
    }

    /// What concerns this connection only; nothing for a command of another kind.
    fn own_setting(&mut self, inner: &Inner, command: &XmlCommand) -> Option<Result<(), String>> {
        let joints = inner.picture.joints.len();
        match command {
            XmlCommand::SetLengthUnits(unit) => self.choice.units.length = *unit,
            XmlCommand::SetAngleUnits(unit) => self.choice.units.angle = *unit,
            XmlCommand::SetForceUnits(unit) => self.choice.units.force = *unit,
            XmlCommand::SetTorqueUnits(unit) => self.choice.units.torque = *unit,
            XmlCommand::ConfigureStatusReport(parts) => self.choice.parts = *parts,
            XmlCommand::ConfigureJointReports { reset_all, reports } => {
                return Some(self.choice.choose_joints(*reset_all, reports, joints));
            }
            XmlCommand::EnableSensor { sensor, .. } => {
                let sensors = &inner.picture.sensors;
                return Some(self.choice.sensors.choose(sensor, true, sensors));
            }
            XmlCommand::DisableSensor(sensor) => {
                let sensors = &inner.picture.sensors;
                return Some(self.choice.sensors.choose(sensor, false, sensors));
            }
            _ => return None,
        }
        Some(Ok(()))
    }

    /// What the engine is to do; nothing where the command changes nothing here.
    fn order(&mut self, inner: &Inner, instruction: &Instruction) -> Result<Option<Order>, String> {
        let (sliding, units) = (&inner.picture.sliding, self.choice.units);
        let command = units.to_si(&instruction.command, sliding);
        let instruction = Instruction {
            command,
            ..instruction.in_si(units.force, units.torque)
        };
        let commands: Vec<_> = match instruction.meaning() {
            Ok(Meaning::Commands(commands)) => {
                let largest = inner.picture.largest;
                let capped = |command| largest.cap(command);
                commands.into_iter().map(capped).collect()
            }
            Ok(Meaning::NoEffect(_)) => return Ok(None),
            Ok(Meaning::LoopStart(name)) => return self.blocks.begin(name).map(|()| None),
            Ok(Meaning::LoopEnd { name, count }) => {
                let again = self.blocks.end(&name, count)?;
                return Ok(self.made(inner, Kind::Motion, again));
            }
            Err(refusal) => return Err(sentence(&refusal)),
        };
        if let Some(error) = commands.iter().find_map(|command| command.check().err()) {
            return Err(error.to_string());
        }
        let (kind, commands) = match instruction.command {
            XmlCommand::RunProgram(_) => (program_kind(&commands), units.around(commands)),
            _ => (kind(&instruction.command), commands),
        };
        if kind == Kind::Begin || kind == Kind::End {
            self.blocks.clear();
        } else {
            self.blocks.keep(&commands)?;
        }
        Ok(self.made(inner, kind, commands))
    }

    /// The order for these commands; none where there is nothing to do.
    fn made(&self, inner: &Inner, kind: Kind, commands: Vec<Command>) -> Option<Order> {
        let first = commands.iter().find(|command| command.takes_guards());
        let moves = kind == Kind::Motion && !matches!(first, Some(Command::Dwell { .. }));
        (!commands.is_empty()).then(|| Order {
            serial: 0,
            epoch: inner.epoch,
            kind,
            target: target(&commands),
            preempts: moves && !self.manners.queue,
            commands,
        })
    }

    fn give(&self, inner: &mut Inner, instance: &Instance, order: Order) {
        match order.kind {
            Kind::Begin => {
                inner.failed = None;
                inner.initialised = true;
            }
            Kind::End => inner.initialised = false,
            _ => {}
        }
        inner.guards.guards = instance.instruction.guards.clone();
        inner.guards.last = None;
        let serial = inner.begin(self.id, Last::new(instance, CommandState::Working));
        let order = Order { serial, ..order };
        if self.ways.orders.send(order).is_err() {
            inner.fail(serial, "the server ends");
        }
    }
}

/// The document as a command.
fn read(bytes: &[u8]) -> Result<Instance, String> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let at = error.valid_up_to();
        format!("a document is text in UTF-8, but byte {at} is none")
    })?;
    if text.starts_with("<CRCLProgram") {
        return Err(
            "this server takes single commands; `canter crcl send` sends a program command by \
             command"
                .to_owned(),
        );
    }
    read_instance(text).map_err(|findings| {
        let first = findings.first().map(|finding| finding.message.as_str());
        first.unwrap_or("the document cannot be read").to_owned()
    })
}

/// Whether a command may be executed now.
fn allowed(inner: &Inner, command: &XmlCommand) -> Result<(), String> {
    match command {
        XmlCommand::InitCanon => Ok(()),
        _ if inner.failed.is_some() => Err(inner.failed.clone().unwrap_or_default()),
        XmlCommand::EndCanon => Ok(()),
        _ if !inner.initialised => {
            let name = command.name();
            Err(format!("not initialised: {name} before InitCanon"))
        }
        _ => Ok(()),
    }
}

/// Whether the command can have the guards that it has.
fn guardable(instruction: &Instruction) -> Result<(), String> {
    let motion = kind(&instruction.command) == Kind::Motion;
    let program = matches!(instruction.command, XmlCommand::RunProgram(_));
    if instruction.guards.is_empty() || motion || program {
        return Ok(());
    }
    let name = instruction.command.name();
    Err(format!(
        "a guard on {name}, which neither moves the arm nor waits"
    ))
}

fn kind(command: &XmlCommand) -> Kind {
    match command {
        XmlCommand::InitCanon => Kind::Begin,
        XmlCommand::EndCanon => Kind::End,
        XmlCommand::MoveTo { .. }
        | XmlCommand::MoveThroughTo { .. }
        | XmlCommand::MoveScrew(_)
        | XmlCommand::ActuateJoints { .. }
        | XmlCommand::Dwell(_) => Kind::Motion,
        XmlCommand::SetEndEffector(_)
        | XmlCommand::OpenToolChanger
        | XmlCommand::CloseToolChanger => Kind::Tool,
        _ => Kind::Setting,
    }
}

/// What kind the program of RunProgram is.
fn program_kind(commands: &[Command]) -> Kind {
    let tool = |command: &Command| {
        matches!(
            command,
            Command::OpenGripper
                | Command::CloseGripper
                | Command::SetEndEffector { .. }
                | Command::OpenToolChanger
                | Command::CloseToolChanger
        )
    };
    if commands.iter().any(tool) {
        Kind::Tool
    } else {
        Kind::Motion
    }
}

/// Where the last move stops (m), if a pose of its own says so.
fn target(commands: &[Command]) -> Option<[f64; 3]> {
    // A program that RunProgram runs has other units.
    let units = |command: &Command| matches!(command, Command::SetLengthUnits { .. });
    if commands.iter().any(units) {
        return None;
    }
    match commands.iter().rev().find(|command| command.is_move())? {
        Command::MoveScrew { .. } => None,
        Command::MoveThroughWaypoints { waypoints } => {
            waypoints.last().map(|waypoint| waypoint.pose.point())
        }
        last => last.poses().last().map(Pose::point),
    }
}

fn sentence(refusal: &Refusal) -> String {
    format!("Canter cannot do this yet: {}", refusal.message)
}

fn is_timeout(error: &std::io::Error) -> bool {
    let kinds = [
        ErrorKind::WouldBlock,
        ErrorKind::TimedOut,
        ErrorKind::Interrupted,
    ];
    kinds.contains(&error.kind())
}
