use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::Duration;

use clap::{Args, Subcommand, ValueEnum};
use crcl::{AngleUnit, LengthUnit};
use crcl_tcp::{Network, Server, ServerConfig, Units, WhenGone};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;
use crate::tls_option::TlsOption;

use super::serve_ros2::ServeRos2;

/// How often a running server looks for a signal.
const LOOK: Duration = Duration::from_millis(20);

/// Serve programs of others: a process of its own beside the engine
#[derive(Args, Debug)]
pub(crate) struct Serve {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    Crcl(ServeCrcl),
    Ros2(ServeRos2),
}

/// Let CRCL clients drive the arm of a running engine
///
/// Speaks CRCL over TCP (port 64444), as NIST's clients do. The protocol has no authentication and
/// no encryption: whoever can connect can move the arm, unless `--tls` says whom to let in. Without `--listen` only programs on this
/// machine can connect. Ctrl-C ends the server and stops a move that a client has begun.
#[derive(Args, Debug)]
pub(crate) struct ServeCrcl {
    #[command(flatten)]
    arm: ArmOption,
    /// Where to listen
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:64444")]
    listen: SocketAddr,
    /// Network that may connect, such as 192.168.1.0/24; may be given several times
    #[arg(long, value_name = "NETWORK")]
    allow: Vec<Network>,
    /// Units of a connection that sets none: length,angle
    #[arg(long, value_delimiter = ',', num_args = 1, value_name = "LENGTH,ANGLE", default_values = ["millimeter", "degree"])]
    units: Vec<UnitName>,
    /// Execute commands one after the other; otherwise a move takes the place of the one under way
    #[arg(long)]
    queue: bool,
    /// Send a status every so many ms instead of answering GetStatus
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..))]
    push: Option<u64>,
    #[command(flatten)]
    tls: TlsOption,
    /// What happens to the command under way when its client goes away
    #[arg(long, value_enum, default_value_t = Gone::Stop)]
    when_gone: Gone,
}

/// Name of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum UnitName {
    Meter,
    Millimeter,
    Inch,
    Degree,
    Radian,
}

/// What happens when a client goes away.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Gone {
    /// The arm stops on its path.
    Stop,
    /// The command is executed to its end.
    Finish,
}

impl Serve {
    /// Serves until a signal ends it.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        match &self.what {
            What::Crcl(serve) => serve.run(),
            What::Ros2(serve) => serve.run(),
        }
    }
}

impl ServeCrcl {
    fn run(&self) -> Result<Exit, Failure> {
        let ends = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            signal_hook::flag::register(signal, Arc::clone(&ends))
                .map_err(|cause| Failure::new(Exit::Internal, cause))?;
        }
        let config = ServerConfig {
            arm: self.arm.open()?,
            listen: self.listen,
            allow: self.allow.clone(),
            units: self.units(),
            queue: self.queue,
            push: self.push.map(Duration::from_millis),
            tls: self.tls.server()?,
            when_gone: match self.when_gone {
                Gone::Stop => WhenGone::Stop,
                Gone::Finish => WhenGone::Finish,
            },
        };
        let server = Server::start(config, |line| output::note(&format!("canter: {line}")))
            .map_err(|error| {
                let exit = match error {
                    crcl_tcp::ServerError::Open { .. } => Exit::Usage,
                    _ => Exit::NoPeer,
                };
                Failure::new(exit, error)
            })?;
        output::note(&format!("canter: serving CRCL at {}", server.address()));
        while !ends.load(Ordering::Acquire) && server.is_running() {
            sleep(LOOK);
        }
        drop(server);
        Ok(Exit::Done)
    }

    /// The units by what each name is a unit of.
    fn units(&self) -> Units {
        let mut units = Units::default();
        for name in &self.units {
            match name {
                UnitName::Meter => units.length = LengthUnit::Meter,
                UnitName::Millimeter => units.length = LengthUnit::Millimeter,
                UnitName::Inch => units.length = LengthUnit::Inch,
                UnitName::Degree => units.angle = AngleUnit::Degree,
                UnitName::Radian => units.angle = AngleUnit::Radian,
            }
        }
        units
    }
}
