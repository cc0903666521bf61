//! What the bridge has in the graph of ROS: topics, services, the action.

use std::net::{IpAddr, Ipv4Addr};
use std::time::Duration;

use ros2_client::action::{ActionServer, ActionServerQosPolicies};
use ros2_client::builtin_interfaces::Time;
use ros2_client::dds::rustdds::DomainParticipantBuilder;
use ros2_client::log::LogLevel;
use ros2_client::qos::{Durability, History, WhenFull};
use ros2_client::rosout::RosoutRaw;
use ros2_client::{
    ActionTypeName, Context, MessageTypeName, Name, Node, NodeOptions, Publisher, QosProfile,
    Server, ServiceTypeName,
};

use crate::loopback::keep_to_loopback;
use crate::messages::{Feedback, Goal, JointState, Outcome, Text, TriggerRequest, TriggerResponse};
use crate::options::{Names, Options};

/// A service of `std_srvs/Trigger`.
pub(crate) type Trigger = Server<TriggerRequest, TriggerResponse>;

/// Longest time in which a message for a slow reader waits for room.
const ROOM: Duration = Duration::from_millis(20);

/// The endpoints; dropping them leaves the graph.
pub(crate) struct Endpoints {
    /// The action.
    pub(crate) action: ActionServer<Goal, Outcome, Feedback>,
    /// Measured joints.
    pub(crate) states: Publisher<JointState>,
    /// Stops the arm.
    pub(crate) stop: Trigger,
    /// One for each program, in the order of the options.
    pub(crate) programs: Vec<Trigger>,
    _description: Publisher<Text>,
    node: Node,
}

impl Endpoints {
    /// Joins the graph of ROS; `urdf` is what late readers of `robot_description` get.
    ///
    /// # Errors
    /// In words: a name that is none, or what DDS says.
    pub(crate) fn open(options: &Options, urdf: String) -> Result<Self, String> {
        let names = Names::new(&options.namespace);
        let name = |under: &str, base: &str| names.name(under, base).map_err(|e| e.to_string());
        let context = context(options)?;
        // Parameters of the node are of no use here, and their services are for one middleware only.
        let choices = NodeOptions::new().start_parameter_services(false);
        let node_name = names.node().map_err(|e| e.to_string())?;
        let mut node = context
            .new_node(node_name, choices)
            .map_err(|e| format!("{e:?}"))?;
        let mapping = options.rmw.mapping();
        let failed = |error: ros2_client::CreateError| error.to_string();
        let action = node
            .create_action_server(
                mapping,
                &name(&options.controller, "follow_joint_trajectory")?,
                &ActionTypeName::new("control_msgs", "FollowJointTrajectory"),
                ActionServerQosPolicies {
                    goal_service: reliable(10),
                    result_service: reliable(10),
                    cancel_service: reliable(10),
                    feedback_publisher: reliable(10),
                    status_publisher: latched(),
                },
            )
            .map_err(failed)?;
        let mut trigger = |name: &Name| {
            let kind = ServiceTypeName::new("std_srvs", "Trigger");
            node.create_server(mapping, name, &kind, reliable(10), reliable(10))
                .map_err(failed)
        };
        let stop = trigger(&name("canter", "stop")?)?;
        let programs = options.program.iter();
        let programs = programs.map(|program| trigger(&name("canter", &program.name)?));
        let programs = programs.collect::<Result<Vec<_>, String>>()?;
        let kind = MessageTypeName::new("sensor_msgs", "JointState");
        let states = publisher(&mut node, (&name("", "joint_states")?, kind), reliable(10))?;
        let kind = MessageTypeName::new("std_msgs", "String");
        let description = publisher(
            &mut node,
            (&name("", "robot_description")?, kind),
            latched(),
        )?;
        description
            .publish(Text { data: urdf })
            .map_err(|e| format!("robot_description: {e}"))?;
        Ok(Self {
            action,
            states,
            stop,
            programs,
            _description: description,
            node,
        })
    }

    /// Says something on `/rosout`.
    pub(crate) fn say(&self, level: LogLevel, text: &str) {
        let place = (file!(), "canter-ros2", line!());
        self.node.rosout_raw(
            Time::now(),
            level,
            "canter",
            text,
            place.0,
            place.1,
            place.2,
        );
    }
}

/// The process as a participant of DDS.
fn context(options: &Options) -> Result<Context, String> {
    let domain = options.ros_domain.unwrap_or(0);
    let loopback = IpAddr::V4(Ipv4Addr::LOCALHOST);
    let all = options.network.iter().copied().chain([loopback]);
    let participant = DomainParticipantBuilder::new(domain)
        .with_only_networks(all)
        .build()
        .map_err(|error| format!("cannot join DDS domain {domain}: {error}"))?;
    if options.network.is_empty() {
        // Before there is anything that could be asked for.
        keep_to_loopback().map_err(|error| format!("cannot keep to the loopback: {error}"))?;
    }
    Context::from_domain_participant(participant).map_err(|error| error.to_string())
}

fn publisher<M: serde::Serialize>(
    node: &mut Node,
    (name, kind): (&Name, MessageTypeName),
    qos: QosProfile,
) -> Result<Publisher<M>, String> {
    let topic = node
        .create_topic(name, kind, &qos)
        .map_err(|e| e.to_string())?;
    node.create_publisher(&topic, Some(qos))
        .map_err(|e| e.to_string())
}

/// What is sent arrives, but for readers that are too slow.
fn reliable(depth: usize) -> QosProfile {
    QosProfile::publisher_default()
        .reliability_reliable(WhenFull::Wait(ROOM))
        .history(History::KeepLast { depth })
}

/// The same; who comes late gets the last.
fn latched() -> QosProfile {
    reliable(1).durability(Durability::TransientLocal)
}
