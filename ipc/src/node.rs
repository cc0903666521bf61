//! The iceoryx2 node of this process: configuration, services, left-overs of dead processes.

use core::fmt::Debug;
use std::thread::sleep;
use std::time::{Duration, Instant};

use iceoryx2::node::NodeView;
use iceoryx2::prelude::*;
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError, PublishSubscribeOpenError, PublishSubscribeOpenOrCreateError,
};
use iceoryx2::service::builder::request_response::{
    Builder as RequestResponseBuilder, RequestResponseCreateError, RequestResponseOpenError,
    RequestResponseOpenOrCreateError,
};
use iceoryx2::service::port_factory::{publish_subscribe, request_response};

use crate::{Arm, Domain, IpcError, PROTOCOL, damage, room};

/// The kind of service: shared memory between processes, ports that stay in their thread.
pub(crate) type Shared = ipc::Service;

/// Requests and answers that are texts.
pub(crate) type TextExchange = request_response::PortFactory<Shared, [u8], (), [u8], ()>;

/// How many messages wait for a slow reader before the oldest is overwritten.
const BUFFER: usize = 16;

/// How long another process may take to make a service or to remove it, and the pause between two looks.
const SETTLING: Duration = Duration::from_secs(3);
const PAUSE: Duration = Duration::from_millis(5);

/// iceoryx2's configuration for a domain: its directory for what is found by name, its prefix for
/// the segments.
fn configuration(domain: &Domain) -> Result<Config, IpcError> {
    let fail = |cause: String| IpcError::Failed {
        service: domain.directory().display().to_string(),
        operation: "naming the directory",
        cause,
    };
    let directory = domain.directory().as_os_str().as_encoded_bytes();
    let directory = Path::new(directory).map_err(|cause| fail(format!("{cause:?}")))?;
    let prefix = FileName::new(domain.prefix().as_bytes());
    let mut config = Config::default();
    config.global.prefix = prefix.map_err(|cause| fail(format!("{cause:?}")))?;
    config.global.set_root_path(&directory);
    Ok(config)
}

/// Cleans up after dead processes, then makes a node. `role` is shown to processes that find this
/// end already taken.
pub(crate) fn join(arm: &Arm, role: &str) -> Result<Node<Shared>, IpcError> {
    set_log_level(LogLevel::Fatal);
    room::look()?;
    damage::look(arm.domain())?;
    let config = configuration(arm.domain())?;
    Node::<Shared>::try_cleanup_dead_nodes(&config);
    let fail = |cause: String| IpcError::Failed {
        service: arm.to_string(),
        operation: "joining shared memory",
        cause,
    };
    let label = format!("{role} of {arm}");
    let name = NodeName::new(&label).map_err(|cause| fail(format!("{cause:?}")))?;
    NodeBuilder::new()
        .name(&name)
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<Shared>()
        .map_err(|cause| fail(format!("{cause:?}")))
}

/// How many processes use a domain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NodeCount {
    /// Nodes of running processes; a process may have several.
    pub alive: usize,
    /// Nodes of dead processes whose segments are still there.
    pub dead: usize,
}

/// Counts the nodes of running and of dead processes in `domain`; changes nothing.
///
/// # Errors
/// [`IpcError::Failed`] when the list cannot be read.
pub fn count_nodes(domain: &Domain) -> Result<NodeCount, IpcError> {
    let mut found = NodeCount::default();
    let config = configuration(domain)?;
    Node::<Shared>::list(&config, |state| {
        match state {
            NodeState::Alive(_) => found.alive += 1,
            NodeState::Dead(_) => found.dead += 1,
            _ => {}
        }
        CallbackProgression::Continue
    })
    .map_err(|cause| IpcError::Failed {
        service: domain.directory().display().to_string(),
        operation: "listing the processes",
        cause: format!("{cause:?}"),
    })?;
    Ok(found)
}

/// What an engine's node for the control channel is called, before the name of its arm.
pub(crate) const ENGINE: &str = "engine for control";

/// Names of the arms (`cell/arm`) whose engine runs in `domain`, in alphabetical order; changes
/// nothing.
///
/// # Errors
/// [`IpcError::Failed`] when the list cannot be read.
pub fn engines(domain: &Domain) -> Result<Vec<String>, IpcError> {
    let mut found = Vec::new();
    let label = format!("{ENGINE} of ");
    Node::<Shared>::list(&configuration(domain)?, |state| {
        if let NodeState::Alive(view) = state
            && let Some(details) = view.details()
            && let Some(arm) = details.name().as_str().strip_prefix(&label)
        {
            found.push(arm.to_owned());
        }
        CallbackProgression::Continue
    })
    .map_err(|cause| IpcError::Failed {
        service: domain.directory().display().to_string(),
        operation: "listing the processes",
        cause: format!("{cause:?}"),
    })?;
    found.sort_unstable();
    found.dedup();
    Ok(found)
}

/// Removes what dead processes left behind in `domain`; returns how many were cleaned up and how
/// many could not be.
///
/// # Errors
/// [`IpcError::Failed`] when iceoryx2 does not take the domain's directory.
pub fn remove_dead_nodes(domain: &Domain) -> Result<(u64, u64), IpcError> {
    let result = Node::<Shared>::try_cleanup_dead_nodes(&configuration(domain)?);
    Ok((result.cleanups, result.failed_cleanups))
}

/// Reads iceoryx2's data of every service in `domain`; returns how many there are. Damaged segments
/// may crash the process: call it in a separate process.
///
/// # Errors
/// [`IpcError::Damaged`], or [`IpcError::Failed`] when the list cannot be read.
pub fn look_at_services(domain: &Domain) -> Result<usize, IpcError> {
    damage::look(domain)?;
    let (config, mut count) = (configuration(domain)?, 0);
    Shared::list(&config, |_| {
        count += 1;
        CallbackProgression::Continue
    })
    .map_err(|cause| IpcError::Failed {
        service: domain.directory().display().to_string(),
        operation: "listing the services",
        cause: format!("{cause:?}"),
    })?;
    Ok(count)
}

/// The name of a service of `arm`, in iceoryx2's type.
fn service_name(arm: &Arm, kind: &str) -> Result<(String, ServiceName), IpcError> {
    let service = arm.service(kind);
    let name = ServiceName::new(&service).map_err(|cause| IpcError::Failed {
        service: service.clone(),
        operation: "naming the service",
        cause: format!("{cause:?}"),
    })?;
    Ok((service, name))
}

/// Opens or creates the topic `kind` of `arm`: one writer, eight readers, never blocking.
pub(crate) fn topic<T>(
    node: &Node<Shared>,
    arm: &Arm,
    kind: &str,
) -> Result<publish_subscribe::PortFactory<Shared, T, ()>, IpcError>
where
    T: Debug + ZeroCopySend,
{
    let (service, name) = service_name(arm, kind)?;
    settled(service, || {
        let mut builder = node.service_builder(&name).publish_subscribe::<T>();
        if let Some(line) = Alignment::new(64) {
            builder = builder.payload_alignment(line);
        }
        let builder = builder
            .enable_safe_overflow(true)
            .history_size(0)
            .subscriber_max_buffer_size(BUFFER)
            .subscriber_max_borrowed_samples(2)
            .max_publishers(1)
            .max_subscribers(8)
            .max_nodes(16);
        Ok(builder.open_or_create()?)
    })
}

/// The same as [`topic`] for texts of any length.
pub(crate) fn text_topic(
    node: &Node<Shared>,
    arm: &Arm,
    kind: &str,
) -> Result<publish_subscribe::PortFactory<Shared, [u8], ()>, IpcError> {
    let (service, name) = service_name(arm, kind)?;
    settled(service, || {
        let builder = node.service_builder(&name).publish_subscribe::<[u8]>();
        let builder = builder
            .enable_safe_overflow(true)
            .history_size(0)
            .subscriber_max_buffer_size(2)
            .subscriber_max_borrowed_samples(2)
            .max_publishers(1)
            .max_subscribers(16)
            .max_nodes(24);
        Ok(builder.open_or_create()?)
    })
}

/// Opens or creates the handshake `kind` of `arm`: one server, a few clients.
pub(crate) fn exchange<Q, A>(
    node: &Node<Shared>,
    arm: &Arm,
    kind: &str,
) -> Result<request_response::PortFactory<Shared, Q, (), A, ()>, IpcError>
where
    Q: Debug + ZeroCopySend,
    A: Debug + ZeroCopySend,
{
    exchange_for(node, arm, kind, 8, 16)
}

/// The same as [`exchange`] for many clients, so that a stop is always possible.
pub(crate) fn control_exchange<Q, A>(
    node: &Node<Shared>,
    arm: &Arm,
    kind: &str,
) -> Result<request_response::PortFactory<Shared, Q, (), A, ()>, IpcError>
where
    Q: Debug + ZeroCopySend,
    A: Debug + ZeroCopySend,
{
    exchange_for(node, arm, kind, 64, 80)
}

/// An exchange with one server, for so many clients in so many processes.
fn exchange_for<Q, A>(
    node: &Node<Shared>,
    arm: &Arm,
    kind: &str,
    clients: usize,
    nodes: usize,
) -> Result<request_response::PortFactory<Shared, Q, (), A, ()>, IpcError>
where
    Q: Debug + ZeroCopySend,
    A: Debug + ZeroCopySend,
{
    let (service, name) = service_name(arm, kind)?;
    settled(service, || {
        let builder = node.service_builder(&name).request_response::<Q, A>();
        Ok(one_server(builder, clients, nodes).open_or_create()?)
    })
}

/// The same as [`exchange`] for texts of any length.
pub(crate) fn text_exchange(
    node: &Node<Shared>,
    arm: &Arm,
    kind: &str,
) -> Result<TextExchange, IpcError> {
    let (service, name) = service_name(arm, kind)?;
    settled(service, || {
        let builder = node.service_builder(&name).request_response::<[u8], [u8]>();
        Ok(one_server(builder, 16, 24).open_or_create()?)
    })
}

/// The settings of an exchange: one server, for so many clients in so many processes.
fn one_server<Q, A>(
    builder: RequestResponseBuilder<Q, (), A, (), Shared>,
    clients: usize,
    nodes: usize,
) -> RequestResponseBuilder<Q, (), A, (), Shared>
where
    Q: Debug + ZeroCopySend + ?Sized,
    A: Debug + ZeroCopySend + ?Sized,
{
    builder
        .enable_safe_overflow_for_requests(true)
        .enable_safe_overflow_for_responses(true)
        .max_active_requests_per_client(2)
        .max_response_buffer_size(2)
        .max_servers(1)
        .max_clients(clients)
        .max_nodes(nodes)
}

/// The other processes that use a service: names and process numbers.
pub(crate) fn inhabitants<F>(factory: &F, ourselves: &Node<Shared>) -> String
where
    F: PortFactory<Service = Shared>,
{
    let mut names = Vec::new();
    // A list that cannot be read gives an owner without a name.
    let _ = factory.nodes(|state| {
        if let NodeState::Alive(view) = state
            && view.id() != ourselves.id()
        {
            let label = view.details().as_ref().map_or_else(String::new, |details| {
                format!("{} ({})", details.name().as_str(), details.executable())
            });
            names.push(format!("{label} process {}", view.id().pid()));
        }
        CallbackProgression::Continue
    });
    if names.is_empty() {
        "a process that is gone (`canter doctor --repair` makes it free)".to_owned()
    } else {
        names.join(", ")
    }
}

/// Opens or creates a service, again and again while another process is about to make it or to remove it.
fn settled<F>(service: String, attempt: impl Fn() -> Result<F, Cause>) -> Result<F, IpcError> {
    let end = Instant::now() + SETTLING;
    loop {
        match attempt() {
            Err(Cause::InFlux(_)) if Instant::now() < end => sleep(PAUSE),
            result => return result.map_err(|cause| cause.error(service)),
        }
    }
}

/// Why a service was neither opened nor created.
enum Cause {
    /// Another process is about to make it or to remove it.
    InFlux(String),
    /// It exists with other types or settings.
    Incompatible,
    /// It exists and is damaged, or another version of iceoryx2 made it.
    Corrupted,
    /// It exists and is another user's.
    Permission,
    /// Another reason why it was not opened.
    Open(String),
    /// It did not exist and was not created.
    Create(String),
}

impl Cause {
    /// The cause as a message that says what to do.
    fn error(self, service: String) -> IpcError {
        let (operation, cause) = match self {
            Self::Incompatible => {
                return IpcError::Incompatible {
                    service,
                    protocol: PROTOCOL,
                };
            }
            Self::Corrupted => return IpcError::OtherLibrary { service },
            Self::Permission => {
                return IpcError::Permission {
                    service,
                    operation: "opening the service",
                };
            }
            Self::Open(cause) | Self::InFlux(cause) => ("opening the service", cause),
            Self::Create(cause) => ("creating the service", cause),
        };
        IpcError::Failed {
            service,
            operation,
            cause,
        }
    }
}

impl From<PublishSubscribeOpenOrCreateError> for Cause {
    fn from(error: PublishSubscribeOpenOrCreateError) -> Self {
        use PublishSubscribeCreateError as Create;
        use PublishSubscribeOpenError as Open;
        use PublishSubscribeOpenOrCreateError as OpenOrCreate;
        match error {
            OpenOrCreate::PublishSubscribeOpenError(open) => match open {
                Open::IncompatibleTypes
                | Open::IncompatibleMessagingPattern
                | Open::IncompatibleOverflowBehavior
                | Open::DoesNotSupportRequestedMinBufferSize => Self::Incompatible,
                Open::ServiceInCorruptedState => Self::Corrupted,
                Open::InsufficientPermissions => Self::Permission,
                Open::DoesNotExist | Open::HangsInCreation | Open::IsMarkedForDestruction => {
                    Self::InFlux(format!("{open:?}"))
                }
                other => Self::Open(format!("{other:?}")),
            },
            OpenOrCreate::PublishSubscribeCreateError(
                Create::AlreadyExists
                | Create::IsBeingCreatedByAnotherInstance
                | Create::HangsInCreation,
            )
            | OpenOrCreate::SystemInFlux => Self::InFlux(format!("{error:?}")),
            other => Self::Create(format!("{other:?}")),
        }
    }
}

impl From<RequestResponseOpenOrCreateError> for Cause {
    fn from(error: RequestResponseOpenOrCreateError) -> Self {
        use RequestResponseCreateError as Create;
        use RequestResponseOpenError as Open;
        use RequestResponseOpenOrCreateError as OpenOrCreate;
        match error {
            OpenOrCreate::RequestResponseOpenError(open) => match open {
                Open::IncompatibleRequestType
                | Open::IncompatibleResponseType
                | Open::IncompatibleMessagingPattern => Self::Incompatible,
                Open::ServiceInCorruptedState => Self::Corrupted,
                Open::InsufficientPermissions => Self::Permission,
                Open::DoesNotExist | Open::HangsInCreation | Open::IsMarkedForDestruction => {
                    Self::InFlux(format!("{open:?}"))
                }
                other => Self::Open(format!("{other:?}")),
            },
            OpenOrCreate::RequestResponseCreateError(
                Create::AlreadyExists
                | Create::IsBeingCreatedByAnotherInstance
                | Create::HangsInCreation,
            )
            | OpenOrCreate::SystemInFlux => Self::InFlux(format!("{error:?}")),
            other => Self::Create(format!("{other:?}")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread;

    /// Processes that look at an arm make its services for a moment when no engine has: an engine that starts at
    /// that moment gets them all the same.
    #[test]
    fn services_are_opened_while_others_make_and_leave_them() {
        let folder = tempfile::tempdir().unwrap();
        let domain = Domain::open(&folder.path().join("domain")).unwrap();
        let arm = domain.arm("cell/arm").unwrap();
        let look = || {
            for _ in 0..100 {
                let node = join(&arm, "visitor").unwrap();
                exchange::<u64, u64>(&node, &arm, "client").unwrap();
                topic::<u64>(&node, &arm, "state").unwrap();
            }
        };
        thread::scope(|scope| {
            for visitor in [(); 4].map(|()| scope.spawn(look)) {
                visitor.join().unwrap();
            }
        });
    }
}
