use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use engine::host::ClientChannels;
use engine::session::{SessionConfig, SessionError};
use ipc::Clock;
use planner::dry_run::FailurePolicy;
use planner::robot::Robot;
use servo::ExecutorError;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::recorder_options::RecorderOptions;
use crate::simulation::{Kind, Simulation};
use crate::view_process::ViewProcess;
use crate::wall::WallOption;

/// An engine that ends its simulated driver, if it has one.
pub(crate) type Host = engine::host::Host<Company>;

/// The processes that end with an engine.
#[derive(Debug, Default)]
pub(crate) struct Company {
    /// The simulated driver.
    pub(crate) _driver: Option<Simulation>,
    /// The live view.
    pub(crate) view: Option<ViewProcess>,
}

/// How an engine is started.
#[derive(Args, Debug)]
pub(crate) struct HostOptions {
    #[command(flatten)]
    pub(crate) arm: ArmOption,
    /// Servo rate
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, value_parser = rate)]
    pub(crate) rate: f64,
    /// Which driver moves the arm
    #[arg(long, value_enum, default_value_t = DriverChoice::Sim)]
    pub(crate) driver: DriverChoice,
    /// Python that runs the MuJoCo driver
    #[arg(long, value_name = "PYTHON", default_value = "python3")]
    python: String,
    #[command(flatten)]
    wall: WallOption,
    #[command(flatten)]
    pub(crate) recorder: RecorderOptions,
    /// Show the arm in the browser: prints the address of a live view, see `canter view`
    #[arg(long)]
    view: bool,
    /// Run in lock-step with the driver instead of by the clock: faster, with the same result every
    /// time
    #[arg(long)]
    lock_step: bool,
}

/// What the live view shows beside the arm.
#[derive(Args, Debug)]
pub(crate) struct ShownWorld {
    /// Show the objects of this world in the live view: the database of a plan as it changes, or a
    /// workstation file
    #[arg(long, value_name = "WORLD", requires = "view")]
    pub(crate) world: Option<PathBuf>,
}

/// What an engine does with a command that it refuses.
#[derive(Args, Debug)]
pub(crate) struct RefusalOption {
    /// What happens when a command cannot be executed
    #[arg(long, value_enum, default_value_t = OnRefusal::Abort)]
    on_refusal: OnRefusal,
}

impl RefusalOption {
    /// The policy that was chosen.
    pub(crate) fn policy(&self) -> FailurePolicy {
        self.on_refusal.into()
    }
}

/// Which driver moves the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum DriverChoice {
    /// The built-in simulated servo, started and ended with the engine.
    Sim,
    /// A MuJoCo simulation of the robot's URDF, started and ended with the engine.
    Mujoco,
    /// One that runs already.
    External,
}

/// What happens when a command cannot be executed.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum OnRefusal {
    /// Stop and drop the rest of the program.
    Abort,
    /// The command has no effect; continue with the next.
    Skip,
    /// Stop and wait for the operator.
    Hold,
}

impl From<OnRefusal> for FailurePolicy {
    fn from(choice: OnRefusal) -> Self {
        match choice {
            OnRefusal::Abort => Self::Abort,
            OnRefusal::Skip => Self::Skip,
            OnRefusal::Hold => Self::Hold,
        }
    }
}

impl HostOptions {
    /// Starts the driver (unless it is external) and the session, opens the channels for clients.
    ///
    /// # Errors
    /// [`Exit::NoPeer`] without a driver or with another engine on the arm; the driver that was
    /// started is ended again.
    pub(crate) fn start(
        &self,
        robot: &Robot,
        place: &str,
        default_length: crcl::LengthUnit,
        on_refusal: FailurePolicy,
    ) -> Result<Host, Failure> {
        if self.wall.text().is_some() && self.driver != DriverChoice::Sim {
            let cause = anyhow::anyhow!("--wall is for --driver sim");
            return Err(Failure::new(Exit::Usage, cause));
        }
        let arm = self.arm.open()?;
        // Before the driver: a second engine must not disturb the arm of the first.
        let channels = ClientChannels::open(&arm)?;
        let simulation = match self.driver {
            DriverChoice::Sim => Some(Kind::Servos {
                wall: self.wall.text(),
            }),
            DriverChoice::Mujoco => Some(Kind::Mujoco {
                python: &self.python,
            }),
            DriverChoice::External => None,
        };
        let simulation = simulation
            .map(|kind| Simulation::start(kind, place, &arm))
            .transpose()?;
        let mut config = SessionConfig::new(arm);
        config.on_wait =
            |reason| crate::output::note(&format!("canter: waiting for the driver: {reason}"));
        config.rate_hz = self.rate;
        config.clock = if self.lock_step {
            Clock::LockStep
        } else {
            Clock::Wall
        };
        config.record = true;
        config.on_refusal = on_refusal;
        config.default_length = default_length;
        let company = Company {
            _driver: simulation,
            view: None,
        };
        let mut host = Host::start(channels, robot, &config, company).map_err(failure)?;
        self.recorder.start(&mut host, robot)?;
        if let Some(warning) = &host.session.warning {
            tracing::warn!("{warning}");
        }
        Ok(host)
    }
}

impl HostOptions {
    /// Starts the live view if one was asked for, with the objects of a world.
    ///
    /// # Errors
    /// [`Exit::Internal`] when its process cannot be started.
    pub(crate) fn show(&self, host: &mut Host, world: Option<&Path>) -> Result<(), Failure> {
        if self.view {
            host.company.view = Some(ViewProcess::start(&host.arm, world)?);
        }
        Ok(())
    }
}

/// An error at the start of the session with its exit code.
fn failure(error: SessionError) -> Failure {
    let exit = match &error {
        SessionError::Robot(_) => Exit::Unreadable,
        SessionError::Executor(ExecutorError::Rate { .. } | ExecutorError::Limit { .. }) => {
            Exit::Usage
        }
        SessionError::Executor(_) => Exit::NoPeer,
        _ => Exit::Internal,
    };
    Failure::new(exit, error)
}

/// A servo rate in Hz.
pub(crate) fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (100.0..=4000.0).contains(&value) => Ok(value),
        _ => Err("expected Hz from 100 to 4000".to_owned()),
    }
}
