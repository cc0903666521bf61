//! Starts the threads, serves until a signal comes.

use std::fs;
use std::io::Write;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use clap::Parser;
use ipc::{Arm, Domain};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use crate::arm::ArmReader;
use crate::bridge::{Bridge, Choices, Program, Threads};
use crate::endpoints::Endpoints;
use crate::engine::{Engine, EngineError, Heard, Order};
use crate::options::{Distribution, Options};
use crate::stopper;

/// Largest file of a program (bytes).
const LARGEST: u64 = 16 << 20;

/// Why the bridge ends; the codes are those of `canter`.
#[derive(Debug, thiserror::Error)]
enum Failure {
    /// A wrong argument.
    #[error("{0}")]
    Usage(String),
    /// A file that cannot be read.
    #[error("{0}")]
    Unreadable(String),
    /// No engine, or no graph to join.
    #[error("{0}")]
    NoPeer(String),
}

impl Failure {
    fn code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::Usage(_) => 2,
            Self::Unreadable(_) => 3,
            Self::NoPeer(_) => 4,
        })
    }
}

impl From<EngineError> for Failure {
    fn from(error: EngineError) -> Self {
        Self::NoPeer(error.to_string())
    }
}

impl From<ipc::IpcError> for Failure {
    fn from(error: ipc::IpcError) -> Self {
        Self::NoPeer(error.to_string())
    }
}

/// Reads the arguments of the process and serves until a signal ends it.
#[must_use]
pub fn main() -> ExitCode {
    match serve(&with_environment(Options::parse())) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            say(&format!("canter: {failure}"));
            failure.code()
        }
    }
}

/// A line for who started it.
fn say(line: &str) {
    // Nobody may listen.
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

/// The domain of ROS from the environment, where the arguments do not name one.
fn with_environment(options: Options) -> Options {
    let given = std::env::var("ROS_DOMAIN_ID").ok();
    let ros_domain = options.ros_domain.or_else(|| given?.trim().parse().ok());
    Options {
        ros_domain,
        ..options
    }
}

fn serve(options: &Options) -> Result<(), Failure> {
    let ends = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&ends))
            .map_err(|cause| Failure::NoPeer(format!("no signals: {cause}")))?;
    }
    let programs = options.program.iter().map(read).collect::<Result<_, _>>()?;
    let domain = Domain::choose(options.domain.as_deref(), |name| std::env::var_os(name))?;
    let arm = domain
        .arm(&options.arm)
        .map_err(|error| Failure::Usage(error.to_string()))?;
    let (threads, joints, urdf) = start(&arm)?;
    let reader = ArmReader::open(&arm, joints)?;
    let endpoints = Endpoints::open(options, urdf).map_err(Failure::NoPeer)?;
    let choices = Choices {
        retime: options.retime,
        indexed: options.distro == Distribution::Kilted,
        programs,
    };
    if options.distro == Distribution::Humble && cfg!(feature = "jazzy") {
        say(
            "canter: built for Jazzy: nodes of Humble do not list this one; topics and action work",
        );
    }
    let where_to = match options.network[..] {
        [] => "this machine only".to_owned(),
        ref all => format!("everybody at {all:?}"),
    };
    let mut bridge = Bridge::new(endpoints, reader, threads, choices);
    let domain = options.ros_domain.unwrap_or(0);
    say(&format!(
        "canter: serving ROS 2, domain {domain}, for {where_to}"
    ));
    bridge.run(|| ends.load(Ordering::Acquire));
    Ok(())
}

/// Reads a program; its form is that of its name.
fn read(program: &crate::options::Program) -> Result<Program, Failure> {
    let shown = program.file.display();
    let unreadable = |cause: String| Failure::Unreadable(format!("cannot read {shown}: {cause}"));
    let found = fs::metadata(&program.file).map_err(|cause| unreadable(cause.to_string()))?;
    if !found.is_file() || found.len() > LARGEST {
        let wanted = format!("expected a regular file of at most {LARGEST} bytes");
        return Err(unreadable(wanted));
    }
    let text = fs::read_to_string(&program.file).map_err(|cause| unreadable(cause.to_string()))?;
    let extension = program
        .file
        .extension()
        .and_then(|extension| extension.to_str());
    let format = match extension {
        Some("json") => "json",
        Some("xml") => "xml",
        _ => "text",
    };
    Ok(Program {
        name: program.name.clone(),
        format,
        text,
    })
}

/// Starts the threads of an arm's engine; with the names of its joints and its URDF.
fn start(arm: &Arm) -> Result<(Threads, Vec<String>, String), Failure> {
    let (orders, ordered) = channel();
    let (tell, heard) = channel();
    let (stops, asked) = channel::<u64>();
    let (tell_stopped, stopped) = channel();
    let (about, opened) = channel();
    let own = arm.clone();
    spawn("engine", move || {
        let facts = || -> Result<(Engine, Vec<String>, String), EngineError> {
            let engine = Engine::open(&own)?;
            let (joints, urdf) = (engine.joints()?, engine.urdf()?);
            Ok((engine, joints, urdf))
        };
        follow(facts(), &about, (&ordered, &tell));
    })?;
    let (joints, urdf) = answer(&opened)??;
    let (about, opened) = channel();
    let own = arm.clone();
    spawn("stop", move || {
        stopper::run(&own, (&asked, &tell_stopped), |result| {
            let _ = about.send(result);
        });
    })?;
    answer(&opened)??;
    Ok((
        Threads {
            orders,
            heard,
            stops,
            stopped,
        },
        joints,
        urdf,
    ))
}

/// Tells what is known of the engine, then serves orders.
fn follow(
    opened: Result<(Engine, Vec<String>, String), EngineError>,
    about: &std::sync::mpsc::Sender<Result<(Vec<String>, String), EngineError>>,
    (orders, tell): (&Receiver<Order>, &std::sync::mpsc::Sender<Heard>),
) {
    match opened {
        // Who asked has ended if nobody listens.
        Err(error) => {
            let _ = about.send(Err(error));
        }
        Ok((engine, joints, urdf)) => {
            let _ = about.send(Ok((joints, urdf)));
            engine.run(orders, tell);
        }
    }
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<(), Failure> {
    let thread = thread::Builder::new().name(name.to_owned()).spawn(work);
    thread
        .map(|_| ())
        .map_err(|cause| Failure::NoPeer(format!("no thread: {cause}")))
}

/// What a thread told first.
fn answer<T>(opened: &Receiver<T>) -> Result<T, Failure> {
    opened
        .recv()
        .map_err(|_| Failure::NoPeer("a thread has ended early".to_owned()))
}
